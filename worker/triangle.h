/*
 * Ray and triangle, without leaks: S. Woop, C. Benthin and I. Wald, "Watertight Ray/Triangle
 * Intersection", JCGT 2(1), 2013.
 *
 * Vertices are moved to the ray's origin and sheared so that the ray becomes an axis; every
 * triangle of a mesh sees its shared vertices at bitwise the same two-dimensional points. Whether
 * the axis passes left or right of an edge between two such points is then decided exactly, and a
 * point that is exactly on an edge is moved aside, in thought, in one direction for all triangles.
 * Hence a closed mesh has no cracks, and of the triangles around an edge or a vertex exactly one is
 * met per sheet of the surface.
 */
#ifndef FARM_WORKER_TRIANGLE_H
#define FARM_WORKER_TRIANGLE_H

#include "worker/exact.h"
#include "worker/shape.h"

/* What shears a ray's direction to an axis: once per ray. */
struct shear {
    unsigned x, y, z; /* z: the axis with the largest component of the direction */
    double sx, sy;    /* direction x / z and y / z, at most 1 in magnitude */
    double dz;        /* direction z */
};

static inline struct shear shear_of(const struct vec3 *direction)
{
    double x = fabs(direction->x), y = fabs(direction->y), z = fabs(direction->z);
    struct shear shear;
    shear.z = z >= x && z >= y ? 2 : y >= x ? 1 : 0;
    shear.x = (shear.z + 1) % 3;
    shear.y = (shear.z + 2) % 3;
    shear.dz = vec_component(direction, shear.z);
    shear.sx = vec_component(direction, shear.x) / shear.dz;
    shear.sy = vec_component(direction, shear.y) / shear.dz;
    return shear;
}

/* A vertex as the ray sees it: the ray runs along x = y = 0, at z = t dz. */
struct sheared {
    double x, y, z;
};

static inline struct sheared shear_vertex(const struct shear *shear, const struct vec3 *origin,
                                          const struct vec3 *vertex)
{
    double z = vec_component(vertex, shear->z) - vec_component(origin, shear->z);
    double x = vec_component(vertex, shear->x) - vec_component(origin, shear->x);
    double y = vec_component(vertex, shear->y) - vec_component(origin, shear->y);
    return (struct sheared){x - shear->sx * z, y - shear->sy * z, z};
}

/*
 * On which side of the directed edge p to q the origin lies: the sign of e = p.x q.y - p.y q.x.
 *
 * Rounding is monotonic: when the two rounded products differ, the exact ones differ the same way,
 * so the error bound of this filter is 0 and only equal products need an exact sign. When e is 0
 * the origin is taken to be displaced by (-eps, -eps^2), which changes e by eps dy - eps^2 dx. 0
 * means that p and q are the same point: the triangle has no area.
 */
static inline int edge_side(const struct sheared *p, const struct sheared *q, uint64_t *exact)
{
    double left = p->x * q->y, right = p->y * q->x;
    if (left > right) return 1;
    if (left < right) return -1;
    ++*exact;
    double e = difference_of_products(p->x, q->y, p->y, q->x);
    if (e == 0) e = q->y - p->y;
    if (e == 0) e = p->x - q->x;
    return (e > 0) - (e < 0);
}

static inline double edge_value(const struct sheared *p, const struct sheared *q)
{
    return difference_of_products(p->x, q->y, p->y, q->x);
}

/*
 * Either side is hit. t, u and v come from edge values with full relative accuracy, even when plain
 * products were enough for the signs: the error of t is then a few u of the largest |z|, also for a
 * needle. NO_CROSSINGS also when a coordinate is not finite.
 */
static inline struct crossings triangle_crossings(const struct vec3 *a, const struct vec3 *b,
                                                  const struct vec3 *c, const struct vec3 *origin,
                                                  const struct shear *shear, uint64_t *exact)
{
    struct sheared p = shear_vertex(shear, origin, a);
    struct sheared q = shear_vertex(shear, origin, b);
    struct sheared r = shear_vertex(shear, origin, c);
    int side = edge_side(&q, &r, exact);
    if (side == 0 || edge_side(&r, &p, exact) != side || edge_side(&p, &q, exact) != side)
        return NO_CROSSINGS;
    double e0 = edge_value(&q, &r), e1 = edge_value(&r, &p), e2 = edge_value(&p, &q);
    double sum = e0 + e1 + e2;
    struct crossings found = one_crossing((e0 * p.z + e1 * q.z + e2 * r.z) / sum / shear->dz);
    found.u = e1 / sum;
    found.v = e2 / sum;
    return found;
}

static inline struct bounds triangle_bounds(const struct vec3 *a, const struct vec3 *b,
                                            const struct vec3 *c)
{
    struct bounds bounds;
    for (unsigned axis = 0; axis < 3; axis++) {
        double p = vec_component(a, axis), q = vec_component(b, axis), r = vec_component(c, axis);
        bounds.min[axis] = p < q ? (p < r ? p : r) : (q < r ? q : r);
        bounds.max[axis] = p > q ? (p > r ? p : r) : (q > r ? q : r);
    }
    return bounds;
}

/* Unit, to the side from which the vertices run counter-clockwise; 0 for a triangle without area.
 */
static inline struct vec3 triangle_normal(const struct vec3 *a, const struct vec3 *b,
                                          const struct vec3 *c)
{
    struct vec3 normal = vec_cross(vec_sub(*b, *a), vec_sub(*c, *a));
    return vec_is_zero(normal) ? normal : vec_normalize(normal);
}

#endif
