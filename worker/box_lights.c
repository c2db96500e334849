/* Bounds on the direct light in a box: struct box_lights of worker/radiance.h. */
#include <stdlib.h>

#include "common/message.h"
#include "worker/exact.h"
#include "worker/radiance.h"

/* With more lights the plain sum is used, since all subsets of them are examined. */
#define PAIRED_LIGHTS 6

/* If the sine of a cone's half angle exceeds this, the box is so close to the light that light may come from
 * anywhere. */
#define SINE_MAX 0.99

/* Error of cosines and sines of angles < pi, and of their sums and products. */
#define COSINE_ERROR (64 * UNIT_ROUNDOFF)

/* The directions in which a light is seen from a box: a cone, or all directions. */
struct light_cone {
    struct vec3 axis; /* unit */
    double sine, cosine;
    bool all;
};

static struct light_cone light_cone_of(const struct light *light, struct vec3 center, double radius)
{
    struct vec3 way = vec_sub(light->position, center);
    double distance = vec_length(way);
    struct light_cone light_cone = {.all = true};
    if (!isfinite(distance) || !(radius < SINE_MAX * distance)) return light_cone;
    light_cone.sine = radius / distance * (1 + COSINE_ERROR) + COSINE_ERROR;
    if (light_cone.sine > SINE_MAX) return light_cone;
    light_cone.cosine = sqrt(1 - light_cone.sine * light_cone.sine);
    light_cone.axis = vec_normalize(way);
    light_cone.all = false;
    return light_cone;
}

/* The largest cosine of the angle between a direction of one cone and one of the other. */
static double closest(const struct light_cone *a, const struct light_cone *b)
{
    if (a->all || b->all) return 1;
    double between = vec_dot(a->axis, b->axis);
    double cosine = a->cosine * b->cosine - a->sine * b->sine;
    if (between >= cosine - COSINE_ERROR) return 1;
    double sine = a->sine * b->cosine + a->cosine * b->sine;
    double apart = vec_length(vec_cross(a->axis, b->axis)); /* accurate near 0, too */
    return fmin(1, between * cosine + apart * sine + COSINE_ERROR);
}

static double share_of(double part, double whole)
{
    return whole > 0 && isfinite(whole) ? part / whole : 0;
}

static void pair_lights(struct box_lights *box_lights, const struct scene *scene,
                        struct vec3 center, double radius)
{
    const struct light *lights = scene_lights(scene);
    struct light_cone cone[PAIRED_LIGHTS];
    box_lights->share = allocate(box_lights->count, sizeof *box_lights->share);
    box_lights->cosine =
        allocate((size_t)box_lights->count * box_lights->count, sizeof *box_lights->cosine);
    uint32_t n = 0;
    for (uint64_t i = 0; i < scene->lights.count; i++) {
        struct vec3 color = lights[i].color, most = box_lights->strongest;
        if (vec_is_zero(color)) continue;
        box_lights->share[n] =
            vec3(share_of(color.x, most.x), share_of(color.y, most.y), share_of(color.z, most.z));
        cone[n++] = light_cone_of(&lights[i], center, radius);
    }
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < n; j++)
            box_lights->cosine[i * n + j] = i == j ? 1 : closest(&cone[i], &cone[j]);
}

/* Upper bound on |sum of l_i L_i|^2 over the lights of a bit set, in units of the strongest light. */
static double square_of(const struct box_lights *box_lights, unsigned c, uint32_t set)
{
    double square = 0;
    uint32_t n = box_lights->count;
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < n; j++)
            if (set >> i & set >> j & 1)
                square += vec_component(&box_lights->share[i], c) *
                          vec_component(&box_lights->share[j], c) * box_lights->cosine[i * n + j];
    return square;
}

/*
 * An upper bound on the sum of L_i max(0, n . l_i) over the lights, for any unit n. If S is the set of lights
 * with n . l_i > 0, this is n . sum over S of L_i l_i, which is at most the length of that sum. The square of
 * the length is the sum over all pairs in S of L_i L_j l_i . l_j.
 */
static double most_diffuse(const struct box_lights *box_lights, unsigned c)
{
    double sum = vec_component(&box_lights->sum, c), square = 0;
    if (!box_lights->paired) return sum;
    uint32_t n = box_lights->count;
    for (uint32_t set = 1; set < UINT32_C(1) << n; set++)
        square = fmax(square, square_of(box_lights, c, set));
    double most = vec_component(&box_lights->strongest, c) * sqrt(square + n * n * COSINE_ERROR);
    return fmin(sum, most * (1 + 8 * UNIT_ROUNDOFF));
}

void box_lights_init(struct box_lights *box_lights, const struct scene *scene,
                     const struct bounds *box, bool light_grows)
{
    const struct light *lights = scene_lights(scene);
    *box_lights = (struct box_lights){.light_grows = light_grows};
    for (uint64_t i = 0; i < scene->lights.count; i++) {
        struct vec3 color = lights[i].color, *most = &box_lights->strongest;
        if (vec_is_zero(color)) continue;
        box_lights->count++;
        box_lights->sum = vec_add(box_lights->sum, color);
        *most = vec3(fmax(most->x, color.x), fmax(most->y, color.y), fmax(most->z, color.z));
    }
    box_lights->sum = vec_scale(box_lights->sum, 1 + box_lights->count * UNIT_ROUNDOFF);
    struct vec3 min = {box->min[0], box->min[1], box->min[2]};
    struct vec3 max = {box->max[0], box->max[1], box->max[2]};
    /* Halved first to avoid overflow. */
    struct vec3 half = vec_sub(vec_scale(max, 0.5), vec_scale(min, 0.5));
    struct vec3 center = vec_add(vec_scale(max, 0.5), vec_scale(min, 0.5));
    double radius = vec_length(half) * (1 + COSINE_ERROR);
    box_lights->paired =
        box_lights->count > 1 && box_lights->count <= PAIRED_LIGHTS && isfinite(radius);
    if (box_lights->paired) pair_lights(box_lights, scene, center, radius);
    box_lights->diffuse =
        vec3(most_diffuse(box_lights, 0), most_diffuse(box_lights, 1), most_diffuse(box_lights, 2));
}

void box_lights_free(struct box_lights *box_lights)
{
    free(box_lights->share);
    free(box_lights->cosine);
}

/* base^exponent, 0 <= base <= 1, rounded up. */
static double power_above(double base, uint32_t exponent)
{
    double product = 1;
    for (; exponent; exponent >>= 1) {
        if (exponent & 1) product *= base * (1 + 2 * UNIT_ROUNDOFF);
        base *= base * (1 + 2 * UNIT_ROUNDOFF);
    }
    return fmin(1, product);
}

/*
 * An upper bound on the sum of L_i max(0, r . l_i)^n. If l_i is the light closest to r, then the angle
 * between r and any other light is at least half of the angle between that light and l_i; and cos^2 of half
 * an angle is (1 + cos) / 2.
 */
static double most_specular(const struct box_lights *box_lights, double shininess, unsigned c)
{
    double most = 0;
    if (!box_lights->paired || !(shininess >= 1)) return vec_component(&box_lights->sum, c);
    uint32_t n = box_lights->count, squares = (uint32_t)(fmin(shininess, 0x1p30) / 2);
    for (uint32_t i = 0; i < n; i++) {
        double sum = 0;
        for (uint32_t j = 0; j < n; j++)
            sum += vec_component(&box_lights->share[j], c) *
                   power_above((1 + box_lights->cosine[i * n + j]) / 2, squares);
        most = fmax(most, sum);
    }
    most *= vec_component(&box_lights->strongest, c) * (1 + (n + 8) * UNIT_ROUNDOFF);
    return fmin(vec_component(&box_lights->diffuse, c), most);
}

bool radiance_light_grows(const struct scene *scene)
{
    const struct material *materials = scene_materials(scene);
    if (!scene->view.shadows) return false;
    for (uint64_t i = 0; i < scene->materials.count; i++)
        if (materials[i].transmission * vec_max(materials[i].color) > 1) return true;
    return false;
}

static double direct(const struct box_lights *box_lights, const struct material *material,
                     unsigned c)
{
    double color = vec_component(&material->color, c);
    double sum = material->ambient * color;
    double diffuse = 0, specular = 0;
    if (material->diffuse > 0 && color > 0)
        diffuse = material->diffuse * color * vec_component(&box_lights->diffuse, c);
    if (material->specular > 0)
        specular = material->specular * most_specular(box_lights, material->shininess, c);
    if (diffuse + specular > 0 && box_lights->light_grows) return HUGE_VAL;
    /* The slack covers products and sums, cosines and lobes that exceed 1 by some u, and the sums over the
     * lights. */
    return (sum + diffuse + specular) * (1 + (32 + box_lights->count) * UNIT_ROUNDOFF);
}

struct vec3 box_lights_bound(const struct box_lights *box_lights, const struct material *material)
{
    static const struct box_lights none = {.count = 0};
    if (!material_shows_light(material)) box_lights = &none;
    return vec3(direct(box_lights, material, 0), direct(box_lights, material, 1),
                direct(box_lights, material, 2));
}
