/*
 * Tests of the triangles of a leaf against a ray, in float and with vertices rounded to 16 bits (struct
 * bvh_corners): a quarter of the work and of the memory of tests in double. They tell which triangles are certainly
 * missed and which are certainly crossed; the others need exact tests.
 *
 * The rounded vertices, called places, are sheared as in worker/triangle.h, in units of the leaf. A vertex
 * with place q has x' = q.x - sx q.z + X, where X = ((base.x - o.x) - sx (base.z - o.z)) / unit and Z =
 * (base.z - o.z) / unit are computed in double for each leaf. The distance of the leaf from the origin
 * therefore only matters in double.
 */
#ifndef FARM_WORKER_ROUGH_TRIANGLES_H
#define FARM_WORKER_ROUGH_TRIANGLES_H

#include "worker/float_slabs.h"
#include "worker/triangle.h"

/*
 * The error of x', in units, with q.x, q.z < 2^16, |sx| <= 1, |X| < ASIDE_MAX and |Z| < AHEAD_MAX. Places err
 * by 1/2 each, and by a thousandth where the vertex itself was rounded (bvh_leaf.c): 1.002 in x' for both. In
 * double, origin and base relative to the tree's centre, their difference and its part in X err by less than
 * 16 u 2^41, as base is at most 2^40; X - sx Z is rounded by u 2^41 more: together less than 2^-7. In float,
 * with v = 2^-24: sx errs by v, in x' 2^16 v; X by 2^18 v; q.x + X by 1.25 2^18 v; the product by 2^16 v and
 * the sum by 1.5 2^18 v: together 17/16 2^20 v < 0.067. The total is less than 1.077.
 */
#define ASIDE_MAX   0x1p18
#define AHEAD_MAX   0x1p40
#define PLACE_ERROR 1.08

/*
 * If all vertices have |x'|, |y'| < `size`, an edge's value p.x q.y - p.y q.x has three errors. PLACE_ERROR
 * of each factor times the other counts four times. The square of PLACE_ERROR counts twice, 2.4 in all; a
 * tenth of PLACE_ERROR size, which is 6.9 with the least size, has room for it. The roundings of the products
 * and of the difference are at most 4 v size^2. For a small triangle this is a tenth of the bound for the
 * extent of a whole leaf.
 */
#define ROUGH_SIZE_MIN 64

/* The values of a ray that these tests need. */
struct rough_ray {
    unsigned x, y, z;        /* axes of its shear */
    struct quad_order order; /* the same order */
    struct quad origin;      /* relative to the tree's centre, in this order */
    struct quad slant;       /* sx, sy, 0, 0 */
    struct floats sx, sy;
};

/* Member by member, as probe_begin(). */
static INLINED void rough_ray_begin(struct rough_ray *rough, const struct bvh *bvh,
                                    const struct ray *ray, const struct shear *shear)
{
    /* The scene has triangles, so probe_begin() has set the shear.
     * NOLINTNEXTLINE(clang-analyzer-core.uninitialized.Assign) */
    rough->x = shear->x;
    rough->y = shear->y;
    rough->z = shear->z;
    rough->order = quad_order(shear->x, shear->y, shear->z);
    rough->origin =
        quad_sub(quad_point(&ray->origin.x, &rough->order), quad_point(bvh->center, &rough->order));
    rough->slant = quad_row(shear->sx, shear->sy, 0, 0);
    rough->sx = floats_of((float)shear->sx);
    rough->sy = floats_of((float)shear->sy);
}

/* X, Y and Z of a leaf. */
static INLINED struct quad rough_base_of(const struct rough_ray *ray,
                                         const struct bvh_corners *corners)
{
    _Static_assert(offsetof(struct bvh_corners, inverse) == 3 * sizeof(float), "the fourth");
    struct quad base = quad_floats(corners->base, &ray->order), inverse = quad_fourth(base);
    base = quad_sub(base, ray->origin);
    return quad_mul(quad_sub_mul(base, ray->slant, quad_third(base)), inverse);
}

/* Whether the error bounds above apply; false for NaN. */
static INLINED bool is_rough_enough(struct quad base)
{
    struct quad most = quad_row(ASIDE_MAX, ASIDE_MAX, AHEAD_MAX, 0);
    return (quad_less(quad_abs(base), most) & 7u) == 7;
}

/* Vertex k of eight triangles, sheared; z is counted from the leaf's base. */
struct rough_corners {
    struct floats x, y, z;
};

static INLINED struct rough_corners rough_shear(struct floats x, struct floats y, struct floats z,
                                                struct floats base_x, struct floats base_y,
                                                struct floats sx, struct floats sy)
{
    return (struct rough_corners){floats_sub_mul(floats_add(x, base_x), sx, z),
                                  floats_sub_mul(floats_add(y, base_y), sy, z), z};
}

static INLINED struct floats rough_edge(const struct rough_corners *p,
                                        const struct rough_corners *q)
{
    return floats_mul_sub(p->x, q->y, floats_mul(p->y, q->x));
}

/* The triangles that the ray's line certainly misses and certainly crosses; the edges' values and their
 * error. */
struct rough_sets {
    lane_set missed, crossed;
    struct floats e0, e1, e2, error;
};

static INLINED struct floats rough_aside(const struct rough_corners *p)
{
    return floats_larger(floats_abs(p->x), floats_abs(p->y));
}

static INLINED struct floats rough_edge_error(const struct rough_corners corner[3])
{
    struct floats size = floats_larger(rough_aside(&corner[0]), rough_aside(&corner[1]));
    size = floats_add(floats_larger(size, rough_aside(&corner[2])), floats_of(ROUGH_SIZE_MIN));
    struct floats share = floats_mul(floats_of((float)(4 * FLOAT_ROUNDOFF)), size);
    return floats_mul(floats_add(share, floats_of((float)(4.1 * PLACE_ERROR))), size);
}

static INLINED struct rough_sets rough_sets(const struct rough_corners corner[3])
{
    struct floats e0 = rough_edge(&corner[1], &corner[2]);
    struct floats e1 = rough_edge(&corner[2], &corner[0]);
    struct floats e2 = rough_edge(&corner[0], &corner[1]);
    struct floats low = floats_smaller(floats_smaller(e0, e1), e2);
    struct floats high = floats_larger(floats_larger(e0, e1), e2);
    struct floats above = rough_edge_error(corner), below = floats_sub(floats_of(0), above);
    return (struct rough_sets){floats_less(low, below) & floats_less(above, high),
                               floats_less(above, low) | floats_less(high, below),
                               e0,
                               e1,
                               e2,
                               above};
}

/* What is known of several triangles and a ray. */
struct triangle_sets {
    lane_set maybe;   /* possibly crossed */
    lane_set certain; /* of these, certainly crossed within the ray's reach */
};

/*
 * The part of the ray in which crossings count, in terms of z = t dz. If all vertices of a triangle are
 * between from and to, and it is crossed, then it is crossed there, and that is a passage of its own:
 * is_near_start() asks for less than half of `from`. t errs by less than 10 u of the vertices' z; see
 * SLOPE_MAX, above which it is corrected.
 */
struct reach {
    double from, to;
};

#define PASSAGE_REACH (2 * START_REACH)
#define REACH_SLACK   (1 - 64 * UNIT_ROUNDOFF)

static INLINED struct reach reach_of(const struct ray *ray, const struct shear *shear)
{
    double near = PASSAGE_REACH * vec_largest(ray->origin);
    double far = ray->t_max * fabs(shear->dz) * REACH_SLACK;
    if (shear->dz < 0) return (struct reach){-far, -near};
    return (struct reach){near, far};
}

/*
 * The triangles with all vertices between from and to, see struct reach. Places are less than 2^16 and err by
 * less than one; so does the difference of from / unit and Z, except for 2^-24 of it.
 */
static INLINED lane_set rough_within(const struct rough_corners corner[3],
                                     const struct reach *reach, double base_z, double inverse)
{
    struct floats first = floats_smaller(floats_smaller(corner[0].z, corner[1].z), corner[2].z);
    struct floats last = floats_larger(floats_larger(corner[0].z, corner[1].z), corner[2].z);
    float from = (float)(reach->from * inverse - base_z + 1);
    float to = (float)(reach->to * inverse - base_z - 1);
    return floats_less(floats_of(from), first) & floats_less(last, floats_of(to));
}

/*
 * The entries of this primitive among LANES entries of a leaf. If fewer are left, what is read after them
 * belongs to their vertices, which take more room than that.
 */
static INLINED lane_set entries_of(const struct bvh_leaf *leaves, uint32_t id)
{
    _Static_assert(sizeof *leaves + sizeof(struct bvh_corners) + CORNER_ROWS * sizeof(uint16_t) >=
                       LANES * sizeof *leaves,
                   "an entry and its corners");
    return same_31((const void *)leaves, id);
}

/*
 * Classifies LANES of a leaf's triangles, from number `first` on, of those that are in sets->maybe. Without a reach
 * no crossing is certain. false: the rounded vertices are not accurate enough, and nothing changes.
 */
static INLINED bool sort_rough_triangles(const struct bvh_corners *corners, uint32_t triangles,
                                         uint32_t first, const struct rough_ray *ray,
                                         const struct reach *reach, struct triangle_sets *sets)
{
    struct quad base = rough_base_of(ray, corners);
    if (!is_rough_enough(base)) return false;
    size_t row = triangles, axis = 3 * row;
    /* Where a leaf has triangles, the scene has some, and rough_ray_begin() was called.
     * NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult) */
    const uint16_t *x = corners->place + ray->x * axis + first;
    const uint16_t *y = corners->place + ray->y * axis + first;
    const uint16_t *z = corners->place + ray->z * axis + first;
    struct floats base_x, base_y;
    struct rough_corners corner[3];
    floats_of_two(base, &base_x, &base_y);
    UNROLLED
    for (unsigned k = 0; k < 3; k++)
        corner[k] = rough_shear(floats_load_shorts(x + k * row), floats_load_shorts(y + k * row),
                                floats_load_shorts(z + k * row), base_x, base_y, ray->sx, ray->sy);
    struct rough_sets found = rough_sets(corner);
    sets->maybe &= ~found.missed;
    sets->certain = 0;
    if (!reach || !(sets->maybe & found.crossed)) return true;
    double at[QUAD];
    quad_store(at, base);
    sets->certain =
        sets->maybe & found.crossed & rough_within(corner, reach, at[2], (double)corners->inverse);
    return true;
}

#endif
