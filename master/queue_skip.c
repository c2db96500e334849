/* What an earlier run has finished is not handed out. */
#include "master/queue_parts.h"

static void skip_tile(struct queue *queue, const struct tile *tile)
{
    if (queue->shared) {
        queue->share_finished[tile->id] = 1;
    } else {
        struct item *item = &queue->items[tile->id];
        item->finished = item->skipped = true;
        queue_unset_waiting(queue, tile->id);
        queue->finished_work += (double)item->work;
        queue->skipped_work += (double)item->work;
    }
    queue->count.finished++;
    queue->count.pixels_finished += tile_pixels(tile);
}

void queue_skip(struct queue *queue, queue_finished_pixels *finished_pixels, void *state)
{
    uint32_t next = 0;
    struct tile tile;
    while (queue_unfinished(queue, &next, &tile)) {
        uint32_t finished = finished_pixels(state, &tile);
        if (finished == tile_pixels(&tile))
            skip_tile(queue, &tile);
        else if (finished > 0 && !queue->shared && dynamic_split(queue, tile.id))
            next = tile.id; /* one half has this id now, the other one comes last */
    }
    queue->pixels_skipped = queue->count.pixels_finished;
    if (queue_complete(queue)) queue->next_probe = queue->probes;
}
