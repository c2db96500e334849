#include "worker/nearest.h"

#include <stdbool.h>

#include "worker/order.h"
#include "worker/probe.h"

struct nearest_walk {
    struct probe probe;
    double origin_error; /* of distances along the ray */
    struct hit hit;
    double hit_error; /* of its distance */
};

/* Whether a crossing that is about as far as the hit comes first; counted as exact arithmetic. */
static bool precedes(const struct nearest_walk *walk, const struct crossing *crossing)
{
    const struct probe *probe = &walk->probe;
    const struct hit *hit = &walk->hit;
    if (hit->primitive == PRIMITIVE_NONE) return true;
    /* A tree may have it in several leaves. */
    if (hit->primitive == crossing->primitive) return false;
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

static INLINED void nearest_triangles(struct nearest_walk *walk, const struct bvh_leaf *leaves,
                                      uint32_t count, bool naive)
{
    for (uint32_t i = 0; i < count; i += LANES) {
        lane_set set = probe_triangles(&walk->probe, leaves + i, count - i, NULL, naive).maybe;
        for (; set; set = without_lowest(set)) {
            const struct bvh_leaf *leaf = &leaves[i + lowest_lane(set)];
            struct crossings found = probe_triangle(&walk->probe, leaf, naive);
            nearest_crossing(walk, &found, 0, leaf->id, naive);
        }
    }
}

static INLINED bool nearest_in(struct nearest_walk *walk, const struct bvh_leaf *leaves,
                               uint32_t count, double *limit, bool naive)
{
    uint32_t triangles = triangles_of(leaves, count);
    nearest_triangles(walk, leaves, triangles, naive);
    for (uint32_t i = triangles; i < count; i++)
        nearest_primitive(walk, leaves[i].id, naive);
    *limit = walk->probe.purpose.farthest;
    return true;
}

static INLINED bool nearest_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                                 double *limit)
{
    return nearest_in(context, leaves, count, limit, false);
}

static INLINED bool naive_nearest_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                                       double *limit)
{
    return nearest_in(context, leaves, count, limit, true);
}

static INLINED struct hit nearest_hit(const struct scene *scene, const struct bvh *bvh,
                                      const struct ray *ray, uint64_t *exact, bool naive)
{
    struct nearest_walk walk = {probe_of(scene, ray, false, exact),
                                order_error_of_origin(ray),
                                {.t = INFINITE, .primitive = PRIMITIVE_NONE},
                                0};
    if (!ray_is_finite(ray)) return walk.hit;
    uint32_t end = plane_ids_end(scene);
    for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < end; id++)
        nearest_primitive(&walk, id, naive);
    visit_leaf *visit = naive ? naive_nearest_leaf : nearest_leaf;
    traverse(bvh, ray, walk.probe.purpose.farthest, true, visit, &walk);
    return walk.hit;
}

void nearest(const struct scene *scene, const struct bvh *bvh, const struct ray *rays, size_t count,
             struct hit *hits, uint64_t *exact_fallbacks)
{
    if (scene->view.formulas == FORMULAS_PAPER) {
        for (size_t i = 0; i < count; i++)
            hits[i] = nearest_hit(scene, bvh, &rays[i], exact_fallbacks, true);
        return;
    }
    for (size_t i = 0; i < count; i++)
        hits[i] = nearest_hit(scene, bvh, &rays[i], exact_fallbacks, false);
}
