/* The search for a ray's nearest hit, one primitive at a time. */
#ifndef FARM_WORKER_NEAREST_WALK_H
#define FARM_WORKER_NEAREST_WALK_H

#include "worker/cone.h"
#include "worker/coplanar.h"
#include "worker/order.h"
#include "worker/probe.h"

/* A primitive that may be a ray's nearest, and whose crossing is only known to lie in an interval. */
struct candidate {
    uint32_t id, part;
    double from, to; /* the interval; to is also infinite if it is not known which part is met */
};

/* The most candidates that a ray keeps: for one more, those so far are tested. */
#define CANDIDATES 6

struct nearest_walk {
    struct probe probe;
    struct known_planes *planes;
    double origin_error; /* part of the error of distances along the ray that its origin causes */
    struct hit hit;
    double hit_error;       /* error of its distance */
    uint32_t waiting_count; /* solids that the ray certainly meets */
    struct candidate waiting[CANDIDATES];
};

/* The relation of the surfaces of a crossing and of the hit. Coplanar pairs are cached. */
static enum surfaces surfaces_at_hit(const struct nearest_walk *walk,
                                     const struct crossing *crossing)
{
    const struct hit *hit = &walk->hit;
    if (are_known_coplanar(walk->planes, hit->primitive, crossing->primitive))
        return SURFACES_ONE_PLANE;
    enum surfaces surfaces = surfaces_of(walk->probe.scene, hit->primitive, hit->part,
                                         crossing->primitive, crossing->part);
    if (surfaces == SURFACES_ONE_PLANE)
        note_coplanar(walk->planes, hit->primitive, crossing->primitive);
    return surfaces;
}

/*
 * Whether a crossing of another primitive, about as far as the hit, comes before it; counts as exact
 * arithmetic. Sets in_corner if the two surfaces differ and so may meet there.
 */
static bool precedes(struct nearest_walk *walk, const struct crossing *crossing)
{
    const struct probe *probe = &walk->probe;
    struct hit *hit = &walk->hit;
    if (hit->primitive == PRIMITIVE_NONE) return true;
    struct crossing best = {hit->primitive, hit->part, hit->t};
    enum surfaces surfaces = surfaces_at_hit(walk, crossing);
    ++*probe->exact;
    if (surfaces == SURFACES_TWO) hit->in_corner = 1;
    int order = surfaces == SURFACES_ONE_PLANE
                    ? 0
                    : compare_crossings(probe->scene, probe->ray, &probe->shear, crossing, &best);
    return order < 0 ||
           (order == 0 && precedes_if_equal(probe->scene, probe->ray, crossing, &best));
}

/* Error of the distance to a crossing, see worker/order.h. */
static INLINED double crossing_error(const struct nearest_walk *walk, uint32_t id, double t)
{
    double error = walk->origin_error + ORDER_ERROR * t;
    return id == walk->probe.ray->from ? error + WAY_OUT_ERROR * t : error;
}

static INLINED void nearest_crossing(struct nearest_walk *walk, const struct crossings *found,
                                     unsigned i, uint32_t id)
{
    struct crossing crossing = {id, found->part[i], found->t[i]};
    double t = crossing.t;
    if (!crossing_counts(walk->probe.ray, t)) return;
    if (id == walk->hit.primitive) return; /* another piece of the same primitive */
    double error = crossing_error(walk, id, t);
    if (t > walk->hit.t + (walk->hit_error + error)) return;
    bool close = !(t < walk->hit.t - (walk->hit_error + error));
    if (close && !precedes(walk, &crossing)) return;
    uint16_t in_corner = close ? walk->hit.in_corner : 0;
    walk->hit = (struct hit){t, found->u, found->v, id, (uint16_t)crossing.part, in_corner};
    walk->hit_error = error;
    /* A crossing that comes before the hit may appear to be this far. */
    walk->probe.purpose.farthest = smaller_number(t + 2 * error, walk->probe.purpose.farthest);
}

/*
 * Whether a primitive is known to lie in the plane of the hit, and comes after it by precedes_if_equal(),
 * wherever it is crossed. Then precedes() would reject it: at the hit's distance within both errors it is
 * compared, and is an equal. So the cache, which depends on preceding rays, changes no hit.
 */
static INLINED bool is_behind_hit(const struct nearest_walk *walk, uint32_t id)
{
    const struct probe *probe = &walk->probe;
    uint32_t hit = walk->hit.primitive;
    return hit != PRIMITIVE_NONE && are_known_coplanar(walk->planes, hit, id) &&
           !is_reversed(probe->ray) && !has_priority(probe->scene, id, hit);
}

static INLINED void nearest_primitive(struct nearest_walk *walk, uint32_t id)
{
    if (is_behind_hit(walk, id)) return;
    struct crossings found = probe_crossings(&walk->probe, id);
    /* The entry, if it is ahead of the ray: at a rim, the exit may be at the same place. */
    unsigned first = crossing_counts(walk->probe.ray, found.t[0]) ? 0 : 1;
    nearest_crossing(walk, &found, first, id);
}

/* planes: the cache of coplanar primitives, filled by preceding rays; not needed if only one primitive is
 * tested. */
static INLINED void nearest_begin(struct nearest_walk *walk, const struct scene *scene,
                                  const struct ray *ray, struct known_planes *planes,
                                  uint64_t *exact)
{
    walk->planes = planes;
    probe_begin(&walk->probe, scene, ray, false, exact);
    walk->origin_error = order_error_of_origin(ray);
    walk->hit = (struct hit){.t = INFINITE, .primitive = PRIMITIVE_NONE};
    walk->hit_error = 0;
    walk->waiting_count = 0;
}

/* Whether the ray certainly does not cross the plane, or only behind the hit. */
static INLINED bool plane_is_missed(const struct nearest_walk *walk, uint32_t id)
{
    const struct probe *probe = &walk->probe;
    if (id == probe->ray->from) return false;
    struct plane_span_one span = plane_span_of_one(probe->scene, id, &probe->line);
    return span.decided && (span.to < 0 || probe->purpose.farthest < span.from);
}

static INLINED void nearest_planes(struct nearest_walk *walk)
{
    uint32_t end = plane_ids_end(walk->probe.scene);
    for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < end; id++)
        if (!plane_is_missed(walk, id)) nearest_primitive(walk, id);
}

/* ---- solids ---- */

/*
 * Whether a waiting solid may still be the nearest. `farthest` allows for the errors of both crossings if
 * they are alike; a ray's exit has a larger error.
 */
static INLINED bool may_precede(const struct nearest_walk *walk, const struct candidate *waiting)
{
    double from = waiting->from;
    if (waiting->id == walk->probe.ray->from)
        from -= crossing_error(walk, waiting->id, waiting->to);
    return from <= walk->probe.purpose.farthest;
}

/* Tests the waiting solids that may still be the nearest. */
static inline void nearest_waiting(struct nearest_walk *walk)
{
    for (uint32_t i = 0; i < walk->waiting_count; i++)
        if (may_precede(walk, &walk->waiting[i])) nearest_primitive(walk, walk->waiting[i].id);
    walk->waiting_count = 0;
}

/* The hit at a crossing that is only known by plain arithmetic. */
static inline struct hit rough_hit(uint32_t id, uint32_t part, double from, double to)
{
    double v = is_triangle(id) ? WEIGHT_UNKNOWN : 0;
    return (struct hit){from / 2 + to / 2, to - from, v, id, (uint16_t)part, 0};
}

/* Whether a crossing no farther than `to` comes before the hit, whatever the rounding. */
static INLINED bool clearly_precedes(const struct nearest_walk *walk, uint32_t id, double to)
{
    return to < walk->probe.ray->t_max &&
           to < walk->hit.t - (walk->hit_error + crossing_error(walk, id, to));
}

/*
 * If only one waiting solid can be the nearest, and is so beyond doubt, makes it the hit. Returns false if
 * that cannot be decided here.
 */
static inline bool nearest_is_decided(struct nearest_walk *walk)
{
    const struct candidate *only = NULL;
    for (uint32_t i = 0; i < walk->waiting_count; i++) {
        const struct candidate *waiting = &walk->waiting[i];
        if (!may_precede(walk, waiting)) continue;
        if (only && waiting->id != only->id) return false;
        only = waiting;
    }
    if (!only) return true;
    if (!clearly_precedes(walk, only->id, only->to)) return false;
    walk->hit = rough_hit(only->id, only->part, only->from, only->to);
    return true;
}

/*
 * Adds a solid that is met between from and to, unless something else is hit before. Crossings that are
 * farther by more than the errors of both (worker/order.h) no longer matter. part_known: the part that is met is
 * known.
 */
static INLINED void nearest_waits(struct nearest_walk *walk, uint32_t id, double from, double to,
                                  bool part_known, uint32_t part)
{
    struct purpose *purpose = &walk->probe.purpose;
    if (walk->waiting_count == CANDIDATES) nearest_waiting(walk);
    walk->waiting[walk->waiting_count++] =
        (struct candidate){id, part, from, part_known ? to : INFINITE};
    if (!(to < walk->probe.ray->t_max)) return;
    purpose->farthest = smaller_number(to + 2 * crossing_error(walk, id, to), purpose->farthest);
}

/* Handles the cone that the ray starts on. */
static INLINED void nearest_way_out_of_cone(struct nearest_walk *walk, uint32_t id)
{
    const struct ray *ray = walk->probe.ray;
    const struct cone *cone = &scene_cones(walk->probe.scene)[primitive_index(id)];
    struct cone_sketch s = cone_sketch(cone, ray);
    struct cone_span exit;
    if (ray_leaves_cone(cone, &s, ray_from_part(ray))) return;
    if (cone_way_out_span(cone, &s, ray_from_part(ray), &exit))
        nearest_waits(walk, id, exit.low, exit.high, exit.part_known, exit.part);
    else
        nearest_primitive(walk, id);
}

/* Handles the sphere that the ray starts on. */
static INLINED void nearest_way_out_of_sphere(struct nearest_walk *walk, uint32_t id)
{
    const struct scene *scene = walk->probe.scene;
    struct sphere_span exit;
    if (has_usable_spans(scene, id) &&
        sphere_way_out_span(&scene_spheres(scene)[primitive_index(id)], walk->probe.ray, &exit))
        nearest_waits(walk, id, exit.low, exit.high, true, CONE_SIDE);
    else
        nearest_primitive(walk, id);
}

static INLINED void nearest_span(struct nearest_walk *walk, const struct bvh_leaf *leaf)
{
    const struct probe *probe = &walk->probe;
    if (leaf->id == probe->ray->from) {
        if (primitive_kind(leaf->id) == PRIMITIVE_CONE)
            nearest_way_out_of_cone(walk, leaf->id);
        else
            nearest_way_out_of_sphere(walk, leaf->id);
        return;
    }
    struct spans_one span = spans_of_one(probe->scene, leaf->id, &probe->line);
    if (!may_be_crossed_one(&span, probe->purpose.farthest)) return;
    struct first_crossing_one first = first_crossing_one(&span);
    if (first.decided && has_usable_spans_ahead(probe->scene, leaf->id, probe->ray, first.from))
        nearest_waits(walk, leaf->id, first.from, first.to, is_on_part_one(&first) & 1,
                      part_at_one(&first, 0));
    else
        nearest_primitive(walk, leaf->id);
}

/* Tests the primitives of a leaf other than triangles. */
static INLINED void nearest_solids(struct nearest_walk *walk, const struct bvh_leaf *leaves,
                                   uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        if (has_spans(leaves[i].id))
            nearest_span(walk, &leaves[i]);
        else
            nearest_primitive(walk, leaves[i].id);
}

#endif
