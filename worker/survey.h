/* Probes: what single samples cost, to predict what tiles will (master/cost.h). */
#ifndef FARM_WORKER_SURVEY_H
#define FARM_WORKER_SURVEY_H

#include "worker/render.h"

/*
 * The first sample of every pixel of a valid tile, each traced on its own: 3 floats (linear RGB) per
 * pixel in the tile's pixel order to rgb, the CPU seconds it took (common/cpu_time.h) to seconds. Returns
 * false, with nothing of use in either, when it was interrupted.
 */
bool survey(struct renderer *renderer, const struct tile *tile, float *rgb, float *seconds);

#endif
