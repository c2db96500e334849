/*
 * nearest() and occluded() by the paper's formulas (render.formulas = paper), for comparison: of equal distances, the
 * primitive with the lower id is hit. A ray with a non-finite component hits nothing.
 */
#ifndef FARM_WORKER_NAIVE_SEARCH_H
#define FARM_WORKER_NAIVE_SEARCH_H

#include "worker/bvh.h"
#include "worker/ray.h"

void naive_nearest(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                   size_t count, struct hit *hits);

void naive_occluded(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                    size_t count, struct vec3 *transmittance);

#endif
