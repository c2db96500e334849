/* Tests of what plain arithmetic decides of rays and solids, singly and in lanes, against MPFR. */
#include "scene_fixture.h"

#include <mpfr.h>

#include "worker/cone.h"
#include "worker/solid_lanes.h"
#include "worker/sphere.h"

/* Bits for differences and products of a dozen doubles between 1e-20 and 1e20, with some to spare. */
#define BITS 1200

/* The line is inside from enter to leave. */
struct truth {
    bool met;
    mpfr_t enter, leave;
};

/* Dot products of f = o - c, w and the direction d, in this order. */
enum dot { FF, FW, FD, WW, WD, DD, DOTS };

static void truth_init(struct truth *truth)
{
    mpfr_inits2(BITS, truth->enter, truth->leave, (mpfr_ptr)0);
}

static void truth_clear(struct truth *truth)
{
    mpfr_clears(truth->enter, truth->leave, (mpfr_ptr)0);
}

static void dot_products(const struct ray *ray, struct vec3 from, struct vec3 to, mpfr_t dots[DOTS])
{
    mpfr_t v[3], product;
    mpfr_inits2(BITS, v[0], v[1], v[2], product, (mpfr_ptr)0);
    for (int i = 0; i < DOTS; i++)
        mpfr_set_zero(dots[i], 1);
    for (unsigned axis = 0; axis < 3; axis++) {
        mpfr_set_d(v[0], vec_component(&ray->origin, axis), MPFR_RNDN);
        mpfr_sub_d(v[0], v[0], vec_component(&from, axis), MPFR_RNDN);
        mpfr_set_d(v[1], vec_component(&to, axis), MPFR_RNDN);
        mpfr_sub_d(v[1], v[1], vec_component(&from, axis), MPFR_RNDN);
        mpfr_set_d(v[2], vec_component(&ray->direction, axis), MPFR_RNDN);
        for (int i = 0, k = 0; i < 3; i++) {
            for (int j = i; j < 3; j++, k++) {
                mpfr_mul(product, v[i], v[j], MPFR_RNDN);
                mpfr_add(dots[k], dots[k], product, MPFR_RNDN);
            }
        }
    }
    mpfr_clears(v[0], v[1], v[2], product, (mpfr_ptr)0);
}

/* a - b c / d */
static void reduced(mpfr_t to, mpfr_t a, mpfr_t b, mpfr_t c, mpfr_t d)
{
    mpfr_mul(to, b, c, MPFR_RNDN);
    mpfr_div(to, to, d, MPFR_RNDN);
    mpfr_sub(to, a, to, MPFR_RNDN);
}

/* Where A t^2 - 2 B t + C <= 0, A > 0; widening: the half that is taken when A < 0. */
static void solve(struct truth *truth, mpfr_t A, mpfr_t B, mpfr_t C, double widening)
{
    mpfr_t root, product;
    mpfr_inits2(BITS, root, product, (mpfr_ptr)0);
    mpfr_mul(root, B, B, MPFR_RNDN);
    mpfr_mul(product, A, C, MPFR_RNDN);
    mpfr_sub(root, root, product, MPFR_RNDN);
    truth->met = mpfr_sgn(root) >= 0;
    mpfr_sqrt(root, root, MPFR_RNDN);
    mpfr_sub(truth->enter, B, root, MPFR_RNDN);
    mpfr_add(truth->leave, B, root, MPFR_RNDN);
    mpfr_div(truth->enter, truth->enter, A, MPFR_RNDN);
    mpfr_div(truth->leave, truth->leave, A, MPFR_RNDN);
    if (truth->met && mpfr_sgn(A) < 0) {
        /* After division by a negative number the two are swapped. */
        if (widening > 0)
            mpfr_set_inf(truth->leave, 1);
        else
            mpfr_set_inf(truth->enter, -1);
    }
    mpfr_clears(root, product, (mpfr_ptr)0);
}

static void sphere_truth(const struct sphere *sphere, const struct ray *ray, struct truth *truth)
{
    mpfr_t dots[DOTS], r;
    mpfr_init2(r, BITS);
    for (int i = 0; i < DOTS; i++)
        mpfr_init2(dots[i], BITS);
    dot_products(ray, sphere->center, sphere->center, dots);
    mpfr_set_d(r, sphere->radius, MPFR_RNDN);
    mpfr_mul(r, r, r, MPFR_RNDN);
    mpfr_sub(dots[FF], dots[FF], r, MPFR_RNDN);
    mpfr_neg(dots[FD], dots[FD], MPFR_RNDN);
    solve(truth, dots[DD], dots[FD], dots[FF], 1);
    for (int i = 0; i < DOTS; i++)
        mpfr_clear(dots[i]);
    mpfr_clear(r);
}

/* Cuts the interval at the planes of base and apex. */
static void cut_by_caps(struct truth *truth, mpfr_t dots[DOTS])
{
    mpfr_t base, apex;
    mpfr_inits2(BITS, base, apex, (mpfr_ptr)0);
    mpfr_neg(base, dots[FW], MPFR_RNDN);
    mpfr_add(apex, base, dots[WW], MPFR_RNDN);
    if (mpfr_zero_p(dots[WD])) {
        truth->met = truth->met && mpfr_sgn(base) <= 0 && mpfr_sgn(apex) >= 0;
    } else {
        mpfr_div(base, base, dots[WD], MPFR_RNDN);
        mpfr_div(apex, apex, dots[WD], MPFR_RNDN);
        if (mpfr_greater_p(base, apex)) mpfr_swap(base, apex);
        mpfr_max(truth->enter, truth->enter, base, MPFR_RNDN);
        mpfr_min(truth->leave, truth->leave, apex, MPFR_RNDN);
        truth->met = truth->met && mpfr_lessequal_p(truth->enter, truth->leave);
    }
    mpfr_clears(base, apex, (mpfr_ptr)0);
}

/* The interval in which the line is in the solid, whose axis is the unit of heights as in worker/solid_spans.h. */
static void cone_truth(const struct cone *cone, const struct ray *ray, struct truth *truth)
{
    mpfr_t dots[DOTS], A, B, C, widening, rho, rise, square;
    mpfr_inits2(BITS, A, B, C, widening, rho, rise, square, (mpfr_ptr)0);
    for (int i = 0; i < DOTS; i++)
        mpfr_init2(dots[i], BITS);
    dot_products(ray, cone->base, cone->apex, dots);
    mpfr_set_d(widening, cone->apex_radius, MPFR_RNDN);
    mpfr_sub_d(widening, widening, cone->base_radius, MPFR_RNDN);
    mpfr_div(widening, widening, dots[WW], MPFR_RNDN);
    mpfr_mul(rho, widening, dots[FW], MPFR_RNDN);
    mpfr_add_d(rho, rho, cone->base_radius, MPFR_RNDN);
    mpfr_mul(rise, widening, dots[WD], MPFR_RNDN);
    reduced(A, dots[DD], dots[WD], dots[WD], dots[WW]);
    reduced(B, dots[FD], dots[FW], dots[WD], dots[WW]);
    reduced(C, dots[FF], dots[FW], dots[FW], dots[WW]);
    mpfr_mul(square, rise, rise, MPFR_RNDN);
    mpfr_sub(A, A, square, MPFR_RNDN);
    mpfr_mul(square, rho, rise, MPFR_RNDN);
    mpfr_sub(B, square, B, MPFR_RNDN);
    mpfr_mul(square, rho, rho, MPFR_RNDN);
    mpfr_sub(C, C, square, MPFR_RNDN);
    solve(truth, A, B, C, mpfr_get_d(rise, MPFR_RNDA));
    cut_by_caps(truth, dots);
    for (int i = 0; i < DOTS; i++)
        mpfr_clear(dots[i]);
    mpfr_clears(A, B, C, widening, rho, rise, square, (mpfr_ptr)0);
}

/* ---- solids and rays ---- */

/* Ten to a power between low and high. */
static double some_size(uint64_t *random, double low, double high)
{
    return pow(10, random_between(random, low, high));
}

static struct cone some_cone(uint64_t *random, double spread)
{
    struct cone cone = {.base = random_vector(random, 1), .capped = 1};
    cone.apex = vec_add(cone.base, random_vector(random, some_size(random, -spread, spread)));
    cone.base_radius = some_size(random, -spread, spread);
    unsigned kind = random_below(random, 4);
    cone.apex_radius = kind == 0 ? 0 : cone.base_radius;
    if (kind > 1) cone.apex_radius = some_size(random, -spread, spread);
    return cone;
}

/* A ray to a point anywhere near the cone, or near its side, as close as 1e-17 of the radius. */
static struct ray some_ray(uint64_t *random, const struct cone *cone, double spread)
{
    double radius = larger_number(cone->base_radius, cone->apex_radius);
    struct vec3 w = vec_sub(cone->apex, cone->base);
    struct vec3 target = vec_add_scaled(cone->base, w, random_between(random, -0.2, 1.2));
    struct vec3 aside = vec_cross(w, random_vector(random, 1));
    double off = random_below(random, 2) ? random_between(random, 0, 1.5) : 1;
    off += random_between(random, -1, 1) * some_size(random, -17, -2);
    target = vec_add_scaled(target, vec_normalize(aside), off * radius);
    struct vec3 way = random_vector(random, 1);
    if (random_below(random, 4) == 0) way = vec_add_scaled(aside, w, random_between(random, -1, 1));
    way = vec_scale(vec_normalize(way), radius * some_size(random, -1, spread));
    return ray_to(vec_add(target, way), target);
}

/* ---- in lanes ---- */

struct counts {
    unsigned missed, decided, open;
};

static void check_span(const struct spans_one *span, const struct truth *truth,
                       struct counts *counts)
{
    if (span->missed) {
        counts->missed++;
        assert_false(truth->met);
        return;
    }
    if (truth->met) {
        assert_true(mpfr_cmp_d(truth->enter, span->enter_low) >= 0);
        assert_true(mpfr_cmp_d(truth->leave, span->leave_high) <= 0);
    }
    if (span->decided) {
        counts->decided++;
        assert_true(truth->met && mpfr_cmp_d(truth->enter, span->enter_high) <= 0);
        assert_true(mpfr_cmp_d(truth->leave, span->leave_low) >= 0);
        /* The intervals are for the distances rounded to double. */
        assert_true(mpfr_get_d(truth->enter, MPFR_RNDN) >= span->enter_low);
        assert_true(mpfr_get_d(truth->enter, MPFR_RNDN) <= span->enter_high);
    } else {
        counts->open++;
    }
}

static double lane_at(struct lanes lanes, unsigned lane)
{
    double at[LANES];
    lanes_store(at, lanes);
    return at[lane];
}

static void assert_same_number(double value, double expected)
{
    assert_memory_equal(&value, &expected, sizeof value);
}

/* A single pair gives the same bits as a lane. */
static void check_lane(const struct spans_lanes *spans, unsigned lane, const struct spans_one *one)
{
    assert_int_equal(spans->missed >> lane & 1, one->missed);
    if (one->missed) return;
    assert_int_equal(spans->decided >> lane & 1, one->decided);
    assert_same_number(lane_at(spans->enter_low, lane), one->enter_low);
    assert_same_number(lane_at(spans->leave_high, lane), one->leave_high);
    if (!one->decided) return;
    assert_int_equal(spans->enter_side >> lane & 1, one->enter_side);
    assert_int_equal(spans->leave_side >> lane & 1, one->leave_side);
    assert_same_number(lane_at(spans->enter_high, lane), one->enter_high);
    assert_same_number(lane_at(spans->leave_low, lane), one->leave_low);
}

static struct lanes3 column(double at[3][LANES])
{
    return (struct lanes3){lanes_load(at[0]), lanes_load(at[1]), lanes_load(at[2])};
}

static void put(double at[3][LANES], unsigned lane, struct vec3 v)
{
    for (unsigned axis = 0; axis < 3; axis++)
        at[axis][lane] = vec_component(&v, axis);
}

/* Eight pairs at once, as cones or as the spheres around their bases. */
static void check_lanes(uint64_t *random, double spread, bool spheres, struct truth *truth,
                        struct counts *counts)
{
    double o[3][LANES], d[3][LANES], base[3][LANES], apex[3][LANES], radius[2][LANES];
    struct cone cones[LANES];
    struct ray rays[LANES];
    for (unsigned i = 0; i < LANES; i++) {
        cones[i] = some_cone(random, spread / 4);
        rays[i] = some_ray(random, &cones[i], spread);
        put(o, i, rays[i].origin);
        put(d, i, rays[i].direction);
        put(base, i, cones[i].base);
        put(apex, i, cones[i].apex);
        radius[0][i] = cones[i].base_radius;
        radius[1][i] = cones[i].apex_radius;
    }
    const struct lanes origins[3] = {lanes_load(o[0]), lanes_load(o[1]), lanes_load(o[2])};
    const struct lanes directions[3] = {lanes_load(d[0]), lanes_load(d[1]), lanes_load(d[2])};
    struct ray_lanes ray = rays_in_lanes(origins, directions);
    struct cone_lanes cone = {column(base), column(apex), lanes_load(radius[0]),
                              lanes_load(radius[1])};
    struct sphere_lanes sphere = {column(base), lanes_load(radius[0])};
    struct spans_lanes spans =
        spheres ? sphere_spans_lanes(&sphere, &ray) : cone_spans_lanes(&cone, &ray);
    for (unsigned i = 0; i < LANES; i++) {
        const struct cone *it = &cones[i];
        struct sphere ball = {.center = it->base, .radius = it->base_radius};
        struct sphere_one sphere_one = {it->base, it->base_radius};
        struct cone_one cone_one = {it->base, it->apex, it->base_radius, it->apex_radius};
        struct ray_one ray_one = ray_in_one(&rays[i]);
        struct spans_one one =
            spheres ? sphere_spans_one(&sphere_one, &ray_one) : cone_spans_one(&cone_one, &ray_one);
        if (spheres)
            sphere_truth(&ball, &rays[i], truth);
        else
            cone_truth(it, &rays[i], truth);
        check_span(&one, truth, counts);
        check_lane(&spans, i, &one);
    }
}

static struct counts check_many(unsigned count, double spread, bool spheres)
{
    uint64_t random = 52;
    struct counts counts = {0, 0, 0};
    struct truth truth;
    truth_init(&truth);
    for (unsigned i = 0; i < count / LANES; i++)
        check_lanes(&random, spread, spheres, &truth, &counts);
    truth_clear(&truth);
    return counts;
}

/* Half of the rays aim at the side itself; for ordinary solids few of them stay undecided. */
static void test_cone_lanes(void **state)
{
    struct counts near = check_many(20000, 1, false);
    assert_true(near.missed > 2000 && near.decided > 2000 && near.open < 6000);
    check_many(20000, 8, false);
    check_many(20000, 20, false);
}

static void test_sphere_lanes(void **state)
{
    struct counts near = check_many(20000, 1, true);
    assert_true(near.missed > 2000 && near.decided > 2000 && near.open < 2000);
    check_many(20000, 8, true);
    check_many(20000, 20, true);
}

/* ---- rays that start on a sphere ---- */

/* A ray from a point of the sphere, up to rounding, in any direction or almost along the surface. */
static struct ray ray_on(uint64_t *random, const struct sphere *sphere)
{
    struct vec3 out = vec_normalize(random_vector(random, 1)), any = random_vector(random, 1);
    struct vec3 way = random_below(random, 2) ? any : vec_cross(out, any);
    way = vec_add_scaled(way, out, random_between(random, -1, 1) * some_size(random, -17, -2));
    return ray_along(vec_add_scaled(sphere->center, out, sphere->radius), way);
}

/* f.d > 0 of a ray that goes outward; one that goes inward leaves at -2 f.d / d.d. */
static void check_way_out(const struct sphere *sphere, const struct ray *ray, struct counts *counts)
{
    mpfr_t dots[DOTS];
    struct sphere_span exit;
    for (int i = 0; i < DOTS; i++)
        mpfr_init2(dots[i], BITS);
    dot_products(ray, sphere->center, sphere->center, dots);
    bool outward = ray_leaves_sphere(sphere, ray), inward = sphere_way_out_span(sphere, ray, &exit);
    if (outward) assert_true(mpfr_sgn(dots[FD]) > 0);
    if (inward) {
        mpfr_mul_si(dots[FD], dots[FD], -2, MPFR_RNDN);
        mpfr_div(dots[FD], dots[FD], dots[DD], MPFR_RNDN);
        assert_true(exit.low > 0);
        assert_true(mpfr_get_d(dots[FD], MPFR_RNDN) >= exit.low);
        assert_true(mpfr_get_d(dots[FD], MPFR_RNDN) <= exit.high);
    }
    counts->missed += outward;
    counts->decided += inward;
    counts->open += !outward && !inward;
    for (int i = 0; i < DOTS; i++)
        mpfr_clear(dots[i]);
}

/* far: how far the centre is from the origin; exponent: of two, by which all of that is scaled; speed: the same for the
 * direction. */
static struct counts check_ways_out(double far, int exponent, int speed)
{
    uint64_t random = 53;
    struct counts counts = {0, 0, 0};
    for (unsigned n = 0; n < 8000; n++) {
        struct sphere sphere = {.center = random_vector(&random, far),
                                .radius = some_size(&random, -3, 1)};
        struct ray ray = ray_on(&random, &sphere);
        sphere.center = vec_scale_exactly(sphere.center, exponent);
        ray.origin = vec_scale_exactly(ray.origin, exponent);
        ray.direction = vec_scale_exactly(ray.direction, speed);
        check_way_out(&sphere, &ray, &counts);
    }
    return counts;
}

static void test_ways_out(void **state)
{
    struct counts near = check_ways_out(1, 0, 0);
    assert_true(near.missed > 3000 && near.decided > 3000 && near.open < 1000);
    struct counts far = check_ways_out(1e6, 0, 0);
    assert_true(far.missed > 3000 && far.decided > 3000);
    check_ways_out(1, -450, -430);
    check_ways_out(1, 500, 480);
    check_ways_out(1, 1015, 0);
    check_ways_out(1, 0, 515);
    /* The smallest products lose digits. */
    assert_int_equal(check_ways_out(1, -920, 0).open, 8000);
    assert_int_equal(check_ways_out(1, 0, -470).decided, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cone_lanes),
        cmocka_unit_test(test_sphere_lanes),
        cmocka_unit_test(test_ways_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
