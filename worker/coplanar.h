/* Surfaces without rounding: whether two lie in one plane or other surface, and which of two flat ones a ray meets
 * first. */
#ifndef FARM_WORKER_COPLANAR_H
#define FARM_WORKER_COPLANAR_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "worker/ray.h"

/* In what two primitives lie, or parts of them (as in struct hit). One that is round: the same sphere, a cylinder of
 * the same axis and radius, or a cone with the same ends. */
enum surfaces { SURFACES_TWO, SURFACES_ONE_PLANE, SURFACES_ONE_ROUND };

/* Without rounding. */
enum surfaces surfaces_of(const struct scene *scene, uint32_t a, uint32_t part_of_a, uint32_t b,
                          uint32_t part_of_b);

static inline bool are_in_one_surface(const struct scene *scene, uint32_t a, uint32_t part_of_a,
                                      uint32_t b, uint32_t part_of_b)
{
    return surfaces_of(scene, a, part_of_a, b, part_of_b) != SURFACES_TWO;
}

/* So many are remembered, of the rays of one wave: not more than half of the nearest cache has room for. */
#define KNOWN_PLANES_BITS 11
#define KNOWN_PLANES      (1u << KNOWN_PLANES_BITS)

/* Of some of what is flat, as surfaces_of() has said of it: what has the same `as` lies in one plane. No kinds of
 * several parts. */
struct known_planes {
    bool any; /* the rest is defined */
    struct {
        uint32_t id, as;
    } of[KNOWN_PLANES];
};

/* Each id has one place; the last one that came there is known. */
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
    return kind <= PRIMITIVE_PATCH || kind == PRIMITIVE_DISC || kind == PRIMITIVE_PLANE;
}

/* They lie in one plane. */
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

/* Tells in *order by its sign, or 0, which of the two planes the ray's line crosses first; false: one of
 * them is round, or along the ray. */
bool compare_flats(const struct scene *scene, const struct ray *ray, uint32_t a, uint32_t part_of_a,
                   uint32_t b, uint32_t part_of_b, int *order);

#endif
