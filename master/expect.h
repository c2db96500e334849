/* What the error of each pixel is expected to be: e of the rule in master/adaptive.h. */
#ifndef FARM_MASTER_EXPECT_H
#define FARM_MASTER_EXPECT_H

#include <stdint.h>

#include "common/crew.h"
#include "master/statistics.h"

/* What nothing around a pixel has warned of: what its halves tell is so many times what is expected by what is around
 * it. Edges, of which about 5 of the 24 pixels around one are part, hardly ever surprise. */
#define SURPRISE 8

/* Sets the expected squared error of every pixel: finite, as squares of floats are well inside of what doubles
 * hold; and the root of what is expected of it by what is around it alone, whatever its own samples have met. */
void expect_errors(const struct sampled *pixels, struct crew *crew, double *error, float *warned);

#endif
