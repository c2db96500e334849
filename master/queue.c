#include "master/queue.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "master/cost.h"
#include "master/heap.h"
#include "master/holdings.h"
#include "master/pace.h"
#include "master/share.h"

/* Lots that a renderer may hold: the one that it renders and the one that waits behind it. */
#define LOTS_HELD 2

/* A lot has at most so many pixels, unless one tile has more: 400 KB of floats. */
#define LOT_PIXELS 32768u

/* A tile is split when it is predicted to take so many times the lot that it is to be. */
#define SPLIT_FROM 1.5

/* A side of so many pixels is not split. */
#define SPLIT_EDGE 3

/* When so many of the probes are back, an idle renderer does not wait for the others. */
#define PROBES_ENOUGH 0.75

/* A probe tile has at most so many probes: a lot of probes is spread over the picture. */
#define PROBE_BLOCKS 8

/* A tile under dynamic and tiles. */
struct item {
    uint32_t x, y, w, h;
    uint32_t pass;
    float work; /* predicted */
    double priority;
    uint32_t copies; /* renderers that have it */
    bool finished;
    bool skipped; /* by an earlier run */
};

struct queue {
    struct queue_config config;
    bool shared; /* a static schedule: shares in place of items */
    struct shares shares;
    unsigned char *share_finished; /* per id */

    struct item *items;
    uint32_t item_count, item_room;
    uint32_t first_probe, probes, next_probe, probe_stride, probes_back;
    bool settled;        /* the map predicts: all probes are back, or enough */
    struct heap waiting; /* items */
    double waiting_work, finished_work, skipped_work;
    struct cost_map map;
    struct pace pace;

    struct holdings holdings;
    uint32_t *probes_given; /* per renderer: probe tiles that it has had */
    bool stopped;
    uint64_t pixels_skipped; /* finished by an earlier run */
    uint64_t news;
    struct queue_count count;
    uint32_t largest;
};

static uint32_t smaller(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static uint32_t divide_up(uint32_t a, uint32_t b)
{
    return (uint32_t)(((uint64_t)a + b - 1) / b);
}

uint32_t queue_auto_edge(enum schedule schedule, uint32_t width, uint32_t height,
                         uint32_t renderers)
{
    uint64_t wanted = UINT64_C(200) * (renderers > 1 ? renderers - 1 : 1);
    if (schedule == SCHEDULE_DYNAMIC) wanted = UINT64_C(100) * renderers;
    uint32_t edge = 64;
    while (edge > 8 && (uint64_t)divide_up(width, edge) * divide_up(height, edge) < wanted)
        edge /= 2;
    return edge;
}

uint32_t queue_auto_probe_edge(uint32_t width, uint32_t height, uint32_t samples)
{
    const uint64_t samples_per_probe = 1000, probes_least = 64;
    uint32_t edge = 4;
    while ((uint64_t)edge * edge * samples < samples_per_probe)
        edge *= 2;
    uint64_t probes = (uint64_t)(width / edge) * (height / edge);
    return probes < probes_least ? 0 : edge;
}

/* ---- what a tile is ---- */

static struct tile tile_of(const struct queue *queue, uint32_t id)
{
    if (queue->shared) return share_tile(&queue->shares, id);
    struct tile tile;
    const struct item *item = &queue->items[id];
    if (item->pass == TILE_PROBE)
        tile = cost_probe(&queue->map, id - queue->first_probe);
    else
        tile = (struct tile){
            .x = item->x, .y = item->y, .w = item->w, .h = item->h, .step = 1, .pass = item->pass};
    tile.id = id;
    return tile;
}

/* Tiles of like cost keep the order of the picture, in which neighbours are near each other: steps
 * of half an octave. */
static double priority_of(const struct queue *queue, const struct item *item)
{
    struct cost cost = cost_predict(&queue->map, item->x, item->y, item->w, item->h);
    double worst = cost.worst / ((double)item->w * item->h);
    return worst > 0 ? exp2(floor(2 * log2(worst)) / 2) : 0;
}

static void set_waiting(struct queue *queue, uint32_t id)
{
    heap_put(&queue->waiting, id, queue->items[id].priority);
    queue->waiting_work += (double)queue->items[id].work;
}

static void unset_waiting(struct queue *queue, uint32_t id)
{
    heap_remove(&queue->waiting, id);
    queue->waiting_work -= (double)queue->items[id].work;
    if (queue->waiting.count == 0) queue->waiting_work = 0;
}

static uint32_t new_item(struct queue *queue, const struct item *item)
{
    if (queue->item_count == queue->item_room) {
        queue->item_room = queue->item_room ? 2 * queue->item_room : 64;
        queue->items = reallocate(queue->items, queue->item_room, sizeof *queue->items);
        heap_reserve(&queue->waiting, queue->item_room);
    }
    queue->items[queue->item_count] = *item;
    return queue->item_count++;
}

static uint64_t area(const struct item *item)
{
    return (uint64_t)item->w * item->h;
}

/* ---- the start ---- */

static void note_size(struct queue *queue, uint64_t pixels)
{
    if (pixels > queue->largest) queue->largest = (uint32_t)pixels;
}

/* In no order at all, so that the first tiles, handed out before anything is known, are of all
 * kinds: multiplication by an odd number near 2^32 / golden ratio (D. Knuth, TAOCP 3, 6.4). */
static double scattered(uint32_t i)
{
    return (double)(uint32_t)(i * UINT32_C(2654435769));
}

static void add_base_tiles(struct queue *queue, uint32_t columns, uint32_t rows)
{
    uint32_t edge = queue->config.tile_edge;
    bool orders = queue->config.schedule == SCHEDULE_DYNAMIC;
    queue->item_room = columns * rows + queue->map.probes;
    queue->items = allocate(queue->item_room, sizeof *queue->items);
    heap_reserve(&queue->waiting, queue->item_room);
    for (uint32_t i = 0; i < columns * rows; i++) {
        uint32_t x = i % columns * edge, y = i / columns * edge;
        struct item item = {.x = x,
                            .y = y,
                            .w = smaller(edge, queue->config.width - x),
                            .h = smaller(edge, queue->config.height - y)};
        item.work = (float)area(&item);
        item.priority = orders ? scattered(i) : 0;
        note_size(queue, area(&item));
        set_waiting(queue, new_item(queue, &item));
    }
    queue->count.tiles = columns * rows;
}

static uint32_t common_divisor(uint32_t a, uint32_t b)
{
    return b == 0 ? a : common_divisor(b, a % b);
}

/* Probes are handed out in steps of about the golden section, so that every lot of them, and every
 * number of lots, is spread over the whole picture. */
static void add_probes(struct queue *queue)
{
    queue->first_probe = queue->item_count;
    queue->probes = queue->map.probes;
    for (uint32_t i = 0; i < queue->probes; i++)
        new_item(queue, &(struct item){.pass = TILE_PROBE});
    uint32_t stride = (uint32_t)(0.6180339887 * queue->probes);
    while (stride == 0 || common_divisor(stride, queue->probes) != 1)
        stride++;
    queue->probe_stride = stride;
    if (queue->probes > 0) note_size(queue, queue->map.probe_blocks);
}

static bool start_items(struct queue *queue)
{
    const struct queue_config *config = &queue->config;
    uint32_t columns = divide_up(config->width, config->tile_edge);
    uint32_t rows = divide_up(config->height, config->tile_edge);
    if ((uint64_t)columns * rows > QUEUE_MAX_TILES) return false;
    uint32_t edge = config->schedule == SCHEDULE_DYNAMIC ? config->probe_edge : 0;
    /* Every renderer gets some. */
    uint64_t blocks = edge ? (uint64_t)(config->width / edge) * (config->height / edge) : 0;
    uint64_t each = blocks / config->renderers;
    cost_init(&queue->map, config->width, config->height, edge,
              each < 1              ? 1
              : each > PROBE_BLOCKS ? PROBE_BLOCKS
                                    : (uint32_t)each);
    add_base_tiles(queue, columns, rows);
    add_probes(queue);
    queue->probes_given = allocate_zeroed(config->renderers, sizeof *queue->probes_given);
    queue->settled = queue->probes == 0;
    pace_init(&queue->pace, config->renderers);
    queue->pace.total = queue->waiting_work;
    return true;
}

static bool start_shares(struct queue *queue)
{
    struct share_config config = {.schedule = queue->config.schedule,
                                  .width = queue->config.width,
                                  .height = queue->config.height,
                                  .renderers = queue->config.renderers,
                                  .rows = queue->config.tile_edge};
    shares_init(&queue->shares, &config, QUEUE_MAX_TILES);
    if (queue->shares.ids > QUEUE_MAX_TILES) return false;
    uint32_t ids = (uint32_t)queue->shares.ids;
    queue->share_finished = allocate_zeroed(ids, 1);
    queue->shares.finished = queue->share_finished;
    for (uint32_t id = 0; id < ids; id++) {
        struct tile tile = share_tile(&queue->shares, id);
        if (!share_has_pixels(&tile)) continue;
        queue->count.tiles++;
        note_size(queue, tile_pixels(&tile));
    }
    return true;
}

struct queue *queue_create(const struct queue_config *config)
{
    struct queue *queue = allocate_zeroed(1, sizeof *queue);
    queue->config = *config;
    queue->shared = config->schedule != SCHEDULE_DYNAMIC && config->schedule != SCHEDULE_TILES;
    holdings_init(&queue->holdings, config->renderers);
    if (queue->shared ? start_shares(queue) : start_items(queue)) return queue;
    queue_destroy(queue);
    return NULL;
}

void queue_destroy(struct queue *queue)
{
    if (!queue) return;
    shares_free(&queue->shares);
    cost_free(&queue->map);
    pace_free(&queue->pace);
    heap_free(&queue->waiting);
    free(queue->share_finished);
    free(queue->items);
    free(queue->probes_given);
    holdings_free(&queue->holdings);
    free(queue);
}

/* ---- handing out ---- */

static void give(struct queue *queue, uint32_t renderer, uint32_t id, double work)
{
    holdings_give(&queue->holdings, renderer, id, work);
    if (!queue->shared) queue->items[id].copies++;
}

/* A second tile in reserve is taken from somebody who could start it at once, when tiles are few. */
static uint32_t next_plain(struct queue *queue, uint32_t renderer, struct tile *tile)
{
    const struct holder *holder = &queue->holdings.holders[renderer];
    if (holder->lots == LOTS_HELD) return 0;
    if (queue->shared) {
        if (!share_next(&queue->shares, renderer, tile)) return 0;
        give(queue, renderer, tile->id, 0);
        return 1;
    }
    uint32_t waiting = queue->waiting.count, id = heap_top(&queue->waiting);
    if (waiting == 0 || (holder->lots > 0 && waiting <= queue->config.renderers)) return 0;
    unset_waiting(queue, id);
    *tile = tile_of(queue, id);
    give(queue, renderer, id, 0);
    return 1;
}

static uint32_t next_probes(struct queue *queue, uint32_t renderer, struct tile *tiles)
{
    uint32_t share = divide_up(queue->probes, queue->config.renderers), count = 0;
    uint32_t *given = &queue->probes_given[renderer];
    while (*given < share && count < LOT_TILES && queue->next_probe < queue->probes) {
        uint64_t i = (uint64_t)queue->next_probe++ * queue->probe_stride % queue->probes;
        uint32_t id = queue->first_probe + (uint32_t)i;
        tiles[count++] = tile_of(queue, id);
        give(queue, renderer, id, 0);
        ++*given;
    }
    return count;
}

/* Two halves in place of a tile that waits, cut across its longer side. */
static void split(struct queue *queue, uint32_t id)
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
    double a = cost_predict(&queue->map, half.x, half.y, half.w, half.h).work;
    double b = cost_predict(&queue->map, rest.x, rest.y, rest.w, rest.h).work;
    double part = a + b > 0 ? a / (a + b) : 0.5;
    unset_waiting(queue, id);
    rest.work = (float)((double)half.work * (1 - part));
    half.work = (float)((double)half.work * part);
    queue->items[id] = half;
    set_waiting(queue, id);
    set_waiting(queue, new_item(queue, &rest));
    queue->count.tiles++;
}

static bool can_split(const struct queue *queue, const struct item *item)
{
    return (item->w > SPLIT_EDGE || item->h > SPLIT_EDGE) && queue->count.tiles < QUEUE_MAX_TILES;
}

/* ---- what an earlier run has finished ---- */

static void skip_tile(struct queue *queue, const struct tile *tile)
{
    if (queue->shared) {
        queue->share_finished[tile->id] = 1;
    } else {
        struct item *item = &queue->items[tile->id];
        item->finished = item->skipped = true;
        unset_waiting(queue, tile->id);
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
        if (finished == tile_pixels(&tile)) {
            skip_tile(queue, &tile);
        } else if (finished > 0 && !queue->shared && can_split(queue, &queue->items[tile.id])) {
            split(queue, tile.id);
            next = tile.id; /* one half has this id now, the other one comes last */
        }
    }
    queue->pixels_skipped = queue->count.pixels_finished;
    if (queue_complete(queue)) queue->next_probe = queue->probes;
}

/* The dearest tiles, so many that they make up the work of a lot. */
static uint32_t take_tiles(struct queue *queue, uint32_t renderer, double now, double work,
                           struct tile *tiles)
{
    uint32_t count = 0;
    uint64_t pixels = 0;
    double sum = 0;
    while (count < LOT_TILES && queue->waiting.count > 0) {
        uint32_t id = heap_top(&queue->waiting);
        const struct item *item = &queue->items[id];
        double more = (double)item->work;
        if (count > 0 && (sum + more > work || pixels + area(item) > LOT_PIXELS)) break;
        if (count == 0 && more > SPLIT_FROM * work && can_split(queue, item)) {
            split(queue, id);
            continue;
        }
        sum += more;
        pixels += area(item);
        unset_waiting(queue, id);
        tiles[count++] = tile_of(queue, id);
        give(queue, renderer, id, more);
    }
    if (count > 0) pace_given(&queue->pace, renderer, now, sum);
    return count;
}

/* ---- a second time ---- */

/* The last tile in the renderer's list that nobody has finished and that has not been handed on: of
 * all that it holds the least likely to be begun. */
static struct hold *last_to_pass_on(struct queue *queue, uint32_t renderer, bool lost)
{
    struct holdings *holdings = &queue->holdings;
    struct hold *found = NULL;
    uint32_t i = holdings->holders[renderer].first;
    while (i != HOLD_NONE) {
        struct hold *hold = &holdings->holds[i];
        const struct item *item = &queue->items[hold->id];
        bool open = item->pass != TILE_PROBE && !item->finished && !hold->passed_on;
        if (open && (lost || item->copies == 1)) found = hold;
        i = hold->next;
    }
    return found;
}

/* Whether it pays that the asker does what this renderer has, too: nobody counts on the lost. */
static bool repeat_pays(const struct queue *queue, uint32_t renderer, uint32_t asker, double now,
                        double work)
{
    const struct pace *pace = &queue->pace;
    const struct pace_renderer *r = &pace->renderers[renderer];
    return r->lost || now + pace_seconds(pace, asker, work) + pace_least(pace) < r->free_at;
}

/* A tile of the renderer on top of the heap goes to the asker, too, if that pays; renderers without
 * such a tile are taken off. */
static uint32_t repeat_from(struct queue *queue, const struct heap *heap, uint32_t asker,
                            double now, struct tile *tile)
{
    struct pace *pace = &queue->pace;
    while (heap->count > 0) {
        uint32_t renderer = heap_top(heap);
        struct hold *hold = last_to_pass_on(queue, renderer, pace->renderers[renderer].lost);
        if (!hold) {
            pace_overlook(pace, renderer);
            continue;
        }
        if (!repeat_pays(queue, renderer, asker, now, hold->work)) return 0;
        hold->passed_on = true;
        struct hold again = *hold;
        *tile = tile_of(queue, again.id);
        give(queue, asker, again.id, again.work);
        pace_given(pace, asker, now, again.work);
        queue->count.repeated++;
        return 1;
    }
    return 0;
}

static uint32_t next_repeat(struct queue *queue, uint32_t renderer, double now, struct tile *tile)
{
    if (queue->holdings.holders[renderer].count > 0) return 0;
    uint32_t count = repeat_from(queue, &queue->pace.lost, renderer, now, tile);
    return count ? count : repeat_from(queue, &queue->pace.last, renderer, now, tile);
}

/* ---- dynamic ---- */

/* Predicts what the tile costs; all that there was to go by before was its size. */
static void predict(struct queue *queue, uint32_t id)
{
    struct item *item = &queue->items[id];
    double before = (double)area(item);
    double factor = cost_predict(&queue->map, item->x, item->y, item->w, item->h).work / before;
    item->work = (float)((double)item->work * factor);
    queue->pace.total += (double)item->work;
    if (item->finished) queue->finished_work += (double)item->work;
    if (item->skipped) queue->skipped_work += (double)item->work;
    if (!heap_has(&queue->waiting, id)) return;
    queue->waiting_work += (double)item->work;
    item->priority = priority_of(queue, item);
    heap_put(&queue->waiting, id, item->priority);
}

/* The work that renderers have was told in another unit. */
static void predict_held(struct queue *queue, double now)
{
    pace_restart(&queue->pace);
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

/* Predictions from the probes, and with them another order. */
static void settle(struct queue *queue, double now)
{
    queue->settled = true;
    cost_settle(&queue->map);
    queue->pace.total = queue->waiting_work = queue->finished_work = queue->skipped_work = 0;
    for (uint32_t id = 0; id < queue->item_count; id++)
        if (queue->items[id].pass != TILE_PROBE) predict(queue, id);
    predict_held(queue, now);
    queue->news++;
}

/* Whether an idle renderer had better not wait for the rest of the probes. */
static bool settles(const struct queue *queue, uint32_t renderer)
{
    return queue->holdings.holders[renderer].count == 0 && queue->map.blocks_known > 0 &&
           queue->probes_back >= PROBES_ENOUGH * queue->probes;
}

static uint32_t next_dynamic(struct queue *queue, uint32_t renderer, double now, struct tile *tiles)
{
    if (queue->holdings.holders[renderer].lots == LOTS_HELD) return 0;
    if (!queue->settled) {
        uint32_t probes = next_probes(queue, renderer, tiles);
        if (probes > 0) return probes;
        if (settles(queue, renderer)) settle(queue, now);
    }
    pace_check(&queue->pace, now);
    if (queue->waiting.count == 0) return next_repeat(queue, renderer, now, tiles);
    double work = pace_lot(&queue->pace, renderer, now, queue->waiting_work);
    return work > 0 ? take_tiles(queue, renderer, now, work, tiles) : 0;
}

uint32_t queue_next(struct queue *queue, uint32_t renderer, double now,
                    struct tile tiles[LOT_TILES])
{
    assert(renderer < queue->config.renderers);
    if (queue->stopped) return 0;
    bool dynamic = queue->config.schedule == SCHEDULE_DYNAMIC;
    uint32_t count =
        dynamic ? next_dynamic(queue, renderer, now, tiles) : next_plain(queue, renderer, tiles);
    if (count > 0) holdings_end_lot(&queue->holdings, renderer);
    return count;
}

/* ---- what comes back ---- */

uint32_t queue_holds(const struct queue *queue, uint32_t renderer)
{
    assert(renderer < queue->config.renderers);
    return queue->holdings.holders[renderer].count;
}

bool queue_held(const struct queue *queue, uint32_t renderer, uint32_t id, struct tile *tile)
{
    assert(renderer < queue->config.renderers);
    if (!holdings_find(&queue->holdings, renderer, id)) return false;
    *tile = tile_of(queue, id);
    return true;
}

void queue_probed(struct queue *queue, const struct tile *probe, const float *seconds)
{
    cost_put(&queue->map, probe, seconds);
}

static bool finish_probe(struct queue *queue, double now)
{
    queue->probes_back++;
    if (!queue->settled && queue->probes_back == queue->probes) settle(queue, now);
    return false;
}

/* Marks the tile; false: it was. */
static bool mark_finished(struct queue *queue, uint32_t id)
{
    if (queue->shared) {
        bool first = !queue->share_finished[id];
        queue->share_finished[id] = 1;
        return first;
    }
    struct item *item = &queue->items[id];
    bool first = !item->finished;
    item->finished = true;
    item->copies--;
    if (first) queue->finished_work += (double)item->work;
    return first;
}

bool queue_finish(struct queue *queue, uint32_t renderer, uint32_t id, double now, double seconds)
{
    struct tile tile = tile_of(queue, id);
    struct hold hold = holdings_take(&queue->holdings, renderer, id);
    bool holds = queue->holdings.holders[renderer].count > 0;
    if (tile.pass == TILE_PROBE) return finish_probe(queue, now);
    if (queue->config.schedule == SCHEDULE_DYNAMIC)
        pace_answered(&queue->pace, renderer, now, hold.work, seconds, holds);
    if (!mark_finished(queue, id)) {
        queue->count.wasted_s += seconds;
        return false;
    }
    queue->count.finished++;
    queue->count.pixels_finished += tile_pixels(&tile);
    return true;
}

void queue_served(struct queue *queue, double seconds)
{
    if (queue->config.schedule == SCHEDULE_DYNAMIC) pace_served(&queue->pace, seconds);
}

/* ---- from outside ---- */

uint32_t queue_add(struct queue *queue, const struct tile *tile, double work, double priority)
{
    struct item item = {.x = tile->x,
                        .y = tile->y,
                        .w = tile->w,
                        .h = tile->h,
                        .pass = tile->pass,
                        .work = (float)work,
                        .priority = priority};
    assert(queue->config.schedule == SCHEDULE_DYNAMIC && tile->pass != TILE_PROBE);
    assert(area(&item) <= queue_largest_lot(queue) && queue->count.tiles < QUEUE_MAX_TILES);
    uint32_t id = new_item(queue, &item);
    set_waiting(queue, id);
    queue->pace.total += work;
    queue->count.tiles++;
    queue->news++;
    return id;
}

void queue_prioritize(struct queue *queue, uint32_t id, double priority)
{
    if (!heap_has(&queue->waiting, id)) return;
    queue->items[id].priority = priority;
    heap_put(&queue->waiting, id, priority);
}

double queue_work(const struct queue *queue, const struct tile *tile)
{
    struct item item = {.x = tile->x, .y = tile->y, .w = tile->w, .h = tile->h};
    if (!queue->settled) return (double)area(&item);
    return cost_predict(&queue->map, item.x, item.y, item.w, item.h).work;
}

void queue_stop(struct queue *queue)
{
    queue->stopped = true;
}

bool queue_complete(const struct queue *queue)
{
    return queue->count.finished == queue->count.tiles;
}

bool queue_over(struct queue *queue, uint32_t renderer)
{
    if (queue->config.schedule == SCHEDULE_DYNAMIC && !queue->stopped) return queue_complete(queue);
    if (queue_holds(queue, renderer) > 0) return false;
    if (queue->stopped) return true;
    return queue->shared ? !share_is_left(&queue->shares, renderer) : queue->waiting.count == 0;
}

uint64_t queue_news(const struct queue *queue)
{
    return queue->news;
}

double queue_wake(const struct queue *queue)
{
    if (queue->config.schedule != SCHEDULE_DYNAMIC || queue->stopped) return HUGE_VAL;
    return pace_next_late(&queue->pace);
}

struct queue_count queue_count(const struct queue *queue)
{
    struct queue_count count = queue->count;
    if (queue->config.schedule == SCHEDULE_DYNAMIC) {
        count.share_finished = queue->finished_work / queue->pace.total;
        count.share_skipped = queue->skipped_work / queue->pace.total;
    } else {
        double pixels = (double)queue->config.width * queue->config.height;
        count.share_finished = (double)count.pixels_finished / pixels;
        count.share_skipped = (double)queue->pixels_skipped / pixels;
    }
    count.share_finished = fmin(count.share_finished, 1);
    count.share_skipped = fmin(count.share_skipped, 1);
    return count;
}

bool queue_unfinished(const struct queue *queue, uint32_t *next, struct tile *tile)
{
    uint32_t ids = queue->shared ? (uint32_t)queue->shares.ids : queue->item_count;
    while (*next < ids) {
        uint32_t id = (*next)++;
        *tile = tile_of(queue, id);
        if (queue->shared ? share_has_pixels(tile) && !queue->share_finished[id]
                          : tile->pass != TILE_PROBE && !queue->items[id].finished)
            return true;
    }
    return false;
}

uint32_t queue_largest_lot(const struct queue *queue)
{
    if (queue->config.schedule != SCHEDULE_DYNAMIC) return queue->largest;
    uint64_t picture = (uint64_t)queue->config.width * queue->config.height;
    uint32_t lot = picture < LOT_PIXELS ? (uint32_t)picture : LOT_PIXELS;
    return lot > queue->largest ? lot : queue->largest;
}
