/* Rows 24 and 25: single triangles, against exact arithmetic. */
#include "bench/oracle.h"
#include "bench/stability.h"

/* The corners relative to the ray's origin, cross products, and E_i = d . (corner j x corner k), whose signs tell on
 * which side of each edge the line passes. */
enum { C0, CROSS = C0 + 9, DIR = CROSS + 3, E = DIR + 3, DET = E + 3, TIME, SIZE, TERM, TRI_REALS };

static void solve_edges(mpfr_t *real, const struct vec3 corner[3], const struct ray *ray)
{
    oracle_exact_begin();
    real_set(&real[DIR], ray->direction);
    for (int i = 0; i < 3; i++)
        real_difference(&real[C0 + 3 * i], corner[i], ray->origin);
    for (int i = 0; i < 3; i++) {
        real_cross(&real[CROSS], &real[C0 + 3 * ((i + 1) % 3)], &real[C0 + 3 * ((i + 2) % 3)]);
        real_dot(real[E + i], &real[DIR], &real[CROSS]);
    }
    mpfr_add(real[DET], real[E], real[E + 1], MPFR_RNDN);
    mpfr_add(real[DET], real[DET], real[E + 2], MPFR_RNDN);
    oracle_exact_end();
}

static unsigned largest_axis(struct vec3 d)
{
    double x = fabs(d.x), y = fabs(d.y), z = fabs(d.z);
    return z >= x && z >= y ? 2 : y >= x ? 1 : 0;
}

/* Computes TIME = t = sum E_i z_i / det / d_z, and SIZE = sum |E_i z_i| / |det| / |d_z|. z is the axis of the
 * direction's largest component. */
static void solve_time(mpfr_t *real, const struct ray *ray)
{
    unsigned z = largest_axis(ray->direction);
    mpfr_set_ui(real[TIME], 0, MPFR_RNDN);
    mpfr_set_ui(real[SIZE], 0, MPFR_RNDN);
    for (unsigned i = 0; i < 3; i++) {
        mpfr_mul(real[TERM], real[E + i], real[C0 + 3 * i + z], MPFR_RNDN);
        mpfr_add(real[TIME], real[TIME], real[TERM], MPFR_RNDN);
        mpfr_abs(real[TERM], real[TERM], MPFR_RNDN);
        mpfr_add(real[SIZE], real[SIZE], real[TERM], MPFR_RNDN);
    }
    mpfr_mul(real[TERM], real[DET], real[DIR + z], MPFR_RNDN);
    mpfr_div(real[TIME], real[TIME], real[TERM], MPFR_RNDN);
    mpfr_div(real[SIZE], real[SIZE], real[TERM], MPFR_RNDN);
    mpfr_abs(real[SIZE], real[SIZE], MPFR_RNDN);
}

/* The error of t in units of u SIZE. */
static double grazing_error(mpfr_t *real, double t)
{
    mpfr_d_sub(real[TERM], t, real[TIME], MPFR_RNDN);
    mpfr_div(real[TERM], real[TERM], real[SIZE], MPFR_RNDN);
    return fabs(mpfr_get_d(real[TERM], MPFR_RNDA)) * 0x1p53;
}

/* Whether the line passes all edges on the same side, or -1 when it goes through one. */
static int passes_inside(mpfr_t *real)
{
    int signs = 0;
    for (int i = 0; i < 3; i++) {
        if (mpfr_zero_p(real[E + i])) return -1;
        signs += mpfr_sgn(real[E + i]);
    }
    return signs == 3 || signs == -3;
}

static void grazing_hit(const struct stage *stage, const struct scene *scene, const struct ray *ray,
                        mpfr_t *real, struct tally *tally, uint64_t sample)
{
    struct hit hit = stage_nearest(stage, scene, ray, &tally->fallbacks);
    struct score *score = scene == stage->ours ? &tally->ours : &tally->paper;
    bool met = hit.primitive != PRIMITIVE_NONE;
    int inside = passes_inside(real);
    bool expected = inside == 1 && mpfr_sgn(real[TIME]) > 0;
    if (inside >= 0 && met != expected)
        score_wrong(score, sample);
    else if (met)
        score_error(score, grazing_error(real, hit.t), sample);
}

/* A ray that runs almost in the triangle's plane towards a point inside it. */
static struct ray graze(struct random *random, const struct vec3 corner[3])
{
    double u = random_between(random, 0, 1), v = random_between(random, 0, 1);
    if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
    }
    struct vec3 e1 = vec_sub(corner[1], corner[0]), e2 = vec_sub(corner[2], corner[0]);
    struct vec3 n = vec_normalize(vec_cross(e1, e2)), across, along;
    struct vec3 target = vec_add_scaled(vec_add_scaled(corner[0], e1, u), e2, v);
    random_frame(random, n, &along, &across);
    double slope = random_signed(random, random_log(random, 1e-15, 0.1));
    struct vec3 direction = vec_add_scaled(along, n, slope);
    double distance = random_log(random, 0.01, 1000);
    return stage_ray(vec_add_scaled(target, direction, -distance), vec_normalize(direction));
}

static void grazing_block(struct block *block, const void *context)
{
    (void)context;
    struct vec3 corner[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    struct stage stage = {NULL, NULL, NULL};
    mpfr_t real[TRI_REALS];
    reals_init(real, TRI_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            struct vec3 middle = random_point(&block->random, 100);
            struct builder *builder = builder_create();
            for (int k = 0; k < 3; k++)
                corner[k] = vec_add(middle, random_point(&block->random, 5));
            stage_triangle(builder, corner[0], corner[1], corner[2]);
            stage = stage_finish(builder, NULL);
        }
        struct ray ray = graze(&block->random, corner);
        solve_edges(real, corner, &ray);
        if (mpfr_zero_p(real[DET])) continue; /* in the plane, or far from it and parallel */
        solve_time(real, &ray);
        grazing_hit(&stage, stage.ours, &ray, real, block->tally, block->first + i);
        grazing_hit(&stage, stage.paper, &ray, real, block->tally, block->first + i);
        block->tally->samples++;
    }
    stage_free(&stage);
    reals_clear(real, TRI_REALS);
}

/* Three triangles: one has the whole edge p r, and the two on its other side share a vertex t on that edge. */
struct junction {
    struct vec3 corner[3][3];
    struct vec3 p, r;
};

/* If the plane has integer coordinates, t is exactly on the edge; if it is turned at random, t is rounded and beside
 * the edge. */
static struct junction any_junction(struct random *random)
{
    struct vec3 origin = integer_point(random, 50), u = {1, 0, 0}, v = {0, 1, 0};
    if (random_bits(random) >> 63) {
        random_frame(random, random_unit(random), &u, &v);
    } else {
        u = integer_point(random, 9);
        v = integer_point(random, 9);
        if (vec_is_zero(vec_cross(u, v))) {
            u = vec3(3, 1, 2);
            v = vec3(-1, 4, 1);
        }
    }
    double length = 2 * (1 + (double)random_below(random, 8));
    double split = 1 + (double)random_below(random, (uint64_t)length - 1);
    struct vec3 p = origin, r = vec_add_scaled(origin, u, length);
    struct vec3 t = vec_add_scaled(origin, u, split);
    struct vec3 above = vec_add_scaled(origin, v, 4), below = vec_add_scaled(origin, v, -4);
    return (struct junction){{{p, r, above}, {t, p, below}, {r, t, below}}, p, r};
}

static struct stage junction_stage(const struct junction *junction)
{
    struct builder *builder = builder_create();
    for (int i = 0; i < 3; i++)
        stage_triangle(builder, junction->corner[i][0], junction->corner[i][1],
                       junction->corner[i][2]);
    return stage_finish(builder, NULL);
}

/* Whether the line meets the closed triangle at t > 0 and does not lie in its plane. */
static bool meets_closed(mpfr_t *real, const struct vec3 corner[3], const struct ray *ray)
{
    solve_edges(real, corner, ray);
    int low = 0, high = 0;
    for (int i = 0; i < 3; i++) {
        low |= mpfr_sgn(real[E + i]) < 0;
        high |= mpfr_sgn(real[E + i]) > 0;
    }
    if ((low && high) || mpfr_zero_p(real[DET])) return false;
    solve_time(real, ray);
    return mpfr_sgn(real[TIME]) > 0;
}

static void junction_block(struct block *block, const void *context)
{
    (void)context;
    struct random *random = &block->random;
    struct tally *tally = block->tally;
    struct junction junction = {.p = {0, 0, 0}};
    struct stage stage = {NULL, NULL, NULL};
    mpfr_t real[TRI_REALS];
    reals_init(real, TRI_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            junction = any_junction(random);
            stage = junction_stage(&junction);
        }
        double along = random_between(random, 0.01, 0.99);
        struct vec3 target = vec_add_scaled(junction.p, vec_sub(junction.r, junction.p), along);
        struct vec3 origin =
            random_bits(random) >> 63 ? random_point(random, 100) : integer_point(random, 100);
        struct ray ray = stage_ray(origin, vec_sub(target, origin));
        bool expected = false;
        for (int k = 0; k < 3 && !expected; k++)
            expected = meets_closed(real, junction.corner[k], &ray);
        struct hit ours = stage_nearest(&stage, stage.ours, &ray, &tally->fallbacks);
        struct hit paper = stage_nearest(&stage, stage.paper, &ray, NULL);
        if (expected && ours.primitive == PRIMITIVE_NONE)
            score_wrong(&tally->ours, block->first + i);
        if (expected && paper.primitive == PRIMITIVE_NONE)
            score_wrong(&tally->paper, block->first + i);
        tally->samples++;
    }
    stage_free(&stage);
    reals_clear(real, TRI_REALS);
}

const struct stability_case triangle_cases[] = {
    {24, "grazing triangle", "rationals", "hit or miss exact, t <= 8 u sum|ez|/|det|",
     .work = grazing_block, .unit = "u sum|ez|/|det|", .limit = 8},
    {25, "T-junctions", "rationals", "misses only where the rationals miss",
     .work = junction_block},
    {.number = 0},
};
