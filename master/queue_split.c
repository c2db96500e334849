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
 * Where there are fewer than FEW_PIXELS pixels per processor, a tile whose worst case is more than DEAR_PART of
 * an even share of all work is split in any case, down to DEAR_PIXELS pixels. Neither probes nor neighbours tell
 * what a tile in the expensive parts of a picture takes, which may be up to ten times what is predicted. There a
 * tile of 4 x 4 pixels costs hardly more than the same part of a larger one, for its rays diverge: 1 % more in
 * tiles of the lantern that take 200 us and more; with 2 x 2 pixels it is 15 %. Single samples of the lantern on
 * 36 to 52 processors are 4 % faster.
 *
 * FEW_PIXELS is 200 of the smallest tiles, see queue_auto_edge(); with more of them there is time to break up
 * what takes long. A DEAR_PART of 0.07 makes 16 samples of eight scenes up to 0.2 % faster, and single ones 0.5
 * to 3 % slower.
 */
#define FEW_PIXELS  (200 * 8 * 8)
#define DEAR_PART   0.1
#define DEAR_PIXELS 16

/* With more samples fewer pixels cost no more than within a larger tile: DEAR_SAMPLES samples together. A
 * DEAR_SAMPLES of 64 makes 16 samples of the lantern on 36 to 52 processors take 1.5 % longer; with 1024 there is no
 * difference. */
#define DEAR_SAMPLES 256

/* A tile takes the master SERVICE_S at least, however short an answer is (service_tile_s in bench/balance_messages.c).
 * Work, the seconds of samples on their own, takes SCALE of that time within a tile: 0.24 to 0.73 in eleven scenes. */
#define SERVICE_S 0.24e-6
#define SCALE     0.45

double queue_served_work(const struct queue *queue, double part)
{
    double samples = larger(queue->config.samples, 1);
    return queue_processors(queue) * SERVICE_S / part / (samples * SCALE);
}

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

/* Whether the tile has more than this number of pixels, and `work`, which it may take, is more than DEAR_PART of an
 * even share of all work: too much for one renderer to begin at all. Only where there are few pixels per processor, and
 * once there are predictions. */
static bool is_dear(const struct queue *queue, const struct item *item, uint32_t pixels, float work)
{
    uint64_t all = (uint64_t)queue->config.width * queue->config.height;
    double processors = queue_processors(queue);
    bool few = (double)all < FEW_PIXELS * processors;
    if (!queue->settled || !few || area(item) <= pixels) return false;
    return (double)work * processors > DEAR_PART * queue->pace.total;
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
    uint32_t small = largest_small(queue);
    if (!is_dear(queue, item, small, item->worst)) return 0;
    double wanted = (double)item->worst * queue_processors(queue) / (DEAR_PART * queue->pace.total);
    return (uint32_t)ceil(fmin(wanted, (double)area(item) / small));
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

/* The most of the master's time that the smallest parts may take if all tiles are split into such. At 0.32, with 4096
 * samples of the garden on 100,000 processors, a run takes 4 % longer with them; at 0.14, with 256 of the lantern on
 * 10,000, it does not. */
#define DEAR_SERVED 0.2

/* Whether the master keeps up with tiles that are DEAR_PART of an even share of all work. */
static bool can_serve_dear(const struct queue *queue)
{
    double share = queue->pace.total / queue_processors(queue);
    return DEAR_PART * share >= queue_served_work(queue, DEAR_SERVED);
}

/*
 * Whether a tile that waits is to be split into parts of fewer than DEAR_PIXELS pixels, where these cost no more: if
 * probes tell that all of it is dear, not its most expensive spot alone. Of 4096 samples of the lantern on 8,000 to
 * 11,000 processors 1.7 % more then goes into tiles that count, of 1024 samples 1.5 %: the most expensive pixels no
 * longer begin last. With the worst case as measure, or a DEAR_PART of 0.03, 256 samples with 640 x 480 pixels on 2 to
 * 64 processors take 0.8 % longer: nothing is predicted of parts that are smaller than the distance between probes, and
 * more of them would be broken up in vain.
 */
static bool is_dear_all_over(const struct queue *queue, const struct item *item)
{
    return queue->map.probes > 0 && is_dear(queue, item, largest_small(queue), item->work) &&
           can_serve_dear(queue);
}

bool split_is_due(const struct queue *queue, uint32_t id, struct pace_lot lot, bool first)
{
    const struct item *item = &queue->items[id];
    if (is_dear_all_over(queue, item)) return may_be_split(queue, item);
    double from = area(item) <= largest_small(queue) ? SPLIT_SMALL : SPLIT_FROM;
    bool large = (double)item->work > from * lot.work || (double)item->worst > from * lot.worst;
    return ((first && large) || is_blind_risk(queue, item) ||
            is_dear(queue, item, DEAR_PIXELS, item->worst) || is_too_long(queue, item)) &&
           split_is_possible(queue, id);
}
