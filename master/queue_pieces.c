/*
 * The last tiles, broken into pieces for those who stand idle. Somebody has the tile already and may
 * yet answer: then its pieces are of no use. With the first piece that comes back the pieces count in
 * place of the tile, and its answer will be of no use. So every pixel is in one tile that counts.
 */
#include <math.h>

#include "master/queue_parts.h"

bool pieces_count(const struct queue *queue, const struct item *item)
{
    if (item->pass == TILE_PROBE || item->replaced) return false;
    return !item->is_piece || queue->items[item->whole].replaced;
}

bool pieces_make(struct queue *queue, uint32_t id, uint32_t wanted, double work)
{
    const struct item whole = queue->items[id];
    uint32_t w = whole.w, h = whole.h;
    while ((uint64_t)divide_up(whole.w, w) * divide_up(whole.h, h) < wanted &&
           (uint64_t)w * h > 1) {
        if (w >= h)
            w = divide_up(w, 2);
        else
            h = divide_up(h, 2);
    }
    uint32_t columns = divide_up(whole.w, w), pieces = columns * divide_up(whole.h, h);
    if (pieces < 2 || whole.pieces > 0 || queue->item_count + pieces > QUEUE_MAX_TILES)
        return false;
    double all = fmax((double)whole.work, work), density = all / (double)area(&whole);
    queue->items[id].first_piece = queue->item_count;
    queue->items[id].pieces = pieces;
    for (uint32_t i = 0; i < pieces; i++) {
        struct item piece = {.pass = whole.pass,
                             .priority = fmax(whole.priority, density),
                             .whole = id,
                             .is_piece = true,
                             .x = whole.x + i % columns * w,
                             .y = whole.y + i / columns * h};
        piece.w = smaller(w, whole.x + whole.w - piece.x);
        piece.h = smaller(h, whole.y + whole.h - piece.y);
        float part = (float)area(&piece) / (float)area(&whole);
        piece.work = (float)all * part;
        piece.worst = fmaxf(whole.worst, (float)all) * part;
        queue_set_waiting(queue, queue_new_item(queue, &piece));
    }
    queue->news++;
    return true;
}

/* The whole tile has come back: nobody needs to do this one. */
static void drop_pieces(struct queue *queue, const struct item *whole)
{
    for (uint32_t id = whole->first_piece; id < whole->first_piece + whole->pieces; id++) {
        struct item *piece = &queue->items[id];
        if (agenda_has(&queue->waiting, id)) queue_unset_waiting(queue, id);
        if (!piece->finished) queue_tell_finished(queue, id);
        piece->finished = true;
        drop_pieces(queue, piece);
    }
}

static void replace(struct queue *queue, uint32_t id)
{
    struct item *item = &queue->items[id];
    if (item->replaced) return;
    if (item->is_piece) replace(queue, item->whole);
    queue_unforesee(queue, id);
    queue_tell_finished(queue, id);
    item->finished = item->replaced = true;
    queue->count.tiles += item->pieces - 1;
    for (uint32_t piece = item->first_piece; piece < item->first_piece + item->pieces; piece++)
        queue_foresee(queue, piece);
}

void pieces_answered(struct queue *queue, uint32_t id)
{
    const struct item *item = &queue->items[id];
    if (item->is_piece) replace(queue, item->whole);
    drop_pieces(queue, item);
}
