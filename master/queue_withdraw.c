/*
 * Withdrawing work from the queue. Tiles that wait are taken out at once, and so are the pieces of a tile of which
 * none has been handed out. Renderers that hold tiles are told that they may drop all but the first, and do so with
 * those that they have not begun; what they have finished or begun comes back and counts. When only late renderers
 * still hold tiles, these are taken out, too.
 */
#include <assert.h>

#include "master/queue_parts.h"

/* Whether the tile is a tile of the picture that is not finished, is no piece, and is not broken into pieces. */
static bool is_single(const struct item *item)
{
    return item->pass != TILE_PROBE && !item->finished && !item->is_piece && item->pieces == 0;
}

static void take_out(struct queue *queue, uint32_t id)
{
    struct item *item = &queue->items[id];
    queue_uncount_outlook(queue, id);
    item->finished = item->replaced = true;
    queue->pace.total -= (double)item->work;
    queue->count.tiles--;
    queue->news++;
}

static bool is_probe(const struct item *item)
{
    return item->pass == TILE_PROBE;
}

/* Recalls the renderer's tiles for which is_meant() is true, except the first tile that it holds, which it has
 * begun if any: that one is finished like any other tile, and others may take it over. */
static void recall_unbegun(struct queue *queue, uint32_t renderer,
                           bool (*is_meant)(const struct item *item))
{
    const struct holdings *holdings = &queue->holdings;
    uint32_t i = holdings->holders[renderer].first;
    if (i == HOLD_NONE) return;
    while ((i = holdings->holds[i].next) != HOLD_NONE) {
        struct hold *hold = &holdings->holds[i];
        if (is_meant(&queue->items[hold->id]) && !hold->recalled) queue_tell(queue, hold, false);
    }
}

void withdraw_dropped(struct queue *queue, uint32_t id)
{
    if (is_single(&queue->items[id]) && queue->items[id].copies == 0) take_out(queue, id);
}

void withdraw_overdue(struct queue *queue)
{
    if (!queue->withdraws || queue->pace.holders > 0) return;
    for (uint32_t renderer = 0; renderer < queue->config.renderers; renderer++) {
        uint32_t i = queue->holdings.holders[renderer].first;
        for (; i != HOLD_NONE; i = queue->holdings.holds[i].next) {
            uint32_t id = queue->holdings.holds[i].id;
            if (!is_single(&queue->items[id])) continue;
            take_out(queue, id);
            queue_tell_finished(queue, id);
        }
    }
}

/* Makes a tile of the picture whole again that was broken into pieces of which none has been handed out. Its holder
 * may drop it; if it has done so already, the tile is taken out. */
static void take_back_pieces(struct queue *queue, uint32_t id)
{
    struct item *whole = &queue->items[id];
    if (whole->finished || whole->is_piece) return;
    for (uint32_t i = 0; i < whole->pieces; i++)
        if (!heap_has(&queue->waiting, whole->first_piece + i)) return;
    pieces_drop(queue, id);
    whole->pieces = whole->missing = 0;
    withdraw_dropped(queue, id);
}

void queue_withdraw(struct queue *queue)
{
    assert(queue->is_dynamic);
    for (uint32_t id = 0; id < queue->item_count; id++)
        if (queue->items[id].pieces > 0) take_back_pieces(queue, id);
    for (uint32_t id = 0; id < queue->item_count; id++) {
        if (!queue_is_untouched(queue, id)) continue;
        queue_unset_waiting(queue, id);
        take_out(queue, id);
    }
    for (uint32_t renderer = 0; renderer < queue->config.renderers; renderer++)
        recall_unbegun(queue, renderer, is_single);
    queue->needs_no_probes = queue->withdraws = true;
}

void queue_end_probes(struct queue *queue, double now)
{
    if (queue->settled || queue->probes_ended) return;
    for (uint32_t renderer = 0; renderer < queue->config.renderers; renderer++)
        recall_unbegun(queue, renderer, is_probe);
    queue->next_probe = queue->map.probes;
    queue->probes_ended = true;
    queue->news++;
    if (queue->map.blocks_known > 0) predictions_settle(queue, now);
}
