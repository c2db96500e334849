/*
 * The error of pixels by what their samples have missed, and nothing has told of.
 *
 * A plan that heeds what pixels themselves have met makes all of them together tell too little: of things smaller than
 * a pixel that stand apart, those that were met by luck get more samples and tell little from then on, those that were
 * missed tell nothing. But consider the pixels of a level which a plan would leave at it by what is around them. Who
 * these are does not depend on their own samples: what their halves tell together is their error, and for things that
 * some of them have met there are others that were missed, how many follows from how small they are. It is known when
 * pixels that had met something have got more samples.
 */
#ifndef FARM_MASTER_HIDDEN_H
#define FARM_MASTER_HIDDEN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/refinement.h"
#include "master/error.h"
#include "master/statistics.h"

struct hidden;

/* Memory that is kept for each pixel. */
size_t hidden_pixel_bytes(void);

/* Of a picture of so many pixels that no plan has looked at; freed by hidden_destroy(), NULL: nothing is. */
struct hidden *hidden_create(size_t pixels);
void hidden_destroy(struct hidden *hidden);

/* Whether a plan has still to tell if the pixel is left where it is by what is around it. */
bool hidden_is_open(const struct hidden *hidden, size_t pixel);

/* The plan leaves it. warned: root of the squared error that what is around it lets expect. From several threads, of a
 * pixel each. */
void hidden_leave(struct hidden *hidden, size_t pixel, float warned);

/* The plan leaves it though what is around it warns of something, as its own samples have met nothing. Again from
 * several threads. */
void hidden_leave_warned(struct hidden *hidden, size_t pixel);

/* The pixel, which had some, has got more samples: what it was before. now: as it is with these. */
void hidden_settle(struct hidden *hidden, const struct sampled *now, size_t pixel,
                   const struct known *before);

/* Of pixels of a level that nothing has warned of: sums over all or some of the picture. */
struct unwarned {
    uint64_t pixels; /* that are at it */
    uint64_t warned; /* and those that were left at it though something had warned */
    double expected; /* error of what they all missed at first, by those that had met something */
    double variance; /* of that */
    double unseen;   /* the most that one part of what is expected may be wrong by */
};

struct hidden_sum {
    struct unwarned levels[LEVEL_MAX + 1];
    /* What pixels tell too little: samples that have missed what was found since are among theirs. */
    struct error_sum carried;
};

/* Adds a pixel. */
void hidden_add(const struct hidden *hidden, const struct sampled *now, size_t pixel,
                struct hidden_sum *sum);
void hidden_join(struct hidden_sum *all, const struct hidden_sum *more);

/* What errors as halves tell them are with what is hidden; sum: of all pixels. */
struct error_told hidden_errors(const struct hidden *hidden, const struct hidden_sum *sum,
                                struct error_sum halves);

/* Shares it out from now on. */
void hidden_share(struct hidden *hidden, const struct hidden_sum *sum);

/* The pixel's share, which has samples of that level. */
double hidden_of(const struct hidden *hidden, size_t pixel, unsigned level);

#endif
