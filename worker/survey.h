/* Probes: measures the cost of single samples, from which the cost of tiles is predicted (master/cost.h). */
#ifndef FARM_WORKER_SURVEY_H
#define FARM_WORKER_SURVEY_H

#include "worker/render.h"

/*
 * Traces the first sample of every pixel of a valid tile, each on its own. Writes 3 floats (linear RGB) per
 * pixel in the tile's pixel order to rgb, and its CPU seconds (common/cpu_time.h) to seconds. Returns false
 * if it was interrupted; both are then undefined.
 */
bool survey(struct renderer *renderer, const struct tile *tile, float *rgb, float *seconds);

#endif
