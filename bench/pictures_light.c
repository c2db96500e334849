/* Rows 45-50: highlights, sums of lights, refraction and reflection at a surface. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <mpfr.h>

#include "bench/oracle.h"
#include "bench/pictures.h"
#include "common/clock.h"
#include "worker/color_sum.h"
#include "worker/optics.h"
#include "worker/shade.h"

/* Bits of the oracle where no exact sign is asked for. */
#define BITS 320

#define ROUND MPFR_RNDN

/* Numbers of one block's oracle. */
struct numbers {
    mpfr_t v[3], n[3], l[3], r[3]; /* view, normal, to light, mirrored */
    mpfr_t a, b, c, d;
};

static void numbers_init(struct numbers *x)
{
    for (int i = 0; i < 3; i++)
        mpfr_inits2(BITS, x->v[i], x->n[i], x->l[i], x->r[i], (mpfr_ptr)NULL);
    mpfr_inits2(BITS, x->a, x->b, x->c, x->d, (mpfr_ptr)NULL);
}

static void numbers_clear(struct numbers *x)
{
    for (int i = 0; i < 3; i++)
        mpfr_clears(x->v[i], x->n[i], x->l[i], x->r[i], (mpfr_ptr)NULL);
    mpfr_clears(x->a, x->b, x->c, x->d, (mpfr_ptr)NULL);
}

/* Relative, in units of 1; 0 for 0 and 0. */
static double relative_error(double value, mpfr_t truth)
{
    return roundoffs(value, truth) * 0x1p-53;
}

/* A unit normal and a unit view that arrives at it with this cosine, up to rounding. */
static void meeting(struct random *random, double cosine, struct vec3 *view, struct vec3 *normal)
{
    struct vec3 u, v;
    *normal = random_unit(random);
    random_frame(random, *normal, &u, &v);
    struct vec3 across = vec_scale(u, sqrt((1 - cosine) * (1 + cosine)));
    *view = vec_normalize(vec_add_scaled(across, *normal, -cosine));
}

/* ---- 45 ---- */

/* r = 2 (l.n) n / n.n - l; d = cos b = -v.r / (|v| |r|) */
static void exact_cosine(struct numbers *x, struct vec3 view, struct vec3 normal, struct vec3 light)
{
    real_set(x->v, view);
    real_set(x->n, normal);
    real_set(x->l, light);
    real_dot(x->a, x->l, x->n);
    real_dot(x->b, x->n, x->n);
    mpfr_div(x->a, x->a, x->b, ROUND);
    mpfr_mul_ui(x->a, x->a, 2, ROUND);
    for (int i = 0; i < 3; i++) {
        mpfr_mul(x->r[i], x->n[i], x->a, ROUND);
        mpfr_sub(x->r[i], x->r[i], x->l[i], ROUND);
    }
    real_dot(x->a, x->v, x->v);
    real_dot(x->b, x->r, x->r);
    mpfr_mul(x->a, x->a, x->b, ROUND);
    mpfr_sqrt(x->a, x->a, ROUND);
    real_dot(x->d, x->v, x->r);
    mpfr_div(x->d, x->d, x->a, ROUND);
    mpfr_neg(x->d, x->d, ROUND);
}

/* A light whose mirrored direction misses the eye by such an angle. */
static struct vec3 light_near_mirror(struct random *random, struct vec3 view, struct vec3 normal,
                                     double angle)
{
    struct vec3 u, v, to_eye = vec_neg(view);
    struct vec3 mirrored = vec_add_scaled(vec_neg(to_eye), normal, 2 * vec_dot(to_eye, normal));
    mirrored = vec_normalize(mirrored);
    random_frame(random, mirrored, &u, &v);
    return vec_normalize(vec_add_scaled(vec_scale(mirrored, cos(angle)), u, sin(angle)));
}

/* In units of what is allowed: 1e-14 above 1e-12, 5e-13 above 1e-300. */
static double lobe_error(double value, mpfr_t truth)
{
    double size = mpfr_get_d(truth, ROUND);
    if (size < 1e-300) return value < 1e-299 ? 0 : HUGE_VAL;
    return relative_error(value, truth) / (size > 1e-12 ? 1e-14 : 5e-13);
}

static void compare_lobes(struct block *block, const void *context)
{
    (void)context;
    struct numbers x;
    struct random *random = &block->random;
    numbers_init(&x);
    for (uint64_t i = 0; i < block->count; i++) {
        double n = random_log(random, 1, 1e9);
        struct vec3 view, normal;
        meeting(random, random_between(random, 0.05, 1), &view, &normal);
        /* exp(-n angle^2 / 2) from 1 down to about 1e-300 */
        double angle = fmin(sqrt(2 * random_between(random, 0, 690) / n), 1.5);
        struct vec3 light = light_near_mirror(random, view, normal, angle);
        exact_cosine(&x, view, normal, light);
        if (mpfr_sgn(x.d) <= 0) continue;
        mpfr_set_d(x.c, n, ROUND);
        mpfr_pow(x.d, x.d, x.c, ROUND);
        double ours = phong_lobe(view, normal, light, n);
        double paper = naive_phong_lobe(view, normal, light, n);
        score_error(&block->tally->ours, lobe_error(ours, x.d), block->first + i);
        score_error(&block->tally->paper, lobe_error(paper, x.d), block->first + i);
        block->tally->samples++;
    }
    numbers_clear(&x);
}

/* ---- 46 ---- */

#define LOBES 512

static double lobe_time(const struct vec3 (*at)[3], double n, double *sum)
{
    double start = clock_wall();
    for (int i = 0; i < LOBES; i++)
        *sum += phong_lobe(at[i][0], at[i][1], at[i][2], n);
    return clock_wall() - start;
}

static uint64_t wrong_ends(struct random *random,
                           double (*lobe)(struct vec3, struct vec3, struct vec3, double))
{
    struct vec3 view, normal;
    uint64_t wrong = 0;
    meeting(random, random_between(random, 0.05, 0.999), &view, &normal);
    struct vec3 bright = light_near_mirror(random, view, normal, 1e-3);
    struct vec3 behind = light_near_mirror(random, view, normal, random_between(random, 1.6, 3.1));
    wrong += lobe(view, normal, bright, 0) != 1; /* cos^0 */
    wrong += lobe(view, normal, behind, 0) != 0; /* nothing from behind, whatever n */
    wrong += lobe(view, normal, behind, 20) != 0;
    wrong += lobe(view, normal, behind, 1e9) != 0;
    double faint = lobe(view, normal, bright, 1e12); /* e^-5e5 */
    wrong += !(faint >= 0 && faint < 1e-300);
    return wrong;
}

/* The loader refuses an infinite exponent, so that the kernel never meets one. */
static bool infinite_refused(void)
{
    struct builder *builder = builder_create();
    struct material material = {.ior = 1.5, .shininess = HUGE_VAL};
    uint32_t index;
    bool refused = builder_add_material(builder, &material, &index) != NULL;
    material.shininess = (double)NAN;
    refused = refused && builder_add_material(builder, &material, &index) != NULL;
    builder_destroy(builder);
    return refused;
}

static void run_phong_ends(const struct budget *budget, struct case_result *result)
{
    static struct vec3 normal_case[LOBES][3], faint_case[LOBES][3];
    struct random random = random_seeded(46, 0);
    uint64_t wrong = !infinite_refused(), paper = 0;
    for (uint64_t i = 0; i < budget->rays; i++) {
        struct random same = random;
        wrong += wrong_ends(&random, phong_lobe);
        paper += wrong_ends(&same, naive_phong_lobe);
    }
    for (int i = 0; i < LOBES; i++) {
        meeting(&random, 0.7, &normal_case[i][0], &normal_case[i][1]);
        memcpy(faint_case[i], normal_case[i], sizeof faint_case[i]);
        struct vec3 view = normal_case[i][0], normal = normal_case[i][1];
        normal_case[i][2] = light_near_mirror(&random, view, normal, 0.1);
        faint_case[i][2] = light_near_mirror(&random, view, normal, 1);
    }
    double sum = 0;
    /* The fastest of many rounds in turn: what disturbs a round only makes it slower. */
    double plain_s = HUGE_VAL, faint_s = HUGE_VAL;
    for (int round = 0; round < 1000; round++) {
        plain_s = fmin(plain_s, lobe_time(normal_case, 100, &sum));
        faint_s = fmin(faint_s, lobe_time(faint_case, 1e6, &sum));
    }
    snprintf(result->paper, sizeof result->paper, "%llu wrong", (unsigned long long)paper);
    snprintf(result->ours, sizeof result->ours, "%llu wrong, %.2f x the time",
             (unsigned long long)wrong, faint_s / plain_s);
    picture_verdict(result, budget->rays * 5,
                    wrong + (!(faint_s <= 1.05 * plain_s) || !(sum >= 0)));
}

/* ---- 47 ---- */

static void compare_sums(struct block *block, const void *context)
{
    (void)context;
    mpfr_t sum;
    mpfr_init2(sum, BITS);
    for (uint64_t i = 0; i < block->count; i++) {
        struct color_sum ours = {{0, 0, 0}, {0, 0, 0}};
        double paper = 0;
        uint64_t terms = 2 + random_below(&block->random, 60);
        mpfr_set_zero(sum, 1);
        for (uint64_t k = 0; k < terms; k++) {
            double size = random_bits(&block->random) & 1 ? 1e30 : 1e-30;
            double term = size * random_between(&block->random, 0, 1);
            if (k % 3 == 2) term = random_log(&block->random, 1e-30, 1e30);
            color_sum_add(&ours, vec3(term, 0, 0));
            paper += term;
            mpfr_add_d(sum, sum, term, ROUND);
        }
        double value = color_sum_value(&ours).x;
        score_error(&block->tally->ours, roundoffs(value, sum), block->first + i);
        score_error(&block->tally->paper, roundoffs(paper, sum), block->first + i);
        block->tally->samples++;
    }
    mpfr_clear(sum);
}

/* Values of a picture under lights of 2^k times the strength that are not 2^k times as bright. */
static uint64_t scaled_lights(int step)
{
    const char *const size[] = {"image.width=32",
                                "image.height=24",
                                "sampling.samples=1",
                                "render.cutoff=0",
                                "render.max_depth=4",
                                "background.color=0 0 0",
                                NULL};
    struct scene *scene = picture_load("test/data/everything.ini", size);
    struct material *materials = (struct material *)((char *)scene + scene->materials.offset);
    struct light *lights = (struct light *)((char *)scene + scene->lights.offset);
    for (uint64_t i = 0; i < scene->materials.count; i++)
        materials[i].ambient = 0;
    struct picture plain = picture_render(scene);
    uint64_t wrong = 0;
    for (int k = -60; k <= 60; k += step) {
        struct vec3 before[16];
        for (uint64_t i = 0; i < scene->lights.count && i < 16; i++) {
            before[i] = lights[i].color;
            lights[i].color = vec_scale(lights[i].color, ldexp(1, k));
        }
        struct picture picture = picture_render(scene);
        for (size_t i = 0; i < (size_t)plain.width * plain.height * 3; i++)
            wrong += picture.rgb[i] != ldexpf(plain.rgb[i], k);
        picture_free(&picture);
        for (uint64_t i = 0; i < scene->lights.count && i < 16; i++)
            lights[i].color = before[i];
    }
    picture_free(&plain);
    free(scene);
    return wrong;
}

static void run_light_sums(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 47, budget->rays, compare_sums, NULL, &tally);
    tally.ours.wrong = scaled_lights(budget->quick ? 40 : 1);
    conclude(result, &tally, "u", 4);
}

/* ---- 48 ---- */

static bool same_bits(struct vec3 a, struct vec3 b)
{
    return memcmp(&a, &b, sizeof a) == 0;
}

static void pass_equal(struct block *block, const void *context)
{
    (void)context;
    for (uint64_t i = 0; i < block->count; i++) {
        struct vec3 view, normal, direction;
        double ior = random_between(&block->random, 0.2, 5);
        meeting(&block->random, random_log(&block->random, 1e-12, 1), &view, &normal);
        struct shading_point at = {.view = view, .geometric = normal, .normal = normal};
        bool passed = refract(&at, ior, ior, &direction);
        if (!passed || !same_bits(direction, view))
            score_wrong(&block->tally->ours, block->first + i);
        passed = naive_snell(view, normal, ior / ior, &direction);
        if (!passed || !same_bits(direction, view))
            score_wrong(&block->tally->paper, block->first + i);
        block->tally->samples++;
    }
}

/* ---- 49 ---- */

/* k = 1 - (from / to)^2 (1 - c^2), times to^2: from^2 c^2 + to^2 - from^2, a sum without rounding.
 */
static void exact_k(mpfr_t k, mpfr_t other, double from, double to, double cosine)
{
    mpfr_set_d(k, from, ROUND);
    mpfr_mul_d(k, k, cosine, ROUND);
    mpfr_sqr(k, k, ROUND);
    mpfr_set_d(other, to, ROUND);
    mpfr_sqr(other, other, ROUND);
    mpfr_add(k, k, other, ROUND);
    mpfr_set_d(other, from, ROUND);
    mpfr_sqr(other, other, ROUND);
    mpfr_sub(k, k, other, ROUND);
    mpfr_set_d(other, to, ROUND);
    mpfr_sqr(other, other, ROUND);
    mpfr_div(k, k, other, ROUND);
}

static void snell_case(struct random *random, double *from, double *to, double *cosine)
{
    *from = random_between(random, 1, 2);
    switch (random_below(random, 4)) {
    case 0:
        *to = *from * (1 + random_signed(random, 1e-7 * random_between(random, 0, 1)));
        break;
    case 1:
        *to = *from * 1e3;
        break;
    case 2:
        *to = *from * 1e-3;
        break;
    default:
        *to = *from * random_between(random, 0.4, 2.5);
        break;
    }
    *cosine = random_log(random, 1e-12, 1);
    if (*from > *to && random_bits(random) & 1) {
        /* the critical angle +- 1e-12, down to the last bit */
        double ratio = *to / *from;
        *cosine = sqrt((1 - ratio) * (1 + ratio)) *
                  (1 + random_signed(random, random_log(random, 1e-17, 1e-12)));
    }
}

static void compare_k(struct block *block, const void *context)
{
    (void)context;
    mpfr_t k, other;
    mpfr_inits2(2048, k, other, (mpfr_ptr)NULL);
    for (uint64_t i = 0; i < block->count; i++) {
        double from, to, cosine;
        snell_case(&block->random, &from, &to, &cosine);
        exact_k(k, other, from, to, cosine);
        double ours = snell_k(from, to, cosine), paper = naive_snell_k(from / to, cosine);
        bool total = mpfr_sgn(k) < 0;
        if ((ours < 0) != total) score_wrong(&block->tally->ours, block->first + i);
        if ((paper < 0) != total) score_wrong(&block->tally->paper, block->first + i);
        score_error(&block->tally->ours, relative_error(ours, k), block->first + i);
        score_error(&block->tally->paper, relative_error(paper, k), block->first + i);
        block->tally->samples++;
    }
    mpfr_clears(k, other, (mpfr_ptr)NULL);
}

/* ---- 50 ---- */

/* | |r| - 1 | in u; a direction below the surface is wrong. */
static void score_mirror(struct numbers *x, struct score *score, struct vec3 direction,
                         struct vec3 normal, uint64_t sample)
{
    real_set(x->r, direction);
    real_set(x->n, normal);
    real_dot(x->a, x->r, x->n);
    if (mpfr_sgn(x->a) < 0) score_wrong(score, sample);
    real_dot(x->b, x->r, x->r);
    mpfr_sqrt(x->b, x->b, ROUND);
    mpfr_sub_ui(x->b, x->b, 1, ROUND);
    score_error(score, fabs(mpfr_get_d(x->b, ROUND)) * 0x1p53, sample);
}

static void graze(struct block *block, const void *context)
{
    (void)context;
    struct numbers x;
    numbers_init(&x);
    for (uint64_t i = 0; i < block->count; i++) {
        struct vec3 view, normal;
        meeting(&block->random, random_log(&block->random, 1e-16, 1e-8), &view, &normal);
        real_set(x.v, view);
        real_set(x.n, normal);
        real_dot(x.a, x.v, x.n);
        if (mpfr_sgn(x.a) > 0) normal = vec_neg(normal); /* rounded to the far side */
        score_mirror(&x, &block->tally->ours, mirror(view, normal), normal, block->first + i);
        score_mirror(&x, &block->tally->paper, naive_mirror(view, normal), normal,
                     block->first + i);
        block->tally->samples++;
    }
    numbers_clear(&x);
}

const struct stability_case light_cases[] = {
    {45, "Phong, n = 1 .. 1e9", "MPFR", "<= 1e-14; <= 5e-13 below 1e-12", .work = compare_lobes,
     .unit = "x allowed", .limit = 1},
    {46, "Phong, n = 0, infinite, cos b <= 0, underflow", "closed form", "no NaN, <= 1.05 x time",
     .run = run_phong_ends},
    {47, "lights of 1e30 and 1e-30; light x 2^k", "MPFR, self", "<= 4 u; bitwise",
     .run = run_light_sums},
    {48, "refraction between equal media", "closed form", "direction bitwise", .work = pass_equal},
    {49, "eta 1+1e-7, 1e+-3, critical +-1e-12", "MPFR", "k <= 1e-15; total reflection exact",
     .work = compare_k, .unit = "relative", .limit = 1e-15},
    {50, "reflection at grazing 1e-12", "MPFR", "r.n >= 0, |r| - 1 <= 2 u", .work = graze,
     .unit = "u of |r| - 1", .limit = 2},
    {.number = 0},
};
