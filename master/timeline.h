/*
 * Who rendered what, and when: one entry per tile that somebody was at, with probes and what was dropped, in
 * the order in which they came in; and when passes of adaptive sampling were planned. Kept when somebody asked for the
 * trace, the heat map or the picture of ranks: 64 bytes each, 64 MB for a million.
 */
#ifndef FARM_MASTER_TIMELINE_H
#define FARM_MASTER_TIMELINE_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "common/protocol.h"
#include "common/tile.h"
#include "master/canvas.h"

enum timeline_kind {
    TIMELINE_TILE,   /* its pixels are in the picture */
    TIMELINE_PROBES, /* single samples that tell what the tiles will cost (TILE_PROBE) */
    TIMELINE_WASTED, /* others came first: their answer, or word of it while the tile was half done */
    TIMELINE_KINDS
};

struct timeline_entry {
    uint32_t x, y, w, h;  /* as in struct tile */
    uint32_t phase, step; /* as in struct tile */
    uint32_t renderer;    /* 0 .. renderers - 1 */
    enum timeline_kind kind;
    uint32_t pass;    /* as in struct tile */
    uint32_t pixels;  /* that samples were traced of; 0 of what was given up */
    uint64_t samples; /* that were traced; 0 of probes, and of what was given up */
    double start_s;   /* seconds after the start of the render phase */
    float busy_s;     /* wall seconds it took, from start_s on */
    float cpu_s;      /* CPU seconds of that */
};

_Static_assert(sizeof(struct timeline_entry) == 64, "what timeline.h promises");

/* In which a pass was planned: nobody had anything to do but what was in vain. */
struct timeline_plan {
    double start_s, end_s; /* seconds after the start of the render phase */
    unsigned pass;
};

struct timeline {
    struct timeline_entry *entries; /* owned */
    size_t count;
    struct timeline_plan *plans; /* in the order of time; owned */
    size_t plan_count;
};

static inline struct tile entry_tile(const struct timeline_entry *entry)
{
    return (struct tile){.x = entry->x,
                         .y = entry->y,
                         .w = entry->w,
                         .h = entry->h,
                         .phase = entry->phase,
                         .step = entry->step};
}

/* Starts empty as (struct timeline){0}. */
void timeline_free(struct timeline *timeline);

void timeline_add(struct timeline *timeline, enum timeline_kind kind, uint32_t renderer,
                  const struct tile *tile, const struct result_header *header);

/* Behind all that were added. */
void timeline_add_plan(struct timeline *timeline, const struct timeline_plan *plan);

/*
 * Chrome trace JSON, to be opened in Perfetto: a row for each of `count` renderers, a bar for each
 * entry with its place and cost, for each pause of 0.1 ms or more up to render_s a bar "waiting", or "planning" where
 * that is why, and "given up" for what was not done when the end came, of which stats alone tell.
 * stats are those of all renderers, in rank order. Errors are left in out.
 */
void timeline_trace(const struct timeline *timeline, const struct renderer_stats *stats,
                    uint32_t count, double render_s, FILE *out);

/* CPU seconds per pixel that the ends of the heat map's colours stand for. */
struct heat_range {
    double lowest, highest; /* black, white; 0 and 0 when nothing is known */
};

/*
 * CPU seconds per pixel as colours, on a logarithmic scale from black (cheap) to white (dear). A
 * tile's cost is spread evenly over its pixels; canvas has the size of the rendered region.
 */
struct heat_range timeline_heatmap(const struct timeline *timeline, struct canvas *canvas);

/* A renderer's colour in the picture of ranks, as it stands in a PNG. */
void timeline_rank_color(uint32_t renderer, float rgb[3]);

/* Which of `count` renderers rendered what: a colour each, tiles outlined where they are 8 pixels or
 * more wide and high. canvas as above; rows below the region are left alone. */
void timeline_ranks(const struct timeline *timeline, uint32_t count, struct canvas *canvas);

#endif
