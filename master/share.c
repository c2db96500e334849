#include "master/share.h"

#include <stdlib.h>

#include "common/message.h"

static uint32_t smaller(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static uint32_t divide_up(uint32_t a, uint32_t b)
{
    return (uint32_t)(((uint64_t)a + b - 1) / b);
}

static struct tile strip_tile(const struct shares *shares, uint32_t id)
{
    uint32_t y = shares->strip_rows[id];
    return (struct tile){.id = id,
                         .y = y,
                         .w = shares->config.width,
                         .h = shares->strip_rows[id + 1] - y,
                         .step = 1};
}

/* Its phase may lie beyond the last pixel: then the renderer has no pixel in this band. */
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

/* Rows of a band: as asked for, or about so many pixels; at least 1, and no more than there are and fit in a
 * tile. */
static uint32_t band_rows(const struct share_config *config, uint64_t pixels)
{
    uint32_t width = config->width, most = smaller(config->height, TILE_MAX_PIXELS / width);
    uint64_t rows = config->rows ? config->rows : pixels / width;
    return rows < 1 ? 1 : rows > most ? most : (uint32_t)rows;
}

/* Renderer r gets height / P rows, and one more when r < height mod P. */
static void lay_out_strips(struct shares *shares)
{
    uint32_t height = shares->config.height, renderers = shares->config.renderers;
    uint32_t longest = divide_up(height, renderers);
    uint32_t rows = smaller(band_rows(&shares->config, BAND_PIXELS), longest);
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
static void lay_out_turns(struct shares *shares, uint64_t ids, uint64_t most)
{
    uint32_t renderers = shares->config.renderers;
    shares->ids = ids;
    shares->stride = renderers;
    if (ids > most) return;
    for (uint32_t r = 0; r < renderers; r++)
        shares->cursors[r] = (struct share_cursor){.next = r, .end = (uint32_t)ids};
}

void shares_init(struct shares *shares, const struct share_config *config, uint64_t most)
{
    uint32_t renderers = config->renderers;
    *shares = (struct shares){.config = *config, .stride = 1};
    shares->cursors = allocate_zeroed(renderers, sizeof *shares->cursors);
    if (config->schedule == SCHEDULE_STRIPS) {
        lay_out_strips(shares);
    } else if (config->schedule == SCHEDULE_CYCLIC) {
        shares->band_rows = band_rows(config, (uint64_t)BAND_PIXELS * renderers);
        uint64_t bands = divide_up(config->height, shares->band_rows);
        lay_out_turns(shares, bands * renderers, most);
    } else {
        shares->band_rows = band_rows(config, 1);
        lay_out_turns(shares, divide_up(config->height, shares->band_rows), most);
    }
}

void shares_free(struct shares *shares)
{
    free(shares->strip_rows);
    free(shares->cursors);
    *shares = (struct shares){0};
}

bool share_is_left(struct shares *shares, uint32_t renderer)
{
    struct share_cursor *cursor = &shares->cursors[renderer];
    while (cursor->next < cursor->end) {
        struct tile tile = share_tile(shares, cursor->next);
        bool finished = shares->finished && shares->finished[cursor->next];
        if (share_has_pixels(&tile) && !finished) return true;
        cursor->next += shares->stride;
    }
    return false;
}

bool share_next(struct shares *shares, uint32_t renderer, struct tile *tile)
{
    if (!share_is_left(shares, renderer)) return false;
    *tile = share_tile(shares, shares->cursors[renderer].next);
    shares->cursors[renderer].next += shares->stride;
    return true;
}
