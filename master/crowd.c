#include "master/crowd.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/cores.h"
#include "common/message.h"

#define NO_GROUP UINT32_MAX

static bool is_known(const struct berth *berth)
{
    return berth->machine[0] != '\0' && CPU_COUNT(&berth->cores) > 0;
}

static bool meet(const struct berth *a, const struct berth *b)
{
    cpu_set_t both;
    if (memcmp(a->machine, b->machine, sizeof a->machine) != 0) return false;
    CPU_AND(&both, &a->cores, &b->cores);
    return CPU_COUNT(&both) > 0;
}

/* Two groups become one; the last one gets the free number. */
static void merge(struct crowd *crowd, struct berth *unions, uint32_t into, uint32_t from)
{
    uint32_t last = --crowd->count;
    CPU_OR(&unions[into].cores, &unions[into].cores, &unions[from].cores);
    unions[from] = unions[last];
    for (uint32_t i = 0; i < crowd->renderers; i++) {
        if (crowd->group_of[i] == from) crowd->group_of[i] = into;
        if (crowd->group_of[i] == last) crowd->group_of[i] = from;
    }
}

/* The renderer joins all groups that it meets, which are one then, or begins a new one. */
static void join(struct crowd *crowd, struct berth *unions, uint32_t renderer,
                 const struct berth *berth)
{
    uint32_t into = NO_GROUP;
    for (uint32_t group = is_known(berth) ? crowd->count : 0; group-- > 0;) {
        if (!meet(&unions[group], berth)) continue;
        if (into != NO_GROUP) merge(crowd, unions, group, into);
        into = group;
    }
    if (into == NO_GROUP) unions[into = crowd->count++] = *berth;
    CPU_OR(&unions[into].cores, &unions[into].cores, &berth->cores);
    crowd->group_of[renderer] = into;
}

void crowd_init(struct crowd *crowd, const struct berth *berths, uint32_t renderers)
{
    struct berth *unions = allocate(renderers, sizeof *unions);
    *crowd = (struct crowd){.renderers = renderers,
                            .group_of = allocate(renderers, sizeof *crowd->group_of)};
    memset(crowd->group_of, 0xff, renderers * sizeof *crowd->group_of);
    for (uint32_t i = 0; i < renderers; i++)
        join(crowd, unions, i, &berths[i]);
    crowd->groups = allocate_zeroed(crowd->count, sizeof *crowd->groups);
    for (uint32_t i = 0; i < renderers; i++)
        crowd->groups[crowd->group_of[i]].renderers++;
    for (uint32_t i = 0; i < crowd->count; i++) {
        struct crowd_group *group = &crowd->groups[i];
        uint32_t cores = (uint32_t)CPU_COUNT(&unions[i].cores);
        group->processors = cores == 0 || cores > group->renderers ? group->renderers : cores;
        crowd->processors += group->processors;
    }
    free(unions);
}

void crowd_free(struct crowd *crowd)
{
    free(crowd->group_of);
    free(crowd->groups);
    *crowd = (struct crowd){0};
}
