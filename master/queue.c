#include "master/queue.h"

#include <assert.h>
#include <stdlib.h>

#include "common/message.h"

/* A static share travels in pieces of about this many pixels: 200 KB of floats, a few tenths of a
 * second of rendering, so that progress shows and buffers stay small. */
#define BAND_PIXELS 16384u

/* Tiles that a renderer may hold: the one it renders and the one that waits behind it. */
#define HELD_MAX 2

#define NOBODY UINT32_MAX

/* What a renderer holds, and how far its own share has been handed out (static schedules). */
struct holder {
    uint32_t held[HELD_MAX]; /* tile ids */
    uint32_t held_count;
    uint32_t next, end; /* ids: next, next + stride, ... below end */
};

struct queue {
    struct queue_config config;
    uint32_t columns;     /* dynamic: tiles side by side */
    uint32_t band_rows;   /* cyclic: rows of a band */
    uint32_t *strip_rows; /* strips: first row of each band, and the height behind the last one */
    uint32_t ids;         /* 0 .. ids - 1; under cyclic some of them have no pixels */
    bool *skipped;        /* per id: finished by an earlier run; NULL: none is */
    uint32_t stride;      /* between the ids of one renderer's share */
    uint32_t next;        /* dynamic: first id not handed out */
    struct holder *holders;
    bool stopped;
    uint32_t tiles, tiles_finished, tiles_waiting;
    uint64_t pixels_finished;
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

uint32_t queue_auto_edge(uint32_t width, uint32_t height, uint32_t renderers)
{
    uint64_t wanted = UINT64_C(200) * (renderers > 1 ? renderers - 1 : 1);
    uint32_t edge = 64;
    while (edge > 8 && (uint64_t)divide_up(width, edge) * divide_up(height, edge) < wanted)
        edge /= 2;
    return edge;
}

static struct tile dynamic_tile(const struct queue *queue, uint32_t id)
{
    uint32_t edge = queue->config.tile_edge;
    uint32_t x = id % queue->columns * edge, y = id / queue->columns * edge;
    return (struct tile){.id = id,
                         .x = x,
                         .y = y,
                         .w = smaller(edge, queue->config.width - x),
                         .h = smaller(edge, queue->config.height - y),
                         .step = 1};
}

static struct tile strip_tile(const struct queue *queue, uint32_t id)
{
    uint32_t y = queue->strip_rows[id];
    return (struct tile){
        .id = id, .y = y, .w = queue->config.width, .h = queue->strip_rows[id + 1] - y, .step = 1};
}

/* Its phase may lie beyond the last pixel: then the renderer has no pixel in this band. */
static struct tile cyclic_tile(const struct queue *queue, uint32_t id)
{
    uint32_t renderers = queue->config.renderers;
    uint32_t band = id / renderers, renderer = id % renderers;
    uint32_t y = band * queue->band_rows;
    uint32_t first = (uint32_t)((uint64_t)y * queue->config.width % renderers);
    return (struct tile){.id = id,
                         .y = y,
                         .w = queue->config.width,
                         .h = smaller(queue->band_rows, queue->config.height - y),
                         .phase = (uint32_t)(((uint64_t)renderer + renderers - first) % renderers),
                         .step = renderers};
}

static struct tile tile_of(const struct queue *queue, uint32_t id)
{
    switch (queue->config.schedule) {
    case SCHEDULE_STRIPS:
        return strip_tile(queue, id);
    case SCHEDULE_CYCLIC:
        return cyclic_tile(queue, id);
    case SCHEDULE_DYNAMIC:
        break;
    }
    return dynamic_tile(queue, id);
}

static bool has_pixels(const struct tile *tile)
{
    return tile->phase < tile->w * tile->h;
}

static uint64_t lay_out_dynamic(struct queue *queue)
{
    queue->columns = divide_up(queue->config.width, queue->config.tile_edge);
    return (uint64_t)queue->columns * divide_up(queue->config.height, queue->config.tile_edge);
}

/* Rows of a band: as asked for, or about so many pixels; at least 1, and no more than fit in a
 * tile. */
static uint32_t band_rows(const struct queue *queue, uint64_t pixels)
{
    uint32_t width = queue->config.width, most = TILE_MAX_PIXELS / width;
    uint64_t rows = queue->config.tile_edge ? queue->config.tile_edge : pixels / width;
    return rows < 1 ? 1 : rows > most ? most : (uint32_t)rows;
}

/* Renderer r gets height / P rows, and one more when r < height mod P. */
static uint64_t lay_out_strips(struct queue *queue)
{
    uint32_t height = queue->config.height, renderers = queue->config.renderers;
    uint32_t rows = band_rows(queue, BAND_PIXELS);
    queue->strip_rows = allocate((size_t)height + 1, sizeof *queue->strip_rows);
    uint32_t ids = 0, y = 0;
    for (uint32_t r = 0; r < renderers; r++) {
        uint32_t end = y + height / renderers + (r < height % renderers);
        queue->holders[r].next = ids;
        while (y < end) {
            queue->strip_rows[ids++] = y;
            y += smaller(rows, end - y);
        }
        queue->holders[r].end = ids;
    }
    queue->strip_rows[ids] = height;
    return ids;
}

static uint64_t lay_out_cyclic(struct queue *queue)
{
    uint32_t renderers = queue->config.renderers;
    queue->band_rows = band_rows(queue, (uint64_t)BAND_PIXELS * renderers);
    uint64_t ids = (uint64_t)divide_up(queue->config.height, queue->band_rows) * renderers;
    if (ids > QUEUE_MAX_TILES) return ids;
    queue->stride = renderers;
    for (uint32_t r = 0; r < renderers; r++) {
        queue->holders[r].next = r;
        queue->holders[r].end = (uint32_t)ids;
    }
    return ids;
}

static uint64_t lay_out(struct queue *queue)
{
    switch (queue->config.schedule) {
    case SCHEDULE_STRIPS:
        return lay_out_strips(queue);
    case SCHEDULE_CYCLIC:
        return lay_out_cyclic(queue);
    case SCHEDULE_DYNAMIC:
        break;
    }
    return lay_out_dynamic(queue);
}

static void count_tiles(struct queue *queue)
{
    for (uint32_t id = 0; id < queue->ids; id++) {
        struct tile tile = tile_of(queue, id);
        if (!has_pixels(&tile)) continue;
        queue->tiles++;
        uint32_t pixels = tile_pixels(&tile);
        if (pixels > queue->largest) queue->largest = pixels;
    }
    queue->tiles_waiting = queue->tiles;
}

struct queue *queue_create(const struct queue_config *config)
{
    struct queue *queue = allocate_zeroed(1, sizeof *queue);
    queue->config = *config;
    queue->stride = 1;
    queue->holders = allocate_zeroed(config->renderers, sizeof *queue->holders);
    uint64_t ids = lay_out(queue);
    if (ids > QUEUE_MAX_TILES) {
        queue_destroy(queue);
        return NULL;
    }
    queue->ids = (uint32_t)ids;
    count_tiles(queue);
    return queue;
}

void queue_destroy(struct queue *queue)
{
    if (!queue) return;
    free(queue->strip_rows);
    free(queue->holders);
    free(queue->skipped);
    free(queue);
}

void queue_skip(struct queue *queue, bool (*is_finished)(void *state, const struct tile *tile),
                void *state)
{
    queue->skipped = allocate_zeroed(queue->ids, sizeof *queue->skipped);
    for (uint32_t id = 0; id < queue->ids; id++) {
        struct tile tile = tile_of(queue, id);
        if (!has_pixels(&tile) || !is_finished(state, &tile)) continue;
        queue->skipped[id] = true;
        queue->tiles_waiting--;
        queue->tiles_finished++;
        queue->pixels_finished += tile_pixels(&tile);
    }
}

/* Whether there is something to render: not so for ids without pixels. */
static bool has_work(const struct queue *queue, uint32_t id)
{
    struct tile tile = tile_of(queue, id);
    return has_pixels(&tile) && !(queue->skipped && queue->skipped[id]);
}

/* The next id of this renderer's own share, or NOBODY. Ids without work are passed over. */
static uint32_t next_of_share(const struct queue *queue, struct holder *holder)
{
    while (holder->next < holder->end) {
        if (has_work(queue, holder->next)) return holder->next;
        holder->next += queue->stride;
    }
    return NOBODY;
}

static uint32_t next_id(struct queue *queue, struct holder *holder)
{
    if (queue->stopped) return NOBODY;
    if (queue->config.schedule != SCHEDULE_DYNAMIC) return next_of_share(queue, holder);
    while (queue->next < queue->ids && !has_work(queue, queue->next))
        queue->next++;
    return queue->next < queue->ids ? queue->next : NOBODY;
}

/* A second tile in reserve is taken from somebody who could start it at once, when tiles are few.
 */
static bool holds_enough(const struct queue *queue, const struct holder *holder)
{
    if (holder->held_count == 0) return false;
    if (holder->held_count == HELD_MAX) return true;
    return queue->config.schedule == SCHEDULE_DYNAMIC &&
           queue->tiles_waiting <= queue->config.renderers;
}

bool queue_next(struct queue *queue, uint32_t renderer, struct tile *tile)
{
    assert(renderer < queue->config.renderers);
    struct holder *holder = &queue->holders[renderer];
    if (holds_enough(queue, holder)) return false;
    uint32_t id = next_id(queue, holder);
    if (id == NOBODY) return false;
    *tile = tile_of(queue, id);
    if (queue->config.schedule == SCHEDULE_DYNAMIC)
        queue->next++;
    else
        holder->next += queue->stride;
    holder->held[holder->held_count++] = id;
    queue->tiles_waiting--;
    return true;
}

uint32_t queue_holds(const struct queue *queue, uint32_t renderer)
{
    assert(renderer < queue->config.renderers);
    return queue->holders[renderer].held_count;
}

static uint32_t held_slot(const struct holder *holder, uint32_t id)
{
    for (uint32_t i = 0; i < holder->held_count; i++) {
        if (holder->held[i] == id) return i;
    }
    return NOBODY;
}

bool queue_held(const struct queue *queue, uint32_t renderer, uint32_t id, struct tile *tile)
{
    assert(renderer < queue->config.renderers);
    if (held_slot(&queue->holders[renderer], id) == NOBODY) return false;
    *tile = tile_of(queue, id);
    return true;
}

void queue_finish(struct queue *queue, uint32_t renderer, uint32_t id)
{
    struct holder *holder = &queue->holders[renderer];
    uint32_t slot = held_slot(holder, id);
    assert(slot != NOBODY);
    holder->held[slot] = holder->held[--holder->held_count];
    struct tile tile = tile_of(queue, id);
    queue->tiles_finished++;
    queue->pixels_finished += tile_pixels(&tile);
}

void queue_stop(struct queue *queue)
{
    queue->stopped = true;
}

uint32_t queue_tiles(const struct queue *queue)
{
    return queue->tiles;
}

uint32_t queue_tiles_finished(const struct queue *queue)
{
    return queue->tiles_finished;
}

uint64_t queue_pixels_finished(const struct queue *queue)
{
    return queue->pixels_finished;
}

uint32_t queue_largest_tile(const struct queue *queue)
{
    return queue->largest;
}
