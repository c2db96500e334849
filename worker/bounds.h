/* Axis-aligned boxes in double, in scene coordinates; worker/extent.h has those in float from which trees are built. */
#ifndef FARM_WORKER_BOUNDS_H
#define FARM_WORKER_BOUNDS_H

#include <math.h>

#include "common/extremes.h"

/* A box around a primitive, tight up to some roundings; the BVH rounds it outward. */
struct bounds {
    double min[3], max[3];
};

/* The empty box. */
#define BOUNDS_NONE                                                                                \
    ((struct bounds){{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}})

/* The box that holds everything. */
#define BOUNDS_ALL                                                                                 \
    ((struct bounds){{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, {HUGE_VAL, HUGE_VAL, HUGE_VAL}})

static inline void bounds_add(struct bounds *all, const struct bounds *more)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        all->min[axis] = smaller_number(all->min[axis], more->min[axis]);
        all->max[axis] = larger_number(all->max[axis], more->max[axis]);
    }
}

/* The length of the longest edge; 0 for the empty box. */
static inline double bounds_size(const struct bounds *box)
{
    double size = 0;
    for (unsigned axis = 0; axis < 3; axis++)
        size = larger_number(size, box->max[axis] - box->min[axis]);
    return size;
}

/* Half the surface; not for the empty box. */
static inline double bounds_half_area(const struct bounds *box)
{
    double x = box->max[0] - box->min[0], y = box->max[1] - box->min[1];
    double z = box->max[2] - box->min[2];
    return x * y + y * z + z * x;
}

/* The middle along an axis, without overflow. */
static inline double bounds_middle(const struct bounds *box, unsigned axis)
{
    return box->min[axis] / 2 + box->max[axis] / 2;
}

#endif
