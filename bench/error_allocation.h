/*
 * What the best allocation of samples to pixels could gain over the same number for all of them:
 * the bound that adaptive sampling is to be measured against.
 */
#ifndef FARM_BENCH_ERROR_ALLOCATION_H
#define FARM_BENCH_ERROR_ALLOCATION_H

#include "common/scene.h"

/*
 * Measures it for a scene and prints a table. A lattice of blocks of the picture, of about so many
 * pixels together (0: ALLOCATION_PIXELS), is rendered ALLOCATION_RUNS times with different random
 * numbers, and its CPU time taken block by block. The scene's view is changed.
 */
#define ALLOCATION_PIXELS 6000u
#define ALLOCATION_RUNS   16u
void allocation_measure(struct scene *scene, const char *name, uint32_t pixels);

#endif
