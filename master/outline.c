#include "master/outline.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"

struct outline {
    const struct builder *builder;
    /* Per vertex: whether it is a corner of a triangle or patch; owned. Others do not belong to the scene. */
    bool *used;
};

/* ---- the corners of meshes ---- */

static void note_corners(bool *used, const uint32_t vertex[3])
{
    for (int i = 0; i < 3; i++)
        used[vertex[i]] = true;
}

static void find_used(const struct builder *builder, bool *used)
{
    const struct triangle *triangles = builder_items(builder, PRIMITIVE_TRIANGLE);
    const struct patch *patches = builder_items(builder, PRIMITIVE_PATCH);
    for (uint32_t i = 0; i < builder_kind_count(builder, PRIMITIVE_TRIANGLE); i++)
        note_corners(used, triangles[i].vertex);
    for (uint32_t i = 0; i < builder_kind_count(builder, PRIMITIVE_PATCH); i++)
        note_corners(used, patches[i].vertex);
}

struct outline *outline_create(const struct builder *builder)
{
    struct outline *outline = allocate_zeroed(1, sizeof *outline);
    outline->builder = builder;
    outline->used = allocate_zeroed(builder_vertex_count(builder), sizeof *outline->used);
    find_used(builder, outline->used);
    return outline;
}

void outline_destroy(struct outline *outline)
{
    free(outline->used);
    free(outline);
}

/* ---- the support function ---- */

static double corners_support(const struct outline *outline, struct vec3 origin,
                              struct vec3 direction)
{
    uint32_t vertices = builder_vertex_count(outline->builder);
    double most = -HUGE_VAL;
    for (uint32_t i = 0; i < vertices; i++) {
        if (!outline->used[i]) continue;
        struct vec3 corner = vec_sub(builder_vertex(outline->builder, i), origin);
        double support = vec_dot(corner, direction);
        if (support > most)
            most = support; /* fmax() would be a call, of which large meshes make millions */
    }
    return most;
}

/* Support function of a disc around its centre; normal: unit. */
static double disc_support(struct vec3 normal, double radius, struct vec3 direction)
{
    double along = vec_dot(normal, direction);
    return radius * sqrt(fmax(0, vec_dot(direction, direction) - along * along));
}

static double cone_support(const struct cone *cone, struct vec3 origin, struct vec3 direction)
{
    struct vec3 axis = vec_normalize(vec_sub(cone->apex, cone->base));
    return fmax(vec_dot(vec_sub(cone->base, origin), direction) +
                    disc_support(axis, cone->base_radius, direction),
                vec_dot(vec_sub(cone->apex, origin), direction) +
                    disc_support(axis, cone->apex_radius, direction));
}

static double box_support(const struct box *box, struct vec3 origin, struct vec3 direction)
{
    struct vec3 corner = {direction.x > 0 ? box->max.x : box->min.x,
                          direction.y > 0 ? box->max.y : box->min.y,
                          direction.z > 0 ? box->max.z : box->min.z};
    return vec_dot(vec_sub(corner, origin), direction);
}

static double primitive_support(enum primitive_kind kind, const void *item, struct vec3 origin,
                                struct vec3 direction)
{
    const struct sphere *sphere = item;
    const struct disc *disc = item;
    switch (kind) {
    case PRIMITIVE_SPHERE:
        return vec_dot(vec_sub(sphere->center, origin), direction) +
               sphere->radius * vec_length(direction);
    case PRIMITIVE_BOX:
        return box_support(item, origin, direction);
    case PRIMITIVE_DISC:
        return vec_dot(vec_sub(disc->center, origin), direction) +
               disc_support(disc->normal, disc->radius, direction);
    case PRIMITIVE_CONE:
        return cone_support(item, origin, direction);
    default: /* triangles and patches are all together, and planes have no end */
        return -HUGE_VAL;
    }
}

/* That of one kind but triangles and patches. */
static double kind_support(const struct builder *builder, enum primitive_kind kind,
                           struct vec3 origin, struct vec3 direction)
{
    const char *items = builder_items(builder, kind);
    size_t size = primitive_size(kind);
    double most = -HUGE_VAL;
    for (uint32_t i = 0; i < builder_kind_count(builder, kind); i++)
        most = fmax(most, primitive_support(kind, items + i * size, origin, direction));
    return most;
}

static double support_along(const struct outline *outline, struct vec3 origin,
                            struct vec3 direction)
{
    double most = corners_support(outline, origin, direction);
    for (int k = 0; k < PRIMITIVE_PLANE; k++) {
        enum primitive_kind kind = (enum primitive_kind)k;
        if (!kind_is_triangle(kind))
            most = fmax(most, kind_support(outline->builder, kind, origin, direction));
    }
    return most;
}

bool outline_support(const struct outline *outline, struct vec3 origin, unsigned count,
                     const struct vec3 *directions, double *support)
{
    const struct builder *builder = outline->builder;
    for (unsigned k = 0; k < count; k++)
        support[k] = support_along(outline, origin, directions[k]);
    return builder_primitive_count(builder) > builder_kind_count(builder, PRIMITIVE_PLANE);
}

bool outline_bounds(const struct outline *outline, struct vec3 *min, struct vec3 *max)
{
    static const struct vec3 sides[6] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},
                                         {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
    double support[6];
    bool any = outline_support(outline, vec3(0, 0, 0), 6, sides, support);
    *max = vec3(support[0], support[1], support[2]);
    *min = vec3(-support[3], -support[4], -support[5]);
    return any;
}
