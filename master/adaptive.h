/*
 * Adaptive sampling: decides which pixels get how many more samples.
 *
 * The picture is sampled in passes. Pass 0 takes min_samples of every pixel. When a pass is complete, the next one is
 * planned from all pixels. Unless there is a time limit, the plan depends on nothing else, so it is the same whoever
 * rendered them, in whatever order and pieces. Sampling ends when the error of the picture is estimated to be at most
 * the target.
 *
 * The rule. Let v be a pixel's variance per sample, defined such that n samples leave a squared error of v n^-3/2
 * (which is what stratified samples leave at an edge):
 *
 *   D  = the weighted mean of v over the 24 pixels around it, nearer ones weighing more, each estimated from its halves
 *        (worker/task.h): (A - B)^2 / 4 n^3/2. The pixel's own halves are left out: if pixels got no more samples
 *        because their halves agreed by chance, the estimate of the picture's error would be too small. So a pixel's
 *        own halves count for its own samples only as one of some thousand pixels that a surprise is averaged over
 *        (master/expect.c). What does count is its mean, through C and P, and
 *   S  = the variance of its samples about the means of their halves: large where an edge runs through the pixel, small
 *        beside it, while D is much the same in both. For independent samples of a normal distribution S is independent
 *        of the difference between the two means; for few samples at an edge it is not, as both are 0 where all samples
 *        have one colour. S cannot be estimated from two samples; where it is needed for other pixels, v estimated from
 *        the halves replaces it.
 *   k  = the ratio of errors to S in the neighbourhood, (D + S / 4) / (S' + S / 4), where S' is the mean of S over the
 *        same pixels as D; n^1/2 at most, as for random samples. It is about 1 at edges, and less where colours change
 *        evenly.
 *   v  = (4 D + (n - 2) k S) / (4 + n - 2): S of n samples is weighted with its n - 2 degrees of freedom, the
 *        neighbourhood as if it had 4.
 *   e  = v n^-3/2 + 4 (C^2 + P) / n^3, the expected squared error. C is the contrast (root mean square of the
 *        components) to that of the 8 neighbours which differs most from the pixel: about 1 / n of the pixel's area can
 *        have the neighbour's colour without being hit by any of n samples, and with a probability of some 1 / n it
 *        has. C alone is largest where all samples of a pixel at an edge fell on one side of it, and its halves agree.
 *        With P added, such luck makes no difference to what the pixel gets, on average over edges and while samples
 *        are few. P is the maximum of -(c - m) . (c' - m) / 3 for the pixel's own mean m, the mean c of that neighbour,
 *        and the mean c' of any other one. It is the variance of a single sample where an edge between the two colours
 *        runs through the pixel, and about 0 beside the edge. Surprises are added (master/expect.c).
 *
 * The samples of the pixel are doubled as long as e / (n c) is above a limit. Up to a factor, this is what the squared
 * error goes down by per ray. c is the pixel's rays per sample, including shadow rays: a cost that is the same on every
 * machine, as seconds would not be. The limit is the same for all pixels of the picture, which minimises the sum of
 * squared errors for a given number of rays (as J. Neyman's allocation does, J. R. Stat. Soc. 97, 1934). It is chosen
 * such that the picture is expected to reach the pass's aim, which is the target, or an eighth of the present error if
 * that is more; or such that the pass fits into the time there is, if that allows fewer samples. Nothing is doubled
 * more than four times in a pass.
 *
 * The error of the picture is estimated from all halves, to which is added what pixels that were left where they are
 * have missed, estimated from pixels like them that have hit something (master/hidden.h). What is hidden is added to e,
 * too.
 *
 * So a thin wire that few first samples have hit is followed from there, through D, two pixels further in each pass.
 * Where there are small features that stand apart and few samples have hit, all pixels that may have missed one get
 * more samples until little is hidden. What no sample of the picture has hit is not known and not looked for.
 *
 * Where there is no time for all of pass 0, it is cut off. Before anything is refined, further passes then take
 * min_samples of pixels that have none: each pass those of one lattice (master/lattice.h), the finest for which there
 * is time, until all have some.
 */
#ifndef FARM_MASTER_ADAPTIVE_H
#define FARM_MASTER_ADAPTIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "common/refinement.h"
#include "common/scene.h"
#include "common/thread_pool.h"
#include "common/tile.h"
#include "master/canvas.h"
#include "master/error.h"

struct adaptive;

/* Bytes of memory kept for each pixel beside the canvas. */
size_t adaptive_pixel_bytes(void);

/*
 * For the picture of a view whose min_samples is less than max_samples, both even. The canvas, which has the size of
 * the view's region, receives the means and must outlive the result. target: the RMSE to reach, above 0; 0: none. Pass
 * 0 is planned. Freed by adaptive_destroy(), which accepts NULL.
 */
struct adaptive *adaptive_create(const struct view *view, struct canvas *canvas, double target);
void adaptive_destroy(struct adaptive *adaptive);

/* Lends a thread pool to make plans with. It stays the caller's and must not be used by anybody else until another one
 * is lent; NULL: the calling thread plans alone. Plans do not depend on it. */
void adaptive_set_pool(struct adaptive *adaptive, struct thread_pool *pool);

/*
 * Ends pass 0 early: no more of its pixels are to come in, and none counts as missing. seconds: of rendering, summed
 * over all renderers, that the pixels without samples are expected to need; 0: unknown, they are taken to need as much
 * as those that have samples. No effect in later passes.
 */
void adaptive_cut(struct adaptive *adaptive, double seconds);

/*
 * Plans the next pass; all pixels of the last one must be in. seconds: of rendering, summed over all renderers, that
 * the pass is to take at most, as far as that can be foreseen; HUGE_VAL: any. The pass asks for some samples in any
 * case. Returns false if no pass is needed, as the target is met, or none is possible, as all pixels that have an error
 * have max_samples, or none is worth it, as the target is out of reach of max_samples and what they can remove is gone.
 */
bool adaptive_plan(struct adaptive *adaptive, double seconds);

/* The same for a run that continues an earlier one: plans the pass that the earlier run planned from the same pixels.
 * limit: its adaptive_limit(). A limit below 0 while pass 0 lacks pixels means that pass 0 was cut off. Returns false
 * also where the limit belongs to no such pass; then nothing changes. */
bool adaptive_replan(struct adaptive *adaptive, double limit);

/* The limit that the present pass was planned with, >= 0; 0 in pass 0. Below 0: the pass is that of a lattice, the one
 * with the number -1 - limit. */
double adaptive_limit(const struct adaptive *adaptive);

/* The level of each pixel of the canvas (common/refinement.h), 0: no samples. It is valid until samples come in. */
const uint8_t *adaptive_levels(const struct adaptive *adaptive);

/* Samples of a pixel in pass 0. */
uint32_t adaptive_first_samples(const struct adaptive *adaptive);

/* All of the picture. */
struct tile adaptive_whole(const struct adaptive *adaptive);

/* How many pixels have no samples. */
uint64_t adaptive_unsampled(const struct adaptive *adaptive);

/* Whether the present pass takes the first samples of pixels, of all or of those of a lattice. */
bool adaptive_is_first(const struct adaptive *adaptive);

/* Whether the target is met, as found by the last plan, or reached by the pass that it asked for. */
bool adaptive_is_met(struct adaptive *adaptive);

/* How many pixels of a tile its result contains: those that get samples in the pass; in pass 0 all of them, also where
 * only some are still to come. */
uint32_t adaptive_pixels(const struct adaptive *adaptive, const struct tile *tile);

/* What is still to come of the pass in a tile. */
struct adaptive_work {
    double samples;
    /* Expected decrease of the sum of the pixels' squared errors; 0 for first samples. */
    double removed;
};
struct adaptive_work adaptive_work(const struct adaptive *adaptive, const struct tile *tile);

/* Predicts what is still to come of the present pass, from the CPU seconds that rays have taken in each part of the
 * picture so far. No pixel may come in meanwhile. */
void adaptive_predict_work(struct adaptive *adaptive);

/* The CPU seconds that were predicted for a tile; 0: none, or not known, as in passes of first samples. Takes as long
 * for a tile of any size. */
double adaptive_work_seconds(const struct adaptive *adaptive, const struct tile *tile);

/* Sets what the pass adds to each pixel of a tile, in the tile's order. */
void adaptive_refinements(const struct adaptive *adaptive, const struct tile *tile,
                          struct refinement *refinements);

/*
 * Takes in the tile's pixels that get samples in this pass, adaptive_pixels() of them in the tile's order. part: the
 * arrays of struct pixel_floats, one after the other. A pixel that already has the pass's samples keeps them. seconds:
 * CPU seconds that they took to render.
 */
void adaptive_put(struct adaptive *adaptive, const struct tile *tile, const float *part,
                  double seconds);

/* Shares out the seconds that a tile took, before adaptive_put(): adds to each pixel in `costs`, which has the size of
 * the canvas, its part by the number of samples that the result has of it. */
void adaptive_spread(const struct adaptive *adaptive, const struct tile *tile, double seconds,
                     float *costs);

/* CPU seconds that all samples so far took to render, as passed to adaptive_put(); those of first samples alone. */
double adaptive_seconds(const struct adaptive *adaptive);
double adaptive_first_seconds(const struct adaptive *adaptive);

/*
 * Predicts a run that ends with the error rmse and takes, in a single pass after pass 0, all samples that the rule asks
 * for. Returns how many seconds of rendering it takes beyond those taken so far; below 0 where it is quicker than this
 * run has been by so much. Its samples are taken to be as effective as passes so far were compared with their promises,
 * and as quick. power: the exponent with which the squared error goes down with samples, used until a pass after the
 * first has been compared with its promise. max_samples: of that run, at least those of this one. HUGE_VAL: they are
 * too few. NaN: unknown, as while there are pixels without samples. Passes are not changed.
 */
double adaptive_forecast(struct adaptive *adaptive, double rmse, double power,
                         uint32_t max_samples);

/* Whether all pixels of the last planned pass are in. */
bool adaptive_is_complete(const struct adaptive *adaptive);

/* The share of the last planned pass's pixels that are not in, 0..1. */
double adaptive_missing(const struct adaptive *adaptive);

/* A hash of what the pass does in a tile: equal for the same plan with the same pixels still to come. */
uint64_t adaptive_plan_hash(const struct adaptive *adaptive, const struct tile *tile);

/* As it was given to adaptive_create(). */
double adaptive_target(const struct adaptive *adaptive);

/* Errors of all pixels that have samples; sets their number and that of their samples. Takes no time if no samples have
 * come in and no pass was planned since the last call. */
struct error_breakdown adaptive_errors(struct adaptive *adaptive, uint64_t *pixels,
                                       uint64_t *samples);

/* Passes planned so far, pass 0 included. */
unsigned adaptive_passes(const struct adaptive *adaptive);

#endif
