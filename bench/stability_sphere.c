/* Rows 1-12: spheres, against MPFR. */
#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "bench/oracle.h"
#include "bench/stability.h"
#include "common/message.h"
#include "master/load.h"

/* Rays of one sphere: a scene is made once for so many. */
#define RAYS_PER_SCENE 32

/* ---- the oracle ---- */

enum { F, D = F + 3, A = D + 3, B, C, DISC, ROOT, T0, T1, PART, SPHERE_REALS };

/* The first crossing at t > 0 of the exact line through the exact sphere. */
struct sphere_truth {
    mpfr_t real[SPHERE_REALS];
    int first; /* 0 or 1: the root T0 or T1; -1: none */
};

/* A, B, C and the discriminant without rounding, so that their signs are those of the inputs. */
static void solve_exactly(mpfr_t *real, const struct sphere *sphere, const struct ray *ray)
{
    oracle_exact_begin();
    real_difference(&real[F], ray->origin, sphere->center);
    real_set(&real[D], ray->direction);
    real_dot(real[A], &real[D], &real[D]);
    real_dot(real[B], &real[F], &real[D]);
    mpfr_neg(real[B], real[B], MPFR_RNDN);
    real_dot(real[C], &real[F], &real[F]);
    mpfr_set_d(real[PART], sphere->radius, MPFR_RNDN);
    mpfr_sqr(real[PART], real[PART], MPFR_RNDN);
    mpfr_sub(real[C], real[C], real[PART], MPFR_RNDN);
    mpfr_fmms(real[DISC], real[B], real[B], real[A], real[C], MPFR_RNDN);
    oracle_exact_end();
}

static void solve_sphere(struct sphere_truth *truth, const struct sphere *sphere,
                         const struct ray *ray)
{
    mpfr_t *real = truth->real;
    solve_exactly(real, sphere, ray);
    truth->first = -1;
    if (mpfr_sgn(real[DISC]) < 0) return;
    mpfr_sqrt(real[ROOT], real[DISC], MPFR_RNDN);
    mpfr_sub(real[T0], real[B], real[ROOT], MPFR_RNDN);
    mpfr_add(real[T1], real[B], real[ROOT], MPFR_RNDN);
    mpfr_div(real[T0], real[T0], real[A], MPFR_RNDN);
    mpfr_div(real[T1], real[T1], real[A], MPFR_RNDN);
    if (mpfr_sgn(real[B]) > 0 && mpfr_sgn(real[C]) > 0)
        truth->first = 0;
    else if (mpfr_sgn(real[C]) < 0 || mpfr_sgn(real[B]) > 0)
        truth->first = 1;
}

/* ---- a case: spheres, rays to them, the kernel and the oracle ---- */

struct sphere_row {
    int number;
    struct sphere (*draw)(struct random *random);
    struct ray (*aim)(struct random *random, const struct sphere *sphere);
    double (*error)(double value, mpfr_t truth);
    const char *unit;
    double limit;
};

static void compare(struct score *score, const struct hit *hit, struct sphere_truth *truth,
                    double (*error)(double, mpfr_t), uint64_t sample)
{
    bool met = hit->primitive != PRIMITIVE_NONE;
    if (met != (truth->first >= 0))
        score_wrong(score, sample);
    else if (met)
        score_error(score, error(hit->t, truth->real[T0 + truth->first]), sample);
}

static struct stage sphere_stage(const struct sphere *sphere)
{
    struct builder *builder = builder_create();
    stage_sphere(builder, sphere->center, sphere->radius);
    return stage_finish(builder, NULL);
}

static void sphere_block(struct block *block, const void *context)
{
    const struct sphere_row *row = context;
    struct tally *tally = block->tally;
    struct sphere_truth truth;
    struct sphere sphere = {.radius = 1};
    struct stage stage = {NULL, NULL, NULL};
    reals_init(truth.real, SPHERE_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            sphere = row->draw(&block->random);
            stage = sphere_stage(&sphere);
        }
        struct ray ray = row->aim(&block->random, &sphere);
        struct hit ours = stage_nearest(&stage, stage.ours, &ray, &tally->fallbacks);
        struct hit paper = stage_nearest(&stage, stage.paper, &ray, NULL);
        solve_sphere(&truth, &sphere, &ray);
        compare(&tally->ours, &ours, &truth, row->error, block->first + i);
        compare(&tally->paper, &paper, &truth, row->error, block->first + i);
        tally->samples++;
    }
    stage_free(&stage);
    reals_clear(truth.real, SPHERE_REALS);
}

static void run_sphere_row(const struct budget *budget, struct case_result *result,
                           const struct sphere_row *row)
{
    struct tally tally = {.samples = 0};
    share(budget, row->number, budget->rays, sphere_block, row, &tally);
    conclude(result, &tally, row->unit, row->limit);
}

/* ---- rows 1, 2, 8, 9: seen from a distance ---- */

static struct sphere any_sphere(struct random *random)
{
    double r = random_log(random, 0.1, 10);
    return (struct sphere){.center = vec_scale(random_unit(random), random_between(random, 0, 20)),
                           .radius = r};
}

/* A ray that passes the centre at `offset`, up to rounding, from the given distance. */
static struct ray ray_past(struct random *random, const struct sphere *sphere, double distance,
                           double offset)
{
    struct vec3 toward = random_unit(random), u, v;
    random_frame(random, toward, &u, &v);
    double sine = fmin(offset / distance, 1), cosine = sqrt((1 - sine) * (1 + sine));
    struct vec3 direction = vec_add_scaled(vec_scale(toward, cosine), u, sine);
    return stage_ray(vec_add_scaled(sphere->center, toward, -distance), vec_normalize(direction));
}

/* Of radius 1: half of the rays well inside or outside, half close to the tangent, on both sides.
 */
static double any_offset(struct random *random)
{
    if (random_bits(random) >> 63) return random_between(random, 0, 1.2);
    return 1 + random_sign(random) * exp2(-random_between(random, 2, 52));
}

static struct ray aim_near(struct random *random, const struct sphere *sphere)
{
    double distance = sphere->radius * random_between(random, 2, 100);
    return ray_past(random, sphere, distance, sphere->radius * any_offset(random));
}

static struct ray aim_far(struct random *random, const struct sphere *sphere)
{
    double distance = sphere->radius * random_log(random, 1e3, 1e14);
    return ray_past(random, sphere, distance, sphere->radius * any_offset(random));
}

static void run_1(const struct budget *budget, struct case_result *result)
{
    run_sphere_row(budget, result, &(struct sphere_row){1, any_sphere, aim_near, ulps, "ulp", 2});
}

static void run_2(const struct budget *budget, struct case_result *result)
{
    run_sphere_row(budget, result, &(struct sphere_row){2, any_sphere, aim_far, ulps, "ulp", 2});
}

static struct sphere extreme_sphere(struct random *random)
{
    double r = random_bits(random) >> 63 ? 1e150 : 1e-150;
    return (struct sphere){
        .center = vec_scale(random_unit(random), r * random_between(random, 0, 2)), .radius = r};
}

static void run_8(const struct budget *budget, struct case_result *result)
{
    run_sphere_row(budget, result,
                   &(struct sphere_row){8, extreme_sphere, aim_near, ulps, "ulp", 2});
}

static struct ray aim_scaled(struct random *random, const struct sphere *sphere)
{
    struct ray ray = aim_near(random, sphere);
    ray.direction = vec_scale(ray.direction, random_log(random, 1e-8, 1e8));
    return ray;
}

/* t of a direction 2^k times as long is 2^-k times as large, bit for bit. */
static void scaling_block(struct block *block, const void *context)
{
    (void)context;
    struct sphere sphere = any_sphere(&block->random);
    struct stage stage = sphere_stage(&sphere);
    for (uint64_t i = 0; i < block->count; i++) {
        struct ray ray = aim_scaled(&block->random, &sphere), scaled = ray;
        int k = (int)random_below(&block->random, 121) - 60;
        scaled.direction = vec_scale(ray.direction, ldexp(1, k));
        const struct scene *scenes[] = {stage.ours, stage.paper};
        struct score *scores[] = {&block->tally->ours, &block->tally->paper};
        for (int which = 0; which < 2; which++) {
            struct hit hit = stage_nearest(&stage, scenes[which], &ray, &block->tally->fallbacks);
            struct hit other =
                stage_nearest(&stage, scenes[which], &scaled, &block->tally->fallbacks);
            if (hit.primitive != other.primitive || hit.t != ldexp(other.t, k))
                score_wrong(scores[which], block->first + i);
        }
        block->tally->samples++;
    }
    stage_free(&stage);
}

static void run_9(const struct budget *budget, struct case_result *result)
{
    struct sphere_row row = {9, any_sphere, aim_scaled, ulps, "ulp", 2};
    struct tally tally = {.samples = 0};
    share(budget, 9, budget->rays, sphere_block, &row, &tally);
    share(budget, 109, budget->rays, scaling_block, NULL, &tally);
    conclude(result, &tally, row.unit, row.limit);
}

/* ---- rows 3, 4: the ground ---- */

/* A ground sphere that passes near the coordinates' origin: the eye's distance from its surface is
 * some 1e-12 of the centre's coordinates. */
static struct sphere ground_sphere(struct random *random)
{
    double r = random_log(random, 1e3, 1e12);
    return (struct sphere){.center = vec_scale(random_unit(random), r), .radius = r};
}

static double horizon_angle(double radius, double height)
{
    return atan2(sqrt(height * (2 * radius + height)), radius);
}

static struct ray ray_down(struct random *random, const struct sphere *sphere, double height,
                           double angle)
{
    struct vec3 up = vec_normalize(vec_neg(sphere->center)), u, v;
    random_frame(random, up, &u, &v);
    struct vec3 direction = vec_add_scaled(vec_scale(u, cos(angle)), up, -sin(angle));
    return stage_ray(vec_scale(up, height), vec_normalize(direction));
}

static struct ray aim_ground(struct random *random, const struct sphere *sphere)
{
    double height = random_between(random, 1, 3);
    double horizon = 1.5 * horizon_angle(sphere->radius, height);
    return ray_down(random, sphere, height, random_log(random, horizon, 0.5 * acos(-1)));
}

static struct ray aim_horizon(struct random *random, const struct sphere *sphere)
{
    double height = random_between(random, 1, 3);
    double factor = 1 + random_log(random, 1e-4, 0.5);
    return ray_down(random, sphere, height, factor * horizon_angle(sphere->radius, height));
}

static void run_3(const struct budget *budget, struct case_result *result)
{
    run_sphere_row(budget, result,
                   &(struct sphere_row){3, ground_sphere, aim_ground, ulps, "ulp", 3});
}

static void run_4(const struct budget *budget, struct case_result *result)
{
    run_sphere_row(budget, result,
                   &(struct sphere_row){4, ground_sphere, aim_horizon, roundoffs, "u", 4});
}

/* ---- rows 5, 6: exactly at the tangent ---- */

/* Orthogonal integer vectors of the same integer length: rational frames without any root. */
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

static struct vec3 integer_vector(struct random *random, uint64_t reach)
{
    double x = (double)random_below(random, 2 * reach) - (double)reach;
    double y = (double)random_below(random, 2 * reach) - (double)reach;
    return vec3(x, y, (double)random_below(random, 2 * reach) - (double)reach);
}

/* Touches at exactly t = steps: wrong when the hit is missed or t is not that very number. */
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
        struct sphere sphere = {.center = integer_vector(random, 1 << 24),
                                .radius = multiple * frames[which].length};
        struct vec3 contact = vec_add_scaled(sphere.center, across, multiple);
        struct ray ray = stage_ray(vec_add_scaled(contact, along, -steps), along);
        struct stage stage = sphere_stage(&sphere);
        struct hit ours = stage_nearest(&stage, stage.ours, &ray, &block->tally->fallbacks);
        ray.direction = along;
        struct hit paper = stage_nearest(&stage, stage.paper, &ray, NULL);
        if (ours.t != steps) score_wrong(&block->tally->ours, block->first + i);
        if (paper.t != steps) score_wrong(&block->tally->paper, block->first + i);
        block->tally->samples++;
        stage_free(&stage);
    }
}

static void run_5(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 5, budget->rays, tangent_block, NULL, &tally);
    conclude(result, &tally, NULL, 0);
}

/* A sphere about the origin with a radius that has 64 neighbours on both sides in its binade. */
static struct sphere centred_sphere(struct random *random)
{
    double mantissa = random_between(random, 1.001, 1.999);
    int exponent = (int)random_below(random, 41) - 20;
    return (struct sphere){.center = vec3(0, 0, 0), .radius = ldexp(mantissa, exponent)};
}

/* A line at exactly r + k ulp(r) from the centre: through that point of one axis, in a direction
 * across that axis. */
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

static void run_6(const struct budget *budget, struct case_result *result)
{
    run_sphere_row(budget, result,
                   &(struct sphere_row){6, centred_sphere, aim_rim, ulps, NULL, HUGE_VAL});
}

/* ---- row 7: from the sphere itself ---- */

static struct ray leave_sphere(struct random *random, const struct sphere *sphere)
{
    struct vec3 n = random_unit(random), u, v;
    struct vec3 direction = random_unit(random);
    if (random_bits(random) >> 63) { /* close to the tangent plane */
        random_frame(random, n, &u, &v);
        double tilt = random_sign(random) * exp2(-random_between(random, 1, 60));
        direction = vec_normalize(vec_add_scaled(u, n, tilt));
    }
    struct ray ray = stage_ray(vec_add_scaled(sphere->center, n, sphere->radius), direction);
    ray.from = primitive_id(PRIMITIVE_SPHERE, 0);
    return ray;
}

/* The ray says that it starts on the sphere, so c is 0 however its origin was rounded: the roots
 * are 0 and 2 b / a. */
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
    sphere->center = integer_vector(random, 1 << 24);
    sphere->radius = multiple * frames[which].length;
    struct vec3 p = vec_add_scaled(sphere->center, turned(frames[which].across, turn), multiple);
    return stage_ray(p, random_unit(random));
}

static void leaving_block(struct block *block, const void *context)
{
    (void)context;
    struct tally *tally = block->tally;
    struct sphere_truth truth;
    reals_init(truth.real, SPHERE_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        struct sphere sphere = any_sphere(&block->random);
        bool named = i % 2 == 0;
        struct ray ray = named ? leave_sphere(&block->random, &sphere)
                               : start_on_integers(&block->random, &sphere);
        struct stage stage = sphere_stage(&sphere);
        struct hit ours = stage_nearest(&stage, stage.ours, &ray, &tally->fallbacks);
        struct hit paper = stage_nearest(&stage, stage.paper, &ray, NULL);
        if (named)
            solve_leaving(&truth, &sphere, &ray);
        else
            solve_sphere(&truth, &sphere, &ray);
        compare(&tally->ours, &ours, &truth, ulps, block->first + i);
        compare(&tally->paper, &paper, &truth, ulps, block->first + i);
        tally->samples++;
        stage_free(&stage);
    }
    reals_clear(truth.real, SPHERE_REALS);
}

static void run_7(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 7, budget->rays, leaving_block, NULL, &tally);
    conclude(result, &tally, "ulp", 2);
}

/* ---- row 10: numbers without a meaning ---- */

/* Scenes that have to be refused, and the line that is at fault. */
static const struct {
    const char *extension, *text;
    int line;
} refused[] = {
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = 0\n", 3},
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = -1\n", 3},
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = -0\n", 3},
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = nan\n", 3},
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = inf\n", 3},
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = -inf\n", 3},
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = 1e999\n", 3},
    {"ini", "[sphere s]\ncenter = 0 nan 0\nradius = 1\n", 2},
    {"ini", "[sphere s]\ncenter = 0 1e400 0\nradius = 1\n", 2},
    {"ini", "[disc d]\ncenter = 0 0 0\nnormal = 0 1 0\nradius = 0\n", 4},
    {"ini", "[disc d]\ncenter = 0 0 0\nnormal = 0 0 0\nradius = 1\n", 1},
    {"ini", "[plane p]\npoint = 0 0 0\nnormal = 0 0 0\n", 1},
    {"ini", "[plane p]\npoint = 0 0 0\nnormal = 0 inf 0\n", 3},
    {"nff", "f 1 1 1 1 0 0 0 1\ns 0 0 0 0\n", 2},
    {"nff", "f 1 1 1 1 0 0 0 1\ns 0 0 0 nan\n", 2},
    {"nff", "f 1 1 1 1 0 0 0 1\ns 0 0 0 inf\n", 2},
    {"nff", "f 1 1 1 1 0 0 0 1\ns 0 1e999 0 1\n", 2},
};

/* Whether loading says one line that begins with "path:line:". */
static bool is_refused(const char *folder, size_t which)
{
    char message[1024] = "";
    char *path = format_text("%s/scene.%s", folder, refused[which].extension);
    FILE *file = fopen(path, "w");
    if (!file || fputs(refused[which].text, file) < 0 || fclose(file) != 0)
        fatal("cannot write %s", path);
    struct job job;
    message_capture(message, sizeof message);
    bool loaded = load_job(path, NULL, 0, REACH_FOLDER, &job);
    message_capture(NULL, 0);
    if (loaded) job_free(&job);
    char *start = format_text("%s:%d:", path, refused[which].line);
    bool good = !loaded && strncmp(message, start, strlen(start)) == 0;
    unlink(path);
    free(start);
    free(path);
    return good;
}

static void run_10(const struct budget *budget, struct case_result *result)
{
    (void)budget;
    char folder[] = "/tmp/stability-XXXXXX";
    struct tally tally = {.samples = 0};
    if (!mkdtemp(folder)) fatal("cannot make a folder for scenes");
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        if (!is_refused(folder, i)) score_wrong(&tally.ours, i);
        tally.samples++;
    }
    rmdir(folder);
    conclude(result, &tally, NULL, 0);
    strcpy(result->paper, "-");
}

/* ---- row 11: normals ---- */

static struct ray aim_for_normal(struct random *random, const struct sphere *sphere)
{
    double distance = sphere->radius * random_log(random, 2, 1e13);
    double offset = random_bits(random) >> 63 ? random_between(random, 0, 1)
                                              : 1 - exp2(-random_between(random, 2, 52));
    return ray_past(random, sphere, distance, sphere->radius * offset);
}

/* |n - (f + t d) / r| / u with the exact t. */
static double normal_error(struct sphere_truth *truth, double radius, struct vec3 normal)
{
    mpfr_t *real = truth->real;
    double n[3] = {normal.x, normal.y, normal.z}, square = 0;
    for (int axis = 0; axis < 3; axis++) {
        mpfr_fma(real[PART], real[T0 + truth->first], real[D + axis], real[F + axis], MPFR_RNDN);
        mpfr_div_d(real[PART], real[PART], radius, MPFR_RNDN);
        mpfr_sub_d(real[PART], real[PART], n[axis], MPFR_RNDN);
        double difference = mpfr_get_d(real[PART], MPFR_RNDN) * 0x1p53;
        square += difference * difference;
    }
    return sqrt(square);
}

static void normal_of(const struct stage *stage, const struct scene *scene, const struct ray *ray,
                      struct sphere_truth *truth, double radius, struct tally *tally,
                      uint64_t sample)
{
    struct score *score = scene == stage->ours ? &tally->ours : &tally->paper;
    struct hit hit = stage_nearest(stage, scene, ray, &tally->fallbacks);
    struct surface surface;
    if ((hit.primitive != PRIMITIVE_NONE) != (truth->first >= 0)) {
        score_wrong(score, sample);
    } else if (truth->first >= 0) {
        surface_at(scene, ray, &hit, &surface);
        score_error(score, normal_error(truth, radius, surface.geometric), sample);
    }
}

static void normal_block(struct block *block, const void *context)
{
    (void)context;
    struct sphere_truth truth;
    reals_init(truth.real, SPHERE_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        struct sphere sphere = any_sphere(&block->random);
        struct ray ray = aim_for_normal(&block->random, &sphere);
        struct stage stage = sphere_stage(&sphere);
        solve_sphere(&truth, &sphere, &ray);
        normal_of(&stage, stage.ours, &ray, &truth, sphere.radius, block->tally, block->first + i);
        normal_of(&stage, stage.paper, &ray, &truth, sphere.radius, block->tally, block->first + i);
        block->tally->samples++;
        stage_free(&stage);
    }
    reals_clear(truth.real, SPHERE_REALS);
}

static void run_11(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 11, budget->rays, normal_block, NULL, &tally);
    conclude(result, &tally, "u", 4);
}

/* ---- row 12: shells ---- */

#define SHELLS 5

/* From the innermost to the outermost, so that the order of ids is not that of distance. */
static struct stage shell_stage(const struct sphere *inner, struct sphere shells[SHELLS])
{
    struct builder *builder = builder_create();
    for (int i = 0; i < SHELLS; i++) {
        shells[i] = *inner;
        shells[i].radius = inner->radius * (1 + 1e-12 * i);
        stage_sphere(builder, shells[i].center, shells[i].radius);
    }
    return stage_finish(builder, NULL);
}

/* The ids that a ray through all of it meets: 4 3 2 1 0 0 1 2 3 4, by going on from each. */
static bool order_is_right(const struct stage *stage, const struct scene *scene, struct ray ray,
                           uint64_t *fallbacks)
{
    for (int i = 0; i < 2 * SHELLS; i++) {
        int expected = i < SHELLS ? SHELLS - 1 - i : i - SHELLS;
        struct hit hit = stage_nearest(stage, scene, &ray, fallbacks);
        if (hit.primitive != primitive_id(PRIMITIVE_SPHERE, (uint32_t)expected)) return false;
        struct surface surface;
        surface_at(scene, &ray, &hit, &surface);
        ray.origin = surface.point;
        ray.from = hit.primitive;
        ray.from_part = hit.part;
    }
    return stage_nearest(stage, scene, &ray, fallbacks).primitive == PRIMITIVE_NONE;
}

/* Whether the first hit of a ray near the tangent is the outermost shell that the oracle lets it
 * meet, and at the right place. */
static void first_shell(const struct hit *hit, struct sphere_truth *truth,
                        const struct sphere shells[SHELLS], const struct ray *ray,
                        struct score *score, uint64_t sample)
{
    for (int i = SHELLS - 1; i >= 0; i--) {
        solve_sphere(truth, &shells[i], ray);
        if (truth->first < 0) continue;
        if (hit->primitive != primitive_id(PRIMITIVE_SPHERE, (uint32_t)i))
            score_wrong(score, sample);
        return;
    }
    if (hit->primitive != PRIMITIVE_NONE) score_wrong(score, sample);
}

static void shell_block(struct block *block, const void *context)
{
    (void)context;
    struct random *random = &block->random;
    struct tally *tally = block->tally;
    struct sphere_truth truth;
    struct sphere inner = {.radius = 1}, shells[SHELLS];
    struct stage stage = {NULL, NULL, NULL};
    reals_init(truth.real, SPHERE_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        uint64_t sample = block->first + i;
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            inner = any_sphere(random);
            stage = shell_stage(&inner, shells);
        }
        double distance = inner.radius * random_between(random, 2, 100);
        bool grazing = i % 2;
        double offset =
            grazing ? 1 + random_between(random, -1e-12, 5e-12) : random_between(random, 0, 0.9);
        struct ray ray = ray_past(random, &inner, distance, inner.radius * offset);
        tally->samples++;
        if (grazing) {
            struct hit ours = stage_nearest(&stage, stage.ours, &ray, &tally->fallbacks);
            struct hit paper = stage_nearest(&stage, stage.paper, &ray, NULL);
            first_shell(&ours, &truth, shells, &ray, &tally->ours, sample);
            first_shell(&paper, &truth, shells, &ray, &tally->paper, sample);
            continue;
        }
        if (!order_is_right(&stage, stage.ours, ray, &tally->fallbacks))
            score_wrong(&tally->ours, sample);
        if (!order_is_right(&stage, stage.paper, ray, NULL)) score_wrong(&tally->paper, sample);
    }
    stage_free(&stage);
    reals_clear(truth.real, SPHERE_REALS);
}

static void run_12(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 12, budget->rays, shell_block, NULL, &tally);
    conclude(result, &tally, NULL, 0);
}

const struct stability_case sphere_cases[] = {
    {1, "sphere, L/r 2-100", "MPFR", "t <= 2 ulp, hit or miss exact", run_1},
    {2, "sphere, L/r 1e3-1e14", "MPFR", "t <= 2 ulp, hit or miss exact", run_2},
    {3, "ground sphere R 1e3-1e12, eye 1-3 above", "MPFR", "t <= 3 ulp", run_3},
    {4, "ground sphere, 1.5-1.0001 x horizon angle", "MPFR", "t <= 4 u relative", run_4},
    {5, "exact tangency, integer data", "rationals", "closed hit, t exact", run_5},
    {6, "offset r + k ulp, |k| <= 64", "rationals", "hit or miss exact", run_6},
    {7, "origin exactly on the sphere", "closed form", "out: none; in: 2b/a <= 2 ulp", run_7},
    {8, "sphere, r = 1e+-150", "MPFR", "t <= 2 ulp, hit or miss exact", run_8},
    {9, "sphere, |d| = 1e-8-1e8", "MPFR", "t <= 2 ulp; 2^k scaling bitwise", run_9},
    {10, "r <= 0, NaN, inf", "-", "refused with file and line", run_10},
    {11, "sphere normal, L/r <= 1e13", "MPFR", "<= 4 u", run_11},
    {12, "concentric shells, gap 1e-12 r", "rationals", "order exact", run_12},
    {0, NULL, NULL, NULL, NULL},
};
