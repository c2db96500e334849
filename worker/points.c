#include "worker/corner.h"
#include "worker/points_kinds.h"

/* Groups of points with code of their own in lanes, in the order in which the points are stored. */
enum group {
    GROUP_SPHERES,
    GROUP_TRIANGLES,
    GROUP_PATCHES,
    GROUP_SIDES,
    GROUP_EXITS, /* sides of cones that the ray starts on */
    GROUP_CAPS,
    GROUP_FLATS, /* discs and planes */
    GROUP_OTHERS,
    GROUPS
};

static enum group group_of(const struct ray *ray, const struct hit *hit)
{
    switch (primitive_kind(hit->primitive)) {
    case PRIMITIVE_SPHERE:
        return GROUP_SPHERES;
    case PRIMITIVE_TRIANGLE:
        return GROUP_TRIANGLES;
    case PRIMITIVE_PATCH:
        return GROUP_PATCHES;
    case PRIMITIVE_CONE:
        if (hit->part != CONE_SIDE) return GROUP_CAPS;
        return ray->from == hit->primitive ? GROUP_EXITS : GROUP_SIDES;
    case PRIMITIVE_DISC:
    case PRIMITIVE_PLANE:
        return GROUP_FLATS;
    case PRIMITIVE_BOX:
    case PRIMITIVE_KINDS:
        break;
    }
    return GROUP_OTHERS;
}

/* Fills points->slot; group g is first[g] .. first[g + 1] - 1. */
static void sort_by_group(const struct ray *rays, const struct hit *hits, uint32_t count,
                          struct points *points, uint32_t first[GROUPS + 1])
{
    uint32_t sizes[GROUPS] = {0};
    uint32_t at[GROUPS];
    for (uint32_t i = 0; i < count; i++)
        if (hits[i].primitive != PRIMITIVE_NONE) sizes[group_of(&rays[i], &hits[i])]++;
    first[0] = 0;
    for (int g = 0; g < GROUPS; g++) {
        at[g] = first[g];
        first[g + 1] = first[g] + sizes[g];
    }
    for (uint32_t i = 0; i < count; i++)
        if (hits[i].primitive != PRIMITIVE_NONE)
            points->slot[at[group_of(&rays[i], &hits[i])]++] = i;
    points->count = first[GROUPS];
}

static void gather_rays(const struct ray *rays, const struct hit *hits, struct points *points)
{
    for (uint32_t i = 0; i < points->count; i++) {
        const struct ray *ray = &rays[points->slot[i]];
        const struct hit *hit = &hits[points->slot[i]];
        set_lane(&points->view, i, ray->direction);
        set_lane(&points->origin, i, ray->origin);
        points->t[i] = hit->t;
        points->u[i] = hit->u;
        points->v[i] = hit->v;
    }
}

static void gather_materials(const struct scene *scene, const struct hit *hits,
                             struct points *points)
{
    const struct material *materials = scene_materials(scene);
    for (uint32_t i = 0; i < points->count; i++) {
        uint32_t primitive = hits[points->slot[i]].primitive;
        points->material[i] = &materials[primitive_material(scene, primitive)];
    }
}

/* Computes the points of all groups but the last. */
static void find_by_groups(const struct scene *scene, const struct hit *hits,
                           const uint32_t first[GROUPS + 1], struct points *points)
{
    static const struct {
        find_points *find;
        enum group from, to;
    } steps[] = {
        {find_on_spheres, GROUP_SPHERES, GROUP_SPHERES},
        {find_on_triangles, GROUP_TRIANGLES, GROUP_PATCHES},
        {find_patch_normals, GROUP_PATCHES, GROUP_PATCHES},
        {find_on_sides, GROUP_SIDES, GROUP_SIDES},
        {find_on_exits, GROUP_EXITS, GROUP_EXITS},
        {find_on_caps, GROUP_CAPS, GROUP_CAPS},
        {find_on_flats, GROUP_FLATS, GROUP_FLATS},
    };
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        uint32_t begin = first[steps[i].from], end = first[steps[i].to + 1];
        if (begin < end) steps[i].find(scene, hits, begin, end, points);
    }
}

/* shading_point(), except for rays that run along the surface. */
static inline void turn_normal(struct points *points, size_t i)
{
    struct vec3 geometric = lane(&points->geometric, i), normal = lane(&points->normal, i);
    double side = vec_dot(lane(&points->view, i), geometric);
    bool sure = !(fabs(side) < 4 * UNIT_ROUNDOFF), entering = side <= 0;
    struct vec3 facing = choose(entering, geometric, vec_neg(geometric));
    struct vec3 shading = choose(vec_dot(normal, facing) < 0, vec_neg(normal), normal);
    set_lane(&points->geometric, i, choose(sure, facing, geometric));
    set_lane(&points->normal, i, choose(sure, shading, normal));
    points->entering[i] = truth(entering);
    points->sure[i] = truth(sure);
}

IN_LANES(turn_normals, points, turn_normal)

static void put_point(struct points *points, size_t i, const struct shading_point *at)
{
    set_lane(&points->point, i, at->point);
    set_lane(&points->geometric, i, at->geometric);
    set_lane(&points->normal, i, at->normal);
    points->entering[i] = at->entering;
}

/* Computes one by one the points that lanes are not sure of or have no code for. */
static void find_singly(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                        const struct hit *hits, struct points *points, uint64_t *exact_fallbacks)
{
    for (uint32_t i = 0; i < points->count; i++) {
        const struct ray *ray = &rays[points->slot[i]];
        const struct hit *found = &hits[points->slot[i]];
        if (points->sure[i] != 0 && !found->in_corner) continue;
        struct hit hit = settled_hit(scene, ray, found, exact_fallbacks);
        struct surface surface;
        surface_at(scene, ray, &hit, &surface);
        if (hit.in_corner) surface.point = corner_point(scene, bvh, ray, &hit);
        set_lane(&points->point, i, surface.point);
        set_lane(&points->geometric, i, surface.geometric);
        set_lane(&points->normal, i, surface.shading);
    }
}

static void turn_singly(const struct scene *scene, const struct ray *rays, struct points *points)
{
    for (uint32_t i = 0; i < points->count; i++) {
        if (points->sure[i] != 0) continue;
        struct surface surface = {.point = lane(&points->point, i),
                                  .geometric = lane(&points->geometric, i),
                                  .shading = lane(&points->normal, i)};
        struct shading_point at = shading_point(scene, &rays[points->slot[i]], &surface);
        put_point(points, i, &at);
    }
}

static void doubt_from(struct points *points, uint32_t begin)
{
    for (uint32_t i = begin; i < points->count; i++)
        points->sure[i] = 0;
}

void points_find(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                 const struct hit *hits, uint32_t count, struct points *points,
                 uint64_t *exact_fallbacks)
{
    uint32_t first[GROUPS + 1];
    points->formulas = scene->view.formulas;
    sort_by_group(rays, hits, count, points, first);
    gather_rays(rays, hits, points);
    gather_materials(scene, hits, points);
    bool exact = points->formulas == FORMULAS_EXACT;
    if (exact) find_by_groups(scene, hits, first, points);
    doubt_from(points, exact ? first[GROUP_OTHERS] : 0); /* lanes have the exact formulas alone */
    find_singly(scene, bvh, rays, hits, points, exact_fallbacks);
    if (exact) turn_normals(points, 0, points->count);
    turn_singly(scene, rays, points);
}

struct shading_point points_get(const struct points *points, size_t i)
{
    return (struct shading_point){.point = lane(&points->point, i),
                                  .view = lane(&points->view, i),
                                  .geometric = lane(&points->geometric, i),
                                  .normal = lane(&points->normal, i),
                                  .entering = points->entering[i] != 0,
                                  .formulas = points->formulas,
                                  .material = points->material[i]};
}
