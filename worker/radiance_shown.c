#include <stdlib.h>

#include "common/message.h"
#include "worker/exact.h"
#include "worker/radiance.h"

/* With more lights the plain sum is used, since all subsets of them are examined. */
#define PAIRED_LIGHTS 6

/* If the sine of a beam's half angle exceeds this, the box is so close to the light that light may come from
 * anywhere. */
#define SINE_MAX 0.99

/* Error of cosines and sines of angles < pi, and of their sums and products. */
#define COSINE_ERROR (64 * UNIT_ROUNDOFF)

/* The directions in which a light is seen from a box: a cone, or all directions. */
struct beam {
    struct vec3 axis; /* unit */
    double sine, cosine;
    bool all;
};

static struct beam beam_of(const struct light *light, struct vec3 center, double radius)
{
    struct vec3 way = vec_sub(light->position, center);
    double distance = vec_length(way);
    struct beam beam = {.all = true};
    if (!isfinite(distance) || !(radius < SINE_MAX * distance)) return beam;
    beam.sine = radius / distance * (1 + COSINE_ERROR) + COSINE_ERROR;
    if (beam.sine > SINE_MAX) return beam;
    beam.cosine = sqrt(1 - beam.sine * beam.sine);
    beam.axis = vec_normalize(way);
    beam.all = false;
    return beam;
}

/* The largest cosine of the angle between a direction of one beam and one of the other. */
static double closest(const struct beam *a, const struct beam *b)
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

static void pair_beams(struct beams *beams, const struct scene *scene, struct vec3 center,
                       double radius)
{
    const struct light *lights = scene_lights(scene);
    struct beam cone[PAIRED_LIGHTS];
    beams->share = allocate(beams->count, sizeof *beams->share);
    beams->cosine = allocate((size_t)beams->count * beams->count, sizeof *beams->cosine);
    uint32_t n = 0;
    for (uint64_t i = 0; i < scene->lights.count; i++) {
        struct vec3 color = lights[i].color, most = beams->strongest;
        if (vec_is_zero(color)) continue;
        beams->share[n] =
            vec3(share_of(color.x, most.x), share_of(color.y, most.y), share_of(color.z, most.z));
        cone[n++] = beam_of(&lights[i], center, radius);
    }
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < n; j++)
            beams->cosine[i * n + j] = i == j ? 1 : closest(&cone[i], &cone[j]);
}

/* Upper bound on |sum of l_i L_i|^2 over the lights of a bit set, in units of the strongest light. */
static double square_of(const struct beams *beams, unsigned c, uint32_t set)
{
    double square = 0;
    uint32_t n = beams->count;
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < n; j++)
            if (set >> i & set >> j & 1)
                square += vec_component(&beams->share[i], c) * vec_component(&beams->share[j], c) *
                          beams->cosine[i * n + j];
    return square;
}

/*
 * An upper bound on the sum of L_i max(0, n . l_i) over the lights, for any unit n. If S is the set of lights
 * with n . l_i > 0, this is n . sum over S of L_i l_i, which is at most the length of that sum. The square of
 * the length is the sum over all pairs in S of L_i L_j l_i . l_j.
 */
static double most_diffuse(const struct beams *beams, unsigned c)
{
    double sum = vec_component(&beams->sum, c), square = 0;
    if (!beams->paired) return sum;
    uint32_t n = beams->count;
    for (uint32_t set = 1; set < UINT32_C(1) << n; set++)
        square = fmax(square, square_of(beams, c, set));
    double most = vec_component(&beams->strongest, c) * sqrt(square + n * n * COSINE_ERROR);
    return fmin(sum, most * (1 + 8 * UNIT_ROUNDOFF));
}

void beams_init(struct beams *beams, const struct scene *scene, const struct bounds *box,
                bool light_grows)
{
    const struct light *lights = scene_lights(scene);
    *beams = (struct beams){.light_grows = light_grows};
    for (uint64_t i = 0; i < scene->lights.count; i++) {
        struct vec3 color = lights[i].color, *most = &beams->strongest;
        if (vec_is_zero(color)) continue;
        beams->count++;
        beams->sum = vec_add(beams->sum, color);
        *most = vec3(fmax(most->x, color.x), fmax(most->y, color.y), fmax(most->z, color.z));
    }
    beams->sum = vec_scale(beams->sum, 1 + beams->count * UNIT_ROUNDOFF);
    struct vec3 min = {box->min[0], box->min[1], box->min[2]};
    struct vec3 max = {box->max[0], box->max[1], box->max[2]};
    /* Halved first to avoid overflow. */
    struct vec3 half = vec_sub(vec_scale(max, 0.5), vec_scale(min, 0.5));
    struct vec3 center = vec_add(vec_scale(max, 0.5), vec_scale(min, 0.5));
    double radius = vec_length(half) * (1 + COSINE_ERROR);
    beams->paired = beams->count > 1 && beams->count <= PAIRED_LIGHTS && isfinite(radius);
    if (beams->paired) pair_beams(beams, scene, center, radius);
    beams->diffuse = vec3(most_diffuse(beams, 0), most_diffuse(beams, 1), most_diffuse(beams, 2));
}

void beams_free(struct beams *beams)
{
    free(beams->share);
    free(beams->cosine);
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
static double most_specular(const struct beams *beams, double shininess, unsigned c)
{
    double most = 0;
    if (!beams->paired || !(shininess >= 1)) return vec_component(&beams->sum, c);
    uint32_t n = beams->count, squares = (uint32_t)(fmin(shininess, 0x1p30) / 2);
    for (uint32_t i = 0; i < n; i++) {
        double sum = 0;
        for (uint32_t j = 0; j < n; j++)
            sum += vec_component(&beams->share[j], c) *
                   power_above((1 + beams->cosine[i * n + j]) / 2, squares);
        most = fmax(most, sum);
    }
    most *= vec_component(&beams->strongest, c) * (1 + (n + 8) * UNIT_ROUNDOFF);
    return fmin(vec_component(&beams->diffuse, c), most);
}

bool radiance_light_grows(const struct scene *scene)
{
    const struct material *materials = scene_materials(scene);
    if (!scene->view.shadows) return false;
    for (uint64_t i = 0; i < scene->materials.count; i++)
        if (materials[i].transmission * vec_max(materials[i].color) > 1) return true;
    return false;
}

static double shown(const struct beams *beams, const struct material *material, unsigned c)
{
    double color = vec_component(&material->color, c);
    double sum = material->ambient * color;
    double diffuse = 0, specular = 0;
    if (material->diffuse > 0 && color > 0)
        diffuse = material->diffuse * color * vec_component(&beams->diffuse, c);
    if (material->specular > 0)
        specular = material->specular * most_specular(beams, material->shininess, c);
    if (diffuse + specular > 0 && beams->light_grows) return HUGE_VAL;
    /* The slack covers products and sums, cosines and lobes that exceed 1 by some u, and the sums over the
     * lights. */
    return (sum + diffuse + specular) * (1 + (32 + beams->count) * UNIT_ROUNDOFF);
}

struct vec3 radiance_shown(const struct beams *beams, const struct material *material)
{
    static const struct beams none = {.count = 0};
    if (!material_shows_light(material)) beams = &none;
    return vec3(shown(beams, material, 0), shown(beams, material, 1), shown(beams, material, 2));
}
