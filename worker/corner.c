#include "worker/corner.h"

#include "worker/order.h"
#include "worker/primitive.h"
#include "worker/visit.h"

struct corner_walk {
    const struct scene *scene;
    const struct ray *ray;
    struct shear shear;
    double low, high; /* range of distances along the ray */
    uint32_t hit;     /* the primitive that is hit */
    uint32_t count;
    struct hit others[CORNER_OTHERS]; /* in order of their ids */
};

/* Adds a primitive once; of too many keeps those with the lowest ids. The result does not depend on the order
 * in the tree. */
static void add_other(struct corner_walk *walk, const struct hit *other)
{
    uint32_t at = 0;
    while (at < walk->count && walk->others[at].primitive < other->primitive)
        at++;
    if (at == CORNER_OTHERS) return;
    if (at < walk->count && walk->others[at].primitive == other->primitive) return;
    if (walk->count < CORNER_OTHERS) walk->count++;
    for (uint32_t i = walk->count - 1; i > at; i--)
        walk->others[i] = walk->others[i - 1];
    walk->others[at] = *other;
}

static void look_at(struct corner_walk *walk, uint32_t id)
{
    if (id == walk->hit) return;
    const struct purpose purpose = {false, walk->ray->t_max};
    uint64_t ignored = 0;
    struct crossings found =
        primitive_crossings(walk->scene, id, walk->ray, &walk->shear, &purpose, &ignored);
    unsigned i = crossing_counts(walk->ray, found.t[0]) ? 0 : 1;
    struct hit other = {found.t[i], found.u, found.v, id, (uint16_t)found.part[i], 0};
    if (other.t >= walk->low && other.t <= walk->high) add_other(walk, &other);
}

static bool look_in_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                         double *limit)
{
    struct corner_walk *walk = context;
    (void)limit;
    for (uint32_t i = 0; i < count; i++)
        look_at(walk, leaves[i].id);
    return true;
}

/*
 * Half of the distance within which nearest() usually calls crossings close. What is this near has been
 * compared with the hit, or with something no farther, in whatever order. So in_corner is always 1 where the
 * point is moved; elsewhere it may depend on that order.
 */
static double corner_reach(const struct ray *ray, double t)
{
    return order_error_of_origin(ray) + ORDER_ERROR * t;
}

struct vec3 corner_point(const struct scene *scene, const struct bvh *bvh, const struct ray *ray,
                         const struct hit *hit)
{
    double reach = corner_reach(ray, hit->t);
    struct corner_walk walk = {.scene = scene,
                               .ray = ray,
                               .shear = shear_of(&ray->direction),
                               .low = hit->t - reach,
                               .high = hit->t + reach,
                               .hit = hit->primitive};
    for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < plane_ids_end(scene); id++)
        look_at(&walk, id);
    visit_leaves(bvh, ray, walk.high, look_in_leaf, &walk);
    return surface_away_from_others(scene, ray, hit, walk.others, walk.count);
}
