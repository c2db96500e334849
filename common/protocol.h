/*
 * The messages between the master (rank 0) and the renderers on other ranks.
 *
 *   start     all ranks take part in a broadcast of struct welcome, then of the scene block
 *   READY     renderer -> master   struct ready: the scene and its BVH are available
 *   START     master -> renderer   struct start: the answer to READY, before any other message
 *   TILES     master -> renderer   a lot, that is, a batch of tiles to render: struct lot_header, then
 *                                  as many floats as it says, padded to lot_report_bytes(), then
 *                                  1 .. LOT_TILES struct tile. A renderer has at most LOTS_UNDER_WAY
 *                                  lots at a time. There is one float for each tile, or none: when a
 *                                  tile has been in work for so many seconds, the renderer reports it,
 *                                  and again each time that this time has doubled. From pass 1 on, each
 *                                  tile is followed by a struct refinement per pixel, padded to
 *                                  tile_part_bytes()
 *   DROP      master -> renderer   1 .. DROP_TILES struct drop: tiles that need not be rendered any
 *                                  more; the message may come too late
 *   RESULT    renderer -> master   a lot or a part of it. For each of its tiles, in order: struct
 *                                  result_header, then 3 floats (linear RGB) per pixel in the tile's
 *                                  pixel order; in adaptive sampling, struct pixel_floats of the
 *                                  pixels that got samples; for a probe (TILE_PROBE), the RGB floats
 *                                  and then one float per pixel, its CPU seconds; all padded to
 *                                  result_bytes(). A dropped tile is a header alone, with
 *                                  RESULT_DROPPED and the time spent on it. A tile that takes long is
 *                                  a header alone, with RESULT_UNFINISHED and the time spent so far;
 *                                  it is sent again when it is done, and the master may receive that
 *                                  result first
 *   PING      master -> renderer   empty: asks for a sign of life. Sent when nothing has been received
 *                                  for a while, and not again before something is
 *   PONG      renderer -> master   empty: the answer; also sent in the middle of a tile
 *   STOP      master -> renderer   empty: abandon the work in hand and leave
 *   STATS     renderer -> master   struct renderer_stats, the renderer's last message
 *
 * If the two are on one node, most of what TILES and RESULT would hold is passed in shared memory instead,
 * see common/tray.h. A renderer receives everything in the order in which the master says it. In the other
 * direction, a result in a tray may overtake a message; no result comes after STATS.
 *
 * STOP is sent when the picture is complete, or at any time when the run is stopped. After the broadcast the
 * master waits for no single renderer, and never blocks until a renderer has received a message: if a
 * renderer no longer answers, the tiles that it has, or would get under a static schedule, go to others.
 *
 * All ranks run the same build (the welcome carries its name), so structures are sent as they lie in memory.
 * The receiver of a message validates it with the functions below before it uses any part of it.
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

/* Most tiles in a lot: a TILES message stays small. */
#define LOT_TILES 64

/* Most lots that a renderer may have: the one in work and the one that waits after it. */
#define LOTS_UNDER_WAY 2

#define WELCOME_MAGIC  UINT64_C(0x314c57204d524146) /* "FARM WL1" */
#define HOST_NAME_SIZE 64

/* The first message that every rank gets from rank 0. */
struct welcome {
    uint64_t magic;
    char build[32];       /* farm_build of the master */
    uint64_t scene_bytes; /* 0: nothing to render, leave with status */
    uint64_t bvh_bytes;   /* bytes reserved for the BVH of the scene */
    uint32_t status;      /* exit status of the whole job when scene_bytes is 0 */
    uint32_t reserved;
};

struct lot_header {
    double answer_s;  /* seconds after which to send the finished tiles; may be infinite */
    uint32_t reports; /* number of floats that follow: the number of tiles, or 0 */
    /* 1: wake the master half way through, if no other lot has come by then; else 0 */
    uint32_t wakes_master;
};

/* Most tiles in a DROP message. */
#define DROP_TILES 32

struct drop {
    uint32_t tile_id;
    /* 1: an answer is of no use any more, so the tile is to be abandoned even if it is begun; 0: only if it is not
     * begun, as another renderer has it, too, or it is withdrawn */
    uint32_t finished;
};

/* Largest time that a renderer may report, in seconds: 30 years. */
#define SECONDS_MOST 1e9

struct ready {
    uint32_t rank;
    uint32_t reserved;         /* 0 */
    char host[HOST_NAME_SIZE]; /* NUL-terminated */
};

struct start {
    double elapsed_s; /* since the start of the render phase */
    double patience;  /* seconds for which any process may give no sign of life */
};

/* Kinds of ray that are counted separately. */
enum ray_kind { RAY_PRIMARY, RAY_SHADOW, RAY_REFLECTION, RAY_REFRACTION, RAY_KINDS };

/*
 * A sample whose colour is NaN, infinite, or too large for a picture of floats, with the first ray of its ray
 * tree that caused this.
 */
struct bad_sample {
    uint32_t x, y;                 /* pixel of the whole picture */
    uint32_t sample;               /* number within the pixel */
    uint32_t depth;                /* of the ray: number of reflections and refractions before it */
    struct vec3 origin, direction; /* of the ray; any values, also not finite */
};

/*
 * Sums over pixels of the squared sampling error and of its square. The squared error of a pixel (mean of the
 * three components) is estimated from the two halves of its samples (worker/task.h).
 */
struct error_sum {
    double squares, fourths;
};

/* Costs and events of rendering: per tile, summed per renderer, summed over the farm. */
struct render_counts {
    uint64_t rays[RAY_KINDS];
    uint64_t primary_hits; /* primary rays that hit something */
    /* Samples that a picture of floats cannot represent: struct bad_sample. */
    uint64_t nonfinite;
    uint64_t exact_fallbacks; /* predicates whose floating-point filter failed: decided exactly */
    double intersect_s;       /* wall seconds spent finding hits and occluders */
    double shade_s;           /* wall seconds of everything else */
    uint64_t bound_rays;      /* rays traced only to bound what max_depth and cutoff leave out */
    double truncation;        /* bound on the error that max_depth and cutoff cause in any pixel */
    /* Refractions out of a medium that the ray had not entered: worker/medium.h. */
    uint64_t unmatched_media;
    uint64_t open_media;       /* rays that left the scene while inside a medium */
    struct error_sum sampling; /* of the pixels with all their samples */
    struct error_sum halfway;  /* of the pixels after samples_halfway() of their samples */
    /* The first nonfinite sample in picture order; all 0 if there is none. */
    struct bad_sample first;
};

/*
 * Values in place of the number of pixels: the tile was dropped, or it takes long. (0 is a valid number: a
 * pass may give samples to no pixel of a refined tile.)
 */
#define RESULT_DROPPED    UINT32_MAX
#define RESULT_UNFINISHED (UINT32_MAX - 1)

/* Precedes a tile's pixels. */
struct result_header {
    uint32_t tile_id;
    uint32_t pixels; /* number of pixels that follow, or RESULT_DROPPED, or RESULT_UNFINISHED */
    double start_s;  /* when the tile was begun, seconds since the start of the render phase */
    double busy_s;   /* wall seconds it took to render */
    double cpu_s;    /* CPU seconds that it took, measured by common/cpu_time.h */
    struct render_counts counts;
};

/* Slots of a tray in each direction: one whose content has not been taken yet, and the next. */
#define TRAY_SLOTS 2

/*
 * Bytes of a slot. One for a lot holds the longest lot without refinements; one for a result holds the
 * results of most lots if there are more than a handful of renderers.
 */
#define TRAY_LOT_BYTES                                                                             \
    (sizeof(struct lot_header) + LOT_TILES * (sizeof(float) + sizeof(struct tile)))
#define TRAY_RESULT_BYTES ((size_t)32 << 10)

/*
 * The number of a pixel's samples of which struct render_counts keeps the error as well: half of them, with
 * equal numbers in both halves A and B; 0: too few samples.
 */
static inline uint32_t samples_halfway(uint32_t samples)
{
    return samples / 4 * 2;
}

struct renderer_stats {
    uint32_t rank;
    uint32_t tiles;
    uint32_t silent;   /* 1: it no longer answers; set by the master, 0 in messages */
    uint32_t reserved; /* 0 */
    uint64_t pixels;
    double busy_s; /* wall seconds of rendering */
    double cpu_s;  /* CPU seconds of the rendering thread from the first wait to the last send */
    double wait_s; /* the rest of the render phase; set by the master */
    double send_s; /* wall seconds spent on handing over results */
    /* End of its last rendering, useful or not, in seconds since the start of the render phase. */
    double finish_s;
    uint64_t bytes; /* of pixel messages */
    struct render_counts counts;
    char host[HOST_NAME_SIZE]; /* NUL-terminated */
};

_Static_assert(sizeof(struct welcome) == 64, "struct welcome goes over the wire as it is");
_Static_assert(sizeof(struct lot_header) == 16, "struct lot_header goes over the wire as it is");
_Static_assert(sizeof(struct drop) == 8, "struct drop goes over the wire as it is");
_Static_assert(sizeof(struct ready) == 72, "struct ready goes over the wire as it is");
_Static_assert(sizeof(struct start) == 16, "struct start goes over the wire as it is");
_Static_assert(sizeof(struct result_header) == 232,
               "struct result_header goes over the wire as it is");
_Static_assert(sizeof(struct renderer_stats) == 336,
               "struct renderer_stats goes over the wire as it is");

/* Floats sent per pixel in adaptive sampling: those of struct pixel_floats. */
#define REFINED_FLOATS 8

/*
 * Output arrays for the pixels of a tile that get samples in its pass. A and B are the two halves of a
 * pixel's samples (worker/task.h). All pointers but mean may be NULL: not wanted.
 */
struct pixel_floats {
    float *mean;       /* 3 per pixel, linear RGB: mean of the samples of this pass */
    float *difference; /* 3 per pixel: mean of A minus mean of B, 0 if either is empty */
    /* 1 per pixel: root mean square deviation of the samples from the mean of their half */
    float *spread;
    float *rays; /* 1 per pixel: rays of all kinds per sample */
};

/*
 * The arrays as they are laid out in messages, for this number of pixels: all means, then all differences and
 * so on. If not refined: means alone.
 */
static inline struct pixel_floats pixel_floats(float *floats, size_t pixels, bool refined)
{
    struct pixel_floats to = {.mean = floats};
    if (!refined) return to;
    to.difference = to.mean + 3 * pixels;
    to.spread = to.difference + 3 * pixels;
    to.rays = to.spread + pixels;
    return to;
}

/* Floats sent per pixel. halves: sampling is adaptive. */
static inline size_t result_floats(const struct tile *tile, bool halves)
{
    return tile->pass == TILE_PROBE ? 4 : halves ? REFINED_FLOATS : 3;
}

/*
 * Bytes of a tile's part of a RESULT message with this number of pixels: a multiple of 8, so that the next
 * part is aligned.
 */
static inline size_t result_bytes(const struct tile *tile, uint32_t pixels, bool halves)
{
    size_t bytes = pixels * result_floats(tile, halves) * sizeof(float);
    return sizeof(struct result_header) + round_up_to(bytes, 8);
}

/* Whether the tile has refinements, so that possibly only some of its pixels get samples in its pass. */
static inline bool tile_is_refined(const struct tile *tile)
{
    return tile->pass != 0 && tile->pass != TILE_PROBE;
}

/* Bytes of `reports` floats in a TILES message, padded to a multiple of 8. */
static inline size_t lot_report_bytes(uint32_t reports)
{
    return round_up_to(reports * sizeof(float), 8);
}

/* Bytes of a tile's part of a TILES message, a multiple of 8. */
static inline size_t tile_part_bytes(const struct tile *tile)
{
    size_t bytes = tile_is_refined(tile) ? tile_pixels(tile) * sizeof(struct refinement) : 0;
    return sizeof *tile + round_up_to(bytes, 8);
}

/*
 * MPICH's transport (UCX) delivers a message of up to RESULT_SHORT bytes within a node eagerly. A longer one
 * is announced and then fetched by the receiver, with a system call that takes as long as some messages. A
 * result that would be up to RESULT_PARTS times this long is therefore sent in parts of as many tiles as fit,
 * unless it fits into a tray, from which nothing has to be fetched.
 */
#define RESULT_SHORT ((size_t)8 << 10)
#define RESULT_PARTS 4

/*
 * Whether a result is sent before the next tile: it has `done` bytes, would have `next` with the next tile,
 * and has `whole` bytes for the whole lot or the rest of one. Applies while no answer is due.
 */
static inline bool result_is_full(size_t whole, size_t done, size_t next)
{
    return whole <= RESULT_PARTS * RESULT_SHORT && done > 0 && next > RESULT_SHORT;
}

/* The longest TILES message. The server never sends a longer one, and receivers have room for it. */
#define TILES_MAX_BYTES                                                                            \
    (sizeof(struct lot_header) + LOT_TILES * (sizeof(float) + sizeof(struct tile) + 8) +           \
     TILE_MAX_PIXELS * sizeof(struct refinement))

/* Whether a precedes b in picture order: row by row from the top, then by the samples' numbers in a pixel. */
bool bad_sample_before(const struct bad_sample *a, const struct bad_sample *b);

/* Counts a bad sample and keeps the first one. */
void render_counts_bad(struct render_counts *counts, const struct bad_sample *sample);

/* Add up; of `truncation` the larger one counts, of the first bad samples the one that precedes the other. */
void error_sum_add(struct error_sum *sum, const struct error_sum *more);
void render_counts_add(struct render_counts *sum, const struct render_counts *more);

/*
 * Adds the header of a tile, be it finished or dropped. cpu_s counts tiles alone until the renderer's last
 * message replaces it by the time of all it has done.
 */
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

/* Whether counts that were received or read from a file are valid. */
bool render_counts_valid(const struct render_counts *counts);

/* Whether the header of a dropped tile, or of one that takes long, is valid. */
bool dropped_valid(const struct result_header *header);
bool unfinished_valid(const struct result_header *header);

/* Whether a READY message of this size from rank, or a START message of this size, is valid. */
bool ready_message_valid(const struct ready *ready, size_t bytes, int rank);
bool start_message_valid(const struct start *start, size_t bytes);

/* Whether the header of a TILES message, or the floats after it, are valid. */
bool lot_header_valid(const struct lot_header *header);
bool lot_report_valid(const float *report_s, uint32_t count);

/* Whether a DROP message of this size is valid. */
bool drop_message_valid(const struct drop *drops, size_t bytes);

/* Whether a tile in a TILES message is valid, for a region of width x height pixels. */
bool tile_message_valid(const struct tile *tile, uint32_t width, uint32_t height);

/* Whether the refinements of a tile's pixels are valid; last: the highest level of the run. */
bool refinements_valid(const struct refinement *refinements, uint32_t count, uint32_t last);

/*
 * Whether a part of a RESULT message is valid for tile, whose id its header names. bytes: from the header to
 * the end of the message. halves: sampling is adaptive.
 */
bool result_message_valid(const struct result_header *header, size_t bytes, const struct tile *tile,
                          bool halves);

/* Whether a STATS message of this size from rank is valid. */
bool stats_message_valid(const struct renderer_stats *stats, size_t bytes, int rank);

/* Whether the welcome is valid and comes from the same build. */
bool welcome_valid(const struct welcome *welcome, const char *build);

#endif
