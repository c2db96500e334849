/*
 * Adaptive sampling: which pixels get how many more samples.
 *
 * The picture is sampled in passes. Pass 0 takes min_samples of every pixel. When a pass is
 * complete, all pixels are looked at and the next one is planned, from the pixels alone, unless there is a
 * time limit: so it is the same plan whoever rendered them, in whatever order and pieces. It ends when the
 * error of the picture is estimated to be at most the target.
 *
 * The rule. Let v be a pixel's variance per sample, such that n samples leave a squared error of
 * v n^-3/2 (what stratified samples leave at an edge):
 *
 *   D  = the mean over the 24 pixels around it, nearer ones counting more, of what their halves
 *        tell (worker/task.h): (A - B)^2 / 4 n^3/2. Its own halves are left out of it. A pixel that
 *        stopped because its halves agreed by chance would make the estimate of the error too
 *        small; so what its halves differ by does not decide about its own samples, but as one of some
 *        thousand pixels of a surprise (master/expect.c). Their mean does, by C and P, and so does
 *   S  = the variance of its samples about the means of their halves: large where an edge runs
 *        through the pixel, small beside it, while D is much the same there. Of independent samples of a
 *        normal distribution it does not depend on what the two means differ by; of few samples at
 *        an edge it does, for where all have one colour both are 0. Of two samples it tells nothing, and
 *        what the halves tell stands in for it around others.
 *   k  = what errors around it are in terms of S, (D + S / 4) / (S' + S / 4), S' being the mean of S
 *        over the same pixels as D, and n^1/2 at most, as of random samples: some 1 at edges, less
 *        where colours change evenly.
 *   v  = (4 D + (n - 2) k S) / (4 + n - 2): S of n samples counts as much as the n - 2 degrees of freedom
 *        that it has, and what is around as much as 4 of them.
 *   e  = v n^-3/2 + 4 (C^2 + P) / n^3, where C is the contrast to that of the 8 neighbours which differs
 *        most from it (root mean square of the components): about 1 / n of a pixel's area can be of
 *        the neighbour's colour without having been hit by one of n samples, and with a chance of some 1 / n it
 *        is. C alone is largest where all samples of an edge's pixel fell on one side of it, and its halves
 *        agree; with P beside it, on average over edges and while samples are few, such luck makes no
 *        difference to what the pixel gets: P is the most that -(c - m) . (c' - m) / 3 is for its
 *        own mean m, that neighbour's mean c and any other one's, c', which is the variance of a single
 *        sample where an edge between the two colours runs through the pixel, and about 0 beside the edge.
 *        Surprises come on top (master/expect.c).
 *
 * The samples of the pixel are doubled as long as e / (n c), what the squared error goes down by per
 * ray up to a factor, is above a limit; c are its rays per sample, shadow rays too: what a pixel
 * costs, but the same on every machine, as seconds would not be. The limit is the same for all
 * pixels of the picture, which makes the sum of squared errors the least for so many rays (as J.
 * Neyman's allocation does, J. R. Stat. Soc. 97, 1934), and such that the picture is expected to
 * reach the pass's aim: the target, or an eighth of the present error if that is more; or to take no
 * longer than there is time, if that is less. Nothing is doubled more than four times in a pass.
 *
 * The error of the picture is estimated by what all halves tell, and by what pixels that were left where they are have
 * missed, as others like them tell that have met something (master/hidden.h). What is hidden counts in e, too.
 *
 * So a thin wire that few first samples have met is followed from there, by D, two pixels further in each
 * pass; and where things stand apart that few have met, all pixels that may have missed one are looked into until
 * little is hidden. What no sample of the picture has met is not known and not looked for.
 *
 * Where there is no time for all of pass 0 it is cut off, and before anything is refined passes come that take
 * min_samples of pixels that have none: each of those of one lattice (master/lattice.h), the finest for which
 * there is time, until all have some.
 */
#ifndef FARM_MASTER_ADAPTIVE_H
#define FARM_MASTER_ADAPTIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "common/crew.h"
#include "common/refinement.h"
#include "common/scene.h"
#include "common/tile.h"
#include "master/canvas.h"
#include "master/error.h"

struct adaptive;

/* Memory that is kept for each pixel beside the canvas. */
size_t adaptive_pixel_bytes(void);

/*
 * For the picture of a view whose min_samples is less than max_samples, both even. The canvas, of
 * the view's region, takes the means and must outlive it. target: RMSE, above 0; 0: there is none.
 * Pass 0 is planned. Freed by adaptive_destroy().
 */
struct adaptive *adaptive_create(const struct view *view, struct canvas *canvas, double target);
void adaptive_destroy(struct adaptive *adaptive);

/* Plans are from now on made by the crew, which stays the caller's and is used by nobody else until another
 * one is lent; NULL: by the caller alone. They are the same. */
void adaptive_lend(struct adaptive *adaptive, struct crew *crew);

/*
 * Pass 0 goes on no further: of its pixels none is to come any more, and none is missing. For those that have no
 * samples so many seconds of rendering, by all renderers, are expected to be needed; 0: nobody knows, they are taken
 * to be like those that have some. Nothing happens in later passes.
 */
void adaptive_cut(struct adaptive *adaptive, double seconds);

/*
 * Plans the next pass, all pixels of the last one being in. seconds: of rendering, by all renderers, that it
 * is to take at most, as far as that can be foreseen; HUGE_VAL: any. It asks for some samples in any case.
 * false: none is needed, as the target is met, or possible, as all pixels that have an error have
 * max_samples.
 */
bool adaptive_plan(struct adaptive *adaptive, double seconds);

/* The same for the pass that came next in a run that had the same pixels until then: limit is its
 * adaptive_limit(). Below 0 it tells that a pass 0 that lacks pixels was cut off. false, too, where it is of no such
 * pass; then nothing changes. */
bool adaptive_plan_again(struct adaptive *adaptive, double limit);

/* By which the present pass was planned, >= 0; 0 in pass 0; below 0: it is one of a lattice, and has that of the
 * lattice number -1 - limit. */
double adaptive_limit(const struct adaptive *adaptive);

/* Of each pixel of the canvas how far it is sampled (common/refinement.h); 0: it has no samples. As long as no
 * more come in. */
const uint8_t *adaptive_levels(const struct adaptive *adaptive);

/* Pixels that have no samples. */
uint64_t adaptive_unsampled(const struct adaptive *adaptive);

/* Whether pixels get their first samples in this pass, all of them or those of a lattice. */
bool adaptive_is_first(const struct adaptive *adaptive);

/* Whether the target is met: so the last plan has found, or what it asked for has reached it. */
bool adaptive_is_met(struct adaptive *adaptive);

/* How many of a tile's pixels its answer has: those that get samples in the pass; in pass 0 all of them, also
 * where only some are still to come. */
uint32_t adaptive_pixels(const struct adaptive *adaptive, const struct tile *tile);

/* What is still to come of the pass in a tile. */
struct adaptive_work {
    double samples;
    double removed; /* from the sum of the pixels' squared errors, expected; 0 for first samples */
};
struct adaptive_work adaptive_work(const struct adaptive *adaptive, const struct tile *tile);

/* What is to be done for each pixel of a tile, in the tile's order. */
void adaptive_refinements(const struct adaptive *adaptive, const struct tile *tile,
                          struct refinement *refinements);

/*
 * The tile's pixels that get samples in this pass, adaptive_pixels(), have come in, in the tile's order:
 * the floats of struct pixel_floats, one kind behind the other. What the pass has brought to a pixel
 * already stays. seconds: of a processor's time that they took to render.
 */
void adaptive_put(struct adaptive *adaptive, const struct tile *tile, const float *part,
                  double seconds);

/* Seconds of rendering that the samples so far have taken, as they came in. */
double adaptive_seconds(const struct adaptive *adaptive);

/*
 * How many seconds more a run needs whose error is rmse in the end, that does at once behind pass 0 what the rule
 * asks for by which passes are planned: taken as good as passes so far have kept what they promised, and as
 * quick as they were. power: of samples that the squared error is known to go down with while no pass after the
 * first tells. Below 0 where such a run is so much quicker than what is there. HUGE_VAL: max_samples are too few for
 * that. NaN: nobody knows, as where there are pixels without samples yet. Passes are not changed.
 */
double adaptive_foresee(struct adaptive *adaptive, double rmse, double power);

/* Whether all pixels of the last planned pass are in. */
bool adaptive_is_complete(const struct adaptive *adaptive);

/* Of the last planned pass the share of its pixels that are not in. */
double adaptive_missing(const struct adaptive *adaptive);

/* A hash of what is to be done in a tile: the same plan for the same pixels still to come. */
uint64_t adaptive_plan_hash(const struct adaptive *adaptive, const struct tile *tile);

/* As it was given to adaptive_create(). */
double adaptive_target(const struct adaptive *adaptive);

/* Errors of all pixels that have samples; their number; samples of all. Where nothing has come in since they were
 * asked for, and no pass was planned, that takes no time. */
struct error_told adaptive_errors(struct adaptive *adaptive, uint64_t *pixels, uint64_t *samples);

/* Passes planned so far, pass 0 included. */
unsigned adaptive_passes(const struct adaptive *adaptive);

#endif
