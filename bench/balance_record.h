/* An adaptive run that was rendered once, in this process: the samples of each pass, and what they took. */
#ifndef FARM_BENCH_BALANCE_RECORD_H
#define FARM_BENCH_BALANCE_RECORD_H

#include <stdint.h>

#include "common/protocol.h"
#include "common/refinement.h"
#include "common/scene.h"
#include "common/tile.h"

/* More than any run here needs. */
#define RECORD_PASSES 32

struct recorded_pass {
    float *floats; /* of all pixels, as pixel_floats() lays them out; owned */
    double
        *sums; /* (width + 1) x (height + 1): seconds of all pixels above and to the left; owned */
    double plan_s; /* one thread's CPU seconds for the plan that it follows */
};

struct record {
    struct view view;
    double target;
    unsigned count; /* passes */
    struct recorded_pass passes[RECORD_PASSES];
    double samples;  /* per pixel, in the end */
    double put_s[2]; /* seconds in which the master takes in a pixel, in pass 0 and in later ones */
};

/* Renders config at this size to a target error, in tiles of 16 x 16 pixels, each timed `rounds` times, of which the
 * median counts. A tile's seconds are divided among its pixels as their rays are. */
void record_make(struct record *record, const char *config, uint32_t width, uint32_t height,
                 double target, unsigned rounds);
void record_free(struct record *record);

/* Seconds of the samples that tile->pass has brought to a tile (step 1). */
double record_seconds(const struct record *record, const struct tile *tile);

/* Copies what the pass has brought to those pixels of a tile that refinements, one for each, ask samples of: to the
 * arrays of `to`, in the tile's order. */
void record_copy(const struct record *record, const struct tile *tile,
                 const struct refinement *refinements, const struct pixel_floats *to);

#endif
