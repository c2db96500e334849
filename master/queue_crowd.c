/* The queue with more renderers than cores. */
#include <math.h>

#include "common/message.h"
#include "master/queue_parts.h"

static const struct crowd_group *group_of(const struct queue *queue, uint32_t renderer)
{
    const struct crowd *crowd = queue->config.crowd;
    return &crowd->groups[crowd->group_of[renderer]];
}

void queue_crowd(struct queue *queue)
{
    const struct crowd *crowd = queue->config.crowd;
    if (!crowd || crowd->processors == crowd->renderers) return;
    queue->groups = allocate_zeroed(crowd->count, sizeof *queue->groups);
    for (uint32_t i = 0; i < crowd->renderers; i++) {
        const struct crowd_group *group = group_of(queue, i);
        queue->pace.renderers[i].stretch = (double)group->renderers / group->processors;
    }
}

uint32_t queue_processors(const struct queue *queue)
{
    return queue->groups ? queue->config.crowd->processors : queue->config.renderers;
}

/* Counts the renderers with and without work in each group. Late renderers are not counted. Neither are those
 * that hold nothing but probes: these are over soon or never, and it is not known whether such a renderer has
 * stopped. */
static void count_working(struct queue *queue)
{
    const struct crowd *crowd = queue->config.crowd;
    if (queue->groups_counted) return;
    queue->groups_counted = true;
    for (uint32_t i = 0; i < crowd->count; i++)
        queue->groups[i].working = queue->groups[i].idle = 0;
    for (uint32_t i = 0; i < crowd->renderers; i++) {
        const struct pace_renderer *r = &queue->pace.renderers[i];
        struct group_state *group = &queue->groups[crowd->group_of[i]];
        group->working += r->holds && !r->is_overdue;
        group->idle += queue->holdings.holders[i].count == 0;
    }
}

static uint32_t idle_cores(const struct queue *queue, uint32_t group)
{
    uint32_t processors = queue->config.crowd->groups[group].processors;
    uint32_t working = queue->groups[group].working;
    return processors > working ? processors - working : 0;
}

bool queue_has_core(struct queue *queue, uint32_t renderer)
{
    if (!queue->groups) return true;
    count_working(queue);
    return idle_cores(queue, queue->config.crowd->group_of[renderer]) > 0;
}

uint32_t queue_idle_cores(struct queue *queue)
{
    if (!queue->groups) return queue->config.renderers - queue->holdings.busy;
    count_working(queue);
    uint32_t sum = 0;
    for (uint32_t i = 0; i < queue->config.crowd->count; i++)
        sum += smaller(idle_cores(queue, i), queue->groups[i].idle);
    return sum;
}

double queue_seconds(struct queue *queue, uint32_t renderer, double wall, double cpu)
{
    if (!queue->groups || queue->pace.renderers[renderer].stretch <= 1) return wall;
    struct group_state *group = &queue->groups[queue->config.crowd->group_of[renderer]];
    group->wall += wall;
    group->cpu += cpu;
    double drawn_out = group->cpu > 0 ? group->wall / group->cpu : 1;
    return cpu * fmax(drawn_out, queue->pace.renderers[renderer].stretch);
}
