/* Rows 1-4, 8, 9, 11 and 12: spheres, against MPFR. */
#include "bench/stability_sphere.h"

#include "bench/stability_compare.h"

/* ---- the oracle ---- */

void solve_exactly(mpfr_t *real, const struct sphere *sphere, const struct ray *ray)
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

void solve_sphere(struct sphere_truth *truth, const struct sphere *sphere, const struct ray *ray)
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

/* ---- a row ---- */

void compare_to_truth(const struct stage *stage, const struct ray *ray, struct sphere_truth *truth,
                      double (*error)(double, mpfr_t), struct tally *tally, uint64_t sample)
{
    int first = truth->first;
    compare_both(stage, ray, first >= 0, truth->real[T0 + (first > 0)], error, tally, sample);
}

struct stage sphere_stage(const struct sphere *sphere)
{
    struct builder *builder = builder_create();
    stage_sphere(builder, sphere->center, sphere->radius);
    return stage_finish(builder, NULL);
}

void sphere_block(struct block *block, const void *context)
{
    const struct sphere_row *row = context;
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
        solve_sphere(&truth, &sphere, &ray);
        compare_to_truth(&stage, &ray, &truth, row->error, block->tally, block->first + i);
    }
    stage_free(&stage);
    reals_clear(truth.real, SPHERE_REALS);
}

struct sphere any_sphere(struct random *random)
{
    double r = random_log(random, 0.1, 10);
    return (struct sphere){.center = random_away(random, random_between(random, 0, 20)),
                           .radius = r};
}

/* ---- rows 1, 2, 8, 9: seen from a distance ---- */

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

/* The offset of a ray from the centre of a sphere of radius 1: for half of the rays anywhere, for half of them close to
 * the tangent, on both sides. */
static double any_offset(struct random *random)
{
    if (random_bits(random) >> 63) return random_between(random, 0, 1.2);
    return 1 + random_signed(random, exp2(-random_between(random, 2, 52)));
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

static struct sphere extreme_sphere(struct random *random)
{
    double r = random_bits(random) >> 63 ? 1e150 : 1e-150;
    return (struct sphere){.center = random_away(random, r * random_between(random, 0, 2)),
                           .radius = r};
}

static struct ray aim_scaled(struct random *random, const struct sphere *sphere)
{
    struct ray ray = aim_near(random, sphere);
    ray.direction = vec_scale(ray.direction, random_log(random, 1e-8, 1e8));
    return ray;
}

/* Tests that a direction that is 2^k times as long gives a t that is 2^-k times as large, bit for bit. */
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
    const struct sphere_row row = {any_sphere, aim_scaled, ulps};
    struct tally tally = {.samples = 0};
    share(budget, 9, budget->rays, sphere_block, &row, &tally);
    share(budget, 109, budget->rays, scaling_block, NULL, &tally);
    conclude(result, &tally, "ulp", 2);
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

/* ---- row 12: shells ---- */

#define SHELLS 5

/* Adds the innermost shell first, so that ids do not have the order of distances. */
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

/* Whether a ray through all shells that goes on from each hit meets the ids 4 3 2 1 0 0 1 2 3 4, and nothing more. */
static bool order_is_right(const struct stage *stage, const struct scene *scene, struct ray ray,
                           uint64_t *fallbacks)
{
    for (int i = 0; i < 2 * SHELLS; i++) {
        int expected = i < SHELLS ? SHELLS - 1 - i : i - SHELLS;
        struct hit hit = stage_nearest(stage, scene, &ray, fallbacks);
        if (hit.primitive != primitive_id(PRIMITIVE_SPHERE, (uint32_t)expected)) return false;
        struct surface surface;
        surface_at(scene, &ray, &hit, &surface);
        ray = stage_going_on(&surface, &hit, ray.direction);
    }
    return stage_nearest(stage, scene, &ray, fallbacks).primitive == PRIMITIVE_NONE;
}

/* Scores the first hit of a ray near the tangent: it must be on the outermost shell that the ray hits by the oracle. */
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

const struct stability_case sphere_cases[] = {
    {1, "sphere, L/r 2-100", "MPFR", "t <= 2 ulp, hit or miss exact", .work = sphere_block,
     .context = &(const struct sphere_row){any_sphere, aim_near, ulps}, .unit = "ulp", .limit = 2},
    {2, "sphere, L/r 1e3-1e14", "MPFR", "t <= 2 ulp, hit or miss exact", .work = sphere_block,
     .context = &(const struct sphere_row){any_sphere, aim_far, ulps}, .unit = "ulp", .limit = 2},
    {3, "ground sphere R 1e3-1e12, eye 1-3 above", "MPFR", "t <= 3 ulp", .work = sphere_block,
     .context = &(const struct sphere_row){ground_sphere, aim_ground, ulps}, .unit = "ulp",
     .limit = 3},
    {4, "ground sphere, 1.5-1.0001 x horizon angle", "MPFR", "t <= 4 u relative",
     .work = sphere_block,
     .context = &(const struct sphere_row){ground_sphere, aim_horizon, roundoffs}, .unit = "u",
     .limit = 4},
    {8, "sphere, r = 1e+-150", "MPFR", "t <= 2 ulp, hit or miss exact", .work = sphere_block,
     .context = &(const struct sphere_row){extreme_sphere, aim_near, ulps}, .unit = "ulp",
     .limit = 2},
    {9, "sphere, |d| = 1e-8-1e8", "MPFR", "t <= 2 ulp; 2^k scaling bitwise", .run = run_9},
    {11, "sphere normal, L/r <= 1e13", "MPFR", "<= 4 u", .work = normal_block, .unit = "u",
     .limit = 4},
    {12, "concentric shells, gap 1e-12 r", "rationals", "order exact", .work = shell_block},
    {.number = 0},
};
