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
    queue->turns = allocate_zeroed(crowd->count, sizeof *queue->turns);
    for (uint32_t i = 0; i < crowd->renderers; i++) {
        const struct crowd_group *group = group_of(queue, i);
        queue->pace.renderers[i].stretch = (double)group->renderers / group->processors;
    }
}

uint32_t queue_processors(const struct queue *queue)
{
    return queue->turns ? queue->config.crowd->processors : queue->config.renderers;
}

/* Counts the renderers with and without work in each group. Late renderers are not counted. Neither are those
 * that hold nothing but probes: these are over soon or never, and it is not known whether such a renderer has
 * stopped. */
static void count_working(struct queue *queue)
{
    const struct crowd *crowd = queue->config.crowd;
    if (queue->counted) return;
    queue->counted = true;
    for (uint32_t i = 0; i < crowd->count; i++)
        queue->turns[i].working = queue->turns[i].idle = 0;
    for (uint32_t i = 0; i < crowd->renderers; i++) {
        const struct pace_renderer *r = &queue->pace.renderers[i];
        struct turns *turns = &queue->turns[crowd->group_of[i]];
        turns->working += r->holds && !r->lost;
        turns->idle += queue->holdings.holders[i].count == 0 && !r->lost;
    }
}

static uint32_t idle_cores(const struct queue *queue, uint32_t group)
{
    uint32_t processors = queue->config.crowd->groups[group].processors;
    uint32_t working = queue->turns[group].working;
    return processors > working ? processors - working : 0;
}

bool queue_has_core(struct queue *queue, uint32_t renderer)
{
    if (!queue->turns) return true;
    count_working(queue);
    return idle_cores(queue, queue->config.crowd->group_of[renderer]) > 0;
}

uint32_t queue_idle_cores(struct queue *queue)
{
    if (!queue->turns) return queue->config.renderers - queue->holdings.busy;
    count_working(queue);
    uint32_t sum = 0;
    for (uint32_t i = 0; i < queue->config.crowd->count; i++)
        sum += smaller(idle_cores(queue, i), queue->turns[i].idle);
    return sum;
}

double queue_seconds(struct queue *queue, uint32_t renderer, double wall, double cpu)
{
    if (!queue->turns || queue->pace.renderers[renderer].stretch <= 1) return wall;
    struct turns *turns = &queue->turns[queue->config.crowd->group_of[renderer]];
    turns->wall += wall;
    turns->cpu += cpu;
    double drawn_out = turns->cpu > 0 ? turns->wall / turns->cpu : 1;
    return cpu * fmax(drawn_out, queue->pace.renderers[renderer].stretch);
}
