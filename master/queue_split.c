/* Splitting tiles: one that would take too long for a single renderer, or for the lot that it is to be part of,
 * is split before it is handed out. */
#include <math.h>

#include "master/queue_parts.h"

/* A tile is split when it is predicted to take SPLIT_FROM times the lot that it is to be, or SPLIT_SMALL times if
 * its parts cost more than the whole (largest_small()). Single samples of the lantern on 36 to 52 processors are 2 %
 * faster than with one figure for both, those of seven other scenes as fast. */
#define SPLIT_FROM  1.5
#define SPLIT_SMALL 3

/* A tile whose sides are no longer than this, in pixels, is not split. */
#define SPLIT_EDGE 3

/*
 * A tile that a renderer has not begun is broken into parts (split_dear_parts()) if its worst case is more than
 * DEAR_PART of an even share of all work. Neither probes nor neighbours tell what a tile in the expensive parts of a
 * picture takes, which may be up to ten times what is predicted. Parts have DEAR_PIXELS pixels at least. There a tile
 * of 4 x 4 pixels costs hardly more than the same part of a larger one, for its rays diverge: 1 % more in tiles of the
 * lantern that take 200 us and more; with 2 x 2 pixels it is 15 %.
 */
#define DEAR_PART   0.1
#define DEAR_PIXELS 16

/* With more samples fewer pixels cost no more than within a larger tile: DEAR_SAMPLES samples together. A
 * DEAR_SAMPLES of 64 makes 16 samples of the lantern on 36 to 52 processors take 1.5 % longer; with 1024 there is no
 * difference. */
#define DEAR_SAMPLES 256

/* The largest tile, in pixels, whose parts cost more than the whole. */
static uint32_t largest_small(const struct queue *queue)
{
    uint32_t pixels = DEAR_PIXELS;
    while (pixels > 1 && (uint64_t)pixels * queue->config.samples > DEAR_SAMPLES)
        pixels /= 2;
    return pixels;
}

void split_tile(struct queue *queue, uint32_t id)
{
    struct item half = queue->items[id], rest = half;
    if (half.w >= half.h) {
        half.w /= 2;
        rest.x += half.w;
        rest.w -= half.w;
    } else {
        half.h /= 2;
        rest.y += half.h;
        rest.h -= half.h;
    }
    double part = predictions_share(queue, &half, &rest);
    queue_uncount_waiting(queue, id);
    queue_uncount_outlook(queue, id);
    rest.worst = (float)((double)half.worst * (1 - part));
    half.worst = (float)((double)half.worst * part);
    rest.work = (float)((double)half.work * (1 - part));
    half.work = (float)((double)half.work * part);
    half.rest = queue->item_count;
    queue->items[id] = half;
    queue_count_outlook(queue, id);
    queue_count_waiting(queue, id);
    queue_set_waiting(queue, queue_new_item(queue, &rest));
    queue->count.tiles++;
}

/* A piece cannot be split: the tile that it is a piece of counts its pieces. */
static bool may_be_split(const struct queue *queue, const struct item *item)
{
    return !item->is_piece && queue->count.tiles < QUEUE_MAX_TILES;
}

bool split_is_possible(const struct queue *queue, uint32_t id)
{
    const struct item *item = &queue->items[id];
    return (item->w > SPLIT_EDGE || item->h > SPLIT_EDGE) && may_be_split(queue, item);
}

/* How many times queue_config.most_work the worst case of a tile may be, that all its pixels cost as much as the
 * most expensive spot around: with a time limit that is a 16th of the limit. Ordinary tiles are far below both
 * bounds. */
#define WORST_MOST 4

/* Whether the tile is to be split because it may take too long for any renderer. */
static bool is_too_long(const struct queue *queue, const struct item *item)
{
    double most = queue->config.most_work;
    return queue->settled && most > 0 &&
           ((double)item->work > most || (double)item->worst > WORST_MOST * most);
}

/*
 * Of 4096 samples of the lantern on 10,000 processors a tile of DEAR_PIXELS pixels takes up to 4 s, the whole run 3.4
 * s. 2 % more goes into tiles that count where parts may then be as small as a pixel.
 */
uint32_t split_dear_parts(const struct queue *queue, uint32_t id)
{
    const struct item *item = &queue->items[id];
    double dear = DEAR_PART * queue->pace.total / queue_processors(queue);
    double wanted = (double)item->worst / dear, most = (double)area(item) / largest_small(queue);
    /* wanted is NaN where there is no work at all. */
    if (!queue->settled || !(wanted > 1) || most <= 1) return 0;
    return (uint32_t)ceil(fmin(wanted, most));
}

/*
 * While nothing is predicted, a tile that is larger than those that are chosen automatically is at most this part of an
 * even share of the pixels, an eighth of a first lot (BLIND_PART in master/pace.c): it may be from the most expensive
 * spot of the picture. With tiles of 64 x 64 pixels, 16 samples of the lantern at 1920 x 1440 on 24 to 64 processors
 * are 7 % faster.
 */
#define BLIND_PARTS 112

/* Whether nothing is predicted yet, and the tile would be too large a part of a renderer's share. */
static bool is_blind_risk(const struct queue *queue, const struct item *item)
{
    return !queue->settled && area(item) > (uint64_t)DYNAMIC_EDGE * DYNAMIC_EDGE &&
           BLIND_PARTS * (double)item->work * queue_processors(queue) > queue->pace.total;
}

/*
 * Whether a tile that waits is to be split, if need be into parts of fewer than DEAR_PIXELS pixels, where these cost no
 * more: if probes tell that all of it is dear, not its most expensive spot alone, and the master keeps up with such
 * parts, so that a shortest lot is not longer. Of 4096 samples of the lantern on 8,000 to 10,000 processors up to 5 %
 * more then goes into tiles that count, by what its most expensive pixels cost: these do not begin last.
 */
static bool is_dear_all_over(const struct queue *queue, const struct item *item)
{
    const struct pace *pace = &queue->pace;
    double dear = DEAR_PART * pace->total / queue_processors(queue);
    uint32_t smallest = largest_small(queue);
    bool keeps_up = dear * pace->scale > pace_least(pace, 0);
    bool is_known = queue->settled && queue->map.probes > 0;
    return is_known && keeps_up && smallest < DEAR_PIXELS && area(item) > smallest &&
           (double)item->work > dear;
}

bool split_is_due(const struct queue *queue, uint32_t id, struct pace_lot lot, bool first)
{
    const struct item *item = &queue->items[id];
    if (is_dear_all_over(queue, item)) return may_be_split(queue, item);
    double from = area(item) <= largest_small(queue) ? SPLIT_SMALL : SPLIT_FROM;
    bool large = (double)item->work > from * lot.work || (double)item->worst > from * lot.worst;
    return ((first && large) || is_blind_risk(queue, item) || is_too_long(queue, item)) &&
           split_is_possible(queue, id);
}
