/* Rows 5-7: rays that touch a sphere exactly, or start on it. */
#include "bench/stability_sphere.h"

/* ---- rows 5, 6: exactly at the tangent ---- */

/* Pairs of orthogonal integer vectors of the same integer length: frames that need no roots. */
static const struct {
    struct vec3 along, across;
    double length;
} frames[] = {
    {{3, 4, 0}, {-4, 3, 0}, 5},    {{1, 2, 2}, {2, 1, -2}, 3},  {{2, 3, 6}, {3, -6, 2}, 7},
    {{5, 12, 0}, {12, -5, 0}, 13}, {{1, 4, 8}, {4, 7, -4}, 9},  {{6, 2, -3}, {2, 3, 6}, 7},
    {{1, 0, 0}, {0, 1, 0}, 1},     {{2, 6, 9}, {6, 7, -6}, 11}, {{0, 0, 1}, {1, 0, 0}, 1},
};

static struct vec3 turned(struct vec3 v, uint64_t turn)
{
    double s[3] = {turn & 1 ? -1 : 1, turn & 2 ? -1 : 1, turn & 4 ? -1 : 1};
    v = vec3(v.x * s[0], v.y * s[1], v.z * s[2]);
    if (turn & 8) v = vec3(v.y, v.x, v.z);
    switch (turn >> 4 & 3) {
    case 1:
        return vec3(v.y, v.z, v.x);
    case 2:
        return vec3(v.z, v.x, v.y);
    default:
        return v;
    }
}

/* Tests rays that touch the sphere at exactly t = steps. A hit that is missed or has another t is wrong. */
static void tangent_block(struct block *block, const void *context)
{
    (void)context;
    struct random *random = &block->random;
    for (uint64_t i = 0; i < block->count; i++) {
        uint64_t which = random_below(random, sizeof frames / sizeof *frames);
        uint64_t turn = random_bits(random);
        double multiple = 1 + (double)random_below(random, 1 << 16);
        double steps = 1 + (double)random_below(random, 1 << 16);
        struct vec3 along = turned(frames[which].along, turn);
        struct vec3 across = turned(frames[which].across, turn);
        struct sphere sphere = {.center = integer_point(random, 1 << 24),
                                .radius = multiple * frames[which].length};
        struct vec3 contact = vec_add_scaled(sphere.center, across, multiple);
        struct ray ray = stage_ray(vec_add_scaled(contact, along, -steps), along);
        struct stage stage = sphere_stage(&sphere);
        struct hit ours = stage_nearest(&stage, stage.ours, &ray, &block->tally->fallbacks);
        struct hit paper = stage_nearest(&stage, stage.paper, &ray, NULL);
        if (ours.t != steps) score_wrong(&block->tally->ours, block->first + i);
        if (paper.t != steps) score_wrong(&block->tally->paper, block->first + i);
        block->tally->samples++;
        stage_free(&stage);
    }
}

/* A sphere around the origin. On either side of its radius there are at least 64 doubles in the same binade. */
static struct sphere centred_sphere(struct random *random)
{
    double mantissa = random_between(random, 1.001, 1.999);
    int exponent = (int)random_below(random, 41) - 20;
    return (struct sphere){.center = vec3(0, 0, 0), .radius = ldexp(mantissa, exponent)};
}

/* A ray whose line is at exactly r + k ulp(r) from the centre: it goes through the point at that distance on an axis,
 * in a direction orthogonal to the axis. */
static struct ray aim_rim(struct random *random, const struct sphere *sphere)
{
    double ulp = nextafter(sphere->radius, HUGE_VAL) - sphere->radius;
    double k = (double)random_below(random, 129) - 64;
    double offset = random_sign(random) * (sphere->radius + k * ulp);
    double angle = random_between(random, 0, 2 * acos(-1));
    double x = cos(angle), y = sin(angle);
    double steps = sphere->radius > 1 ? -0x1p22 : -4;
    switch (random_below(random, 3)) {
    case 0:
        return stage_ray(vec3(offset, steps * x, steps * y), vec3(0, x, y));
    case 1:
        return stage_ray(vec3(steps * y, offset, steps * x), vec3(y, 0, x));
    default:
        return stage_ray(vec3(steps * x, steps * y, offset), vec3(x, y, 0));
    }
}

/* ---- row 7: from the sphere itself ---- */

static struct ray leave_sphere(struct random *random, const struct sphere *sphere)
{
    struct vec3 n = random_unit(random), u, v;
    struct vec3 direction = random_unit(random);
    if (random_bits(random) >> 63) { /* close to the tangent plane */
        random_frame(random, n, &u, &v);
        double tilt = random_signed(random, exp2(-random_between(random, 1, 60)));
        direction = vec_normalize(vec_add_scaled(u, n, tilt));
    }
    struct ray ray = stage_ray(vec_add_scaled(sphere->center, n, sphere->radius), direction);
    ray.from = primitive_id(PRIMITIVE_SPHERE, 0);
    return ray;
}

/* For a ray that names the sphere as the surface that it starts on: c is 0, however its origin was rounded, and the
 * roots are 0 and 2 b / a. */
static void solve_leaving(struct sphere_truth *truth, const struct sphere *sphere,
                          const struct ray *ray)
{
    mpfr_t *real = truth->real;
    solve_exactly(real, sphere, ray);
    truth->first = mpfr_sgn(real[B]) > 0 ? 1 : -1;
    mpfr_div(real[T1], real[B], real[A], MPFR_RNDN);
    mpfr_mul_2ui(real[T1], real[T1], 1, MPFR_RNDN);
}

/* An integer point on an integer sphere, which the ray does not name. */
static struct ray start_on_integers(struct random *random, struct sphere *sphere)
{
    uint64_t which = random_below(random, sizeof frames / sizeof *frames);
    uint64_t turn = random_bits(random);
    double multiple = 1 + (double)random_below(random, 1 << 16);
    sphere->center = integer_point(random, 1 << 24);
    sphere->radius = multiple * frames[which].length;
    struct vec3 p = vec_add_scaled(sphere->center, turned(frames[which].across, turn), multiple);
    return stage_ray(p, random_unit(random));
}

static void leaving_block(struct block *block, const void *context)
{
    (void)context;
    struct sphere_truth truth;
    reals_init(truth.real, SPHERE_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        struct sphere sphere = any_sphere(&block->random);
        bool named = i % 2 == 0;
        struct ray ray = named ? leave_sphere(&block->random, &sphere)
                               : start_on_integers(&block->random, &sphere);
        struct stage stage = sphere_stage(&sphere);
        if (named)
            solve_leaving(&truth, &sphere, &ray);
        else
            solve_sphere(&truth, &sphere, &ray);
        compare_to_truth(&stage, &ray, &truth, ulps, block->tally, block->first + i);
        stage_free(&stage);
    }
    reals_clear(truth.real, SPHERE_REALS);
}

const struct stability_case tangent_cases[] = {
    {5, "exact tangency, integer data", "rationals", "closed hit, t exact", .work = tangent_block},
    {6, "offset r + k ulp, |k| <= 64", "rationals", "hit or miss exact", .work = sphere_block,
     .context = &(const struct sphere_row){centred_sphere, aim_rim, ulps}, .limit = HUGE_VAL},
    {7, "origin exactly on the sphere", "closed form", "out: none; in: 2b/a <= 2 ulp",
     .work = leaving_block, .unit = "ulp", .limit = 2},
    {.number = 0},
};
