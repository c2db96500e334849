/*
 * The work queue: which tiles go to which renderer next, and what has come back.
 *
 * Pure C: no MPI, no clock, no scene. Times are passed in, in seconds since the start of the render
 * phase by any clock that does not run backwards. Renderers are numbered 0 .. renderers - 1. Not
 * thread-safe: the caller holds a lock where several threads use one queue.
 *
 *   waiting --queue_next()--> out (with one renderer, or two) --queue_finish()--> finished
 *
 * Tiles are handed out in lots, which are answered as a whole or in parts. A renderer holds two lots, so
 * that it never waits for the next one.
 *
 * schedule     who gets what
 * dynamic      Whoever asks. A coarse pre-pass of probes (master/cost.h) predicts what tiles cost;
 *              dear ones go first, in lots that shrink with what is left and follow the renderer's
 *              speed (master/pace.h), and cheap ones with them, so that pixels come in at an even
 *              rate. Cheap tiles side by side are joined when predictions are there, and what is
 *              larger than its lot is split. What somebody who is late has not begun goes to others;
 *              a renderer tells of a tile that takes long (queue_takes_long()), so that others need
 *              not wait for the end of its lot to be late. When nothing waits, tiles of those who
 *              are late, or will be, are handed out a second time to those who are idle; the first
 *              answer counts. The master's own renderer, which loses the time that serving takes,
 *              leaves the end to the others.
 * tiles        Whoever asks: square tiles row by row from the top, one at a time.
 * strips, cyclic, cyclic-rows
 *              Fixed shares: master/share.h. One tile, a band of rows, at a time.
 *
 * Under all but dynamic a renderer that gives no sign of life any more (queue_set_silent()) loses what
 * it has to those who are idle.
 *
 * With more renderers than cores (master/crowd.h) an idle renderer is no idle core: tiles and lots are as
 * large as for a renderer to a core, and nothing that somebody has is given to another one while
 * all cores have work.
 *
 * With n tiles, P renderers and t a tile's or lot's time, every queue that keeps nobody idle while
 * tiles wait ends by sum(t) / P + (1 - 1 / P) max(t) (Graham 1966).
 */
#ifndef FARM_MASTER_QUEUE_H
#define FARM_MASTER_QUEUE_H

#include <stdbool.h>
#include <stdint.h>

#include "common/protocol.h"
#include "common/schedule.h"
#include "common/tile.h"
#include "master/crowd.h"

struct queue_config {
    enum schedule schedule;
    uint32_t width, height;    /* of the rendered region, pixels, at least 1 */
    uint32_t renderers;        /* at least 1 */
    bool master_renders;       /* renderer 0 is rank 0's own: what serving takes, it loses */
    const struct crowd *crowd; /* of the renderers, outlives the queue; NULL: each has a core */
    uint32_t tile_edge;  /* dynamic, tiles: pixels, at least 1; else: rows of a band, 0: auto */
    uint32_t probe_edge; /* dynamic: pixels from probe to probe; 0: no pre-pass */
    uint32_t samples;    /* of a pixel, the fewest; 0: one */
    double most_work; /* dynamic: seconds of probing that a tile may be predicted to take; 0: any */
};

/* A picture of more tiles than this is refused: their bookkeeping alone would take about 2 GB. Tiles
 * are split no further, either; what queue_add() brings comes on top. */
#define QUEUE_MAX_TILES (UINT32_C(1) << 24)

struct queue;

/* NULL when the configuration makes more than QUEUE_MAX_TILES tiles. Freed by queue_destroy(). */
struct queue *queue_create(const struct queue_config *config);
void queue_destroy(struct queue *queue);

/*
 * The edge that `tile = auto` stands for. tiles: with n tiles, P renderers and a dearest tile r
 * times the mean, at most r (P - 1) / n of the time is lost at the end. For r = 10 and a loss of
 * 5 % that asks for n = 200 (P - 1); the edge is the power of two that gives at least so many, from
 * 8 (below, a tile's fixed cost shows) to 64 (above, progress comes in lumps). dynamic: the same
 * with n = 100 P, for order and splitting do the rest; where a pixel has 16 samples or more, that fixed cost
 * does not show, n = 400 P: in simulated runs of the lantern on 2 to 16 processors 99.8 % of their time goes into
 * tiles that count, and with 100 P 99.2 %; with single samples it would be 95.7 % in place of 96.3 %.
 */
uint32_t queue_auto_edge(enum schedule schedule, uint32_t width, uint32_t height, uint32_t samples,
                         uint32_t processors);

/* Of the tiles that were made in the beginning, as asked for or chosen: the edge (dynamic, tiles) or the
 * rows of a band, pixels. */
uint32_t queue_tile_edge(const struct queue *queue);

/*
 * The distance of probes so that they take less than one percent of the time: a sample on its own was
 * measured at up to 5 times what one in a tile costs, so it is one of at least 500. Where that leaves
 * fewer than 25 for each renderer, what the dearest spots of the picture keep one of many from ending
 * with the others is more than that, and they may be one of 125. Fewer for few processors (600 each) took
 * 0.4 to 1.1 % off the time of 1 or 2, but the end of a pass was foretold worse: of the time limits of
 * test/test_adaptive.sh that cut pass 0 off, 3 of 6 runs chose a lattice that they could not finish. 0: the
 * picture is too small to be worth it.
 */
uint32_t queue_auto_probe_edge(uint32_t width, uint32_t height, uint32_t samples,
                               uint32_t processors);

/*
 * Before anything is handed out: how many pixels of a tile an earlier run has finished. Tiles that are
 * finished are so here, too; those that are in part are split (dynamic, tiles).
 */
typedef uint32_t queue_finished_pixels(void *state, const struct tile *tile);
void queue_skip(struct queue *queue, queue_finished_pixels *finished_pixels, void *state);

/*
 * Hands out a lot for this renderer: returns the number of tiles, at most LOT_TILES. 0: not now,
 * because it holds enough already or nothing waits, or never again: see queue_over().
 */
uint32_t queue_next(struct queue *queue, uint32_t renderer, double now,
                    struct tile tiles[LOT_TILES]);

/* Whether nothing is left for this renderer, ever, unless queue_add() brings more: all is finished, for
 * until then it may have to take over from somebody else; or the queue is stopped, and it holds nothing. */
bool queue_over(struct queue *queue, uint32_t renderer);

/*
 * Renderers that got nothing, but are not through, should ask again when this number has changed, or
 * after queue_wake(), HUGE_VAL: not before.
 */
uint64_t queue_news(const struct queue *queue);
double queue_wake(struct queue *queue);

/* For so many seconds no renderer should run out of what it has, so that answers can wait so long; 0: one
 * has, or nothing is known. */
double queue_calm(struct queue *queue, double now);

/* Whether it holds as many lots as it may: until it answers there are no more for it. */
bool queue_is_full(const struct queue *queue, uint32_t renderer);

/* Tiles that this renderer holds. */
uint32_t queue_tile_count(const struct queue *queue, uint32_t renderer);

/* The tile that this renderer holds under this id; false when it holds no such tile. */
bool queue_find_held(const struct queue *queue, uint32_t renderer, uint32_t id, struct tile *tile);

/*
 * What a tile has taken this renderer, as the functions below are to be told, of what it tells of it: wall
 * seconds, and CPU seconds of them. Where renderers share cores, whose turn it was says nothing about the
 * tile or the renderer: the CPU time counts, drawn out as that of all who share them is.
 */
double queue_seconds(struct queue *queue, uint32_t renderer, double wall, double cpu);

/*
 * The renderer has finished a tile that it holds (asserted) in so many seconds of its own. The first to do so
 * counts, later ones are in vain. A piece of a tile that somebody else has as a whole is to be kept, until
 * queue_fate() says which of both counts.
 */
enum answer { ANSWER_IN_VAIN, ANSWER_COUNTS, ANSWER_KEPT };
enum answer queue_finish(struct queue *queue, uint32_t renderer, uint32_t id, double now,
                         double seconds);

/* What becomes of a piece that is kept: to be asked after each queue_finish() until this returns false. */
struct fate {
    uint32_t id;
    bool counts; /* false: it was in vain */
};
bool queue_fate(struct queue *queue, struct fate *fate);

/* A renderer that has finished a part of a lot answers with it when its last answer, or the begin of
 * the lot, is so many seconds ago: then what it has not done yet can be given to others. */
double queue_answer_after(const struct queue *queue);

/* Of the tiles of a lot that the renderer has just got: one that is in work for so many seconds it tells
 * of, and again when it is twice as long. Returns how many there are, 0: it is to tell of none. */
uint32_t queue_tells(const struct queue *queue, uint32_t renderer, const struct tile *tiles,
                     uint32_t count, float tells[LOT_TILES]);

/* What the tiles that it has just got are predicted to take it; 0: nobody knows. */
double queue_lot_seconds(const struct queue *queue, uint32_t renderer, const struct tile *tiles,
                         uint32_t count);

/* It has told: the tile, which it has, is in work for so many seconds. */
void queue_takes_long(struct queue *queue, uint32_t renderer, uint32_t id, double now,
                      double seconds);

/*
 * A tile that its renderer need not render any more: to be told to it after each queue_next() and
 * queue_finish(), until this returns false. It may render it all the same, or answer that it has dropped
 * it, after so many seconds of rendering: queue_drop(), of what queue_is_recalled() says.
 */
struct recall {
    uint32_t renderer, id;
    /* By somebody else: even if it has begun it, its answer is of no use. false: somebody else has it, too. */
    bool finished;
};
bool queue_next_recall(struct queue *queue, struct recall *recall);
bool queue_has_recalls(const struct queue *queue); /* whether there may be any */
bool queue_is_recalled(const struct queue *queue, uint32_t renderer, uint32_t id);
void queue_drop(struct queue *queue, uint32_t renderer, uint32_t id, double now, double seconds);

/* What each pixel of a probe took, CPU seconds; before queue_finish() of that tile. false: one of them is below 0 or
 * above SECONDS_MOST. */
bool queue_probed(struct queue *queue, const struct tile *probe, const float *seconds);

/*
 * There is no time for more probes (dynamic only): none is handed out any more, who has some may leave those that it
 * has not begun, and predictions come from those that are back, or from the first that comes. Nothing where the queue
 * predicts already.
 */
void queue_end_probes(struct queue *queue, double now);

/* How long the master has worked on an answer of so many pixels. */
void queue_served(struct queue *queue, double seconds, double pixels);

/*
 * Puts in one more tile (x, y, w, h and pass of it count; dynamic only) while the queue runs. work:
 * what it is predicted to cost, as queue_work() tells it; priority: tiles with more go first, the
 * first ones have their work per pixel. Returns its id.
 */
uint32_t queue_add(struct queue *queue, const struct tile *tile, double work, double priority);

/* What pass 0 of this tile is predicted to cost, in units of the queue's own. */
double queue_work(const struct queue *queue, const struct tile *tile);

/* When all will be finished, seconds since the start, if all who are not late go on as they have; 0: nobody knows, as
 * nothing is finished yet, or the schedule is not dynamic. The first tiles are the dear ones, which tell little about
 * the others; what is out counts as not begun. */
double queue_ends(const struct queue *queue, double now);

/* Takes out all tiles that nobody has begun (dynamic only), as if they had never been in: what somebody has done or is
 * at comes back, unless he is late and all others are done, and then the queue is complete. */
void queue_withdraw(struct queue *queue);

/*
 * Whether the renderer gives no sign of life. What it has, and under the static schedules all that
 * is left of its share, goes to others that have nothing to do (dynamic: those who are late are known
 * without this).
 */
void queue_set_silent(struct queue *queue, uint32_t renderer, bool silent);

/* Hand out nothing more; what is out may still come back. */
void queue_stop(struct queue *queue);

/* All but the probes, which nobody needs for the picture. */
struct queue_count {
    uint32_t tiles, finished;
    uint64_t pixels_finished; /* of all passes */
    double share_finished;    /* of the seconds that all is expected to take, 0..1; tiles: of the
                               * pixels */
    double share_skipped;     /* of that: by an earlier run */
    uint32_t repeated;        /* handed out a second time */
    double wasted_s; /* in answers that came second, or was dropped half done before the end */
};
struct queue_count queue_count(const struct queue *queue);

/* Looks for those who are late by now; when queue_wake() has come. */
void queue_look(struct queue *queue, double now);

/* Whether every tile is finished. */
bool queue_complete(const struct queue *queue);

/* The tiles that are not finished, one by one: *next begins with 0; false: there are no more. */
bool queue_unfinished(const struct queue *queue, uint32_t *next, struct tile *tile);

/* Pixels of the largest lot, which may be one tile: bounds every message. */
uint32_t queue_largest_lot(const struct queue *queue);

#endif
