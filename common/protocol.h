/*
 * The messages between the master (rank 0) and the renderers on other ranks.
 *
 *   start     every rank takes part in one broadcast of struct welcome, then of the scene block
 *   READY     renderer -> master   struct ready: the scene and its BVH are here
 *   START     master -> renderer   struct start: the answer to READY, before any other message
 *   TILES     master -> renderer   struct lot_header, then as many floats as it says, filled up to
 *                                  lot_tells_bytes(), then 1 .. LOT_TILES struct tile, a lot: render
 *                                  these; up to LOTS_UNDER_WAY lots at a time. The floats are one for
 *                                  each tile, or none: what is in work for so many seconds is to be
 *                                  told of, and again when it is twice as long. From pass 1 on,
 *                                  each is followed by a struct refinement per pixel, filled up to
 *                                  tile_part_bytes()
 *   DROP      master -> renderer   1 .. DROP_TILES struct drop: tiles that need not be rendered any
 *                                  more; it may be too late
 *   RESULT    renderer -> master   a lot or a part of it: for each of its tiles in their order struct
 *                                  result_header, then 3 floats (linear RGB) per pixel in the
 *                                  tile's pixel order; where sampling is adaptive struct
 *                                  pixel_floats of those that got samples; behind those of a probe
 *                                  (TILE_PROBE) one float per pixel, the CPU seconds that it took;
 *                                  filled up to result_bytes(). A tile that is dropped is a header
 *                                  alone, with RESULT_DROPPED and the time that it has taken; one that
 *                                  takes long is a header alone, with RESULT_UNFINISHED and the time
 *                                  that it has taken so far. It comes once more when it is done, which
 *                                  may be taken in before
 *   PING      master -> renderer   empty: a sign of life is asked for. Comes when nothing has been
 *                                  heard for a while, and not again before something is
 *   PONG      renderer -> master   empty: the answer, in the midst of a tile, too
 *   STOP      master -> renderer   empty: give up what is in work and leave
 *   STATS     renderer -> master   struct renderer_stats, the renderer's last message
 *
 * Most of what TILES and RESULT would hold lies in memory that the two share instead, where they are on one
 * node: common/tray.h. A renderer hears what the master says in the order in which it is said, the other way
 * round what lies in a tray may overtake a message; none of it comes behind STATS.
 *
 * STOP comes when the picture is whole, or at any time when the run is stopped. From the broadcast on
 * the master waits for no single renderer, and no message to one waits for it to be taken: what one that
 * answers no more has, or would get under a static schedule, goes to others.
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

#include "common/refinement.h"
#include "common/tile.h"
#include "common/vec.h"
#include "common/whole.h"

enum message_tag {
    TAG_MASTER_TO_RENDERER_TILES = 1,
    TAG_MASTER_TO_RENDERER_STOP = 2,
    TAG_RENDERER_TO_MASTER_RESULT = 3,
    TAG_RENDERER_TO_MASTER_STATS = 4,
    TAG_RENDERER_TO_MASTER_READY = 5,
    TAG_MASTER_TO_RENDERER_START = 6,
    TAG_MASTER_TO_RENDERER_DROP = 7,
    TAG_MASTER_TO_RENDERER_PING = 8,
    TAG_RENDERER_TO_MASTER_PONG = 9,
};

/* Tiles of a lot, at most: a TILES message stays small. */
#define LOT_TILES 64

/* Lots that a renderer may have at a time: the one in work and the one that waits behind it. */
#define LOTS_UNDER_WAY 2

#define WELCOME_MAGIC  UINT64_C(0x314c57204d524146) /* "FARM WL1" */
#define HOST_NAME_SIZE 64

/* The first thing every rank hears from rank 0. */
struct welcome {
    uint64_t magic;
    char build[32];       /* farm_build of the master */
    uint64_t scene_bytes; /* 0: there is nothing to render, leave with status */
    uint64_t bvh_bytes;   /* room for the BVH of the scene */
    uint32_t status;      /* exit status of the whole job when scene_bytes is 0 */
    uint32_t reserved;
};

struct lot_header {
    double answer_s; /* answer with what is finished after so long; may be infinite */
    uint32_t tells;  /* floats that follow: as many as there are tiles, or 0 */
    uint32_t calls;  /* 1: wake the master half way, if no other lot is there by then; or 0 */
};

/* Tiles in a DROP message, at most. */
#define DROP_TILES 32

struct drop {
    uint32_t tile_id;
    /* 1: by somebody else, so that it is to be given up even when it is begun; 0: somebody else has it, too */
    uint32_t finished;
};

/* Seconds that a renderer may tell of, at most: 30 years. */
#define SECONDS_MOST 1e9

struct ready {
    uint32_t rank;
    uint32_t reserved;         /* 0 */
    char host[HOST_NAME_SIZE]; /* NUL-terminated */
};

struct start {
    double elapsed_s; /* since the start of the render phase */
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

/*
 * Over pixels: the sum of their squared sampling errors (mean of the three components), as the
 * pixels' halves tell them (worker/task.h), and of the squares of these.
 */
struct error_sum {
    double squares, fourths;
};

/* What rendering cost and met: per tile, summed per renderer, summed over the farm. */
struct render_counts {
    uint64_t rays[RAY_KINDS];
    uint64_t primary_hits;    /* primary rays that have met something */
    uint64_t nonfinite;       /* samples that a picture of floats cannot hold: struct bad_sample */
    uint64_t exact_fallbacks; /* predicates whose error filter asked for exact arithmetic */
    double intersect_s;       /* wall seconds spent finding hits and occluders */
    double shade_s;           /* wall seconds of the rest */
    uint64_t bound_rays;      /* traced only to bound what max_depth and cutoff have left out */
    double truncation; /* largest error of a pixel that max_depth and cutoff can have caused */
    uint64_t unmatched_media; /* refractions out of what the ray had not entered: worker/medium.h */
    uint64_t open_media;      /* rays that left the scene within a medium */
    struct error_sum sampling; /* of the pixels as they are */
    struct error_sum halfway;  /* and as they were after samples_halfway() of their samples */
    struct bad_sample first;   /* of the nonfinite ones, in the order of the picture; else all 0 */
};

/* In place of the number of pixels, of which a part of a refined tile may have none: the tile was dropped, or
 * it takes long. */
#define RESULT_DROPPED    UINT32_MAX
#define RESULT_UNFINISHED (UINT32_MAX - 1)

/* Stands before a tile's pixels. */
struct result_header {
    uint32_t tile_id;
    uint32_t pixels; /* that follow, or RESULT_DROPPED, or RESULT_UNFINISHED */
    double start_s;  /* when it was begun, seconds after the start of the render phase */
    double busy_s;   /* wall seconds it took to render */
    double cpu_s;    /* CPU seconds of that, as common/cpu_time.h has them */
    struct render_counts counts;
};

/* Slots of a tray for each direction: one for what has not been looked at yet, one for the next. */
#define TRAY_SLOTS 2

/* What they hold: the longest lot without refinements; the results of most lots, where there are more than a
 * handful of renderers. */
#define TRAY_LOT_BYTES                                                                             \
    (sizeof(struct lot_header) + LOT_TILES * (sizeof(float) + sizeof(struct tile)))
#define TRAY_RESULT_BYTES ((size_t)32 << 10)

/* Half of a pixel's samples, the same number in each of its halves; 0: too few for that. */
static inline uint32_t samples_halfway(uint32_t samples)
{
    return samples / 4 * 2;
}

struct renderer_stats {
    uint32_t rank;
    uint32_t tiles;
    uint32_t silent;   /* 1: it answered no more; filled in by the master, 0 in messages */
    uint32_t reserved; /* 0 */
    uint64_t pixels;
    double busy_s;   /* wall seconds of rendering */
    double cpu_s;    /* CPU seconds of the rendering thread from the first wait to the last send */
    double wait_s;   /* the rest of the render phase; filled in by the master */
    double send_s;   /* wall seconds in handing over results */
    double finish_s; /* when it rendered for the last time, for what was of no use in the end, too:
                      * seconds after the start of the render phase */
    uint64_t bytes;  /* of pixel messages */
    struct render_counts counts;
    char host[HOST_NAME_SIZE]; /* NUL-terminated */
};

_Static_assert(sizeof(struct welcome) == 64, "struct welcome goes over the wire as it is");
_Static_assert(sizeof(struct lot_header) == 16, "struct lot_header goes over the wire as it is");
_Static_assert(sizeof(struct drop) == 8, "struct drop goes over the wire as it is");
_Static_assert(sizeof(struct ready) == 72, "struct ready goes over the wire as it is");
_Static_assert(sizeof(struct start) == 8, "struct start goes over the wire as it is");
_Static_assert(sizeof(struct result_header) == 232,
               "struct result_header goes over the wire as it is");
_Static_assert(sizeof(struct renderer_stats) == 336,
               "struct renderer_stats goes over the wire as it is");

/* Floats that are sent of a pixel where sampling is adaptive: those of struct pixel_floats. */
#define REFINED_FLOATS 8

/* Where what samples tell of a tile's pixels goes, of those that get some in the tile's pass; their two halves,
 * A and B, are those of worker/task.h. All but the means may be NULL: not wanted. */
struct pixel_floats {
    float *mean;       /* 3 per pixel, linear RGB: of these samples */
    float *difference; /* 3 per pixel: the mean of A less that of B, 0 where one of them is empty */
    float *spread;     /* 1 per pixel: root mean square of samples less the mean of their half */
    float *rays;       /* 1 per pixel: rays of all kinds per sample */
};

/* As it is sent of so many pixels: all means, then all differences and so on; without refined means alone. */
static inline struct pixel_floats pixel_floats(float *floats, size_t pixels, bool refined)
{
    struct pixel_floats to = {.mean = floats};
    if (!refined) return to;
    to.difference = to.mean + 3 * pixels;
    to.spread = to.difference + 3 * pixels;
    to.rays = to.spread + pixels;
    return to;
}

/* Floats that are sent of a pixel; halves: sampling is adaptive. */
static inline size_t result_floats(const struct tile *tile, bool halves)
{
    return tile->pass == TILE_PROBE ? 4 : halves ? REFINED_FLOATS : 3;
}

/* Bytes of a tile's part of a RESULT message with so many pixels: a multiple of 8, so that what
 * follows is aligned. */
static inline size_t result_bytes(const struct tile *tile, uint32_t pixels, bool halves)
{
    size_t bytes = pixels * result_floats(tile, halves) * sizeof(float);
    return sizeof(struct result_header) + round_up_to(bytes, 8);
}

/* Whether only some of the tile's pixels get samples in its pass, as struct refinement says. */
static inline bool tile_is_refined(const struct tile *tile)
{
    return tile->pass != 0 && tile->pass != TILE_PROBE;
}

/* Bytes of so many floats in a TILES message, a multiple of 8. */
static inline size_t lot_tells_bytes(uint32_t tells)
{
    return round_up_to(tells * sizeof(float), 8);
}

/* Bytes of a tile's part of a TILES message, a multiple of 8. */
static inline size_t tile_part_bytes(const struct tile *tile)
{
    size_t bytes = tile_is_refined(tile) ? tile_pixels(tile) * sizeof(struct refinement) : 0;
    return sizeof *tile + round_up_to(bytes, 8);
}

/*
 * MPICH's transport (UCX) delivers a message of so many bytes within a node as it is; what is longer is
 * announced, and fetched by who receives it, in a system call that takes as long as some messages. So what
 * would be a few of these long is answered tile by tile, as many as fit; unless it fits into a tray, from
 * which nothing has to be fetched.
 */
#define RESULT_SHORT ((size_t)8 << 10)
#define RESULT_PARTS 4

/* A result of a lot, or of the rest of one, that has so many bytes as a whole, is sent when it has `done`
 * and would have `next` with the next tile; that answer being not due. */
static inline bool result_is_full(size_t whole, size_t done, size_t next)
{
    return whole <= RESULT_PARTS * RESULT_SHORT && done > 0 && next > RESULT_SHORT;
}

/* A TILES message is never longer: the server keeps to that, and receivers have so much room. */
#define TILES_MAX_BYTES                                                                            \
    (sizeof(struct lot_header) + LOT_TILES * (sizeof(float) + sizeof(struct tile) + 8) +           \
     TILE_MAX_PIXELS * sizeof(struct refinement))

/*
 * How the master renders tiles of its own without knowing a renderer: see worker/render.h and
 * worker/survey.h. Both return false when they gave up, because the run is stopped or others
 * have finished the tile.
 */
struct tile_renderer {
    void *state;
    bool (*render)(void *state, const struct tile *tile, const struct refinement *refinements,
                   const struct pixel_floats *to, struct render_counts *counts);
    bool (*probe)(void *state, const struct tile *tile, float *rgb, float *seconds);
};

/* In the order of the picture: row by row from the top, the samples of a pixel in turn. */
bool bad_sample_before(const struct bad_sample *a, const struct bad_sample *b);

/* Counts a bad sample; keeps the first one. */
void render_counts_bad(struct render_counts *counts, const struct bad_sample *sample);

void error_sum_add(struct error_sum *sum, const struct error_sum *more);

void render_counts_add(struct render_counts *sum, const struct render_counts *more);

/* What a tile adds, as its header tells, be it finished or dropped. cpu_s is that of tiles until the renderer's
 * last message tells of all that it did. */
void renderer_stats_add(struct renderer_stats *stats, const struct tile *tile,
                        const struct result_header *header);

/* Rays of all kinds. */
static inline uint64_t render_counts_rays(const struct render_counts *counts)
{
    uint64_t sum = 0;
    for (int kind = 0; kind < RAY_KINDS; kind++)
        sum += counts->rays[kind];
    return sum;
}

/* Counts that came from elsewhere, or from a file. */
bool render_counts_valid(const struct render_counts *counts);

/* The header in place of a tile that was dropped; that takes long. */
bool dropped_valid(const struct result_header *header);
bool unfinished_valid(const struct result_header *header);

/* A READY message of so many bytes from rank; a START message. */
bool ready_message_valid(const struct ready *ready, size_t bytes, int rank);
bool start_message_valid(const struct start *start, size_t bytes);

/* What a TILES message begins with; the floats behind it. */
bool lot_header_valid(const struct lot_header *header);
bool lot_tells_valid(const float *tells, uint32_t count);

/* A DROP message of so many bytes. */
bool drop_message_valid(const struct drop *drops, size_t bytes);

/* A tile in a TILES message, for a region of width x height pixels. */
bool tile_message_valid(const struct tile *tile, uint32_t width, uint32_t height);

/* What a TILES message says of so many pixels of a tile; last: the highest level there is. */
bool refinements_valid(const struct refinement *refinements, uint32_t count, uint32_t last);

/*
 * A part of so many bytes or more of a RESULT message for tile, the one with the id that its header
 * names; halves: sampling is adaptive.
 */
bool result_message_valid(const struct result_header *header, size_t bytes, const struct tile *tile,
                          bool halves);

/* A STATS message of so many bytes from rank. */
bool stats_message_valid(const struct renderer_stats *stats, size_t bytes, int rank);

/* The welcome, against this build. */
bool welcome_valid(const struct welcome *welcome, const char *build);

#endif
