/*
 * Which renderers share cores. The renderers of a machine whose sets of allowed cores overlap, directly or
 * through others, form a group. Where a group has more renderers than cores, they take turns.
 */
#ifndef FARM_MASTER_CROWD_H
#define FARM_MASTER_CROWD_H

#include <stdint.h>

struct affinity;

struct crowd_group {
    uint32_t renderers;
    uint32_t processors; /* how many of them can work at a time, each on its own core */
};

struct crowd {
    uint32_t renderers, count; /* count: number of groups */
    uint32_t *group_of;        /* per renderer: index of its group */
    struct crowd_group *groups;
    uint32_t processors; /* sum over all groups */
    /* Cores that at least one renderer may use. A renderer of unknown placement adds one. */
    uint32_t cores;
};

/* Finds the groups. affinities: one per renderer. A renderer of which nothing is known counts as having its own
 * core. Freed by crowd_free(). */
void crowd_init(struct crowd *crowd, const struct affinity *affinities, uint32_t renderers);
void crowd_free(struct crowd *crowd);

#endif
