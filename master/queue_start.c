/* The initial state of the queue: how large tiles are, which tiles there are, and which of them an earlier run
 * has finished. */
#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "master/queue_parts.h"

/*
 * The most probes of a probe tile: few, so that a lot of probe tiles is spread over the picture. But a probe tile
 * takes the master as long as any other, 0.3 us, and renderers wait for it when many are short. In pictures with
 * so many probes that there would be more than PROBE_TILES probe tiles they have up to PROBE_BLOCKS_MOST probes, if
 * that leaves PROBE_TILES_EACH of them for each renderer. So 256 samples of the lantern with 7680 x 4320 pixels, two
 * million probes, are 2.5 % faster on 1,000 simulated processors, and 1024 samples 4 % on 10,000.
 *
 * With 16384 PROBE_TILES 16 samples of five scenes with 3840 x 2880 pixels are 0.1 to 1.3 % slower on 128, with 2048
 * as fast. With 32 PROBE_BLOCKS_MOST the 256 samples are 0.7 % slower; with 16 PROBE_TILES_EACH the 1024 samples are
 * 2 % slower, with 4 as fast.
 */
#define PROBE_BLOCKS      8
#define PROBE_BLOCKS_MOST 64
#define PROBE_TILES       4096
#define PROBE_TILES_EACH  8

#define TILES_EDGE 64u

/* The number of probes in whole blocks. Blocks cut by the edge of the picture have one, too, if it lies within
 * (cost_init()). */
static uint64_t probes_at(uint32_t width, uint32_t height, uint32_t edge)
{
    return (uint64_t)(width / edge) * (height / edge);
}

/* ---- how large they are ---- */

/*
 * Few samples are rendered so soon that the master, which takes some microseconds for a tile, is busy all the time if
 * tiles are smaller than DYNAMIC_EDGE. Single samples of twelve scenes with 640 x 480 pixels on 104 to 128 processors
 * then take 1.4 times as long, of 640 x 120 pixels on 28 to 64 1.2 times; four samples of the lantern on 44 take 6 %
 * less.
 */
#define FEW_SAMPLES 4

uint32_t queue_auto_edge(enum schedule schedule, uint32_t width, uint32_t height, uint32_t samples,
                         uint32_t processors)
{
    bool dynamic = schedule == SCHEDULE_DYNAMIC;
    uint64_t wanted = UINT64_C(200) * (processors > 1 ? processors - 1 : 1);
    if (dynamic) wanted = samples < FEW_SAMPLES ? 0 : UINT64_C(100) * processors;
    uint32_t edge = dynamic ? DYNAMIC_EDGE : TILES_EDGE;
    while (edge > 8 && (uint64_t)divide_up(width, edge) * divide_up(height, edge) < wanted)
        edge /= 2;
    return edge;
}

uint32_t queue_auto_probe_edge(uint32_t width, uint32_t height, uint32_t samples)
{
    const uint64_t samples_of_one = 500, least = 64;
    uint32_t edge = 4;
    while ((uint64_t)edge * edge * samples < samples_of_one)
        edge += 2;
    return probes_at(width, height, edge) < least ? 0 : edge;
}

uint32_t queue_tile_edge(const struct queue *queue)
{
    return queue->is_static ? queue->shares.band_rows : queue->config.tile_edge;
}

/* ---- which tiles there are ---- */

static void note_size(struct queue *queue, uint64_t pixels)
{
    if (pixels > queue->largest) queue->largest = (uint32_t)pixels;
}

/* Priorities in pseudo-random order, so that the first tiles, which are handed out before anything is known, are
 * of all kinds: multiplication by an odd number near 2^32 / golden ratio (D. Knuth, TAOCP 3, 6.4). */
static double scattered(uint32_t i)
{
    return (double)(uint32_t)(i * UINT32_C(2654435769));
}

/* Spare room for as many tiles again saves moving all items to a larger block when the first tile is split. This
 * is the most of it, 2 MB: of a large picture few tiles are split. */
#define SPARE_ITEMS 16384u

static void add_base_tiles(struct queue *queue, uint32_t columns, uint32_t rows)
{
    uint32_t edge = queue->config.tile_edge;
    queue_reserve(queue, columns * rows + queue->map.probes + smaller(columns * rows, SPARE_ITEMS));
    for (uint32_t i = 0; i < columns * rows; i++) {
        uint32_t x = i % columns * edge, y = i / columns * edge;
        struct item item = {.x = x,
                            .y = y,
                            .w = smaller(edge, queue->config.width - x),
                            .h = smaller(edge, queue->config.height - y)};
        item.work = item.worst = (float)area(&item);
        item.priority = queue->is_dynamic ? scattered(i) : 0;
        note_size(queue, area(&item));
        queue_set_waiting(queue, queue_new_item(queue, &item));
    }
    queue->count.tiles = columns * rows;
}

static uint32_t common_divisor(uint32_t a, uint32_t b)
{
    return b == 0 ? a : common_divisor(b, a % b);
}

/* Probe tiles are handed out with a stride of about the golden section of their number, so that every lot of
 * them, and every number of lots, is spread over the whole picture. */
static void add_probes(struct queue *queue)
{
    queue->first_probe = queue->item_count;
    for (uint32_t i = 0; i < queue->map.probes; i++)
        queue_new_item(queue, &(struct item){.pass = TILE_PROBE});
    uint32_t stride = (uint32_t)(0.6180339887 * queue->map.probes);
    while (common_divisor(stride, queue->map.probes) != 1)
        stride++;
    queue->probe_stride = stride;
}

/* The most probes of a probe tile for so many probes in all. */
static uint32_t probe_blocks(uint64_t probes, uint32_t renderers)
{
    uint64_t each = probes / renderers, blocks = probes / PROBE_TILES;
    if (blocks > each / PROBE_TILES_EACH) blocks = each / PROBE_TILES_EACH;
    if (blocks < PROBE_BLOCKS) blocks = PROBE_BLOCKS;
    if (blocks > PROBE_BLOCKS_MOST) blocks = PROBE_BLOCKS_MOST;
    /* Every renderer gets a probe tile, if there are enough probes. */
    if (blocks > each) blocks = each;
    return blocks > 0 ? (uint32_t)blocks : 1;
}

static bool start_items(struct queue *queue)
{
    const struct queue_config *config = &queue->config;
    uint32_t columns = divide_up(config->width, config->tile_edge);
    uint32_t rows = divide_up(config->height, config->tile_edge);
    if ((uint64_t)columns * rows > QUEUE_MAX_TILES) return false;
    uint32_t edge = queue->is_dynamic ? config->probe_edge : 0;
    uint64_t probes = edge ? probes_at(config->width, config->height, edge) : 0;
    cost_init(&queue->map, config->width, config->height, edge,
              probe_blocks(probes, config->renderers));
    add_base_tiles(queue, columns, rows);
    add_probes(queue);
    queue->probes_given = allocate_zeroed(config->renderers, sizeof *queue->probes_given);
    queue->settled = queue->map.probes == 0;
    pace_init(&queue->pace, config->renderers);
    queue_crowd(queue);
    queue->pace.blind = !queue->settled;
    queue->pace.total = queue->waiting_work;
    return true;
}

static bool start_shares(struct queue *queue)
{
    share_init(&queue->shares, &queue->config);
    if (queue->shares.ids > QUEUE_MAX_TILES) return false;
    uint32_t ids = (uint32_t)queue->shares.ids;
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
    queue->retry = HUGE_VAL;
    queue->is_dynamic = config->schedule == SCHEDULE_DYNAMIC;
    queue->is_static = schedule_is_static(config->schedule);
    queue->silent = allocate_zeroed(config->renderers, sizeof *queue->silent);
    holdings_init(&queue->holdings, config->renderers);
    if (queue->is_static ? start_shares(queue) : start_items(queue)) return queue;
    queue_destroy(queue);
    return NULL;
}

void queue_destroy(struct queue *queue)
{
    if (!queue) return;
    share_free(&queue->shares);
    cost_free(&queue->map);
    pace_free(&queue->pace);
    heap_free(&queue->waiting);
    free(queue->items);
    free(queue->probes_given);
    free(queue->groups);
    free(queue->silent);
    free(queue->recalls);
    free(queue->fates);
    holdings_free(&queue->holdings);
    free(queue);
}

/* ---- what an earlier run has finished ---- */

static void skip_tile(struct queue *queue, const struct tile *tile)
{
    if (queue->is_static) {
        share_skip(&queue->shares, tile);
    } else {
        struct item *item = &queue->items[tile->id];
        queue_uncount_outlook(queue, tile->id);
        item->finished = item->skipped = true;
        queue_count_outlook(queue, tile->id);
        queue_unset_waiting(queue, tile->id);
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
        } else if (finished > 0 && !queue->is_static && split_is_possible(queue, tile.id)) {
            split_tile(queue, tile.id);
            /* Visit the halves: one has this id now, the other one is the last item. */
            next = tile.id;
        }
    }
    queue->pixels_skipped = queue->count.pixels_finished;
    queue->pace.total = queue->waiting_work;
    queue->needs_no_probes = queue_complete(queue);
}
