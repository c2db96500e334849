/* A ray's search for its nearest hit, a primitive at a time. */
#ifndef FARM_WORKER_NEAREST_WALK_H
#define FARM_WORKER_NEAREST_WALK_H

#include "worker/order.h"
#include "worker/probe.h"

struct nearest_walk {
    struct probe probe;
    double origin_error; /* of distances along the ray */
    struct hit hit;
    double hit_error; /* of its distance */
};

/* Whether a crossing of another primitive that is about as far as the hit comes first; counted as
 * exact arithmetic. */
static bool precedes(const struct nearest_walk *walk, const struct crossing *crossing)
{
    const struct probe *probe = &walk->probe;
    const struct hit *hit = &walk->hit;
    if (hit->primitive == PRIMITIVE_NONE) return true;
    ++*probe->exact;
    struct crossing best = {hit->primitive, hit->part, hit->t};
    int order = compare_crossings(probe->scene, probe->ray, &probe->shear, crossing, &best);
    return order < 0 || (order == 0 && crossing->primitive < hit->primitive);
}

static INLINED void nearest_crossing(struct nearest_walk *walk, const struct crossings *found,
                                     unsigned i, uint32_t id, bool naive)
{
    struct crossing crossing = {id, found->part[i], found->t[i]};
    double t = crossing.t, error = 0;
    if (!crossing_counts(walk->probe.ray, t)) return;
    if (id == walk->hit.primitive) return; /* a triangle of which there are several pieces */
    if (!naive) {
        error = walk->origin_error + ORDER_ERROR * t;
        if (id == walk->probe.ray->from) error += WAY_OUT_ERROR * t;
    }
    if (t > walk->hit.t + (walk->hit_error + error)) return;
    if (!(t < walk->hit.t - (walk->hit_error + error)) && !naive && !precedes(walk, &crossing))
        return;
    if (naive && t == walk->hit.t && id >= walk->hit.primitive) return;
    walk->hit = (struct hit){t, found->u, found->v, id, crossing.part};
    walk->hit_error = error;
    /* Something that comes before the hit may seem to be that far. */
    walk->probe.purpose.farthest = smaller(t + 2 * error, walk->probe.ray->t_max);
}

static INLINED void nearest_primitive(struct nearest_walk *walk, uint32_t id, bool naive)
{
    struct crossings found = probe_crossings(&walk->probe, id, naive);
    /* Where it comes in, if that is ahead: at a rim it may go out at the same place. */
    unsigned first = crossing_counts(walk->probe.ray, found.t[0]) ? 0 : 1;
    nearest_crossing(walk, &found, first, id, naive);
}

static INLINED struct nearest_walk nearest_walk_of(const struct scene *scene, const struct ray *ray,
                                                   uint64_t *exact)
{
    return (struct nearest_walk){probe_of(scene, ray, false, exact),
                                 order_error_of_origin(ray),
                                 {.t = INFINITE, .primitive = PRIMITIVE_NONE},
                                 0};
}

static INLINED void nearest_planes(struct nearest_walk *walk, bool naive)
{
    uint32_t end = plane_ids_end(walk->probe.scene);
    for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < end; id++)
        nearest_primitive(walk, id, naive);
}

#endif
