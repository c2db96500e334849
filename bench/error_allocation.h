/* The gain of the best allocation of samples to pixels over the same number for all of them: an upper bound to
 * compare adaptive sampling with. */
#ifndef FARM_BENCH_ERROR_ALLOCATION_H
#define FARM_BENCH_ERROR_ALLOCATION_H

#include "common/scene.h"

/* Measures the gain for a scene and prints a table. Changes the scene's view. */
void allocation_measure(struct scene *scene, const char *name);

#endif
