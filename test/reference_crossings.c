#include "test/reference_crossings.h"

struct ray make_ray(struct point origin, struct point direction, uint32_t from, uint32_t part)
{
    struct ray ray = {origin, direction, from, part, {0}, {0}};
    real o[] = {origin.x, origin.y, origin.z}, d[] = {direction.x, direction.y, direction.z};
    for (int i = 0; i < 3; i++) {
        ray.o[i] = mpfr_get_d(o[i], MPFR_RNDN);
        ray.d[i] = mpfr_get_d(d[i], MPFR_RNDN);
    }
    return ray;
}

static void cross_at(struct crossings *found, real t, uint32_t part)
{
    found->at[found->count++] = (struct crossing){t, NULL, NULL, part};
}

/* Drops the root at the ray's start, for a surface that it starts on: the one nearer to 0. */
static void drop_own_root(struct crossings *found)
{
    if (found->count == 0) return;
    unsigned own = 0;
    if (found->count == 2 && mpfr_cmpabs(found->at[1].t, found->at[0].t) < 0) own = 1;
    found->at[own] = found->at[--found->count];
}

static void cross_sphere(ref r, const struct sphere *sphere, const struct ray *ray, bool leaving,
                         struct crossings *found)
{
    struct point f = point_sub(r, ray->origin, point_of(r, sphere->center));
    real radius = number(r, sphere->radius);
    real a = dot(r, ray->direction, ray->direction), b = dot(r, f, ray->direction);
    real c = sub(r, dot(r, f, f), mul(r, radius, radius));
    real discriminant = sub(r, mul(r, b, b), mul(r, a, c));
    if (sign(discriminant) < 0) return;
    real half = root(r, discriminant), minus_b = mul(r, b, number(r, -1));
    if (!sphere->inside_only || leaving) cross_at(found, divide(r, sub(r, minus_b, half), a), 0);
    cross_at(found, divide(r, add(r, minus_b, half), a), 0);
    if (leaving) drop_own_root(found);
}

static real plane_parameter(ref r, struct vec3 point, struct vec3 normal, const struct ray *ray)
{
    struct point n = point_of(r, normal);
    real speed = dot(r, ray->direction, n);
    if (sign(speed) == 0) return NULL;
    return divide(r, dot(r, point_sub(r, point_of(r, point), ray->origin), n), speed);
}

static void cross_plane(ref r, const struct plane *plane, const struct ray *ray,
                        struct crossings *found)
{
    real t = plane_parameter(r, plane->point, plane->normal, ray);
    if (t) cross_at(found, t, 0);
}

static void cross_disc(ref r, const struct disc *disc, const struct ray *ray,
                       struct crossings *found)
{
    real t = plane_parameter(r, disc->center, disc->normal, ray);
    if (!t) return;
    struct point f = point_sub(r, ray->origin, point_of(r, disc->center));
    struct point p = point_along(r, f, ray->direction, t);
    real radius = number(r, disc->radius);
    if (compare(dot(r, p, p), mul(r, radius, radius)) <= 0) cross_at(found, t, 0);
}

/* By Cramer's rule. All edges belong to the triangle. */
static void cross_triangle(ref r, struct point a, struct point b, struct point c,
                           const struct ray *ray, struct crossings *found)
{
    struct point ab = point_sub(r, b, a), ac = point_sub(r, c, a);
    struct point f = point_sub(r, ray->origin, a), across = cross(r, ray->direction, ac);
    real det = dot(r, across, ab);
    if (sign(det) == 0) return;
    struct point turned = cross(r, f, ab);
    real u = divide(r, dot(r, across, f), det);
    real v = divide(r, dot(r, turned, ray->direction), det);
    if (sign(u) < 0 || sign(v) < 0 || compare(add(r, u, v), number(r, 1)) > 0) return;
    found->at[found->count++] = (struct crossing){divide(r, dot(r, turned, ac), det), u, v, 0};
}

static void cross_box(ref r, const struct box *box, const struct ray *ray, bool leaving,
                      struct crossings *found)
{
    struct point low = point_of(r, box->min), high = point_of(r, box->max);
    real min[] = {low.x, low.y, low.z}, max[] = {high.x, high.y, high.z};
    real o[] = {ray->origin.x, ray->origin.y, ray->origin.z};
    real d[] = {ray->direction.x, ray->direction.y, ray->direction.z};
    for (unsigned face = 0; face < 6; face++) {
        unsigned axis = face / 2;
        bool sheet = compare(min[axis], max[axis]) == 0;
        bool own = leaving && (face == ray->from_part || (sheet && axis == ray->from_part / 2));
        if (sign(d[axis]) == 0 || own || (sheet && face & 1)) continue;
        real t = divide(r, sub(r, face & 1 ? max[axis] : min[axis], o[axis]), d[axis]);
        bool inside = true;
        for (unsigned other = 0; other < 3; other++) {
            if (other == axis) continue;
            real at = add(r, o[other], mul(r, d[other], t));
            inside = inside && compare(at, min[other]) >= 0 && compare(at, max[other]) <= 0;
        }
        if (inside) cross_at(found, t, face);
    }
}

struct axis cone_axis(ref r, const struct cone *cone)
{
    struct point base = point_of(r, cone->base);
    struct point w = point_sub(r, point_of(r, cone->apex), base);
    return (struct axis){base, w, dot(r, w, w)};
}

/* rho = base_radius + (apex_radius - base_radius) s for a dot product with w. */
static real cone_radius(ref r, const struct cone *cone, const struct axis *axis, real along,
                        double at_base)
{
    real widening = sub(r, number(r, cone->apex_radius), number(r, cone->base_radius));
    return add(r, number(r, at_base), mul(r, widening, divide(r, along, axis->W)));
}

static void cone_side_root(ref r, const struct axis *axis, struct point f, const struct ray *ray,
                           real t, struct crossings *found)
{
    real along = dot(r, point_along(r, f, ray->direction, t), axis->w);
    if (sign(along) >= 0 && compare(along, axis->W) <= 0) cross_at(found, t, CONE_SIDE_PART);
}

/* |p x w|^2 = W rho^2 along the ray: (F + t D)^2 = W (rho0 + t rho1)^2. */
static void cross_cone_side(ref r, const struct cone *cone, const struct axis *axis, struct point f,
                            const struct ray *ray, bool leaving, struct crossings *found)
{
    struct point F = cross(r, f, axis->w), D = cross(r, ray->direction, axis->w);
    real rho0 = cone_radius(r, cone, axis, dot(r, f, axis->w), cone->base_radius);
    real rho1 = cone_radius(r, cone, axis, dot(r, ray->direction, axis->w), 0);
    real W = axis->W;
    real A = sub(r, dot(r, D, D), mul(r, W, mul(r, rho1, rho1)));
    real B = sub(r, mul(r, W, mul(r, rho0, rho1)), dot(r, F, D));
    real C = sub(r, dot(r, F, F), mul(r, W, mul(r, rho0, rho0)));
    if (sign(A) == 0) {
        if (sign(B) != 0 && !leaving)
            cone_side_root(r, axis, f, ray, divide(r, C, mul(r, number(r, 2), B)), found);
        return;
    }
    real discriminant = sub(r, mul(r, B, B), mul(r, A, C));
    if (sign(discriminant) < 0) return;
    real half = root(r, discriminant);
    real low = divide(r, sub(r, B, half), A), high = divide(r, add(r, B, half), A);
    if (leaving && ray->from_part == CONE_SIDE_PART) {
        cone_side_root(r, axis, f, ray, mpfr_cmpabs(low, high) < 0 ? high : low, found);
    } else {
        cone_side_root(r, axis, f, ray, low, found);
        cone_side_root(r, axis, f, ray, high, found);
    }
}

static void cross_cap(ref r, const struct axis *axis, struct point f, const struct ray *ray,
                      double height, double radius, uint32_t part, struct crossings *found)
{
    real speed = dot(r, ray->direction, axis->w);
    if (sign(speed) == 0) return;
    real wanted = mul(r, number(r, height), axis->W);
    real t = divide(r, sub(r, wanted, dot(r, f, axis->w)), speed);
    struct point out = cross(r, point_along(r, f, ray->direction, t), axis->w);
    real limit = mul(r, number(r, radius), number(r, radius));
    if (compare(dot(r, out, out), mul(r, axis->W, limit)) <= 0) cross_at(found, t, part);
}

static void cross_cone(ref r, const struct cone *cone, const struct ray *ray, bool leaving,
                       struct crossings *found)
{
    struct axis axis = cone_axis(r, cone);
    struct point f = point_sub(r, ray->origin, axis.base);
    cross_cone_side(r, cone, &axis, f, ray, leaving, found);
    if (!cone->capped) return;
    if (!leaving || ray->from_part != CONE_BASE_PART)
        cross_cap(r, &axis, f, ray, 0, cone->base_radius, CONE_BASE_PART, found);
    if (!leaving || ray->from_part != CONE_APEX_PART)
        cross_cap(r, &axis, f, ray, 1, cone->apex_radius, CONE_APEX_PART, found);
}

const uint32_t *triangle_corners(const struct scene *scene, uint32_t id)
{
    uint32_t index = primitive_index(id);
    if (primitive_kind(id) == PRIMITIVE_PATCH) return scene_patches(scene)[index].vertex;
    return scene_triangles(scene)[index].vertex;
}

/* ---- one call for all kinds ---- */

void cross_primitive(ref r, uint32_t id, const struct ray *ray, struct crossings *found)
{
    const struct scene *scene = r->scene;
    uint32_t index = primitive_index(id);
    bool leaving = ray->from == id;
    found->count = 0;
    switch (primitive_kind(id)) {
    case PRIMITIVE_SPHERE:
        cross_sphere(r, &scene_spheres(scene)[index], ray, leaving, found);
        return;
    case PRIMITIVE_BOX:
        cross_box(r, &scene_boxes(scene)[index], ray, leaving, found);
        return;
    case PRIMITIVE_CONE:
        cross_cone(r, &scene_cones(scene)[index], ray, leaving, found);
        return;
    case PRIMITIVE_DISC:
        if (!leaving) cross_disc(r, &scene_discs(scene)[index], ray, found);
        return;
    case PRIMITIVE_PLANE:
        if (!leaving) cross_plane(r, &scene_planes(scene)[index], ray, found);
        return;
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_KINDS:
        break;
    }
    if (leaving) return;
    const uint32_t *corner = triangle_corners(scene, id);
    const struct vec3 *vertices = scene_vertices(scene);
    cross_triangle(r, point_of(r, vertices[corner[0]]), point_of(r, vertices[corner[1]]),
                   point_of(r, vertices[corner[2]]), ray, found);
}

static void reach_around(struct reach *reach, const struct vec3 *points, int count, double more)
{
    struct vec3 sum = {0, 0, 0};
    for (int i = 0; i < count; i++)
        sum = vec_add(sum, vec_scale(points[i], 1.0 / count));
    *reach = (struct reach){{sum.x, sum.y, sum.z}, 0};
    for (int i = 0; i < count; i++)
        reach->radius = fmax(reach->radius, vec_length(vec_sub(points[i], sum)) + more);
}

void primitive_reach(const struct scene *scene, uint32_t id, struct reach *reach)
{
    uint32_t index = primitive_index(id);
    struct vec3 points[3];
    double more = 0;
    int count = 2;
    switch (primitive_kind(id)) {
    case PRIMITIVE_SPHERE:
        points[0] = points[1] = scene_spheres(scene)[index].center;
        more = scene_spheres(scene)[index].radius;
        break;
    case PRIMITIVE_BOX:
        points[0] = scene_boxes(scene)[index].min;
        points[1] = scene_boxes(scene)[index].max;
        break;
    case PRIMITIVE_CONE:
        points[0] = scene_cones(scene)[index].base;
        points[1] = scene_cones(scene)[index].apex;
        more = fmax(scene_cones(scene)[index].base_radius, scene_cones(scene)[index].apex_radius);
        break;
    case PRIMITIVE_DISC:
        points[0] = points[1] = scene_discs(scene)[index].center;
        more = scene_discs(scene)[index].radius;
        break;
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
        count = 3;
        for (int i = 0; i < 3; i++)
            points[i] = scene_vertices(scene)[triangle_corners(scene, id)[i]];
        break;
    case PRIMITIVE_PLANE:
    case PRIMITIVE_KINDS:
        *reach = (struct reach){{0, 0, 0}, HUGE_VAL};
        return;
    }
    reach_around(reach, points, count, more);
}

/* The margin is 1e4 roundings of the largest numbers in it. */
bool clearly_past(const struct reach *reach, const struct ray *ray)
{
    const double *d = ray->d;
    double f[3], size = reach->radius;
    for (int i = 0; i < 3; i++) {
        f[i] = ray->o[i] - reach->center[i];
        size = fmax(size, fmax(fabs(ray->o[i]), fabs(reach->center[i])));
    }
    struct vec3 out = vec_cross(vec3(f[0], f[1], f[2]), vec3(d[0], d[1], d[2]));
    double distance = vec_length(out) / vec_length(vec3(d[0], d[1], d[2]));
    return distance > reach->radius + 1e-12 * size;
}
