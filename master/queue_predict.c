/* Predicted costs of tiles, from the probes on, and what is learnt from tiles that take longer than predicted. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/extremes.h"
#include "common/message.h"
#include "master/queue_parts.h"

/* The largest power of sqrt(2) that is not larger than value, which is >= 0; 0 for 0 and subnormal numbers. Made of the
 * bits of value, as speed matters: when the probes are back, thousands of tiles are sorted by it while all renderers
 * wait. */
static double half_octave_below(double value)
{
    uint64_t bits;
    double whole;
    memcpy(&bits, &value, sizeof bits);
    bits = bits >> (DBL_MANT_DIG - 1) << (DBL_MANT_DIG - 1);
    memcpy(&whole, &bits, sizeof whole);
    return value >= whole * M_SQRT2 ? whole * M_SQRT2 : whole;
}

/* The priority of a tile, from its cost per pixel. It is rounded down to steps of half an octave, so that tiles
 * of similar cost keep the order of the picture, in which neighbours are near each other. */
static double priority_of(const struct item *item, struct cost cost)
{
    return half_octave_below(cost.worst / (double)area(item));
}

/* What a tile of a later pass, or a part of one, is predicted to take, as the pass has told; 0: it has not. */
static double work_in_pass(const struct queue *queue, const struct item *item)
{
    struct tile tile = item_tile(item);
    if (item->pass == 0 || !queue->part_work) return 0;
    return queue->part_work(queue->part_state, &tile);
}

double predictions_share(const struct queue *queue, const struct item *part,
                         const struct item *rest)
{
    double a = work_in_pass(queue, part), b = work_in_pass(queue, rest);
    if (a + b > 0) return a / (a + b);
    a = cost_predict(&queue->map, part->x, part->y, part->w, part->h).work;
    b = cost_predict(&queue->map, rest->x, rest->y, rest->w, rest->h).work;
    return a / (a + b); /* both are above 0 */
}

/* The tile's work relative to what the map predicts. */
static double work_ratio(const struct queue *queue, const struct item *item)
{
    return (double)item->work / cost_predict(&queue->map, item->x, item->y, item->w, item->h).work;
}

/* Predicts one tile anew: `ratio` times what the map says. The caller puts what waits in order, and counts the tile in
 * the outlook. */
static void predict(struct queue *queue, uint32_t id, double ratio)
{
    struct item *item = &queue->items[id];
    struct cost cost = cost_predict(&queue->map, item->x, item->y, item->w, item->h);
    item->work = (float)fmin(cost.work * ratio, WORK_MOST);
    item->worst = (float)fmin(larger_number(cost.worst, cost.work) * ratio, WORK_MOST);
    if (is_of_picture(item) && !item->skipped) queue->pace.total += (double)item->work;
    /* Tiles of later passes keep the priority that they were added with, if that was given when the map was
     * settled. */
    if (item->pass == 0 || !queue->settled) item->priority = priority_of(item, cost);
    if (!heap_has(&queue->waiting, id)) return;
    queue->waiting_work += (double)item->work;
    heap_change(&queue->waiting, id, item->priority);
}

/* Converts the work that renderers hold, which was given in another unit. */
static void predict_held(struct queue *queue, double now)
{
    pace_restart(&queue->pace);
    queue->groups_counted = false;
    for (uint32_t renderer = 0; renderer < queue->config.renderers; renderer++) {
        double held = 0;
        uint32_t i = queue->holdings.holders[renderer].first;
        while (i != HOLD_NONE) {
            struct hold *hold = &queue->holdings.holds[i];
            const struct item *item = &queue->items[hold->id];
            hold->work = item->pass == TILE_PROBE ? 0 : (double)item->work;
            held += hold->work;
            i = hold->next;
        }
        if (held > 0) pace_given(&queue->pace, renderer, now, held);
    }
}

void predictions_settle(struct queue *queue, double now)
{
    bool is_first = !queue->settled;
    float *ratios = allocate(queue->item_count, sizeof *ratios);
    for (uint32_t id = 0; id < queue->item_count; id++)
        if (queue->items[id].pass != TILE_PROBE)
            ratios[id] = (float)work_ratio(queue, &queue->items[id]);
    cost_settle(&queue->map);
    queue->pace.total = queue->waiting_work = 0;
    queue->outlook = (struct outlook){0};
    for (uint32_t id = 0; id < queue->item_count; id++)
        if (queue->items[id].pass != TILE_PROBE) predict(queue, id, (double)ratios[id]);
    free(ratios);
    if (is_first) predict_held(queue, now);
    /* Tiles are joined whether all probes are back or one is missing for long. In cheap pictures there are so
     * many tiles that the master does not keep up with them otherwise; and rank 0's own renderer, which the
     * master keeps from rendering, has probes, too. Single samples of two such scenes on 36 to 52 processors are
     * half as fast again and more. */
    queue_join(queue);
    heap_restore(&queue->waiting);
    for (uint32_t id = 0; id < queue->item_count; id++)
        queue_count_outlook(queue, id);
    queue->settled = true;
    queue->next_cheap = 0;
    queue->pace.blind = false;
    queue->news++;
    if (is_first) repeat_blind(queue);
}

/* ---- tiles that cost more than predicted ---- */

/* A tile that costs more than FAR_DEARER times what was predicted says something about its neighbours. */
#define FAR_DEARER 2

/* Where a tile was more expensive than predicted: pixels from x to right - 1, y to bottom - 1. */
struct surroundings {
    uint32_t x, y, right, bottom;
};

/* The number of pixels of the tile whose prediction is raised: all of a tile of automatic size, which lies in the area
 * or touches it; of a larger one, which reaches far beyond it, those within. */
static uint64_t pixels_near(const struct queue *queue, const struct item *item,
                            const struct surroundings *near)
{
    if (queue->config.tile_edge <= DYNAMIC_EDGE) return area(item);
    uint32_t x = larger(item->x, near->x), right = smaller(item->x + item->w, near->right);
    uint32_t y = larger(item->y, near->y), bottom = smaller(item->y + item->h, near->bottom);
    return x < right && y < bottom ? (uint64_t)(right - x) * (bottom - y) : 0;
}

/* Corrects the prediction of a tile, if it waits: its pixels in the area may cost as much as this density (work per
 * pixel) at worst, and are predicted to cost half as much. */
static void raise_prediction(struct queue *queue, uint32_t id, const struct surroundings *near,
                             double density)
{
    struct item *item = &queue->items[id];
    if (!heap_has(&queue->waiting, id)) return;
    uint64_t pixels = pixels_near(queue, item, near);
    double dear = density * (double)pixels, part = (double)pixels / (double)area(item);
    double worst = (double)item->worst * part, work = (double)item->work * part;
    if (worst >= dear) return;
    queue_unset_waiting(queue, id);
    queue_uncount_outlook(queue, id);
    pace_place(&queue->pace); /* with the predictions so far */
    queue->pace.total -= (double)item->work;
    item->worst = (float)((double)item->worst - worst + dear);
    item->work = (float)((double)item->work - work + larger_number(work, dear / 2));
    item->priority = fmax(item->priority, density);
    queue->pace.total += (double)item->work;
    queue_count_outlook(queue, id);
    queue_set_waiting(queue, id);
}

/* The squares that a tile lies in, and those beside them: their sides are those of the initial tiles, DYNAMIC_EDGE
 * pixels at most. For a joined tile, those of its first part. */
static struct surroundings around(const struct queue *queue, const struct tile *tile)
{
    const struct queue_config *config = &queue->config;
    uint32_t side = smaller(config->tile_edge, DYNAMIC_EDGE);
    uint32_t column = tile->x / side, row = tile->y / side;
    uint32_t last_x = tile->x + smaller(tile->w, config->tile_edge) - 1;
    uint32_t last_y = tile->y + smaller(tile->h, config->tile_edge) - 1;
    return (struct surroundings){.x = (column - (column > 0)) * side,
                                 .y = (row - (row > 0)) * side,
                                 .right = smaller((last_x / side + 2) * side, config->width),
                                 .bottom = smaller((last_y / side + 2) * side, config->height)};
}

/* A tile of pass 0 was more expensive than predicted: raises the predictions of the tiles around it, and of what
 * was split off them or it. */
static void raise_neighbours(struct queue *queue, const struct tile *tile, double work)
{
    uint32_t edge = queue->config.tile_edge, columns = divide_up(queue->config.width, edge);
    struct surroundings near = around(queue, tile);
    double density = work / tile_pixels(tile);
    for (uint32_t y = near.y / edge; y * edge < near.bottom; y++) {
        for (uint32_t x = near.x / edge; x * edge < near.right; x++) {
            uint32_t id = y * columns + x;
            do
                raise_prediction(queue, id, &near, density);
            while ((id = queue->items[id].rest) != 0);
        }
    }
}

void predictions_learn(struct queue *queue, uint32_t renderer, const struct tile *tile,
                       double seconds, double predicted)
{
    double unit = pace_seconds(&queue->pace, renderer, 1);
    if (!queue->settled || unit <= 0 || seconds <= FAR_DEARER * predicted * unit) return;
    if (tile->pass > 0) return; /* the tiles of pass 0 around it are finished */
    if (seconds < pace_least(&queue->pace, renderer)) return;
    raise_neighbours(queue, tile, fmin(seconds / unit, WORK_MOST));
}
