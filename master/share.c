#include "master/share.h"

#include <stdlib.h>

#include "common/message.h"
#include "common/whole.h"

static struct tile strip_tile(const struct shares *shares, uint32_t id)
{
    uint32_t y = shares->strip_rows[id];
    return (struct tile){.id = id,
                         .y = y,
                         .w = shares->config.width,
                         .h = shares->strip_rows[id + 1] - y,
                         .step = 1};
}

/* The tile of this id under the cyclic schedule. If its phase is beyond the last pixel, the renderer has no pixel in
 * this band. */
static struct tile cyclic_tile(const struct shares *shares, uint32_t id)
{
    uint32_t renderers = shares->config.renderers;
    uint32_t band = id / renderers, renderer = id % renderers;
    uint32_t y = band * shares->band_rows;
    uint32_t first = (uint32_t)((uint64_t)y * shares->config.width % renderers);
    return (struct tile){.id = id,
                         .y = y,
                         .w = shares->config.width,
                         .h = smaller(shares->band_rows, shares->config.height - y),
                         .phase = (uint32_t)(((uint64_t)renderer + renderers - first) % renderers),
                         .step = renderers};
}

static struct tile row_tile(const struct shares *shares, uint32_t id)
{
    uint32_t y = id * shares->band_rows;
    return (struct tile){.id = id,
                         .y = y,
                         .w = shares->config.width,
                         .h = smaller(shares->band_rows, shares->config.height - y),
                         .step = 1};
}

struct tile share_tile(const struct shares *shares, uint32_t id)
{
    if (shares->config.schedule == SCHEDULE_STRIPS) return strip_tile(shares, id);
    if (shares->config.schedule == SCHEDULE_CYCLIC) return cyclic_tile(shares, id);
    return row_tile(shares, id);
}

bool share_has_pixels(const struct tile *tile)
{
    return tile->phase < tile->w * tile->h;
}

/* The rows of a band: as configured, or for about `pixels` pixels; at least 1, and at most those of the picture or
 * those that fit into a tile. */
static uint32_t band_rows(const struct queue_config *config, uint64_t pixels)
{
    uint32_t width = config->width, most = smaller(config->height, TILE_MAX_PIXELS / width);
    uint64_t rows = config->tile_edge ? config->tile_edge : pixels / width;
    return rows < 1 ? 1 : rows > most ? most : (uint32_t)rows;
}

/*
 * A share is sent in pieces of about BAND_PIXELS pixels, 200 KB of floats and a few tenths of a second of rendering, so
 * that progress can be seen and buffers stay small. A small share is sent in BANDS_SHOWN pieces, so that it shows
 * progress, too, unless these have fewer than BAND_LEAST pixels, those of a small tile.
 */
#define BAND_PIXELS 16384u
#define BAND_LEAST  256u
#define BANDS_SHOWN 16u

/* Pixels of a renderer's part of a band. */
static uint32_t band_pixels(const struct queue_config *config)
{
    uint64_t share = (uint64_t)config->width * config->height / config->renderers / BANDS_SHOWN;
    return share < BAND_LEAST ? BAND_LEAST : share > BAND_PIXELS ? BAND_PIXELS : (uint32_t)share;
}

/* Renderer r gets height / P rows, and one more when r < height mod P. */
static void lay_out_strips(struct shares *shares)
{
    uint32_t height = shares->config.height, renderers = shares->config.renderers;
    uint32_t longest = divide_up(height, renderers);
    uint32_t rows = smaller(band_rows(&shares->config, band_pixels(&shares->config)), longest);
    shares->band_rows = rows;
    shares->strip_rows = allocate((size_t)height + 1, sizeof *shares->strip_rows);
    uint32_t ids = 0, y = 0;
    for (uint32_t r = 0; r < renderers; r++) {
        uint32_t end = y + height / renderers + (r < height % renderers);
        shares->cursors[r].next = ids;
        while (y < end) {
            shares->strip_rows[ids++] = y;
            y += smaller(rows, end - y);
        }
        shares->cursors[r].end = ids;
    }
    shares->strip_rows[ids] = height;
    shares->ids = ids;
}

/* One tile of every band for each renderer (cyclic), or every P-th band (cyclic-rows). */
static void lay_out_turns(struct shares *shares, uint64_t ids)
{
    uint32_t renderers = shares->config.renderers;
    shares->ids = ids;
    shares->stride = renderers;
    if (ids > QUEUE_MAX_TILES) return;
    for (uint32_t r = 0; r < renderers; r++)
        shares->cursors[r] = (struct share_cursor){.next = r, .end = (uint32_t)ids};
}

/* The share that the tile with this id belongs to. */
static struct share_work *work_of(const struct shares *shares, uint32_t id)
{
    uint32_t height = shares->config.height, renderers = shares->config.renderers;
    if (shares->config.schedule != SCHEDULE_STRIPS) return &shares->work[id % renderers];
    uint32_t y = shares->strip_rows[id], rows = height / renderers, longer = height % renderers;
    uint32_t behind = longer * (rows + 1); /* first row after the strips that have one more row */
    return &shares->work[y < behind ? y / (rows + 1) : longer + (y - behind) / rows];
}

static void count_pixels(struct shares *shares)
{
    for (uint32_t id = 0; id < shares->ids; id++) {
        struct tile tile = share_tile(shares, id);
        if (share_has_pixels(&tile)) work_of(shares, id)->pixels += tile_pixels(&tile);
    }
}

void share_init(struct shares *shares, const struct queue_config *config)
{
    uint32_t renderers = config->renderers;
    *shares = (struct shares){.config = *config, .stride = 1};
    shares->cursors = allocate_zeroed(renderers, sizeof *shares->cursors);
    shares->work = allocate_zeroed(renderers, sizeof *shares->work);
    if (config->schedule == SCHEDULE_STRIPS) {
        lay_out_strips(shares);
    } else if (config->schedule == SCHEDULE_CYCLIC) {
        shares->band_rows = band_rows(config, (uint64_t)band_pixels(config) * renderers);
        uint64_t bands = divide_up(config->height, shares->band_rows);
        lay_out_turns(shares, bands * renderers);
    } else {
        shares->band_rows = band_rows(config, 1);
        lay_out_turns(shares, divide_up(config->height, shares->band_rows));
    }
    if (shares->ids > QUEUE_MAX_TILES) return;
    shares->finished = allocate_zeroed(shares->ids, sizeof *shares->finished);
    count_pixels(shares);
}

void share_free(struct shares *shares)
{
    free(shares->strip_rows);
    free(shares->cursors);
    free(shares->work);
    free(shares->finished);
    *shares = (struct shares){0};
}

/* Whether the renderer has a tile left; its cursor is then at that tile. */
static bool is_left(struct shares *shares, uint32_t renderer)
{
    struct share_cursor *cursor = &shares->cursors[renderer];
    while (cursor->next < cursor->end) {
        struct tile tile = share_tile(shares, cursor->next);
        if (share_has_pixels(&tile) && !shares->finished[cursor->next]) return true;
        cursor->next += shares->stride;
    }
    return false;
}

bool share_next(struct shares *shares, uint32_t renderer, struct tile *tile)
{
    if (!is_left(shares, renderer)) return false;
    *tile = share_tile(shares, shares->cursors[renderer].next);
    shares->cursors[renderer].next += shares->stride;
    return true;
}

void share_finish(struct shares *shares, const struct tile *tile, double now, double seconds)
{
    struct share_work *counts[] = {work_of(shares, tile->id), &shares->all};
    for (int i = 0; i < 2; i++) {
        counts[i]->finished += tile_pixels(tile);
        counts[i]->seconds += seconds;
    }
    shares->finished[tile->id] = true;
    shares->last_result_s = now;
}

void share_skip(struct shares *shares, const struct tile *tile)
{
    shares->finished[tile->id] = true;
    work_of(shares, tile->id)->skipped += tile_pixels(tile);
}

/* The weight, as a part of a share's pixels, of the mean over all shares. Pixels in the middle of a picture take many
 * times as long as those of the sky, so what a share's finished pixels took is no reliable guide to its others. For
 * strips, cyclic pixels and rows of lantern and garden on 2 to 44 renderers, the predicted time left is too long or too
 * short by a factor of 1.9 on average. By the share's own pixels alone it is 2.2, and up to 16 where a strip begins
 * with expensive pixels; by all finished pixels it is 3.3. */
#define COMMON_PART 0.5

/* Seconds that each pixel that is left of a share is expected to take. */
static double expected_pixel(const struct shares *shares, const struct share_work *share)
{
    double common = COMMON_PART * share->pixels, mean = shares->all.seconds / shares->all.finished;
    return (share->seconds + common * mean) / (share->finished + common);
}

/* Before the first result: the state of the share that has most pixels left. */
static struct outlook_share outlook_of_pixels(const struct shares *shares)
{
    double most = 0, skipped = 1, finished = 1;
    for (uint32_t i = 0; i < shares->config.renderers; i++) {
        const struct share_work *share = &shares->work[i];
        double left = share->pixels - share->finished - share->skipped;
        if (left <= most) continue;
        most = left;
        skipped = share->skipped / share->pixels;
        finished = skipped + share->finished / share->pixels;
    }
    return (struct outlook_share){.finished = finished, .skipped = skipped};
}

struct outlook_share share_outlook(const struct shares *shares)
{
    const struct share_work *all = &shares->all;
    double most = 0, before = 0;
    if (!(all->seconds > 0 && shares->last_result_s > 0)) return outlook_of_pixels(shares);
    for (uint32_t i = 0; i < shares->config.renderers; i++) {
        const struct share_work *share = &shares->work[i];
        if (share->pixels == 0) continue;
        double pixel = expected_pixel(shares, share);
        double left = (share->pixels - share->finished - share->skipped) * pixel;
        if (left <= most) continue;
        most = left;
        before = share->skipped * pixel;
    }
    double sum = before + shares->last_result_s + most;
    return (struct outlook_share){.finished = (before + shares->last_result_s) / sum,
                                  .skipped = before / sum};
}
