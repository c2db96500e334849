/* Predicts the squared error of each pixel: e of the rule in master/adaptive.h. */
#ifndef FARM_MASTER_EXPECT_H
#define FARM_MASTER_EXPECT_H

#include "common/thread_pool.h"
#include "master/statistics.h"

/* A pixel is a surprise where the squared error estimated from its halves is more than this many times the one
 * predicted from its neighbourhood. Pixels at edges hardly ever are: about 5 of the 24 pixels around one are at the
 * same edge. */
#define SURPRISE 8

/* Sets for each pixel its expected squared error, which is finite, as squares of floats are far inside the range of
 * doubles; and in predicted_rms the root of that predicted from its neighbourhood alone, whatever its own samples
 * have hit. All pixels must have samples. The pool must be idle; NULL: the caller works alone. */
void expect_errors(const struct statistics *pixels, struct thread_pool *pool, double *error,
                   float *predicted_rms);

#endif
