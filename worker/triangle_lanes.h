/* Tests of several triangles of a leaf against a ray: which of them it may hit. The scalar functions decide
 * about those. */
#ifndef FARM_WORKER_TRIANGLE_LANES_H
#define FARM_WORKER_TRIANGLE_LANES_H

#include "worker/bvh.h"
#include "worker/lanes.h"
#include "worker/quad.h"
#include "worker/triangle.h"

#define WIDE lanes
#include "worker/sheared_edges.h"
#define WIDE quad
#include "worker/sheared_edges.h"

/* A ray's shear and its origin, in the order of the shear's axes. */
struct shear_quad {
    struct quad_order order;
    double origin[3], sx, sy;
};

static INLINED struct shear_quad shear_quad_of(const struct shear *shear, const struct vec3 *origin)
{
    return (struct shear_quad){quad_order(shear->x, shear->y, shear->z),
                               {vec_component(origin, shear->x), vec_component(origin, shear->y),
                                vec_component(origin, shear->z)},
                               shear->sx,
                               shear->sy};
}

/* Vertex k of each of `count` triangles, sheared; further lanes repeat the first triangle. */
static INLINED struct sheared_quad shear_vertices(const struct shear_quad *shear,
                                                  const struct scene *scene,
                                                  const struct bvh_leaf *leaves, uint32_t count,
                                                  unsigned k)
{
    const struct vec3 *vertices = scene_vertices(scene);
    const double *at[QUAD];
    struct quad p[3];
    UNROLLED
    for (uint32_t i = 0; i < QUAD; i++)
        at[i] = &vertices[corner_indices(scene, leaves[i < count ? i : 0].id)[k]].x;
    quad_transpose(at, &shear->order, p);
    struct quad z = quad_sub(p[2], quad_of(shear->origin[2]));
    struct quad x = quad_sub(p[0], quad_of(shear->origin[0]));
    struct quad y = quad_sub(p[1], quad_of(shear->origin[1]));
    return (struct sheared_quad){quad_sub(x, quad_mul(quad_of(shear->sx), z)),
                                 quad_sub(y, quad_mul(quad_of(shear->sy), z)), z};
}

/* Results of the filter of triangle_crossings(), as sets of triangles. */
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
 * Classifies the first QUAD of `count` triangles. Without a reach no crossing is certain. The operations and
 * their order are those of triangle_crossings().
 */
static INLINED struct triangle_sets sort_triangles(const struct scene *scene,
                                                   const struct bvh_leaf *leaves, uint32_t count,
                                                   const struct shear_quad *shear,
                                                   const struct reach *reach)
{
    struct sheared_quad p = shear_vertices(shear, scene, leaves, count, 0);
    struct sheared_quad q = shear_vertices(shear, scene, leaves, count, 1);
    struct sheared_quad r = shear_vertices(shear, scene, leaves, count, 2);
    struct edges_quad edges = quad_edges(&p, &q, &r);
    struct triangle_sets sets = {.maybe = ~edges.missed & first_lanes(count < QUAD ? count : QUAD)};
    if (!reach || !sets.maybe) return sets;
    struct quad first = quad_least(p.z, q.z, r.z), last = quad_largest(p.z, q.z, r.z);
    lane_set within = quad_less(quad_of(reach->from), first) & quad_less(last, quad_of(reach->to));
    sets.certain = sets.maybe & edges.crossed & within;
    return sets;
}

#endif
