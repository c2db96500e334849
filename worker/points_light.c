/* Lighting of the points of a wave, and the directions of secondary rays. */
#include "worker/optics_body.h"
#include "worker/points.h"

/* ---- light ---- */

/*
 * The parameter at which the shadow ray from point p to a light at l ends. It is less than 1 by the
 * uncertainty of the light's position and of the ray's direction: l - p is rounded by u |l - p|; p lies
 * within some 4 u |p| of its surface, and l is rounded by as much relative to a surface that is meant to
 * carry it. Without this margin, rounding would decide whether a light on a lamp's surface is shaded by it;
 * with it, the light shines on its own side. A light closer to the point than this is not shaded at all.
 */
#define SHADOW_ROUNDOFF (8 * UNIT_ROUNDOFF)

static inline double shadow_end(struct vec3 point, struct vec3 light, struct vec3 to_light)
{
    double reach = vec_largest(point) + vec_largest(light);
    double end = 1 - SHADOW_ROUNDOFF * (reach / vec_largest(to_light));
    return end > 0 ? end : 0;
}

FLATTENED void points_face(const struct points *points, const struct light *light,
                           struct faced *faced)
{
    struct vec3 position = light->position;
    bool paper = points->formulas == FORMULAS_PAPER;
    OVER_LANES
    for (uint32_t i = 0; i < points->count; i++) {
        struct vec3 point = lane(&points->point, i), to_light = vec_sub(position, point);
        bool front = vec_dot(to_light, lane(&points->geometric, i)) > 0;
        bool lit = vec_dot(to_light, lane(&points->normal, i)) > 0;
        double end = shadow_end(point, position, to_light);
        set_lane(&faced->to_light, i, to_light);
        faced->end[i] = paper ? 1 : end;
        faced->faces[i] = truth(front & lit);
    }
}

static void gather_lit(const struct points *points, struct lit *lit)
{
    for (uint32_t i = 0; i < lit->count; i++) {
        uint32_t point = lit->point[i];
        const struct material *material = points->material[point];
        set_lane(&lit->view, i, lane(&points->view, point));
        set_lane(&lit->normal, i, lane(&points->normal, point));
        set_lane(&lit->surface, i, material->color);
        lit->diffuse[i] = material->diffuse;
        lit->specular[i] = material->specular;
        lit->shininess[i] = material->shininess;
    }
}

static inline void light_diffuse_lane(struct lit *lit, size_t i)
{
    bool sure = true;
    struct vec3 unit = plain_unit(lane(&lit->to_light, i), &sure);
    double cos_a = lit_cosine(unit, lane(&lit->normal, i));
    struct vec3 color = vec_mul(lane(&lit->strength, i), lane(&lit->surface, i));
    set_lane(&lit->color, i, vec_scale(color, lit->diffuse[i] * cos_a));
    lit->sure[i] = truth(sure);
}

IN_LANES(light_diffuse, lit, light_diffuse_lane)

static inline void add_highlight(struct lit *lit, size_t i)
{
    struct vec3 to_light = lane(&lit->to_light, i), color = lane(&lit->color, i);
    struct lobe terms = lobe_of(lane(&lit->view, i), lane(&lit->normal, i), to_light);
    double power = lobe_power(&terms, 0, lit->shininess[i]), p = terms.p.high;
    double value = p > 0 ? power : 0, specular = lit->specular[i];
    bool sure = is_in_range(to_light) & ((p >= LOBE_P_MIN) | (p <= 0));
    struct vec3 bright = vec_add_scaled(color, lane(&lit->strength, i), specular * value);
    set_lane(&lit->color, i, choose(specular > 0, bright, color));
    lit->sure[i] = truth((lit->sure[i] != 0) & (sure | !(specular > 0)));
}

IN_LANES(add_highlights, lit, add_highlight)

static bool any_specular(const struct lit *lit)
{
    for (uint32_t i = 0; i < lit->count; i++)
        if (lit->specular[i] > 0) return true;
    return false;
}

void points_light(const struct points *points, struct lit *lit)
{
    bool exact = points->formulas == FORMULAS_EXACT;
    if (exact) {
        gather_lit(points, lit);
        light_diffuse(lit, 0, lit->count);
        if (any_specular(lit)) add_highlights(lit, 0, lit->count);
    }
    for (uint32_t i = 0; i < lit->count; i++) {
        if (exact && lit->sure[i] != 0) continue;
        struct shading_point at = points_get(points, lit->point[i]);
        set_lane(&lit->color, i,
                 shade_light(&at, lane(&lit->to_light, i), lane(&lit->strength, i)));
    }
}

/* ---- where rays go on ---- */

static void gather_secondary(const struct points *points, struct secondary_rays *secondary)
{
    for (uint32_t i = 0; i < secondary->count; i++) {
        uint32_t point = secondary->point[i];
        set_lane(&secondary->view, i, lane(&points->view, point));
        set_lane(&secondary->normal, i, lane(&points->normal, point));
        set_lane(&secondary->geometric, i, lane(&points->geometric, point));
    }
}

static inline void reflect_lane(struct secondary_rays *secondary, size_t i)
{
    struct vec3 geometric = lane(&secondary->geometric, i);
    double v_n;
    struct vec3 out = mirrored_view(lane(&secondary->view, i), lane(&secondary->normal, i), &v_n);
    set_lane(&secondary->direction, i, out);
    bool sure = vec_dot(out, geometric) > 0;
    sure &= !mirror_may_enter(v_n);
    secondary->sure[i] = truth(sure);
}

IN_LANES(reflect_lanes, secondary_rays, reflect_lane)

void points_reflect(const struct points *points, struct secondary_rays *secondary)
{
    bool exact = points->formulas == FORMULAS_EXACT;
    if (exact) {
        gather_secondary(points, secondary);
        reflect_lanes(secondary, 0, secondary->count);
    }
    for (uint32_t i = 0; i < secondary->count; i++) {
        if (exact && secondary->sure[i] != 0) continue;
        struct shading_point at = points_get(points, secondary->point[i]);
        set_lane(&secondary->direction, i, reflect(&at));
    }
}

/* refract() with the shading normal, where that suffices. With a second index below N2_MIN, and with k = 0, so much of
 * the terms of k cancels that it is not plain. */
static inline void refract_lane(struct secondary_rays *secondary, size_t i)
{
    struct vec3 view = lane(&secondary->view, i), normal = lane(&secondary->normal, i);
    double from = secondary->from[i], to = secondary->to[i], e, d;
    bool plain, facing = vec_dot(view, normal) < 0;
    struct transition at = transition_from(from, to, cosine_in(view, normal, &e, &d), &plain);
    bool passes = at.k.high >= 0;
    struct vec3 out = passed_view(view, normal, &at, dd_root(at.k), e, d);
    bool through = vec_dot(out, lane(&secondary->geometric, i)) < 0;
    set_lane(&secondary->direction, i, out);
    secondary->passes[i] = truth(passes);
    plain &= is_plain_index(larger_number(from, to));
    secondary->sure[i] = truth(plain & (from != to) & facing & (through | !passes));
}

IN_LANES(refract_lanes, secondary_rays, refract_lane)

void points_refract(const struct points *points, struct secondary_rays *secondary)
{
    bool exact = points->formulas == FORMULAS_EXACT;
    if (exact) {
        gather_secondary(points, secondary);
        refract_lanes(secondary, 0, secondary->count);
    }
    for (uint32_t i = 0; i < secondary->count; i++) {
        if (exact && secondary->sure[i] != 0) continue;
        struct shading_point at = points_get(points, secondary->point[i]);
        struct vec3 direction = at.view;
        secondary->passes[i] = refract(&at, secondary->from[i], secondary->to[i], &direction);
        set_lane(&secondary->direction, i, direction);
    }
}
