/*
 * How far a pixel is sampled, in levels: level 0 is without samples, level 1 has min_samples, every
 * further level twice as many as the one before, up to max_samples. Where both are equal, as
 * without adaptive sampling, level 1 is all there is.
 */
#ifndef FARM_COMMON_REFINEMENT_H
#define FARM_COMMON_REFINEMENT_H

#include <stdint.h>

#include "common/scene.h"

/* The highest level there can be: from one sample to SAMPLES_MAX = 2^16. */
#define LEVEL_MAX 17u

/* What one pass adds to one pixel: the samples between two levels. from = to: nothing. */
struct refinement {
    uint8_t from, to;
};

/* How many of these pixels get samples. */
static inline uint32_t refinements_sampled(const struct refinement *refinements, uint32_t pixels)
{
    uint32_t count = 0;
    for (uint32_t k = 0; k < pixels; k++)
        count += refinements[k].to > refinements[k].from;
    return count;
}

/* Samples that a pixel of this level has; level <= LEVEL_MAX. */
static inline uint32_t level_samples(const struct view *view, uint32_t level)
{
    if (level == 0) return 0;
    uint64_t samples = (uint64_t)view->min_samples << (level - 1);
    return samples < view->max_samples ? (uint32_t)samples : view->max_samples;
}

/* The lowest level that has max_samples. */
static inline uint32_t level_last(const struct view *view)
{
    uint32_t level = 1;
    while (level_samples(view, level) < view->max_samples)
        level++;
    return level;
}

#endif
