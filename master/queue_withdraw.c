/*
 * Taking work out of the queue again. Tiles that wait are out at once. Who has tiles hears that he may leave
 * them, and does so with those that he has not begun; what he has done already, or is at, comes back and counts.
 */
#include <assert.h>

#include "master/queue_parts.h"

/* Whether the tile is one by itself: no piece of another one, and not broken into pieces. */
static bool is_single(const struct item *item)
{
    return item->pass != TILE_PROBE && !item->finished && !item->is_piece && item->pieces == 0;
}

static void take_out(struct queue *queue, uint32_t id)
{
    struct item *item = &queue->items[id];
    queue_unforesee(queue, id);
    item->finished = item->replaced = true;
    queue->pace.total -= (double)item->work;
    queue->count.tiles--;
    queue->news++;
}

/* Those that nobody else has. */
static void recall_all(struct queue *queue, uint32_t renderer)
{
    uint32_t i = queue->holdings.holders[renderer].first;
    while (i != HOLD_NONE) {
        struct hold *hold = &queue->holdings.holds[i];
        const struct item *item = &queue->items[hold->id];
        i = hold->next;
        if (is_single(item) && item->copies == 1 && hold->may_pass) queue_tell(queue, hold, false);
    }
}

void withdraw_dropped(struct queue *queue, uint32_t id)
{
    if (is_single(&queue->items[id]) && queue->items[id].copies == 0) take_out(queue, id);
}

void withdraw_lost(struct queue *queue)
{
    for (uint32_t renderer = 0; renderer < queue->config.renderers; renderer++) {
        if (!queue->pace.renderers[renderer].lost) continue;
        uint32_t i = queue->holdings.holders[renderer].first;
        for (; i != HOLD_NONE; i = queue->holdings.holds[i].next) {
            uint32_t id = queue->holdings.holds[i].id;
            if (is_single(&queue->items[id]) && queue->items[id].copies == 1) take_out(queue, id);
        }
    }
}

void queue_withdraw(struct queue *queue)
{
    assert(queue->config.schedule == SCHEDULE_DYNAMIC);
    for (uint32_t id = 0; id < queue->item_count; id++) {
        if (!queue_is_untouched(queue, id)) continue;
        queue_unset_waiting(queue, id);
        take_out(queue, id);
    }
    for (uint32_t renderer = 0; renderer < queue->config.renderers; renderer++)
        recall_all(queue, renderer);
    withdraw_lost(queue);
    queue->needs_no_probes = queue->withdraws = true;
}
