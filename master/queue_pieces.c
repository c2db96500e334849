/*
 * The last tiles are broken into pieces for idle renderers. A renderer holds the tile as a whole already and may
 * still answer: then its pieces are of no use. If all pieces are back before, they count in place of the tile.
 * Until then those that are back are kept, for the whole may be nearly done. A piece may be broken in turn. So
 * every pixel is in exactly one tile that counts.
 */
#include <math.h>

#include "common/message.h"
#include "master/queue_parts.h"

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
    double all = fmin(fmax((double)whole.work, work), WORK_MOST),
           density = all / (double)area(&whole);
    queue->items[id].first_piece = queue->item_count;
    queue->items[id].pieces = queue->items[id].missing = pieces;
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

/* Decides whether a piece that was kept counts. */
static void decide(struct queue *queue, uint32_t id, bool counts)
{
    struct item *item = &queue->items[id];
    item->kept = false;
    if (!counts) queue->count.wasted_s += (double)item->seconds;
    queue->fates = grow(queue->fates, queue->fate_count, sizeof *queue->fates);
    queue->fates[queue->fate_count++] = (struct fate){id, counts};
}

void pieces_drop(struct queue *queue, uint32_t id)
{
    const struct item *whole = &queue->items[id];
    for (uint32_t part = whole->first_piece; part < whole->first_piece + whole->pieces; part++) {
        struct item *piece = &queue->items[part];
        if (heap_has(&queue->waiting, part)) queue_unset_waiting(queue, part);
        if (!piece->finished) queue_tell_finished(queue, part);
        piece->finished = true;
        if (piece->kept) decide(queue, part, false);
        pieces_drop(queue, part);
    }
}

struct sum {
    uint32_t pieces;
    double seconds;
};

/* Lets all pieces of the tile that are kept count, and sums them up. */
static void count_kept(struct queue *queue, uint32_t id, struct sum *sum)
{
    const struct item *item = &queue->items[id];
    if (item->kept) {
        sum->pieces++;
        sum->seconds += (double)item->seconds;
        decide(queue, id, true);
        return;
    }
    for (uint32_t part = item->first_piece; part < item->first_piece + item->pieces; part++)
        count_kept(queue, part, sum);
}

/* Marks a tile that is no piece itself as finished by its pieces. */
static void put_together(struct queue *queue, uint32_t id)
{
    struct sum sum = {0};
    count_kept(queue, id, &sum);
    queue_set_finished(queue, id, sum.seconds);
    queue->count.tiles += sum.pieces - 1;
    queue->count.finished += sum.pieces;
    queue->count.pixels_finished += area(&queue->items[id]);
}

void pieces_keep(struct queue *queue, uint32_t id)
{
    queue->items[id].kept = true;
    for (uint32_t whole = queue->items[id].whole; --queue->items[whole].missing == 0;
         whole = queue->items[whole].whole) {
        queue_tell_finished(queue, whole);
        queue->items[whole].finished = true;
        if (queue->items[whole].is_piece) continue;
        put_together(queue, whole);
        return;
    }
}

bool queue_fate(struct queue *queue, struct fate *fate)
{
    if (queue->fate_count == 0) return false;
    *fate = queue->fates[--queue->fate_count];
    return true;
}
