#include "test/reference.h"

#include "test/reference_crossings.h"

/* ---- nearest and occluded ---- */

struct hit {
    real t, u, v;
    uint32_t primitive, part;
};

static void consider(struct hit *hit, uint32_t id, const struct crossing *crossing)
{
    if (sign(crossing->t) <= 0) return;
    if (hit->primitive != PRIMITIVE_NONE) {
        int order = compare(crossing->t, hit->t);
        if (order > 0) return;
        if (order == 0 && id > hit->primitive) return;
        if (order == 0 && id == hit->primitive && crossing->part >= hit->part) return;
    }
    mpfr_set(hit->t, crossing->t, MPFR_RNDN);
    if (crossing->u) {
        mpfr_set(hit->u, crossing->u, MPFR_RNDN);
        mpfr_set(hit->v, crossing->v, MPFR_RNDN);
    }
    hit->primitive = id;
    hit->part = crossing->part;
}

static struct hit nearest_hit(ref r, const struct ray *ray)
{
    struct hit hit = {new_real(r), new_real(r), new_real(r), PRIMITIVE_NONE, 0};
    for (int k = 0; k < PRIMITIVE_KINDS; k++) {
        for (uint32_t i = 0; i < r->scene->primitives[k].count; i++) {
            if (clearly_past(&r->reach[k][i], ray)) continue;
            uint32_t id = primitive_id((enum primitive_kind)k, i);
            struct crossings found;
            size_t before = mark(r);
            cross_primitive(r, id, ray, &found);
            for (unsigned c = 0; c < found.count; c++)
                consider(&hit, id, &found.at[c]);
            release(r, before);
        }
    }
    decide(r, hit.primitive);
    decide(r, hit.part);
    return hit;
}

/* The light's colour, multiplied by the transmittances of all surfaces in 0 < t < 1. */
static struct point light_through(ref r, const struct ray *ray, struct vec3 color)
{
    struct point light = point_of(r, color);
    uint64_t crossings = 0;
    for (int k = 0; k < PRIMITIVE_KINDS; k++) {
        for (uint32_t i = 0; i < r->scene->primitives[k].count; i++) {
            if (clearly_past(&r->reach[k][i], ray)) continue;
            uint32_t id = primitive_id((enum primitive_kind)k, i);
            const struct material *material =
                &scene_materials(r->scene)[primitive_material(r->scene, id)];
            struct crossings found;
            size_t before = mark(r);
            cross_primitive(r, id, ray, &found);
            real share = number(r, material->transmission);
            for (unsigned c = 0; c < found.count; c++) {
                if (sign(found.at[c].t) <= 0 || mpfr_cmp_ui(found.at[c].t, 1) >= 0) continue;
                struct point filter = point_scale(r, point_of(r, material->color), share);
                point_copy(light, point_mul(r, light, filter));
                crossings++;
            }
            release(r, before);
        }
    }
    bool dark = sign(light.x) == 0 && sign(light.y) == 0 && sign(light.z) == 0;
    decide(r, dark ? UINT64_MAX : crossings);
    return light;
}

/* The number of surfaces in 0 < t < 1. */
static uint64_t crossings_of(ref r, const struct ray *ray)
{
    uint64_t crossings = 0;
    for (int k = 0; k < PRIMITIVE_KINDS; k++) {
        for (uint32_t i = 0; i < r->scene->primitives[k].count; i++) {
            if (clearly_past(&r->reach[k][i], ray)) continue;
            struct crossings found;
            size_t before = mark(r);
            cross_primitive(r, primitive_id((enum primitive_kind)k, i), ray, &found);
            for (unsigned c = 0; c < found.count; c++)
                crossings += sign(found.at[c].t) > 0 && mpfr_cmp_ui(found.at[c].t, 1) < 0;
            release(r, before);
        }
    }
    return crossings;
}

/* ---- the surface at a hit ---- */

struct surface {
    struct point point, geometric, normal;
    const struct material *material;
    bool entering;
};

static struct point cone_normal(ref r, const struct cone *cone, struct point p, uint32_t part)
{
    struct axis axis = cone_axis(r, cone);
    if (part == CONE_APEX_PART) return axis.w;
    if (part == CONE_BASE_PART) return negative(r, axis.w);
    struct point f = point_sub(r, p, axis.base);
    real along = divide(r, dot(r, f, axis.w), axis.W);
    struct point radial = point_sub(r, f, point_scale(r, axis.w, along));
    real widening = sub(r, number(r, cone->apex_radius), number(r, cone->base_radius));
    real slope = divide(r, mul(r, root(r, dot(r, radial, radial)), widening), axis.W);
    return point_sub(r, radial, point_scale(r, axis.w, slope));
}

static struct point triangle_normal(ref r, uint32_t id)
{
    const uint32_t *corner = triangle_corners(r->scene, id);
    const struct vec3 *vertices = scene_vertices(r->scene);
    struct point a = point_of(r, vertices[corner[0]]);
    struct point ab = point_sub(r, point_of(r, vertices[corner[1]]), a);
    return cross(r, ab, point_sub(r, point_of(r, vertices[corner[2]]), a));
}

static struct point face_normal(ref r, uint32_t face)
{
    double side = face & 1 ? 1 : -1;
    uint32_t axis = face / 2;
    return point_of(r, vec3(axis == 0 ? side : 0, axis == 1 ? side : 0, axis == 2 ? side : 0));
}

/* The normal, of any length: outward on a solid, to the front on others. */
static struct point outward(ref r, const struct hit *hit, struct point p)
{
    const struct scene *scene = r->scene;
    uint32_t index = primitive_index(hit->primitive);
    switch (primitive_kind(hit->primitive)) {
    case PRIMITIVE_SPHERE:
        return point_sub(r, p, point_of(r, scene_spheres(scene)[index].center));
    case PRIMITIVE_BOX:
        return face_normal(r, hit->part);
    case PRIMITIVE_CONE:
        return cone_normal(r, &scene_cones(scene)[index], p, hit->part);
    case PRIMITIVE_DISC:
        return point_of(r, scene_discs(scene)[index].normal);
    case PRIMITIVE_PLANE:
        return point_of(r, scene_planes(scene)[index].normal);
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_KINDS:
        break;
    }
    return triangle_normal(r, hit->primitive);
}

static struct point interpolated(ref r, const struct hit *hit, struct point geometric)
{
    if (primitive_kind(hit->primitive) != PRIMITIVE_PATCH) return geometric;
    const uint32_t *at = scene_patches(r->scene)[primitive_index(hit->primitive)].normal;
    const struct vec3 *normals = scene_normals(r->scene);
    real rest = sub(r, sub(r, number(r, 1), hit->u), hit->v);
    struct point sum = point_scale(r, point_of(r, normals[at[0]]), rest);
    sum = point_along(r, sum, point_of(r, normals[at[1]]), hit->u);
    sum = point_along(r, sum, point_of(r, normals[at[2]]), hit->v);
    return sign(dot(r, sum, sum)) == 0 ? geometric : unit(r, sum);
}

/* The magnitude of the largest number from which the point is computed, by the more accurate of two ways: o + t d, or
 * from the primitive. */
static double point_magnitude(ref r, const struct ray *ray, const struct hit *hit)
{
    double t = fabs(mpfr_get_d(hit->t, MPFR_RNDN));
    double along = fmax(largest(ray->origin), t * largest(ray->direction));
    enum primitive_kind kind = primitive_kind(hit->primitive);
    const struct reach *reach = &r->reach[kind][primitive_index(hit->primitive)];
    if (kind != PRIMITIVE_SPHERE && kind != PRIMITIVE_TRIANGLE && kind != PRIMITIVE_PATCH)
        return along;
    double own = reach->radius;
    for (int i = 0; i < 3; i++)
        own = fmax(own, fabs(reach->center[i]) + reach->radius);
    return fmin(along, own);
}

static struct surface surface_at(ref r, const struct ray *ray, const struct hit *hit)
{
    struct surface at;
    at.point = point_along(r, ray->origin, ray->direction, hit->t);
    at.geometric = unit(r, outward(r, hit, at.point));
    at.normal = interpolated(r, hit, at.geometric);
    at.material = &scene_materials(r->scene)[primitive_material(r->scene, hit->primitive)];
    displace(r, at.point, point_magnitude(r, ray, hit));
    displace(r, at.geometric, 1);
    if (at.normal.x != at.geometric.x) displace(r, at.normal, 1);
    at.entering = sign(dot(r, ray->direction, at.geometric)) <= 0;
    if (!at.entering) {
        bool same = at.normal.x == at.geometric.x;
        at.geometric = negative(r, at.geometric);
        if (same) at.normal = at.geometric;
    }
    if (sign(dot(r, at.normal, at.geometric)) < 0) at.normal = negative(r, at.normal);
    decide(r, at.entering);
    return at;
}

/* ---- light ---- */

static struct point mirror(ref r, struct point view, struct point normal)
{
    real twice = mul(r, number(r, -2), dot(r, view, normal));
    return unit(r, point_along(r, view, normal, twice));
}

static struct point reflected(ref r, const struct surface *at, struct point view)
{
    struct point direction = mirror(r, view, at->normal);
    bool above = sign(dot(r, direction, at->geometric)) > 0;
    decide(r, above);
    if (!above) direction = mirror(r, view, at->geometric);
    displace(r, direction, 1);
    return direction;
}

static bool snell(ref r, struct point view, struct point normal, double from, double to,
                  struct point *direction)
{
    real eta = divide(r, number(r, from), number(r, to)), one = number(r, 1);
    real cosine = mul(r, number(r, -1), dot(r, view, normal));
    real sine2 = sub(r, one, mul(r, cosine, cosine));
    real k = sub(r, one, mul(r, mul(r, eta, eta), sine2));
    decide(r, sign(k) >= 0);
    if (sign(k) < 0) return false;
    real along = sub(r, mul(r, eta, cosine), root(r, k));
    *direction = unit(r, point_along(r, point_scale(r, view, eta), normal, along));
    displace(r, *direction, 1);
    return true;
}

static bool refracted(ref r, const struct surface *at, struct point view, double from, double to,
                      struct point *direction)
{
    if (from == to) {
        *direction = view;
        return true;
    }
    if (sign(dot(r, view, at->normal)) < 0) {
        if (!snell(r, view, at->normal, from, to, direction)) return false;
        if (sign(dot(r, *direction, at->geometric)) < 0) return true;
    }
    return snell(r, view, at->geometric, from, to, direction);
}

/* s kd cos(a) Cs + s ks cos^n(b), added to *color. */
static void add_light(ref r, const struct surface *at, struct point view, struct point to_light,
                      struct point strength, struct point color)
{
    const struct material *m = at->material;
    struct point l = unit(r, to_light);
    real diffuse = mul(r, number(r, m->diffuse), dot(r, l, at->normal));
    struct point shade = point_mul(r, strength, point_of(r, m->color));
    point_copy(color, point_along(r, color, shade, diffuse));
    struct point away = mirror(r, negative(r, l), at->normal);
    real cosine = mul(r, number(r, -1), dot(r, away, view));
    if (!(m->specular > 0) || sign(cosine) <= 0) return;
    real lobe = mul(r, number(r, m->specular), power(r, cosine, number(r, m->shininess)));
    point_copy(color, point_along(r, color, strength, lobe));
}

static void add_lights(ref r, const struct surface *at, struct point view, const struct hit *hit,
                       struct point color)
{
    for (uint64_t i = 0; i < r->scene->lights.count; i++) {
        const struct light *light = &scene_lights(r->scene)[i];
        size_t before = mark(r);
        struct point position = point_of(r, light->position);
        struct point to_light = point_sub(r, position, at->point);
        displace(r, to_light, fmax(largest(position), largest(at->point)));
        bool faces =
            sign(dot(r, to_light, at->geometric)) > 0 && sign(dot(r, to_light, at->normal)) > 0;
        decide(r, faces);
        if (faces) {
            struct ray ray = make_ray(at->point, to_light, hit->primitive, hit->part);
            struct point strength = r->scene->view.shadows ? light_through(r, &ray, light->color)
                                                           : point_of(r, light->color);
            add_light(r, at, view, to_light, strength, color);
        }
        release(r, before);
    }
}

/* ---- media ---- */

struct medium {
    uint32_t solid; /* PRIMITIVE_NONE: identified by its index of refraction alone */
    double ior;
};

/* A stack of media, from the outermost to the one entered last. */
struct media {
    unsigned count;
    struct medium in[REFERENCE_MAX_DEPTH];
};

static bool bounds_a_volume(const struct scene *scene, uint32_t id)
{
    uint32_t index = primitive_index(id);
    enum primitive_kind kind = primitive_kind(id);
    if (kind == PRIMITIVE_SPHERE) return !scene_spheres(scene)[index].inside_only;
    if (kind == PRIMITIVE_CONE) return scene_cones(scene)[index].capped;
    return kind == PRIMITIVE_BOX;
}

static double innermost(const struct media *media)
{
    return media->count ? media->in[media->count - 1].ior : 1;
}

/* The media behind a surface; *from and *to are the indices of refraction on its sides. */
static struct media media_behind(ref r, struct media media, const struct hit *hit, bool entering,
                                 double ior, double *from, double *to)
{
    struct medium medium = {
        bounds_a_volume(r->scene, hit->primitive) ? hit->primitive : PRIMITIVE_NONE, ior};
    unsigned place = media.count;
    while (place > 0 &&
           (media.in[place - 1].solid != medium.solid || media.in[place - 1].ior != ior))
        place--;
    *from = innermost(&media);
    if (entering && !(place > 0 && medium.solid != PRIMITIVE_NONE)) {
        media.in[media.count++] = medium;
    } else if (!entering && place > 0) {
        for (unsigned i = place; i < media.count; i++)
            media.in[i - 1] = media.in[i];
        media.count--;
    } else if (!entering) {
        *from = ior;
    }
    *to = innermost(&media);
    return media;
}

/* ---- the tree ---- */

static void trace(ref r, const struct ray *ray, uint32_t depth, const struct media *media,
                  struct point color);

static void trace_child(ref r, const struct surface *at, const struct hit *hit,
                        struct point direction, uint32_t depth, const struct media *media,
                        struct point share, struct point color)
{
    if (depth == r->scene->view.max_depth) return;
    if (sign(share.x) == 0 && sign(share.y) == 0 && sign(share.z) == 0) return;
    struct ray ray = make_ray(at->point, direction, hit->primitive, hit->part);
    struct point brought = new_point(r);
    trace(r, &ray, depth + 1, media, brought);
    point_copy(color, point_add(r, color, point_mul(r, brought, share)));
}

static void trace_children(ref r, const struct surface *at, const struct hit *hit,
                           struct point view, uint32_t depth, const struct media *media,
                           struct point color)
{
    const struct material *m = at->material;
    struct point mirrored = point_of(r, vec3(m->reflection, m->reflection, m->reflection));
    if (m->transmission > 0) {
        double from, to;
        struct media behind = media_behind(r, *media, hit, at->entering, m->ior, &from, &to);
        struct point passed = point_scale(r, point_of(r, m->color), number(r, m->transmission));
        struct point direction;
        if (refracted(r, at, view, from, to, &direction))
            trace_child(r, at, hit, direction, depth, &behind, passed, color);
        else
            mirrored = point_add(r, mirrored, passed);
    }
    if (sign(mirrored.x) != 0 || sign(mirrored.y) != 0 || sign(mirrored.z) != 0)
        trace_child(r, at, hit, reflected(r, at, view), depth, media, mirrored, color);
}

static void background(ref r, struct point direction, struct point color)
{
    const struct view *view = &r->scene->view;
    real one = number(r, 1), half = number(r, 0.5);
    real up = mul(r, half, add(r, one, dot(r, direction, point_of(r, view->background_up))));
    struct point bottom = point_scale(r, point_of(r, view->background_bottom), sub(r, one, up));
    point_copy(color, point_along(r, bottom, point_of(r, view->background_top), up));
}

static void trace(ref r, const struct ray *ray, uint32_t depth, const struct media *media,
                  struct point color)
{
    size_t before = mark(r);
    struct hit hit = nearest_hit(r, ray);
    if (hit.primitive == PRIMITIVE_NONE) {
        background(r, ray->direction, color);
    } else {
        struct surface at = surface_at(r, ray, &hit);
        struct point own = point_of(r, at.material->color);
        point_copy(color, point_scale(r, own, number(r, at.material->ambient)));
        add_lights(r, &at, ray->direction, &hit, color);
        trace_children(r, &at, &hit, ray->direction, depth, media, color);
    }
    release(r, before);
}

/* ---- pictures ---- */

struct reference *reference_create(const struct scene *scene, unsigned bits)
{
    struct reference *r = calloc(1, sizeof *r);
    r->scene = scene;
    r->pool = malloc(POOL_SIZE * sizeof *r->pool);
    for (size_t i = 0; i < POOL_SIZE; i++)
        mpfr_init2(r->pool[i], (mpfr_prec_t)bits);
    for (int k = 0; k < PRIMITIVE_KINDS; k++) {
        uint64_t count = scene->primitives[k].count;
        r->reach[k] = calloc(count + 1, sizeof *r->reach[k]);
        for (uint32_t i = 0; i < count; i++)
            primitive_reach(scene, primitive_id((enum primitive_kind)k, i), &r->reach[k][i]);
    }
    return r;
}

void reference_free(struct reference *r)
{
    for (size_t i = 0; i < POOL_SIZE; i++)
        mpfr_clear(r->pool[i]);
    for (int k = 0; k < PRIMITIVE_KINDS; k++)
        free(r->reach[k]);
    free(r->pool);
    free(r);
}

static void begin(ref r, double displacement, uint64_t seed)
{
    r->used = 0;
    r->decisions = 0;
    r->displacement = displacement;
    r->random = seed * 2 + 1;
}

void reference_render(struct reference *r, uint32_t x, uint32_t y, double displacement,
                      uint64_t seed, struct reference_sample *sample)
{
    const struct view *view = &r->scene->view;
    begin(r, displacement, seed);
    real height = number(r, view->height);
    real u = divide(r, number(r, 2.0 * x + 1 - view->width), height);
    real v = divide(r, number(r, 2.0 * y + 1 - view->height), height);
    struct point direction = point_of(r, view->camera.forward);
    direction = point_along(r, direction, point_of(r, view->camera.right), u);
    direction = point_along(r, direction, point_of(r, view->camera.down), v);
    direction = unit(r, direction);
    displace(r, direction, 1);
    struct ray ray = make_ray(point_of(r, view->camera.eye), direction, PRIMITIVE_NONE, 0);
    struct media media = {.count = 0};
    struct point color = new_point(r);
    trace(r, &ray, 0, &media, color);
    sample->color[0] = mpfr_get_d(color.x, MPFR_RNDN);
    sample->color[1] = mpfr_get_d(color.y, MPFR_RNDN);
    sample->color[2] = mpfr_get_d(color.z, MPFR_RNDN);
    sample->decisions = r->decisions;
}

uint32_t reference_nearest(struct reference *r, struct vec3 origin, struct vec3 direction,
                           uint32_t *part)
{
    begin(r, 0, 0);
    struct ray ray = make_ray(point_of(r, origin), point_of(r, direction), PRIMITIVE_NONE, 0);
    struct hit hit = nearest_hit(r, &ray);
    *part = hit.part;
    return hit.primitive;
}

uint64_t reference_crossings(struct reference *r, struct vec3 a, struct vec3 b, double displacement,
                             uint64_t seed)
{
    begin(r, displacement, seed);
    struct point origin = point_of(r, a), target = point_of(r, b);
    displace(r, origin, largest(origin));
    displace(r, target, largest(target));
    struct ray ray = make_ray(origin, point_sub(r, target, origin), PRIMITIVE_NONE, 0);
    return crossings_of(r, &ray);
}
