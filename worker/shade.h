/*
 * Phong's reflection model as in the paper, and the directions of secondary rays.
 *
 * Conventions: all vectors have unit length; `view` points from the eye to the point, like the paper's V;
 * normals are turned to the side that the ray came from.
 */
#ifndef FARM_WORKER_SHADE_H
#define FARM_WORKER_SHADE_H

#include <stdbool.h>

#include "worker/nearest.h"

/* A hit, as seen from the ray that found it. */
struct shading_point {
    struct vec3 point;
    struct vec3 view;      /* direction of the ray, unit */
    struct vec3 geometric; /* unit, view . geometric <= 0 */
    struct vec3 normal;    /* unit, the shading normal, on the same side as geometric */
    bool entering;         /* the ray came from outside: it met the front */
    uint32_t formulas;     /* enum formulas, for the functions below */
    const struct material *material;
};

struct shading_point shading_point(const struct scene *scene, const struct ray *ray,
                                   const struct surface *surface);

/*
 * The ambient term ke Cs, added once per point, not once per light. This and background() are inlined to keep
 * colours in registers.
 */
static inline struct vec3 shade_ambient(const struct material *material)
{
    return vec_scale(material->color, material->ambient);
}

/*
 * Whether the light is on the lit side of the point. If so, *to_light is the vector from the point to the
 * light, not normalised.
 */
bool light_faces(const struct shading_point *at, const struct light *light, struct vec3 *to_light);

/*
 * The contribution of one light, without ambient: s kd cos(a) Cs + s ks cos^n(b) Cw (the paper's equation 8),
 * where s is the light's colour times what the shadow ray lets through.
 */
struct vec3 shade_light(const struct shading_point *at, struct vec3 to_light, struct vec3 strength);

/* The mirror direction; always on the side of the geometric normal. */
struct vec3 reflect(const struct shading_point *at);

/*
 * The refracted direction by Snell's law, through the surface from one index of refraction to another; false:
 * total internal reflection.
 */
bool refract(const struct shading_point *at, double from, double to, struct vec3 *direction);

/* The cosine for a light that faces a point; near 90 degrees rounding might make it negative. NaN stays NaN. */
static inline double lit_cosine(struct vec3 unit, struct vec3 normal)
{
    return larger_number(0, vec_dot(unit, normal));
}

/* The colour of the background in a direction. Rounding may take the dot product of two unit vectors beyond
 * 1. */
static inline struct vec3 background(const struct view *view, struct vec3 direction)
{
    double up = 0.5 * (1 + vec_dot(direction, view->background_up));
    up = smaller_number(1, larger_number(0, up));
    struct vec3 bottom = vec_scale(view->background_bottom, 1 - up);
    return vec_add_scaled(bottom, view->background_top, up);
}

#endif
