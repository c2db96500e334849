/* Checks shared by scene.c, which validates scene blocks, and the builder, which makes them. */
#ifndef FARM_COMMON_SCENE_CHECK_H
#define FARM_COMMON_SCENE_CHECK_H

#include <math.h>
#include <stdbool.h>

#include "common/scene.h"

static inline bool at_least_zero(double value)
{
    return value >= 0 && isfinite(value);
}

static inline bool positive(double value)
{
    return value > 0 && isfinite(value);
}

/*
 * The logarithm of a highlight has an error of some 2^-104. With a larger exponent that error would become
 * visible: 1e15 x 2^-104 is half of u (worker/optics.h).
 */
#define SHININESS_MAX 1e15

static inline bool shininess_valid(double value)
{
    return at_least_zero(value) && value <= SHININESS_MAX;
}

static inline bool color_valid(struct vec3 color)
{
    return at_least_zero(color.x) && at_least_zero(color.y) && at_least_zero(color.z);
}

static inline bool indices_valid(const uint32_t index[3], uint64_t count)
{
    return index[0] < count && index[1] < count && index[2] < count;
}

static inline bool box_has_volume(const struct box *box)
{
    return box->min.x < box->max.x && box->min.y < box->max.y && box->min.z < box->max.z;
}

/* All computations with a triangle begin with these differences. */
static inline bool edges_finite(const struct vec3 *vertices, const uint32_t corners[3])
{
    struct vec3 a = vertices[corners[0]], b = vertices[corners[1]], c = vertices[corners[2]];
    return vec_is_finite(vec_sub(b, a)) && vec_is_finite(vec_sub(c, a)) &&
           vec_is_finite(vec_sub(c, b));
}

/* Offset in bytes of the material's index (uint32_t) in an element of a kind's span. */
size_t primitive_material_offset(enum primitive_kind kind);

#endif
