/*
 * The messages between the master (rank 0) and the renderers on other ranks.
 *
 *   start     every rank takes part in one broadcast of struct welcome, then of the scene block
 *   TILE      master -> renderer   struct tile: render this; up to two are under way at a time
 *   RESULT    renderer -> master   struct result_header, then 3 floats (linear RGB) per pixel in
 *                                  the tile's pixel order
 *   STOP      master -> renderer   empty: give up what is in work and leave
 *   STATS     renderer -> master   struct renderer_stats, the renderer's last message
 *
 * STOP comes when no tile is left for a renderer and all of its tiles are back, or at any time when
 * the run is stopped.
 *
 * All ranks run the same build (the welcome carries its name), so that structures travel as they
 * are in memory. Who receives a message validates it with the functions below before using any of
 * it.
 */
#ifndef FARM_COMMON_PROTOCOL_H
#define FARM_COMMON_PROTOCOL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/tile.h"
#include "common/vec.h"

enum message_tag {
    TAG_MASTER_TO_RENDERER_TILE = 1,
    TAG_MASTER_TO_RENDERER_STOP = 2,
    TAG_RENDERER_TO_MASTER_RESULT = 3,
    TAG_RENDERER_TO_MASTER_STATS = 4,
};

#define WELCOME_MAGIC  UINT64_C(0x314c57204d524146) /* "FARM WL1" */
#define HOST_NAME_SIZE 64

/* The first thing every rank hears from rank 0. */
struct welcome {
    uint64_t magic;
    char build[32];       /* FARM_VERSION of the master */
    uint64_t scene_bytes; /* 0: there is nothing to render, leave with status */
    uint64_t bvh_bytes;   /* room for the BVH of the scene */
    uint32_t status;      /* exit status of the whole job when scene_bytes is 0 */
    uint32_t reserved;
};

struct result_header {
    uint32_t tile_id;
    uint32_t pixels;
    uint64_t rays; /* of all kinds, traced for this tile */
    double busy_s; /* wall seconds it took to render */
};

/* Kinds of ray that are counted. */
enum ray_kind { RAY_PRIMARY, RAY_SHADOW, RAY_REFLECTION, RAY_REFRACTION, RAY_KINDS };

/* A sample whose colour is NaN, infinite, or too large for a picture of floats, and the first ray
 * of its tree that made it so. */
struct bad_sample {
    uint32_t x, y;                 /* pixel of the whole picture */
    uint32_t sample;               /* of the pixel */
    uint32_t depth;                /* of the ray: reflections and refractions on its way */
    struct vec3 origin, direction; /* of the ray; may be anything */
};

/* What rendering cost and met: per tile, summed per renderer, summed over the farm. */
struct render_counts {
    uint64_t rays[RAY_KINDS];
    uint64_t nonfinite;       /* samples that came out as NaN or infinity: struct bad_sample */
    uint64_t exact_fallbacks; /* predicates whose error filter asked for exact arithmetic */
    double intersect_s;       /* wall seconds spent finding hits and occluders */
    double shade_s;           /* wall seconds of the rest */
    uint64_t bound_rays; /* traced only to bound what max_depth and cutoff have left out */
    double truncation; /* largest error of a pixel that max_depth and cutoff can have caused */
    uint64_t unmatched_media; /* refractions out of what the ray had not entered: worker/medium.h */
    uint64_t open_media;      /* rays that left the scene within a medium */
    struct bad_sample first;  /* of the nonfinite ones, in the order of the picture; else all 0 */
};

struct renderer_stats {
    uint32_t rank;
    uint32_t tiles;
    uint64_t pixels;
    double busy_s; /* wall seconds of rendering */
    double cpu_s;  /* CPU seconds of the rendering thread from the first wait to the last send */
    double wait_s; /* the rest of the render phase; filled in by the master */
    double send_s; /* wall seconds in handing over results */
    double
        finish_s; /* when the last tile was finished, seconds after the start of the render phase */
    uint64_t bytes; /* of pixel messages */
    struct render_counts counts;
    char host[HOST_NAME_SIZE]; /* NUL-terminated */
};

_Static_assert(sizeof(struct welcome) == 64, "struct welcome goes over the wire as it is");
_Static_assert(sizeof(struct result_header) == 24,
               "struct result_header goes over the wire as it is");
_Static_assert(sizeof(struct renderer_stats) == 288,
               "struct renderer_stats goes over the wire as it is");

/* Bytes of the RESULT message for a tile. */
static inline size_t result_bytes(const struct tile *tile)
{
    return sizeof(struct result_header) + (size_t)tile_pixels(tile) * 3 * sizeof(float);
}

/*
 * How the master renders tiles of its own without knowing a renderer: see worker/render.h. render
 * returns false when it gave up, because the run is stopped.
 */
struct tile_renderer {
    void *state;
    bool (*render)(void *state, const struct tile *tile, float *rgb, struct render_counts *counts);
};

/* In the order of the picture: row by row from the top, the samples of a pixel in turn. */
bool bad_sample_before(const struct bad_sample *a, const struct bad_sample *b);

/* Counts a bad sample; keeps the first one. */
void render_counts_bad(struct render_counts *counts, const struct bad_sample *sample);

void render_counts_add(struct render_counts *sum, const struct render_counts *more);

/* Rays of all kinds. */
static inline uint64_t render_counts_rays(const struct render_counts *counts)
{
    uint64_t sum = 0;
    for (int kind = 0; kind < RAY_KINDS; kind++)
        sum += counts->rays[kind];
    return sum;
}

/* A TILE message of so many bytes, for a region of width x height pixels. */
bool tile_message_valid(const struct tile *tile, size_t bytes, uint32_t width, uint32_t height);

/* A RESULT message of so many bytes for tile, the one with the id that its header names. */
bool result_message_valid(const struct result_header *header, size_t bytes,
                          const struct tile *tile);

/* A STATS message of so many bytes from rank. */
bool stats_message_valid(const struct renderer_stats *stats, size_t bytes, int rank);

/* The welcome, against this build. */
bool welcome_valid(const struct welcome *welcome, const char *build);

#endif
