/* Eight triangles against a ray: which of them it may meet. */
#ifndef FARM_WORKER_TRIANGLE_LANES_H
#define FARM_WORKER_TRIANGLE_LANES_H

#include "worker/bvh.h"
#include "worker/lanes.h"
#include "worker/triangle.h"

/* struct sheared of eight vertices, one of each triangle. */
struct sheared_lanes {
    struct lanes x, y, z;
};

/* Vertex k of each triangle; lanes behind the last triangle repeat the first. */
static inline struct sheared_lanes shear_vertices(const struct shear *shear,
                                                  const struct vec3 *origin,
                                                  const struct vec3 *vertices,
                                                  const struct bvh_leaf *const leaves[LANES],
                                                  unsigned k)
{
    const double *at[LANES];
    struct lanes p[3];
    for (unsigned i = 0; i < LANES; i++)
        at[i] = &vertices[leaves[i]->vertex[k]].x;
    lanes_transpose(at, p);
    struct sheared_lanes v;
    v.z = lanes_sub(p[shear->z], lanes_of(vec_component(origin, shear->z)));
    struct lanes x = lanes_sub(p[shear->x], lanes_of(vec_component(origin, shear->x)));
    struct lanes y = lanes_sub(p[shear->y], lanes_of(vec_component(origin, shear->y)));
    v.x = lanes_sub(x, lanes_mul(lanes_of(shear->sx), v.z));
    v.y = lanes_sub(y, lanes_mul(lanes_of(shear->sy), v.z));
    return v;
}

static inline struct lanes lanes_edge(const struct sheared_lanes *p, const struct sheared_lanes *q)
{
    return lanes_sub(lanes_mul(p->x, q->y), lanes_mul(p->y, q->x));
}

static inline struct lanes lanes_largest(struct lanes a, struct lanes b, struct lanes c)
{
    return lanes_larger(lanes_larger(a, b), c);
}

static inline struct lanes lanes_sideways(const struct sheared_lanes *p)
{
    return lanes_add(lanes_abs(p->x), lanes_abs(p->y));
}

/* edge_error() of each lane. */
static inline struct lanes lanes_edge_error(const struct sheared_lanes *p,
                                            const struct sheared_lanes *q,
                                            const struct sheared_lanes *r)
{
    struct lanes s = lanes_largest(lanes_sideways(p), lanes_sideways(q), lanes_sideways(r));
    struct lanes z = lanes_largest(lanes_abs(p->z), lanes_abs(q->z), lanes_abs(r->z));
    struct lanes product = lanes_mul(lanes_mul(lanes_of(EDGE_FILTER), s), lanes_add(z, s));
    return lanes_add(product, lanes_of(EDGE_LEAST));
}

/* Of `count` triangles, 8 at most, those that the ray does not certainly miss by the filter of
 * triangle_crossings(): the same operations in the same order. */
static inline lane_set triangles_not_missed(const struct vec3 *vertices,
                                            const struct bvh_leaf *leaves, uint32_t count,
                                            const struct ray *ray, const struct shear *shear)
{
    const struct bvh_leaf *leaf[LANES];
    for (uint32_t i = 0; i < LANES; i++)
        leaf[i] = &leaves[i < count ? i : 0];
    struct sheared_lanes p = shear_vertices(shear, &ray->origin, vertices, leaf, 0);
    struct sheared_lanes q = shear_vertices(shear, &ray->origin, vertices, leaf, 1);
    struct sheared_lanes r = shear_vertices(shear, &ray->origin, vertices, leaf, 2);
    struct lanes e0 = lanes_edge(&q, &r), e1 = lanes_edge(&r, &p), e2 = lanes_edge(&p, &q);
    struct lanes low = lanes_smaller(lanes_smaller(e0, e1), e2);
    struct lanes high = lanes_larger(lanes_larger(e0, e1), e2);
    struct lanes error = lanes_edge_error(&p, &q, &r);
    lane_set missed = lanes_less(lanes_add(low, error), lanes_of(0)) & lanes_less(error, high);
    return ~missed & first_lanes(count);
}

#endif
