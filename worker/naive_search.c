#include "worker/naive_search.h"

#include "worker/lanes3.h"
#include "worker/naive.h"
#include "worker/passages.h"
#include "worker/primitive.h"
#include "worker/several.h"
#include "worker/visit.h"

static struct crossings triangle_crossings_of(const struct scene *scene, uint32_t id,
                                              const struct ray *ray)
{
    const uint32_t *corner = corner_indices(scene, id);
    const struct vec3 *vertices = scene_vertices(scene);
    return naive_beyond_epsilon(
        naive_triangle(&vertices[corner[0]], &vertices[corner[1]], &vertices[corner[2]], ray), ray);
}

static struct crossings crossings_of(const struct scene *scene, uint32_t id, const struct ray *ray)
{
    uint32_t index = primitive_index(id);
    const struct plane *plane;
    switch (primitive_kind(id)) {
    case PRIMITIVE_SPHERE:
        return naive_beyond_epsilon(naive_sphere(&scene_spheres(scene)[index], ray), ray);
    case PRIMITIVE_BOX:
        return naive_beyond_epsilon(naive_box(&scene_boxes(scene)[index], ray), ray);
    case PRIMITIVE_CONE:
        return naive_beyond_epsilon(naive_cone(&scene_cones(scene)[index], ray), ray);
    case PRIMITIVE_DISC:
        return naive_beyond_epsilon(naive_disc(&scene_discs(scene)[index], ray), ray);
    case PRIMITIVE_PLANE:
        plane = &scene_planes(scene)[index];
        return naive_beyond_epsilon(
            one_crossing(naive_plane_distance(plane->point, plane->normal, ray)), ray);
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_KINDS:
        break;
    }
    return triangle_crossings_of(scene, id, ray);
}

static INLINED struct lanes lanes_minor(struct lanes a, struct lanes b, struct lanes c,
                                        struct lanes d)
{
    return lanes_sub(lanes_mul(a, b), lanes_mul(c, d));
}

static INLINED struct lanes3 lanes3_cross(struct lanes3 a, struct lanes3 b)
{
    return (struct lanes3){lanes_minor(a.y, b.z, a.z, b.y), lanes_minor(a.z, b.x, a.x, b.z),
                           lanes_minor(a.x, b.y, a.y, b.x)};
}

/* Vertex k of each of `count` triangles; further lanes repeat the first triangle. */
static INLINED struct lanes3 vertices_of(const struct scene *scene, const struct bvh_leaf *leaves,
                                         uint32_t count, unsigned k)
{
    const struct vec3 *vertices = scene_vertices(scene);
    const double *at[LANES];
    struct axis_order order = axis_order(0, 1, 2);
    struct lanes p[3];
    UNROLLED
    for (uint32_t i = 0; i < LANES; i++)
        at[i] = &vertices[corner_indices(scene, leaves[i < count ? i : 0].id)[k]].x;
    lanes_transpose(at, &order, p);
    return (struct lanes3){p[0], p[1], p[2]};
}

/*
 * Of `count` triangles, or the first LANES of more, those that may be crossed. Where lanes are SIMD, those that
 * naive_triangle() finds crossed: the operations and their order are those of that function. Without this, rendering
 * with the paper's formulas would take about twice as long, and beside it the exact ones would look too cheap.
 */
static lane_set maybe_crossed(const struct scene *scene, const struct bvh_leaf *leaves,
                              uint32_t count, const struct ray *ray)
{
    if (!LANES_IN_SIMD) return first_lanes(count);
    struct lanes3 a = vertices_of(scene, leaves, count, 0);
    struct lanes3 e1 = lanes3_sub(vertices_of(scene, leaves, count, 1), a);
    struct lanes3 e2 = lanes3_sub(vertices_of(scene, leaves, count, 2), a);
    struct lanes3 d = lanes3_of(ray->direction), s = lanes3_sub(lanes3_of(ray->origin), a);
    struct lanes3 p = lanes3_cross(d, e2), q = lanes3_cross(s, e1);
    struct lanes determinant = lanes3_dot(e1, p), zero = lanes_of(0), one = lanes_of(1);
    struct lanes u = lanes_div(lanes3_dot(s, p), determinant);
    struct lanes v = lanes_div(lanes3_dot(d, q), determinant);
    lane_set inside = lanes_at_most(zero, u) & lanes_at_most(u, one) & lanes_at_most(zero, v) &
                      lanes_at_most(lanes_add(u, v), one);
    return inside & first_lanes(count);
}

struct naive_walk {
    const struct scene *scene;
    const struct ray *ray;
    struct hit hit; /* nearest */
    /* occluded */
    struct passages *passages;
    bool blocked;
};

/* ---- nearest ---- */

static void take_if_nearer(struct naive_walk *walk, uint32_t id, const struct crossings *found)
{
    unsigned first = crossing_counts(walk->ray, found->t[0]) ? 0 : 1;
    double t = found->t[first];
    if (!crossing_counts(walk->ray, t) || t > walk->hit.t) return;
    if (t == walk->hit.t && id >= walk->hit.primitive) return;
    walk->hit = (struct hit){t, found->u, found->v, id, (uint16_t)found->part[first], 0};
}

static bool nearest_in_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                            double *limit)
{
    struct naive_walk *walk = context;
    uint32_t triangles = triangles_of(leaves, count);
    for (uint32_t i = 0; i < triangles; i += LANES) {
        lane_set set = maybe_crossed(walk->scene, leaves + i, triangles - i, walk->ray);
        for (; set; set = without_lowest(set)) {
            uint32_t id = leaves[i + lowest_lane(set)].id;
            struct crossings found = triangle_crossings_of(walk->scene, id, walk->ray);
            take_if_nearer(walk, id, &found);
        }
    }
    for (uint32_t i = triangles; i < count; i++) {
        struct crossings found = crossings_of(walk->scene, leaves[i].id, walk->ray);
        take_if_nearer(walk, leaves[i].id, &found);
    }
    *limit = smaller_number(walk->hit.t, *limit);
    return true;
}

static struct hit nearest_hit(const struct scene *scene, const struct bvh *bvh,
                              const struct ray *ray)
{
    struct naive_walk walk = {
        .scene = scene, .ray = ray, .hit = {.t = INFINITE, .primitive = PRIMITIVE_NONE}};
    if (!ray_is_finite(ray)) return walk.hit;
    for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < plane_ids_end(scene); id++) {
        struct crossings found = crossings_of(scene, id, ray);
        take_if_nearer(&walk, id, &found);
    }
    double limit = smaller_number(walk.hit.t, ray->t_max);
    for (lane_set trees = trees_of_ray(bvh, ray, limit); trees;) {
        limit = smaller_number(walk.hit.t, ray->t_max);
        visit_tree(take_tree(bvh, &trees), ray, limit, true, nearest_in_leaf, &walk);
    }
    return walk.hit;
}

void naive_nearest(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                   size_t count, struct hit *hits)
{
    for (size_t i = 0; i < count; i++)
        hits[i] = nearest_hit(scene, bvh, &rays[i]);
}

/* ---- occluded ---- */

/* Returns whether the ray goes on. */
static bool passes(struct naive_walk *walk, const struct bvh_leaf *leaf,
                   const struct crossings *found)
{
    unsigned crossings = crossings_that_count(walk->ray, found);
    if (crossings == 0) return true;
    walk->blocked = !leaf->transparent;
    if (walk->blocked) return false;
    passages_add(walk->passages, primitive_material(walk->scene, leaf->id), leaf->id, crossings);
    return true;
}

static bool occlusion_in_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                              double *limit)
{
    (void)limit;
    struct naive_walk *walk = context;
    uint32_t triangles = triangles_of(leaves, count);
    for (uint32_t i = 0; i < triangles; i += LANES) {
        lane_set set = maybe_crossed(walk->scene, leaves + i, triangles - i, walk->ray);
        for (; set; set = without_lowest(set)) {
            const struct bvh_leaf *leaf = &leaves[i + lowest_lane(set)];
            struct crossings found = triangle_crossings_of(walk->scene, leaf->id, walk->ray);
            if (!passes(walk, leaf, &found)) return false;
        }
    }
    for (uint32_t i = triangles; i < count; i++) {
        struct crossings found = crossings_of(walk->scene, leaves[i].id, walk->ray);
        if (!passes(walk, &leaves[i], &found)) return false;
    }
    return true;
}

static bool passes_planes(struct naive_walk *walk)
{
    const struct scene *scene = walk->scene;
    for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < plane_ids_end(scene); id++) {
        struct bvh_leaf plane = bvh_leaf_of(scene, id);
        struct crossings found = crossings_of(scene, id, walk->ray);
        if (!passes(walk, &plane, &found)) return false;
    }
    return true;
}

static bool is_blocked(struct naive_walk *walk, const struct bvh *bvh)
{
    const struct ray *ray = walk->ray;
    if (!ray_is_finite(ray) || !passes_planes(walk)) return walk->blocked;
    lane_set trees = trees_of_ray(bvh, ray, ray->t_max);
    while (trees && !walk->blocked)
        visit_tree(take_tree(bvh, &trees), ray, ray->t_max, false, occlusion_in_leaf, walk);
    return walk->blocked;
}

void naive_occluded(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                    size_t count, struct vec3 *transmittance)
{
    struct passages passages;
    passages_begin(&passages);
    for (size_t i = 0; i < count; i++) {
        struct naive_walk walk = {.scene = scene, .ray = &rays[i], .passages = &passages};
        passages.count = 0;
        transmittance[i] = transmittance_of(scene, &passages, is_blocked(&walk, bvh));
    }
    passages_end(&passages);
}
