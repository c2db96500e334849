/*
 * Levels of sampling of a pixel. Level 0 has no samples, level 1 has min_samples, and every further level has
 * twice as many samples as the one before, up to max_samples. If both are equal, as without adaptive
 * sampling, level 1 is the only one besides 0.
 */
#ifndef FARM_COMMON_REFINEMENT_H
#define FARM_COMMON_REFINEMENT_H

#include <stdint.h>

#include "common/scene.h"

/* The highest possible level: samples double from 1 at level 1 to SAMPLES_MAX = 2^16 at level 17. */
#define LEVEL_MAX 17u

/* The samples that one pass adds to a pixel, as a step between two levels. from = to: none. */
struct refinement {
    uint8_t from, to;
};

/* The number of these pixels that get samples. */
static inline uint32_t refinements_sampled(const struct refinement *refinements, uint32_t pixels)
{
    uint32_t count = 0;
    for (uint32_t k = 0; k < pixels; k++)
        count += refinements[k].to > refinements[k].from;
    return count;
}

/* Total samples of a pixel at this level; level <= LEVEL_MAX. */
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
