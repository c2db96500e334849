#include "worker/primitive.h"

#include "worker/box.h"
#include "worker/cone.h"
#include "worker/order.h"
#include "worker/planar.h"
#include "worker/sphere.h"

struct bounds primitive_bounds(const struct scene *scene, uint32_t id)
{
    uint32_t index = primitive_index(id);
    switch (primitive_kind(id)) {
    case PRIMITIVE_SPHERE:
        return sphere_bounds(&scene_spheres(scene)[index]);
    case PRIMITIVE_BOX:
        return box_bounds(&scene_boxes(scene)[index]);
    case PRIMITIVE_CONE:
        return cone_bounds(&scene_cones(scene)[index]);
    case PRIMITIVE_DISC:
        return disc_bounds(&scene_discs(scene)[index]);
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_PLANE:
    case PRIMITIVE_KINDS:
        break;
    }
    struct vec3 at[3];
    triangle_vertices(scene, id, at);
    return triangle_bounds(&at[0], &at[1], &at[2]);
}

static bool have_common_vertex(const uint32_t a[3], const uint32_t b[3])
{
    for (unsigned i = 0; i < 3; i++)
        if (a[i] == b[0] || a[i] == b[1] || a[i] == b[2]) return true;
    return false;
}

/*
 * Whether the crossing with a neighbour of the triangle that the ray starts on is the same as its passage
 * through that triangle. Two coplanar triangles are neighbours if the line passes beside the first one;
 * otherwise they are two sheets that lie on each other.
 */
static bool is_same_passage(const struct scene *scene, uint32_t id, const struct ray *ray,
                            const struct shear *shear, bool coplanar)
{
    if (!is_triangle(ray->from)) return false;
    if (!have_common_vertex(corner_indices(scene, ray->from), corner_indices(scene, id)))
        return false;
    struct vec3 from[3], of[3];
    triangle_vertices(scene, ray->from, from);
    triangle_vertices(scene, id, of);
    if (!triangle_is_same_passage(from, of, ray)) return false;
    return !coplanar || triangle_crossings_exact(from, ray, shear, NULL).t[0] == NOT_CROSSED;
}

/* Whether a triangle that is crossed close to the ray's start does not count there. */
static bool is_left_out(const struct scene *scene, uint32_t id, const struct ray *ray,
                        const struct shear *shear, double t)
{
    const struct crossing crossing = {id, 0, t};
    bool coplanar = is_at_start(scene, ray, &crossing);
    return (coplanar && is_passed(scene, ray, &crossing)) ||
           is_same_passage(scene, id, ray, shear, coplanar);
}

struct crossings triangle_crossings_ahead(const struct scene *scene, uint32_t id,
                                          const uint32_t corner[3], const struct ray *ray,
                                          const struct shear *shear, const struct purpose *purpose,
                                          uint64_t *exact)
{
    if (id == ray->from) return NO_CROSSINGS;
    const struct vec3 *vertices = scene_vertices(scene);
    struct crossings found = triangle_crossings(&vertices[corner[0]], &vertices[corner[1]],
                                                &vertices[corner[2]], ray, shear, purpose, exact);
    if (!is_near_start(ray, found.t[0])) return found;
    return is_left_out(scene, id, ray, shear, found.t[0]) ? NO_CROSSINGS : found;
}

/* The crossings without those that the ray has passed where it starts. */
static struct crossings crossings_ahead(const struct scene *scene, uint32_t id,
                                        const struct ray *ray, struct crossings found)
{
    for (unsigned i = 0; i < 2; i++) {
        const struct crossing crossing = {id, found.part[i], found.t[i]};
        if (!is_near_start(ray, found.t[i])) continue;
        if (is_at_start(scene, ray, &crossing) && is_passed(scene, ray, &crossing))
            found.t[i] = NOT_CROSSED;
    }
    return found;
}

/* The exit of a cone that is entered through a cap may not have been computed. */
static struct crossings cone_crossings_ahead(const struct scene *scene, uint32_t id,
                                             const struct ray *ray, const struct purpose *purpose,
                                             uint64_t *exact)
{
    const struct purpose both = {true, INFINITE};
    const struct cone *cone = &scene_cones(scene)[primitive_index(id)];
    bool leaving = id == ray->from;
    struct crossings found = cone_crossings(cone, ray, leaving, purpose, exact);
    struct crossings ahead = crossings_ahead(scene, id, ray, found);
    if (ahead.t[0] == found.t[0] || found.t[1] != NOT_CROSSED) return ahead;
    return crossings_ahead(scene, id, ray, cone_crossings(cone, ray, leaving, &both, exact));
}

bool never_meets_its_start(const struct scene *scene, const struct ray *ray)
{
    uint32_t id = ray->from, index = primitive_index(id), part = ray_from_part(ray);
    switch (primitive_kind(id)) {
    case PRIMITIVE_SPHERE:
        return ray_leaves_sphere(&scene_spheres(scene)[index], ray);
    case PRIMITIVE_BOX:
        return !box_goes_inside(part, ray);
    case PRIMITIVE_CONE: {
        const struct cone *cone = &scene_cones(scene)[index];
        struct cone_sketch s = cone_sketch(cone, ray);
        return ray_leaves_cone(cone, &s, part);
    }
    default:
        return true;
    }
}

struct crossings primitive_crossings(const struct scene *scene, uint32_t id, const struct ray *ray,
                                     const struct shear *shear, const struct purpose *purpose,
                                     uint64_t *exact)
{
    uint32_t index = primitive_index(id);
    bool leaving = id == ray->from;
    struct crossings found = NO_CROSSINGS;
    switch (primitive_kind(id)) {
    case PRIMITIVE_SPHERE:
        found = sphere_crossings(&scene_spheres(scene)[index], ray, leaving, purpose, exact);
        /* Only another sphere can coincide with a sphere. */
        if (primitive_kind(ray->from) != PRIMITIVE_SPHERE) return found;
        return crossings_ahead(scene, id, ray, found);
    case PRIMITIVE_BOX:
        found = box_crossings(&scene_boxes(scene)[index], ray, leaving, exact);
        return crossings_ahead(scene, id, ray, found);
    case PRIMITIVE_CONE:
        return cone_crossings_ahead(scene, id, ray, purpose, exact);
    case PRIMITIVE_DISC:
        if (!leaving) found = disc_crossings(&scene_discs(scene)[index], ray, purpose, exact);
        return crossings_ahead(scene, id, ray, found);
    case PRIMITIVE_PLANE:
        if (!leaving) found = plane_crossings(&scene_planes(scene)[index], ray);
        return crossings_ahead(scene, id, ray, found);
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_KINDS:
        break;
    }
    return triangle_crossings_ahead(scene, id, corner_indices(scene, id), ray, shear, purpose,
                                    exact);
}
