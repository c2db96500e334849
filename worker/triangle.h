/*
 * Watertight intersection of a ray and a triangle.
 *
 * The vertices are translated to the ray's origin and sheared so that the ray becomes an axis (S. Woop, C.
 * Benthin and I. Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013). Unlike there, the
 * two-dimensional edge tests are only a filter for exact ones. On which side of the line through two vertices
 * the ray passes is decided exactly; a ray that meets an edge exactly is treated as if displaced, in one
 * direction for all triangles. Hence a closed mesh has no cracks, and of the triangles around an edge or a
 * vertex exactly one is hit per sheet of the surface: the one that exact geometry has there.
 */
#ifndef FARM_WORKER_TRIANGLE_H
#define FARM_WORKER_TRIANGLE_H

#include "worker/exact.h"
#include "worker/shape.h"

/* Copies the vertices of a triangle or patch. */
static inline void triangle_vertices(const struct scene *scene, uint32_t id, struct vec3 at[3])
{
    const uint32_t *corner = corner_indices(scene, id);
    const struct vec3 *vertices = scene_vertices(scene);
    for (unsigned i = 0; i < 3; i++)
        at[i] = vertices[corner[i]];
}

/* The shear that maps a ray's direction to an axis; computed once per ray. */
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

/* A sheared vertex: the ray runs along x = y = 0, and z = t dz. */
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

static inline double edge_value(const struct sheared *p, const struct sheared *q)
{
    return difference_of_products(p->x, q->y, p->y, q->x);
}

/*
 * The origin of the sheared plane is left or right of the edge p q by the sign of e = p.x q.y - p.y q.x. A
 * sheared coordinate errs by u |x| (difference), 3 u |s z| (shear) and u |x'| (subtraction), with |s| <= 1
 * and |x| <= |x'| + |z|: by at most (4.1 Z + 2.1 S) u, where Z is the largest |z| and S the largest |x'| +
 * |y'|. In e that makes 2 S (4.1 Z + 2.1 S) u, and its own roundings add 2 S^2 u: less than 10 u S (Z + S) in
 * all. Products below 2^-1000 are left to exact arithmetic.
 */
#define EDGE_FILTER (10 * UNIT_ROUNDOFF)
#define EDGE_LEAST  0x1p-1000

static inline double edge_error(const struct sheared *p, const struct sheared *q,
                                const struct sheared *r)
{
    double sp = fabs(p->x) + fabs(p->y), sq = fabs(q->x) + fabs(q->y), sr = fabs(r->x) + fabs(r->y);
    double zp = fabs(p->z), zq = fabs(q->z), zr = fabs(r->z);
    double s = sp > sq ? sp : sq, z = zp > zq ? zp : zq;
    s = s > sr ? s : sr;
    z = z > zr ? z : zr;
    return EDGE_FILTER * s * (z + s) + EDGE_LEAST;
}

/* The least and the largest value of the edges, rounded, and their error. */
struct edge_range {
    double low, high, error;
};

static inline struct edge_range edge_range(const struct sheared *p, const struct sheared *q,
                                           const struct sheared *r)
{
    double e0 = q->x * r->y - q->y * r->x, e1 = r->x * p->y - r->y * p->x;
    double e2 = p->x * q->y - p->y * q->x;
    return (struct edge_range){.low = smaller_number(smaller_number(e0, e1), e2),
                               .high = larger_number(larger_number(e0, e1), e2),
                               .error = edge_error(p, q, r)};
}

/*
 * Errors of the sheared coordinates displace the triangle sideways by some 4 u Z, and the crossing along the
 * ray by that times the slope of the triangle's plane relative to the ray. If the slope is larger than this,
 * the crossing is corrected; otherwise t errs by 8 u of sum |e z| / |det| in all.
 */
#define SLOPE_MAX 0.5

/*
 * Whether that error leaves the sign of t open, because the ray starts next to the triangle's plane, for
 * instance on something that touches it. Not if all vertices are on one side of the origin along the ray. 16
 * u of their z is twice the error.
 */
static inline bool start_is_close(const struct sheared *p, const struct sheared *q,
                                  const struct sheared *r, double way)
{
    double close = 16 * UNIT_ROUNDOFF * (fabs(p->z) + fabs(q->z) + fabs(r->z));
    if (!(fabs(way) <= close)) return false;
    return smaller_number(p->z, smaller_number(q->z, r->z)) < 0 &&
           larger_number(p->z, larger_number(q->z, r->z)) > 0;
}

/*
 * Limit on the sum of the vertices' |z|, relative to the crossing's distance and the origin's coordinates.
 * Within it, 8 u of the largest z is less than an ORDER_ERROR (worker/order.h). Large triangles exceed it by
 * far.
 */
#define CORNERS_MAX 6

static inline bool corners_are_near(const struct sheared *p, const struct sheared *q,
                                    const struct sheared *r, double size)
{
    return fabs(p->z) + fabs(q->z) + fabs(r->z) <= CORNERS_MAX * size;
}

/* Whether the crossing z = way is accurate enough if the slope is small. */
static inline bool way_is_accurate(const struct sheared *p, const struct sheared *q,
                                   const struct sheared *r, double way, const struct vec3 *origin)
{
    if (corners_are_near(p, q, r, fabs(way))) return true;
    return corners_are_near(p, q, r, fabs(way) + vec_largest(*origin)) &&
           !start_is_close(p, q, r, way);
}

/* The slope, as the sum of the absolute values of its components. */
static inline double triangle_slope(const struct sheared *p, const struct sheared *q,
                                    const struct sheared *r, double sum)
{
    double qx = q->x - p->x, qy = q->y - p->y, qz = q->z - p->z;
    double rx = r->x - p->x, ry = r->y - p->y, rz = r->z - p->z;
    return (fabs(qz * ry - rz * qy) + fabs(qx * rz - rx * qz)) / fabs(sum);
}

/*
 * Corrects t by the distance of o + t d from the triangle's plane, divided by the component of the direction
 * across the plane. The vector v from a vertex to o + t d is small, of the triangle's size, and exact up to
 * its rounding. The normal n = e1 x e2 errs by 6 u |e1| |e2|, n.v by 3 u more, so the correction errs by 9 u
 * |e1| |e2| |v| / |n.d|. Returns false, and leaves t, unless that is less than 3 u t.
 */
static inline bool triangle_correct(const struct vec3 *a, const struct vec3 *b,
                                    const struct vec3 *c, const struct ray *ray, double *t)
{
    struct vec3 e1 = vec_sub(*b, *a), e2 = vec_sub(*c, *a), d = ray->direction;
    struct vec3 n = vec_cross(e1, e2);
    struct dd3 f = exact_difference3(ray->origin, *a);
    struct vec3 v = vec3(dd_advance(f.x, *t, d.x).high, dd_advance(f.y, *t, d.y).high,
                         dd_advance(f.z, *t, d.z).high);
    double speed = vec_dot(n, d), edges = sum_of_sizes(e1) * sum_of_sizes(e2);
    if (!(3 * edges * sum_of_sizes(v) < fabs(speed * *t))) return false;
    *t -= vec_dot(n, v) / speed;
    return true;
}

/*
 * Upper bound on the error of an uncorrected t. By what is said at SLOPE_MAX it is less than 2^-30 of the
 * largest coordinate of the sheared triangle if the slope is less than 2^20; infinite otherwise.
 */
static inline double uncorrected_error(const struct sheared *p, const struct sheared *q,
                                       const struct sheared *r, const struct shear *shear,
                                       double slope)
{
    double size = fabs(p->z) + fabs(q->z) + fabs(r->z) + fabs(p->x) + fabs(q->x) + fabs(r->x) +
                  fabs(p->y) + fabs(q->y) + fabs(r->y);
    return slope < 0x1p20 ? 0x1p-30 * size / fabs(shear->dz) : INFINITE;
}

/*
 * Limit for triangle_plane_distance(). In dd3_cross() and the dot products each product of sizes errs by less
 * than 64 u^2. If 20 bits of them cancel, t has an error of 2^-78, and is rounded correctly except once in
 * some 2^24 times.
 */
#define PLANE_SHARE 0x1p-20

/*
 * The parameter *t at which the ray's line crosses the triangle's plane, accurate to the last bit; false:
 * double-double is not accurate enough.
 */
bool triangle_plane_distance(const struct vec3 *a, const struct vec3 *b, const struct vec3 *c,
                             const struct ray *ray, double *t);

/* triangle_crossings() with exact decisions. *distance receives t before it is rounded (may be NULL). */
struct crossings triangle_crossings_exact(const struct vec3 corners[3], const struct ray *ray,
                                          const struct shear *shear, struct dd *distance);

static inline struct crossings exact_crossings(const struct vec3 *a, const struct vec3 *b,
                                               const struct vec3 *c, const struct ray *ray,
                                               const struct shear *shear)
{
    const struct vec3 corners[3] = {*a, *b, *c};
    return triangle_crossings_exact(corners, ray, shear, NULL);
}

/* Whether products of three coordinates are within the range of double, and those that matter do not
 * underflow. */
static inline bool cubes_are_in_range(const struct sheared *p, const struct sheared *q,
                                      const struct sheared *r)
{
    double size = fabs(p->x) + fabs(p->y) + fabs(p->z) + fabs(q->x) + fabs(q->y) + fabs(q->z) +
                  fabs(r->x) + fabs(r->y) + fabs(r->z);
    return size > 0x1p-300 && size < 0x1p300;
}

/*
 * triangle_crossings() for very large or very small triangles: scales the triangle to about size 1, which
 * gives the bits that it has there.
 */
struct crossings scaled_crossings(const struct vec3 *a, const struct vec3 *b, const struct vec3 *c,
                                  const struct ray *ray, const struct shear *shear,
                                  const struct purpose *purpose, uint64_t *exact);

/*
 * The crossing of the ray's line with the triangle, from either side. On which side of an edge the line
 * passes is decided exactly, in exact arithmetic where the filter is not sufficient, which is counted. If a
 * crossing certainly does not matter for the purpose, its t may be less accurate.
 */
static inline struct crossings triangle_crossings(const struct vec3 *a, const struct vec3 *b,
                                                  const struct vec3 *c, const struct ray *ray,
                                                  const struct shear *shear,
                                                  const struct purpose *purpose, uint64_t *exact)
{
    struct sheared p = shear_vertex(shear, &ray->origin, a);
    struct sheared q = shear_vertex(shear, &ray->origin, b);
    struct sheared r = shear_vertex(shear, &ray->origin, c);
    struct edge_range edges = edge_range(&p, &q, &r);
    if (edges.low < -edges.error && edges.high > edges.error) return NO_CROSSINGS;
    if (!(edges.low > edges.error || edges.high < -edges.error)) {
        ++*exact;
        return exact_crossings(a, b, c, ray, shear);
    }
    double e0 = edge_value(&q, &r), e1 = edge_value(&r, &p), e2 = edge_value(&p, &q);
    if (!cubes_are_in_range(&p, &q, &r))
        return scaled_crossings(a, b, c, ray, shear, purpose, exact);
    double sum = e0 + e1 + e2;
    struct crossings found = one_crossing((e0 * p.z + e1 * q.z + e2 * r.z) / sum / shear->dz);
    found.u = e1 / sum;
    found.v = e2 / sum;
    double slope = triangle_slope(&p, &q, &r, sum), t = found.t[0];
    if (slope <= SLOPE_MAX && way_is_accurate(&p, &q, &r, t * shear->dz, &ray->origin))
        return found;
    double doubt = uncorrected_error(&p, &q, &r, shear, slope);
    if (t < -doubt || t - doubt > purpose->farthest) return found;
    if (purpose->any && t > doubt && t + doubt < purpose->farthest) return found;
    if (triangle_correct(a, b, c, ray, &found.t[0])) return found;
    if (triangle_plane_distance(a, b, c, ray, &found.t[0])) return found;
    return exact_crossings(a, b, c, ray, shear);
}

/*
 * Whether a ray that starts on triangle `from`, on the side that it came from, goes through it and meets
 * triangle `of` at the same place, up to the rounding of its origin: at a common edge or vertex. Both
 * crossings are then one passage through the surface.
 */
bool triangle_is_same_passage(const struct vec3 from[3], const struct vec3 of[3],
                              const struct ray *ray);

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

/* Unit normal on the side from which the vertices run counter-clockwise; 0 for a triangle without area. */
static inline struct vec3 triangle_normal(const struct vec3 *a, const struct vec3 *b,
                                          const struct vec3 *c)
{
    struct vec3 ab = vec_sub(*b, *a), ac = vec_sub(*c, *a), normal = vec_cross(ab, ac);
    double square = vec_dot(normal, normal);
    /*
     * For very small or very large triangles the products may leave the range of double: they are scaled as
     * in vec_normalize().
     */
    if (!(square > 0x1p-900 && square < 0x1p1000))
        normal = vec_cross(vec_scale_exactly(ab, -vec_exponent(ab)),
                           vec_scale_exactly(ac, -vec_exponent(ac)));
    return vec_is_zero(normal) ? normal : vec_normalize(normal);
}

#endif
