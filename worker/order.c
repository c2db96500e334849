#include "worker/order.h"

#include "worker/box.h"
#include "worker/cone.h"
#include "worker/coplanar.h"
#include "worker/sphere.h"

static struct dd triangle_parameter(const struct scene *scene, const struct ray *ray,
                                    const struct shear *shear, const struct crossing *crossing)
{
    struct vec3 at[3];
    triangle_vertices(scene, crossing->primitive, at);
    struct dd t = dd(crossing->t);
    (void)triangle_crossings_exact(at, ray, shear, &t);
    return t;
}

static struct dd parameter_of(const struct scene *scene, const struct ray *ray,
                              const struct shear *shear, const struct crossing *crossing)
{
    uint32_t id = crossing->primitive, index = primitive_index(id);
    struct supporting_plane plane;
    bool leaving = id == ray->from;
    switch (primitive_kind(id)) {
    case PRIMITIVE_SPHERE:
        return sphere_parameter(&scene_spheres(scene)[index], ray, crossing->t, leaving);
    case PRIMITIVE_BOX:
        return box_parameter(&scene_boxes(scene)[index], ray, crossing->part);
    case PRIMITIVE_CONE:
        return cone_parameter(&scene_cones(scene)[index], ray, crossing->t, crossing->part,
                              leaving);
    case PRIMITIVE_DISC:
    case PRIMITIVE_PLANE:
        plane = supporting_plane(scene, id);
        return plane_parameter(plane.point, plane.normal, ray);
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_KINDS:
        break;
    }
    return triangle_parameter(scene, ray, shear, crossing);
}

/*
 * Relative difference below which two crossings count as equal, because double-double cannot separate them: a
 * parameter takes some thirty operations with errors of up to 10 u^2 = 2^-102 each. Let a ray meet a sphere
 * and two planes in one point, and let the order of the planes be known (compare_flats()). An order by
 * smaller differences might be cyclic, and which crossing wins would then depend on which pair is compared
 * first.
 */
#define SAME_PLACE 0x1p-90

static bool are_of_glass_meshes(const struct scene *scene, uint32_t a, uint32_t b)
{
    return is_triangle(a) && is_triangle(b) && transmits(scene, a) && transmits(scene, b);
}

int compare_crossings(const struct scene *scene, const struct ray *ray, const struct shear *shear,
                      const struct crossing *a, const struct crossing *b)
{
    int order;
    if (compare_flats(scene, ray, a->primitive, a->part, b->primitive, b->part, &order)) {
        if (order != 0 || !are_of_glass_meshes(scene, a->primitive, b->primitive)) return order;
        return compare_flats_beside(scene, ray, shear, a->primitive, b->primitive);
    }
    struct dd ta = parameter_of(scene, ray, shear, a), tb = parameter_of(scene, ray, shear, b);
    double apart = (ta.high - tb.high) + (ta.low - tb.low);
    if (fabs(apart) <= SAME_PLACE * fabs(ta.high)) return 0;
    return apart < 0 ? -1 : 1;
}

bool has_priority(const struct scene *scene, uint32_t a, uint32_t b)
{
    bool through_a = transmits(scene, a), through_b = transmits(scene, b);
    return through_a == through_b ? a < b : through_b;
}

/*
 * Whether the ray goes outward both at its start and at t, or inward at both. A round surface is crossed
 * twice, and its other side may be arbitrarily close to the start.
 */
static bool keeps_sense(const struct scene *scene, const struct ray *ray,
                        const struct crossing *crossing)
{
    uint32_t index = primitive_index(crossing->primitive);
    double first, later;
    if (primitive_kind(crossing->primitive) == PRIMITIVE_SPHERE) {
        struct vec3 d = ray->direction,
                    f = vec_sub(ray->origin, scene_spheres(scene)[index].center);
        first = vec_dot(f, d);
        later = first + crossing->t * vec_dot(d, d);
    } else if (primitive_kind(crossing->primitive) == PRIMITIVE_CONE &&
               crossing->part == CONE_SIDE) {
        const struct cone *cone = &scene_cones(scene)[index];
        struct cone_sketch s = cone_sketch(cone, ray);
        first = cone_outward(cone, &s, 0);
        later = cone_outward(cone, &s, crossing->t);
    } else {
        return true;
    }
    return (first > 0) == (later > 0);
}

bool is_at_start(const struct scene *scene, const struct ray *ray, const struct crossing *crossing)
{
    return is_near_start(ray, crossing->t) && crossing->primitive != ray->from &&
           are_in_one_surface(scene, ray->from, ray_from_part(ray), crossing->primitive,
                              crossing->part) &&
           keeps_sense(scene, ray, crossing);
}

bool is_passed(const struct scene *scene, const struct ray *ray, const struct crossing *crossing)
{
    return has_priority(scene, crossing->primitive, ray->from) != is_reversed(ray);
}

bool precedes_if_equal(const struct scene *scene, const struct ray *ray, const struct crossing *a,
                       const struct crossing *b)
{
    bool first = has_priority(scene, a->primitive, b->primitive);
    if (!is_reversed(ray)) return first;
    bool here = is_at_start(scene, ray, a);
    if (here != is_at_start(scene, ray, b)) return here;
    return here ? !first : first;
}
