/*
 * The work queue of the master: it decides which tiles each renderer gets next, and keeps account of which are
 * finished.
 *
 * Pure C: no MPI, no clock, no scene. Times are passed in, in seconds since the start of the render phase, by
 * any clock that does not run backwards. Renderers are numbered 0 .. renderers - 1. Not thread-safe: where
 * several threads use one queue, the caller holds a lock.
 *
 *   waiting --queue_next()--> out (with one renderer or more) --queue_finish()--> finished
 *
 * A lot is the batch of tiles that a renderer gets in one message (a "chunk" in the literature on loop
 * scheduling). It is answered as a whole or in parts. A renderer holds up to two lots, so that it need not wait
 * for the next one.
 *
 * schedule     who gets what
 * dynamic      Whoever asks. A coarse pre-pass of probes (master/cost.h) predicts the cost of each tile.
 *              Expensive tiles go first, in lots that shrink with the remaining work and follow the renderer's
 *              speed (master/pace.h). Cheap tiles are mixed in, so that pixels come in at an even rate. Once
 *              there are predictions, adjacent cheap tiles are joined; a tile that is larger than its lot is
 *              split, also if it has been handed out by then and is more than an even share. What a late
 *              renderer has not begun goes to others. A renderer reports a tile that takes long
 *              (queue_takes_long()), so that it can be treated as late before its whole lot is overdue.
 *              When nothing waits, idle renderers get backup copies of the tiles of those that are late, or
 *              are going to be; the first answer counts. The master's own renderer, which loses the time that
 *              serving takes, leaves the last lots to the others.
 * tiles        Whoever asks: square tiles row by row from the top, one at a time.
 * strips, cyclic, cyclic-rows
 *              Fixed shares: master/share.h. One tile, a band of rows, at a time.
 *
 * Under all schedules but dynamic, the tiles of a renderer that gives no sign of life (queue_set_silent()) go to
 * idle renderers.
 *
 * With more renderers than cores (master/crowd.h), an idle renderer does not mean an idle core. Tiles and lots
 * are then as large as with one renderer per core, and nothing that a renderer holds is given to another one
 * while all cores have work.
 *
 * With n tiles, P renderers and time t per tile or lot, every queue that keeps no renderer idle while tiles wait
 * finishes by sum(t) / P + (1 - 1 / P) max(t) (Graham 1966).
 */
#ifndef FARM_MASTER_QUEUE_H
#define FARM_MASTER_QUEUE_H

#include <stdbool.h>
#include <stdint.h>

#include "common/protocol.h"
#include "common/tile.h"
#include "master/crowd.h"
#include "master/schedule.h"

struct queue_config {
    enum schedule schedule;
    uint32_t width, height; /* of the rendered region, in pixels, at least 1 */
    uint32_t renderers;     /* at least 1 */
    /* Renderer 0 is rank 0's own, which loses the time that serving takes. */
    bool master_renders;
    /* Which renderers share cores; not owned, outlives the queue. NULL: each renderer has its own core. */
    const struct crowd *crowd;
    /* dynamic and tiles: edge in pixels, at least 1. Other schedules: rows of a band, 0: automatic. */
    uint32_t tile_edge;
    uint32_t probe_edge; /* dynamic: distance between probes in pixels; 0: no pre-pass */
    uint32_t samples;    /* fewest samples per pixel; 0 counts as 1 */
    /* dynamic: the most that a tile may be predicted to cost, in seconds of probing (master/cost.h); 0: no
     * limit */
    double most_work;
};

/* A picture of more tiles is refused: their bookkeeping alone would take about 2 GB. Splitting also stops
 * at this number; tiles from queue_add() come on top. */
#define QUEUE_MAX_TILES (UINT32_C(1) << 24)

struct queue;

/* Returns NULL when the configuration makes more than QUEUE_MAX_TILES tiles. Freed by queue_destroy(). */
struct queue *queue_create(const struct queue_config *config);
void queue_destroy(struct queue *queue);

/*
 * The edge in pixels that `tile = auto` stands for; processors: how many renderers can work at a time.
 *
 * Schedule tiles: with n tiles, P renderers and a most expensive tile that costs r times the mean, at most
 * r (P - 1) / n of the time is lost at the end. For r = 10 and a loss of 5 % that asks for n = 200 (P - 1).
 * The edge is the largest power of two that gives at least so many tiles, between 8 (below it, a tile's
 * fixed cost shows) and 64 (above it, progress comes in lumps).
 *
 * Schedule dynamic: the same with n = 100 P and an edge of at most 16, since ordering and splitting do the
 * rest. With fewer than four samples per pixel it is 16.
 */
uint32_t queue_auto_edge(enum schedule schedule, uint32_t width, uint32_t height, uint32_t samples,
                         uint32_t processors);

/* The edge (dynamic, tiles) or the rows of a band (other schedules), in pixels, of the tiles that were made
 * at the start, whether configured or chosen automatically. */
uint32_t queue_tile_edge(const struct queue *queue);

/*
 * The distance between probes in pixels; 0: the picture is too small to be worth probing.
 *
 * It is chosen so that probes take less than one percent of the time: a sample on its own was measured at up to
 * 5 times the cost of one within a tile, so at most one of 500 samples is a probe. Twice as many and more for 44
 * processors make single samples of twelve scenes 1 % slower, though there are only 14 probes for each.
 */
uint32_t queue_auto_probe_edge(uint32_t width, uint32_t height, uint32_t samples);

/*
 * Takes over what an earlier run has finished, before anything is handed out. The callback returns how many
 * pixels of a tile are finished. Tiles that are finished count as finished here, too; those that are finished in
 * part are split (dynamic, tiles).
 */
typedef uint32_t queue_finished_pixels(void *state, const struct tile *tile);
void queue_skip(struct queue *queue, queue_finished_pixels *finished_pixels, void *state);

/* queue_next() is about to be called for the renderer: asks for the memory that it needs, which arrives while what the
 * renderer has sent is taken in. */
void queue_expect(const struct queue *queue, uint32_t renderer);

/*
 * Hands out a lot to the renderer: fills in its tiles and returns their number, at most LOT_TILES. 0: there is
 * nothing for it now (it holds enough, or nothing suitable waits) or ever again: queue_over() tells which.
 */
uint32_t queue_next(struct queue *queue, uint32_t renderer, double now,
                    struct tile tiles[LOT_TILES]);

/* Whether the renderer will never get anything again, unless queue_add() brings more tiles. That is so when
 * all tiles are finished (until then it may have to take over from another renderer), or when the queue is
 * stopped and the renderer holds nothing. */
bool queue_over(struct queue *queue, uint32_t renderer);

/*
 * Renderers that got nothing from queue_next(), but are not over, should ask again when the count of
 * queue_news() has changed, or after the time that queue_wake() returns (HUGE_VAL: there is none).
 */
uint64_t queue_news(const struct queue *queue);
double queue_wake(struct queue *queue);

/* Seconds for which no renderer is predicted to run out of work, so that answers may be left unread for that
 * time. 0: one has run out, or nothing is known. */
double queue_calm(struct queue *queue, double now);

/* Whether the renderer holds as many lots as it may: it gets no more until it answers. */
bool queue_is_full(const struct queue *queue, uint32_t renderer);

/* How many tiles the renderer holds, probes included. */
uint32_t queue_tile_count(const struct queue *queue, uint32_t renderer);

/* Sets *tile to the tile with this id that the renderer holds; false when it holds no such tile. */
bool queue_find_held(const struct queue *queue, uint32_t renderer, uint32_t id, struct tile *tile);

/*
 * Converts the wall and CPU seconds of a tile, as the renderer reports them, to the seconds to pass to the
 * functions below: the wall seconds, except where renderers share cores. There the wall time depends on how
 * often the renderer had its turn. So it is the CPU time, multiplied by the ratio of wall to CPU time of all
 * tiles of its group (master/crowd.h), or by the number of renderers per core if that is larger.
 */
double queue_seconds(struct queue *queue, uint32_t renderer, double wall, double cpu);

/*
 * The renderer has finished a tile that it holds (asserted). seconds: what the tile took, see queue_seconds().
 * The first answer for a tile counts, later ones are in vain. A piece of a tile that another renderer holds as a
 * whole is kept: the caller keeps its pixels until queue_fate() says whether they count.
 */
enum answer { ANSWER_IN_VAIN, ANSWER_COUNTS, ANSWER_KEPT };
enum answer queue_finish(struct queue *queue, uint32_t renderer, uint32_t id, double now,
                         double seconds);

/* The fate of a piece that was kept. To be called after each queue_finish() until it returns false. */
struct fate {
    uint32_t id;
    bool counts; /* false: it was in vain, its pixels are to be discarded */
};
bool queue_fate(struct queue *queue, struct fate *fate);

/* Seconds after its last answer, or after the start of the lot, at which a renderer sends the part of the
 * lot that it has finished; what it has not begun can then be given to others. HUGE_VAL: it answers lots as
 * a whole. */
double queue_answer_after(const struct queue *queue);

/*
 * For each tile of a lot that the renderer has just got, the seconds after which it is to report that it is
 * still working on that tile; it reports again whenever that time has doubled. Returns how many values
 * there are: count, or 0 when it is to report no tile.
 */
uint32_t queue_report_times(const struct queue *queue, uint32_t renderer, const struct tile *tiles,
                            uint32_t count, float report_s[LOT_TILES]);

/* The predicted seconds that the tiles of a lot will take the renderer that has just got them; 0: nothing
 * is known. */
double queue_lot_seconds(const struct queue *queue, uint32_t renderer, const struct tile *tiles,
                         uint32_t count);

/* The renderer has reported that it has been working on this tile, which it holds, for `seconds`. */
void queue_takes_long(struct queue *queue, uint32_t renderer, uint32_t id, double now,
                      double seconds);

/*
 * A recall: a tile that its renderer need not render any more, which the caller is to tell that renderer. To be
 * called after each queue_next() and queue_finish(), until it returns false. The renderer may render the tile
 * all the same, or drop it: then the caller calls queue_drop(), for a tile for which queue_is_recalled() is
 * true, with the seconds for which the renderer has worked on it.
 */
struct recall {
    uint32_t renderer, id;
    /* true: the tile is finished or not wanted any more, so that an answer is of no use even if the
     * renderer has begun it. false: the renderer is to give the tile up only if it has not begun it:
     * another one has it, too, or it is withdrawn. */
    bool finished;
};
bool queue_next_recall(struct queue *queue, struct recall *recall);
bool queue_has_recalls(const struct queue *queue);
bool queue_is_recalled(const struct queue *queue, uint32_t renderer, uint32_t id);
void queue_drop(struct queue *queue, uint32_t renderer, uint32_t id, double now, double seconds);

/* Takes in the CPU seconds of each pixel of a probe tile; to be called before queue_finish() of that tile.
 * false: one of the values is below 0 or above SECONDS_MOST. */
bool queue_probed(struct queue *queue, const struct tile *probe, const float *seconds);

/*
 * Ends the pre-pass early (dynamic only): no more probes are handed out, and renderers may leave those that
 * they have not begun. Predictions are made from the probes that are back, or from the first one that
 * comes. Has no effect once the queue predicts.
 */
void queue_end_probes(struct queue *queue, double now);

/* Reports how many seconds the master spent on an answer with this number of pixels. */
void queue_served(struct queue *queue, double seconds, double pixels);

/*
 * Adds a tile while the queue runs (dynamic only); only its x, y, w, h and pass are used. work: its predicted
 * cost in the unit of queue_work(). priority: tiles of higher priority go first; that of the initial tiles is
 * their predicted worst-case work per pixel, rounded down to half an octave.
 */
void queue_add(struct queue *queue, const struct tile *tile, double work, double priority);

/*
 * Tells how the work of added tiles is spread over their pixels, for when they are split: the callback returns what a
 * part of one costs, in a unit that is the same for all parts of the tile; 0 for the whole tile: not known. Without it,
 * and where it is not known, work is taken to be spread as in pass 0. The state is not owned; it must stay valid as
 * long as the queue hands out tiles.
 */
typedef double queue_part_work(const void *state, const struct tile *part);
void queue_set_part_work(struct queue *queue, queue_part_work *part_work, const void *state);

/* The predicted cost of pass 0 of this tile, in the queue's own unit of work. */
double queue_work(const struct queue *queue, const struct tile *tile);

/* The predicted time at which all will be finished, in seconds since the start, if all renderers that are
 * not late go on as they have so far. 0: not known, as nothing is finished yet, or the schedule is not
 * dynamic. Early predictions are rough: the first tiles are the expensive ones, which tell little about the
 * others. Tiles that are out count as not begun. */
double queue_ends(const struct queue *queue, double now);

/* Removes all tiles that no renderer has begun (dynamic only), as if they had never been added. What is
 * finished or begun still comes back, and then the queue is complete; it does not wait for renderers that
 * are late once all others are done. */
void queue_withdraw(struct queue *queue);

/*
 * Sets whether the renderer gives no sign of life. Under all schedules but dynamic, idle renderers then get what
 * it holds, under the static ones also the rest of its share. The dynamic schedule recognises late renderers
 * without this.
 */
void queue_set_silent(struct queue *queue, uint32_t renderer, bool silent);

/* Hands out nothing more from now on; what is out may still come back. */
void queue_stop(struct queue *queue);

/* How far the run has come. Probes are not counted, as the picture does not need them. */
struct queue_count {
    uint32_t tiles, finished;
    uint64_t pixels_finished; /* of all passes */
    /* Part of the seconds that all is predicted to take, 0..1; under the schedule tiles, part of the
     * pixels. */
    double share_finished;
    double share_skipped; /* part of the same total that an earlier run finished */
    uint32_t repeated;    /* tiles handed out a second time */
    /* Seconds spent on answers that did not count, or on tiles that were dropped half done before the end. */
    double wasted_s;
};
struct queue_count queue_count(const struct queue *queue);

/* Looks for renderers that are late by now; to be called when the time of queue_wake() has come. */
void queue_look(struct queue *queue, double now);

bool queue_complete(const struct queue *queue);

/* Iterates over the tiles that are not finished: *next begins with 0; false: there are no more. */
bool queue_unfinished(const struct queue *queue, uint32_t *next, struct tile *tile);

/* Pixels of the largest lot, which may be a single tile. It bounds the size of every message. */
uint32_t queue_largest_lot(const struct queue *queue);

#endif
