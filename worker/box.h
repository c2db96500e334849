/* Intersection of a ray and an axis-aligned box. */
#ifndef FARM_WORKER_BOX_H
#define FARM_WORKER_BOX_H

#include <float.h>

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
 * The part of the line between all three pairs of faces, in rounded distances. A ray parallel to a pair of
 * faces is either between them (the box is closed), or misses the box: false.
 */
static inline bool box_line(const struct box *box, const struct ray *ray, struct crossings *line)
{
    *line = (struct crossings){.t = {-INFINITE, INFINITE}};
    for (unsigned axis = 0; axis < 3; axis++) {
        double speed = vec_component(&ray->direction, axis);
        double origin = vec_component(&ray->origin, axis);
        uint32_t in = 2 * axis + (signbit(speed) ? 1 : 0);
        uint32_t out = in ^ 1;
        if (speed == 0) {
            if (origin < box_face(box, 2 * axis) || origin > box_face(box, 2 * axis + 1))
                return false;
            continue;
        }
        double enter = (box_face(box, in) - origin) / speed;
        double leave = (box_face(box, out) - origin) / speed;
        if (enter > line->t[0]) {
            line->t[0] = enter;
            line->part[0] = in;
        }
        if (leave < line->t[1]) {
            line->t[1] = leave;
            line->part[1] = out;
        }
    }
    return true;
}

/* Whether the box has no thickness along some axis: such a sheet is crossed once, whatever the direction. */
static inline bool box_is_sheet(const struct box *box)
{
    return box->min.x == box->max.x || box->min.y == box->max.y || box->min.z == box->max.z;
}

/* The face of a sheet that faces the ray; `otherwise` for a ray parallel to it. */
static inline uint32_t box_sheet_face(const struct box *box, const struct ray *ray,
                                      uint32_t otherwise)
{
    for (uint32_t low = 0; low < 6; low += 2) {
        double speed = vec_component(&ray->direction, low / 2);
        if (box_face(box, low) == box_face(box, low + 1) && speed != 0)
            return speed < 0 ? low + 1 : low;
    }
    return otherwise;
}

/* Whether the line enters all three pairs of faces before it leaves any, decided exactly. */
bool box_is_met(const struct box *box, const struct ray *ray);

/*
 * Relative error of the comparison of two distances. A distance to a face is rounded twice, so the order of
 * two of them is certain if they differ by 4 u (1 + u) of the larger one; twice that covers the roundings of
 * this comparison.
 */
#define BOX_FILTER (8 * UNIT_ROUNDOFF)

static inline bool box_line_is_inside(const struct box *box, const struct ray *ray,
                                      const struct crossings *line, uint64_t *exact)
{
    double enter = line->t[0], leave = line->t[1];
    double margin = BOX_FILTER * larger_number(fabs(enter), fabs(leave));
    if (leave - enter > margin) return true;
    if (enter - leave > margin) return false;
    ++*exact;
    return box_is_met(box, ray);
}

/* Whether a ray that starts on a face goes into the box. Along the face counts as outside. */
static inline bool box_goes_inside(uint32_t face, const struct ray *ray)
{
    double speed = vec_component(&ray->direction, face / 2);
    return face & 1 ? speed < 0 : speed > 0;
}

/*
 * The exit of a ray that starts on a face and goes into the box. At an edge its rounded origin may lie beside
 * the box; it then leaves at once, but it does leave.
 */
static inline struct crossings box_way_out(const struct box *box, const struct ray *ray)
{
    struct crossings line;
    uint32_t face = ray_from_part(ray);
    if (!box_goes_inside(face, ray) || box_is_sheet(box)) return NO_CROSSINGS;
    if (!box_line(box, ray, &line)) {
        line = one_crossing(NOT_CROSSED);
        line.part[1] = face ^ 1;
    }
    line.t[0] = NOT_CROSSED;
    if (!(line.t[1] > 0)) line.t[1] = DBL_TRUE_MIN;
    return line;
}

/*
 * Entry and exit. leaving: the ray starts on face from_part of this box; if it goes outward there is no
 * crossing, if inward only the exit. Which of two faces is hit at their common edge follows from the rounded
 * distances; equal ones go to the lower axis.
 */
static inline struct crossings box_crossings(const struct box *box, const struct ray *ray,
                                             bool leaving, uint64_t *exact)
{
    struct crossings line;
    if (leaving) return box_way_out(box, ray);
    if (!box_line(box, ray, &line)) return NO_CROSSINGS;
    if (!box_line_is_inside(box, ray, &line, exact)) return NO_CROSSINGS;
    if (line.t[1] < line.t[0]) line.t[1] = line.t[0]; /* they are in order except for rounding */
    if (box_is_sheet(box)) {
        line.part[0] = box_sheet_face(box, ray, line.part[0]);
        line.t[1] = NOT_CROSSED;
    }
    return line;
}

/* The distance to a face that the ray crosses. */
static inline struct dd box_parameter(const struct box *box, const struct ray *ray, uint32_t face)
{
    struct dd way = exact_difference(box_face(box, face), vec_component(&ray->origin, face / 2));
    return dd_div(way, dd(vec_component(&ray->direction, face / 2)));
}

static inline struct vec3 box_normal(uint32_t face)
{
    double sign = face & 1 ? 1 : -1;
    uint32_t axis = face / 2;
    return vec3(axis == 0 ? sign : 0, axis == 1 ? sign : 0, axis == 2 ? sign : 0);
}

#endif
