/*
 * The work queue: which tile goes to which renderer next, and what has come back.
 *
 * Pure C: no MPI, no clock, no scene. Renderers are numbered 0 .. renderers - 1. Not thread-safe:
 * the caller holds a lock where several threads use one queue.
 *
 *   waiting --queue_next()--> out (with one renderer) --queue_finish()--> finished
 *
 * schedule   who gets a tile
 * dynamic    whoever asks, square tiles row by row from the top. A renderer may hold two tiles, the
 *            second one waiting so that it never idles, until there are no more tiles than renderers
 *            left.
 * strips     the paper's: the rows divided by the renderers, one extra row each to the first ones.
 *            A strip travels in bands of rows, but all of it belongs to its renderer.
 * cyclic     pixel number i (row by row) belongs to renderer i mod renderers, again in bands.
 */
#ifndef FARM_MASTER_QUEUE_H
#define FARM_MASTER_QUEUE_H

#include <stdbool.h>
#include <stdint.h>

#include "common/schedule.h"
#include "common/tile.h"

struct queue_config {
    enum schedule schedule;
    uint32_t width, height; /* of the rendered region, pixels, at least 1 */
    uint32_t renderers;     /* at least 1 */
    uint32_t tile_edge; /* dynamic: of a tile, pixels, at least 1; else: rows of a band, 0: auto */
};

/* More tiles than this are refused: their bookkeeping alone would take over 100 MB. */
#define QUEUE_MAX_TILES (UINT32_C(1) << 24)

struct queue;

/* NULL when the configuration makes more than QUEUE_MAX_TILES tiles. Freed by queue_destroy(). */
struct queue *queue_create(const struct queue_config *config);
void queue_destroy(struct queue *queue);

/*
 * The edge that `tile = auto` stands for. With n tiles, P renderers and a dearest tile r times the
 * mean, at most r (P - 1) / n of the time is lost at the end (Graham 1966). For r = 10 and a loss
 * of 5 % that asks for n = 200 (P - 1); the edge is the power of two that gives at least so many,
 * from 8 (below, a tile's fixed cost shows) to 64 (above, progress comes in lumps).
 */
uint32_t queue_auto_edge(uint32_t width, uint32_t height, uint32_t renderers);

/*
 * Before anything is handed out: the tiles for which is_finished() says so, being finished by an
 * earlier run, are so here too.
 */
void queue_skip(struct queue *queue, bool (*is_finished)(void *state, const struct tile *tile),
                void *state);

/*
 * Hands out a tile for this renderer. false: not now, because it holds enough already, or never
 * again, because nothing is left for it.
 */
bool queue_next(struct queue *queue, uint32_t renderer, struct tile *tile);

/* Tiles that this renderer holds. When it holds none and queue_next() gives none, none is left for
 * it. */
uint32_t queue_holds(const struct queue *queue, uint32_t renderer);

/* The tile that this renderer holds under this id; false when it holds no such tile. */
bool queue_held(const struct queue *queue, uint32_t renderer, uint32_t id, struct tile *tile);

/* The renderer has finished a tile that it holds (asserted). */
void queue_finish(struct queue *queue, uint32_t renderer, uint32_t id);

/* Hand out nothing more; what is out may still come back. */
void queue_stop(struct queue *queue);

uint32_t queue_tiles(const struct queue *queue);
uint32_t queue_tiles_finished(const struct queue *queue);
uint64_t queue_pixels_finished(const struct queue *queue);

/* Pixels of the largest tile: bounds every message. */
uint32_t queue_largest_tile(const struct queue *queue);

#endif
