/*
 * Renderers that share cores. Those of a machine that may run on the same cores, whether all of them or
 * not, are a group; where a group has more renderers than cores, they take turns.
 */
#ifndef FARM_MASTER_CROWD_H
#define FARM_MASTER_CROWD_H

#include <stdint.h>

struct berth;

struct crowd_group {
    uint32_t renderers;
    uint32_t processors; /* of them that can work at a time: there is a core for each */
};

struct crowd {
    uint32_t renderers, count; /* count: of groups */
    uint32_t *group_of;        /* per renderer */
    struct crowd_group *groups;
    uint32_t processors; /* of all groups */
    /* That one of them or more may use; who has one of its own because nothing is known counts it. */
    uint32_t cores;
};

/* berths: per renderer. One of which nothing is known has a core of its own. */
void crowd_init(struct crowd *crowd, const struct berth *berths, uint32_t renderers);
void crowd_free(struct crowd *crowd);

#endif
