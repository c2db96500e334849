/* The gain of the best allocation of samples to pixels over the same number for all of them: an upper bound to
 * compare adaptive sampling with. */
#ifndef FARM_BENCH_ERROR_ALLOCATION_H
#define FARM_BENCH_ERROR_ALLOCATION_H

#include "common/scene.h"

/*
 * Measures the gain for a scene and prints a table. A lattice of blocks of the picture, of about ALLOCATION_PIXELS
 * pixels together, is rendered ALLOCATION_RUNS times with different random numbers, and its CPU time is measured block
 * by block. Changes the scene's view.
 */
#define ALLOCATION_PIXELS 6000u
#define ALLOCATION_RUNS   16u
void allocation_measure(struct scene *scene, const char *name);

#endif
