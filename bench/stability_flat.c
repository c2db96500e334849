/* Rows 13 and 14: planes and discs, against exact arithmetic. */
#include "bench/stability_compare.h"

enum { F, D = F + 3, N = D + 3, DN = N + 3, FN, T, P, PP = P + 3, RR, FLAT_REALS };

/* Computes t = -(f.n) / (d.n) with the normal that is in the scene block. Returns whether t > 0. */
static bool solve_plane(mpfr_t *real, struct vec3 point, struct vec3 normal, const struct ray *ray)
{
    oracle_exact_begin();
    real_difference(&real[F], ray->origin, point);
    real_set(&real[D], ray->direction);
    real_set(&real[N], normal);
    real_dot(real[DN], &real[D], &real[N]);
    real_dot(real[FN], &real[F], &real[N]);
    oracle_exact_end();
    if (mpfr_zero_p(real[DN])) return false;
    mpfr_div(real[T], real[FN], real[DN], MPFR_RNDN);
    mpfr_neg(real[T], real[T], MPFR_RNDN);
    return mpfr_sgn(real[T]) > 0;
}

/* Computes t, and returns whether t > 0 and the point is on the closed disc: |f (d.n) - d (f.n)|^2 <= r^2 (d.n)^2. */
static bool solve_disc(mpfr_t *real, const struct disc *disc, const struct ray *ray)
{
    if (!solve_plane(real, disc->center, disc->normal, ray)) return false;
    oracle_exact_begin();
    for (int axis = 0; axis < 3; axis++)
        mpfr_fmms(real[P + axis], real[F + axis], real[DN], real[D + axis], real[FN], MPFR_RNDN);
    real_dot(real[PP], &real[P], &real[P]);
    mpfr_mul_d(real[RR], real[DN], disc->radius, MPFR_RNDN);
    mpfr_sqr(real[RR], real[RR], MPFR_RNDN);
    oracle_exact_end();
    return mpfr_cmp(real[PP], real[RR]) <= 0;
}

static struct stage plane_stage(struct random *random)
{
    struct builder *builder = builder_create();
    struct plane plane = {.point = random_point(random, 10), .material = stage_material(builder)};
    plane.normal = random_unit(random);
    if (random_below(random, 4) == 0) plane.normal.z = 0;
    expect_added(builder_add_plane(builder, &plane));
    return stage_finish(builder, NULL);
}

/* A ray with n.d down to 1e-15. Where the normal allows it, every eighth ray is exactly parallel to the plane. */
static struct ray aim_along(struct random *random, const struct plane *plane)
{
    struct vec3 u, v, n = plane->normal;
    random_frame(random, n, &u, &v);
    double slope = random_signed(random, random_log(random, 1e-15, 1));
    struct ray ray = stage_ray(random_point(random, 10), vec_add_scaled(u, n, slope));
    if (n.z == 0 && random_below(random, 8) == 0) ray.direction = vec3(n.y, -n.x, 0);
    ray.direction = vec_normalize(ray.direction);
    return ray;
}

static void plane_block(struct block *block, const void *context)
{
    (void)context;
    struct stage stage = {NULL, NULL, NULL};
    mpfr_t real[FLAT_REALS];
    reals_init(real, FLAT_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            stage = plane_stage(&block->random);
        }
        const struct plane *plane = scene_planes(stage.ours);
        struct ray ray = aim_along(&block->random, plane);
        bool expected = solve_plane(real, plane->point, plane->normal, &ray);
        compare_both(&stage, &ray, expected, real[T], roundoffs, block->tally, block->first + i);
    }
    stage_free(&stage);
    reals_clear(real, FLAT_REALS);
}

/* A random disc; or one orthogonal to an axis, with an integer centre and integer points on its rim. */
static struct disc any_disc(struct random *random, bool integers)
{
    struct disc disc = {.center = random_point(random, 10)};
    disc.normal = random_unit(random);
    disc.radius = random_log(random, 0.1, 10);
    if (!integers) return disc;
    disc.center = integer_point(random, 1000);
    disc.radius = 5 * (1 + (double)random_below(random, 1000));
    disc.normal = vec3(0, 0, 0);
    unsigned axis = (unsigned)random_below(random, 3);
    set_component(&disc.normal, axis, random_sign(random));
    return disc;
}

/* value, or one of the neighbouring doubles; 0 stays 0, as its neighbours are of another magnitude. */
static double ulp_step(struct random *random, double value)
{
    if (value == 0) return value;
    switch (random_below(random, 3)) {
    case 0:
        return nextafter(value, -HUGE_VAL);
    case 1:
        return nextafter(value, HUGE_VAL);
    default:
        return value;
    }
}

static struct ray aim_at_rim(struct random *random, const struct disc *disc)
{
    struct vec3 u, v;
    random_frame(random, disc->normal, &u, &v);
    struct vec3 rim = vec_add_scaled(disc->center, u, disc->radius);
    struct vec3 origin = vec_add(rim, random_away(random, random_log(random, 0.1, 1e4)));
    struct vec3 direction = vec_sub(rim, origin);
    for (unsigned axis = 0; axis < 3; axis++)
        set_component(&direction, axis, ulp_step(random, vec_component(&direction, axis)));
    return stage_ray(origin, direction);
}

/* A ray to the point of the rim at (3, 4) r/5 from the centre: in an oblique direction of integers, or along the normal
 * through it or one ulp beside it. */
static struct ray aim_at_integer_rim(struct random *random, const struct disc *disc)
{
    unsigned z = vec_component(&disc->normal, 0) != 0   ? 0
                 : vec_component(&disc->normal, 1) != 0 ? 1
                                                        : 2;
    unsigned x = (z + 1) % 3, y = (z + 2) % 3;
    struct vec3 p = disc->center, step = integer_point(random, 50);
    set_component(&p, x, vec_component(&p, x) + random_sign(random) * 0.6 * disc->radius);
    set_component(&p, y, vec_component(&p, y) + random_sign(random) * 0.8 * disc->radius);
    if (vec_component(&step, z) == 0) set_component(&step, z, 1);
    struct vec3 origin = vec_add_scaled(p, step, -(1 + (double)random_below(random, 100)));
    if (random_bits(random) >> 63) {
        set_component(&step, x, 0);
        set_component(&step, y, 0);
        set_component(&origin, x, ulp_step(random, vec_component(&p, x)));
        set_component(&origin, y, ulp_step(random, vec_component(&p, y)));
    }
    return stage_ray(origin, step);
}

static void disc_block(struct block *block, const void *context)
{
    (void)context;
    struct stage stage = {NULL, NULL, NULL};
    mpfr_t real[FLAT_REALS];
    reals_init(real, FLAT_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        bool integers = i / RAYS_PER_SCENE % 2;
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            struct builder *builder = builder_create();
            struct disc disc = any_disc(&block->random, integers);
            disc.material = stage_material(builder);
            expect_added(builder_add_disc(builder, &disc));
            stage = stage_finish(builder, NULL);
        }
        const struct disc *disc = scene_discs(stage.ours);
        struct ray ray =
            integers ? aim_at_integer_rim(&block->random, disc) : aim_at_rim(&block->random, disc);
        bool expected = solve_disc(real, disc, &ray);
        compare_both(&stage, &ray, expected, real[T], roundoffs, block->tally, block->first + i);
    }
    stage_free(&stage);
    reals_clear(real, FLAT_REALS);
}

const struct stability_case flat_cases[] = {
    {13, "plane, |n.d| down to 1e-15", "MPFR", "t <= 4 u; parallel: miss", .work = plane_block,
     .unit = "u", .limit = 4},
    {14, "disc rim +-1 ulp", "rationals", "hit or miss exact, t <= 4 u", .work = disc_block,
     .unit = "u", .limit = 4},
    {.number = 0},
};
