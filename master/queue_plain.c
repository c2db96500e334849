/* The schedules that hand out one tile at a time: fixed shares, and square tiles to whoever asks. What renderers
 * that give no sign of life hold goes to idle renderers. */
#include <assert.h>

#include "master/queue_parts.h"

/* Sets *tile to the next tile of a silent renderer to take over: one that it holds and that was not passed on
 * yet, or, with static schedules, one of the rest of its share. */
static bool next_of_silent(struct queue *queue, uint32_t silent, struct tile *tile)
{
    uint32_t i = queue->holdings.holders[silent].first;
    for (; i != HOLD_NONE; i = queue->holdings.holds[i].next) {
        struct hold *hold = &queue->holdings.holds[i];
        if (hold->recalled || queue_is_finished(queue, hold->id)) continue;
        holdings_recall(&queue->holdings, hold);
        queue->count.repeated++;
        *tile = queue_tile_of(queue, hold->id);
        return true;
    }
    return queue->is_static && share_next(&queue->shares, silent, tile);
}

/* Hands out a tile of a silent renderer to a renderer that has nothing to do. */
static uint32_t take_over(struct queue *queue, uint32_t renderer, struct tile *tile)
{
    if (queue->silent_count == 0 || queue->holdings.holders[renderer].lots > 0) return 0;
    for (uint32_t i = 0; i < queue->config.renderers; i++) {
        if (!queue->silent[i] || !next_of_silent(queue, i, tile)) continue;
        queue_give(queue, renderer, tile->id, 0);
        return 1;
    }
    return 0;
}

/* When few tiles wait, a renderer gets no second tile in reserve: it would be taken from one that could start it
 * at once. */
uint32_t plain_next(struct queue *queue, uint32_t renderer, struct tile *tile)
{
    const struct holder *holder = &queue->holdings.holders[renderer];
    if (queue_is_full(queue, renderer)) return 0;
    if (queue->is_static) {
        if (!share_next(&queue->shares, renderer, tile)) return take_over(queue, renderer, tile);
        queue_give(queue, renderer, tile->id, 0);
        return 1;
    }
    uint32_t waiting = queue->waiting.count, id = heap_top(&queue->waiting);
    if (waiting == 0) return take_over(queue, renderer, tile);
    if (holder->lots > 0 && waiting <= queue->config.renderers) return 0;
    queue_unset_waiting(queue, id);
    *tile = queue_tile_of(queue, id);
    queue_give(queue, renderer, id, 0);
    return 1;
}

void queue_set_silent(struct queue *queue, uint32_t renderer, bool silent)
{
    assert(renderer < queue->config.renderers);
    queue->silent_count += silent;
    queue->silent_count -= queue->silent[renderer];
    queue->silent[renderer] = silent;
    queue->news++;
}
