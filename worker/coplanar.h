/*
 * Exact predicates on surfaces: whether two lie in one plane or on one curved surface, and which of two flat
 * ones a ray crosses first.
 */
#ifndef FARM_WORKER_COPLANAR_H
#define FARM_WORKER_COPLANAR_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "worker/triangle.h"

/*
 * The relation of two primitives, or of parts of them (as in struct hit): in two surfaces, in one plane, or
 * on one curved surface, that is the same sphere, cylinders with the same axis and radius, or cones with the
 * same ends.
 */
enum surfaces { SURFACES_TWO, SURFACES_ONE_PLANE, SURFACES_ONE_ROUND };

/* The relation, decided exactly. */
enum surfaces surfaces_of(const struct scene *scene, uint32_t a, uint32_t part_of_a, uint32_t b,
                          uint32_t part_of_b);

static inline bool are_in_one_surface(const struct scene *scene, uint32_t a, uint32_t part_of_a,
                                      uint32_t b, uint32_t part_of_b)
{
    return surfaces_of(scene, a, part_of_a, b, part_of_b) != SURFACES_TWO;
}

/* Size of a cache of coplanar primitives for the rays of one wave; at most half of what fits into the L1
 * cache. */
#define KNOWN_PLANES_BITS 11
#define KNOWN_PLANES      (1u << KNOWN_PLANES_BITS)

/*
 * A cache of results of surfaces_of() for flat primitives: those with equal `as` lie in one plane. It holds
 * no kinds that have several parts.
 */
struct known_planes {
    bool any; /* the rest is defined */
    struct {
        uint32_t id, as;
    } of[KNOWN_PLANES];
};

/* A direct-mapped cache: each id has one place, which holds the last id stored there. */
static inline unsigned known_place(uint32_t id)
{
    return id * UINT32_C(0x9e3779b1) >> (32 - KNOWN_PLANES_BITS);
}

static inline bool are_known_coplanar(const struct known_planes *known, uint32_t a, uint32_t b)
{
    unsigned i = known_place(a), k = known_place(b);
    return known->any && known->of[i].id == a && known->of[k].id == b &&
           known->of[i].as == known->of[k].as;
}

static inline bool has_one_plane(uint32_t id)
{
    enum primitive_kind kind = primitive_kind(id);
    return kind_is_triangle(kind) || kind == PRIMITIVE_DISC || kind == PRIMITIVE_PLANE;
}

/* Records that a and b lie in one plane. */
static inline void note_coplanar(struct known_planes *known, uint32_t a, uint32_t b)
{
    if (!has_one_plane(a) || !has_one_plane(b)) return;
    if (!known->any) memset(known->of, 0xff, sizeof known->of);
    known->any = true;
    unsigned i = known_place(a), k = known_place(b);
    uint32_t as = known->of[i].id == a ? known->of[i].as : a;
    known->of[i].id = a;
    known->of[i].as = as;
    known->of[k].id = b;
    known->of[k].as = as;
}

/*
 * Compares where the ray's line crosses two planes: *order < 0 if it crosses a first, > 0 if b, 0 if both at
 * once. false: one of them is not flat, or is parallel to the ray.
 */
bool compare_flats(const struct scene *scene, const struct ray *ray, uint32_t a, uint32_t part_of_a,
                   uint32_t b, uint32_t part_of_b, int *order);

/* Whether a point lies, exactly, in the plane of a triangle, patch, disc or plane. */
bool is_in_plane_of(const struct scene *scene, uint32_t flat_primitive, struct vec3 point);

/*
 * The order, as above, in which a ray crosses two triangles that it meets at one place, if it is displaced like
 * one that meets an edge exactly (worker/triangle.h): 0 only if they lie in one plane or are parallel to the ray.
 */
int compare_flats_beside(const struct scene *scene, const struct ray *ray,
                         const struct shear *shear, uint32_t a, uint32_t b);

#endif
