/*
 * The timeline: which renderer rendered which tile, and when. It has an entry per tile that a renderer worked
 * on, including probes and dropped tiles, in the order in which they came in; and the times of planning passes
 * of adaptive sampling. It is recorded if the trace, the heat map or the picture of ranks is wanted: 72 bytes
 * per entry, 72 MB for a million. For the heat map it also has what each pixel has cost so far, 4 bytes a pixel.
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
    TIMELINE_PROBES, /* single samples that predict the cost of tiles (TILE_PROBE) */
    /* Another answer came first: this one came second, or the tile was dropped half done. */
    TIMELINE_WASTED,
    TIMELINE_KINDS
};

struct timeline_entry {
    struct tile tile;
    uint32_t renderer; /* 0 .. renderers - 1 */
    enum timeline_kind kind;
    uint64_t samples; /* samples that were traced; 0 for probes and dropped tiles */
    double start_s;   /* seconds after the start of the render phase */
    float busy_s;     /* wall seconds it took, from start_s on */
    float cpu_s;      /* CPU seconds of that */
    uint32_t pixels;  /* pixels that got samples; 0 for a dropped tile */
};

_Static_assert(sizeof(struct timeline_entry) == 72, "what timeline.h promises");

/* The time in which a pass was planned. Renderers had nothing to do then, or only work whose results were not
 * needed. */
struct timeline_plan {
    double start_s, end_s; /* seconds after the start of the render phase */
    unsigned pass;
};

/* An interval in which rank 0 served: took in results, handed out work, planned passes. */
struct timeline_service {
    double start_s, end_s; /* seconds after the start of the render phase */
    double cpu_s;          /* CPU seconds of serving in it */
};

struct timeline {
    struct timeline_entry *entries; /* owned */
    size_t count;
    struct timeline_plan *plans; /* in order of time; owned */
    size_t plan_count;
    struct timeline_service *services; /* in order of time, without gaps; owned */
    size_t service_count;
    /* CPU seconds of each pixel of the rendered region, rows from the top; owned; NULL: no heat map is wanted. To be
     * added to by whoever knows which pixels of a tile its time was spent on. */
    float *costs;
    uint32_t width; /* of that region */
};

/* Starts empty as (struct timeline){0}. */
void timeline_free(struct timeline *timeline);

void timeline_add(struct timeline *timeline, enum timeline_kind kind, uint32_t renderer,
                  const struct tile *tile, const struct result_header *header);

/* Prepares for the heat map of a region of this size. */
void timeline_record_costs(struct timeline *timeline, uint32_t width, uint32_t height);

/* Adds a tile's CPU seconds to the costs of its pixels, the same to each. */
void timeline_spread(struct timeline *timeline, const struct tile *tile, double seconds);

/* Adds a plan, which is later than all that were added before. */
void timeline_add_plan(struct timeline *timeline, const struct timeline_plan *plan);

/* Adds an interval of serving, which begins where the last one ends. */
void timeline_add_service(struct timeline *timeline, const struct timeline_service *service);

/*
 * Writes a trace in Chrome's JSON format, to be opened in Perfetto. It has a row for each of `count` renderers,
 * and in it a bar for each entry, with its place and cost. Pauses of 0.1 ms or more up to render_s are bars
 * "waiting", which say what for, or "planning" if that is the reason. A bar "given up" is what a renderer was
 * working on when the end came, of which only stats tell. A counter shows how much of a core serving has taken.
 * stats: those of all renderers, in rank order. Errors are left to ferror(out).
 */
void timeline_trace(const struct timeline *timeline, const struct renderer_stats *stats,
                    uint32_t count, double render_s, FILE *out);

/* The CPU seconds per pixel at the ends of the heat map's colour scale. */
struct heat_range {
    double lowest, highest; /* black and white; both 0 when nothing is known */
};

/*
 * Draws the costs, which must have been recorded, as colours, on a logarithmic scale from black (cheap) to white
 * (expensive). The canvas is as wide as the rendered region, whose height is given; rows below it are left alone.
 */
struct heat_range timeline_heatmap(const struct timeline *timeline, uint32_t height,
                                   struct canvas *canvas);

/* The colour of a place on that scale, 0 (cheap) <= heat <= 1, as it is in a PNG. */
void timeline_heat_color(double heat, float rgb[3]);

/* Draws which renderer rendered what, in the colours of the renderers; tiles are outlined where they are at least 8
 * pixels wide and high. canvas as above. */
void timeline_ranks(const struct timeline *timeline, float (*colors)[3], struct canvas *canvas);

#endif
