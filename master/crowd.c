#include "master/crowd.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/cores.h"
#include "common/message.h"
#include "master/union_find.h"

#define NOBODY UINT32_MAX

/* Working storage for finding the groups. */
struct grouping {
    const struct affinity *affinities; /* per renderer, as are the other arrays */
    const struct affinity **sorted;    /* by machine */
    uint32_t *parent;                  /* union_find.h */
    uint32_t *cores;                   /* cores of the group whose first renderer this is */
};

static bool is_known(const struct affinity *affinity)
{
    return affinity->machine[0] != '\0';
}

/* Joins the renderer to the groups of all that may use one of its cores. has: per core, a renderer that may use
 * it. */
static void join(struct grouping *grouping, uint32_t renderer, uint32_t has[CPU_SETSIZE])
{
    const cpu_set_t *cores = &grouping->affinities[renderer].cores;
    int left = CPU_COUNT(cores);
    for (size_t core = 0; left > 0; core++) {
        if (!CPU_ISSET(core, cores)) continue;
        left--;
        if (has[core] != NOBODY) union_find_join(grouping->parent, renderer, has[core]);
        has[core] = renderer;
    }
}

/* Finds the groups of one machine; affinities: those of its renderers. */
static void join_machine(struct grouping *grouping, const struct affinity *const *affinities,
                         uint32_t count)
{
    uint32_t has[CPU_SETSIZE];
    memset(has, 0xff, sizeof has);
    for (uint32_t i = 0; i < count; i++)
        if (is_known(affinities[i]))
            join(grouping, (uint32_t)(affinities[i] - grouping->affinities), has);
    for (size_t core = 0; core < CPU_SETSIZE; core++)
        if (has[core] != NOBODY) grouping->cores[union_find_root(grouping->parent, has[core])]++;
}

static int by_machine(const void *first, const void *second)
{
    const struct affinity *a = *(const struct affinity *const *)first;
    const struct affinity *b = *(const struct affinity *const *)second;
    return memcmp(a->machine, b->machine, sizeof a->machine);
}

static void join_all(struct grouping *grouping, uint32_t renderers)
{
    const struct affinity **sorted = grouping->sorted;
    for (uint32_t i = 0; i < renderers; i++)
        sorted[i] = &grouping->affinities[i];
    union_find_init(grouping->parent, renderers);
    qsort(sorted, renderers, sizeof *sorted, by_machine);
    for (uint32_t begin = 0, end = 0; begin < renderers; begin = end) {
        while (end < renderers && by_machine(&sorted[begin], &sorted[end]) == 0)
            end++;
        join_machine(grouping, sorted + begin, end - begin);
    }
}

/* Numbers the groups in the order of their first renderers. */
static void number(struct crowd *crowd, struct grouping *grouping)
{
    for (uint32_t i = 0; i < crowd->renderers; i++) {
        uint32_t first = union_find_root(grouping->parent, i);
        crowd->group_of[i] = first == i ? crowd->count++ : crowd->group_of[first];
    }
    crowd->groups = allocate_zeroed(crowd->count, sizeof *crowd->groups);
    for (uint32_t i = 0; i < crowd->renderers; i++)
        crowd->groups[crowd->group_of[i]].renderers++;
    for (uint32_t i = 0; i < crowd->renderers; i++) {
        if (union_find_root(grouping->parent, i) != i) continue;
        struct crowd_group *group = &crowd->groups[crowd->group_of[i]];
        uint32_t cores = grouping->cores[i];
        group->processors = cores == 0 || cores > group->renderers ? group->renderers : cores;
        crowd->processors += group->processors;
        crowd->cores += cores == 0 ? group->renderers : cores;
    }
}

void crowd_init(struct crowd *crowd, const struct affinity *affinities, uint32_t renderers)
{
    struct grouping grouping = {.affinities = affinities,
                                .sorted = allocate(renderers, sizeof *grouping.sorted),
                                .parent = allocate(renderers, sizeof *grouping.parent),
                                .cores = allocate_zeroed(renderers, sizeof *grouping.cores)};
    *crowd = (struct crowd){.renderers = renderers,
                            .group_of = allocate(renderers, sizeof *crowd->group_of)};
    join_all(&grouping, renderers);
    number(crowd, &grouping);
    free(grouping.sorted);
    free(grouping.parent);
    free(grouping.cores);
}

void crowd_free(struct crowd *crowd)
{
    free(crowd->group_of);
    free(crowd->groups);
    *crowd = (struct crowd){0};
}
