/* Ray and axis-aligned box. */
#ifndef FARM_WORKER_BOX_H
#define FARM_WORKER_BOX_H

#include "worker/shape.h"

static inline struct bounds box_bounds(const struct box *box)
{
    return (struct bounds){{box->min.x, box->min.y, box->min.z},
                           {box->max.x, box->max.y, box->max.z}};
}

static inline double box_face(const struct box *box, uint32_t part)
{
    return vec_component(part & 1 ? &box->max : &box->min, part / 2);
}

/*
 * The part of the line between the three pairs of faces. A ray parallel to a pair and in between
 * divides by zero to (-inf, inf); exactly in a face it is 0 / 0 = NaN, which loses every
 * comparison: the box is closed.
 */
static inline struct crossings box_line(const struct box *box, const struct ray *ray)
{
    struct crossings line = {.t = {-INFINITE, INFINITE}};
    for (unsigned axis = 0; axis < 3; axis++) {
        double speed = vec_component(&ray->direction, axis);
        double origin = vec_component(&ray->origin, axis);
        uint32_t in = 2 * axis + (signbit(speed) ? 1 : 0);
        uint32_t out = in ^ 1;
        double enter = (box_face(box, in) - origin) / speed;
        double leave = (box_face(box, out) - origin) / speed;
        if (enter > line.t[0]) {
            line.t[0] = enter;
            line.part[0] = in;
        }
        if (leave < line.t[1]) {
            line.t[1] = leave;
            line.part[1] = out;
        }
    }
    return line;
}

/* Whether a ray that starts on a face goes into the box. Along a face is outside. */
static inline bool box_goes_inside(uint32_t face, const struct ray *ray)
{
    double speed = vec_component(&ray->direction, face / 2);
    return face & 1 ? speed < 0 : speed > 0;
}

/*
 * In and out. leaving: the ray starts on the face from_part of this box; outward of it nothing can
 * be met, inward only the way out. A box without thickness is a sheet, crossed once.
 */
static inline struct crossings box_crossings(const struct box *box, const struct ray *ray,
                                             bool leaving)
{
    if (leaving && !box_goes_inside(ray->from_part, ray)) return NO_CROSSINGS;
    struct crossings line = box_line(box, ray);
    if (leaving) {
        uint32_t face = ray->from_part;
        line.t[0] = NOT_CROSSED;
        if (box_face(box, face) == box_face(box, face ^ 1)) return NO_CROSSINGS;
        return line;
    }
    if (!(line.t[0] <= line.t[1])) return NO_CROSSINGS;
    if (box_face(box, line.part[0]) == box_face(box, line.part[0] ^ 1)) line.t[1] = NOT_CROSSED;
    return line;
}

static inline struct vec3 box_normal(uint32_t face)
{
    double sign = face & 1 ? 1 : -1;
    uint32_t axis = face / 2;
    return vec3(axis == 0 ? sign : 0, axis == 1 ? sign : 0, axis == 2 ? sign : 0);
}

#endif
