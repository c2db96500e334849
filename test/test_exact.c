#include "scene_fixture.h"

#include <float.h>

#include <gmp.h>
#include <mpfr.h>

#include "worker/exact.h"

/* Bits of the oracle's numbers: enough for sums of products of EXACT_FACTORS doubles of any size, and of doubles of
 * moderate size. */
#define BITS_OF_ALL  20000
#define BITS_OF_SOME 1600

/* The relative error of a double-double in units of DD_ROUNDOFF. */
static double dd_error(struct dd value, mpfr_t truth)
{
    mpfr_t error;
    mpfr_init2(error, mpfr_get_prec(truth));
    mpfr_sub_d(error, truth, value.high, MPFR_RNDN);
    mpfr_sub_d(error, error, value.low, MPFR_RNDN);
    mpfr_div(error, error, truth, MPFR_RNDN);
    double units = fabs(mpfr_get_d(error, MPFR_RNDA)) / DD_ROUNDOFF;
    mpfr_clear(error);
    return units;
}

static void set_dd(mpfr_t real, struct dd a)
{
    mpfr_set_d(real, a.high, MPFR_RNDN);
    mpfr_add_d(real, real, a.low, MPFR_RNDN);
}

static double wide_double(uint64_t *random, int reach)
{
    int exponent = (int)random_below(random, (uint32_t)(2 * reach + 1)) - reach;
    return ldexp(random_between(random, -1, 1), exponent);
}

static struct dd some_dd(uint64_t *random)
{
    double high = wide_double(random, 100);
    return sum_of_ordered(high, high * 0x1p-53 * random_between(random, -1, 1));
}

static void test_sums_and_products(void **state)
{
    uint64_t random = 20;
    mpfr_t x, y;
    mpfr_inits2(BITS_OF_SOME, x, y, (mpfr_ptr)0);
    for (int i = 0; i < 100000; i++) {
        double a = wide_double(&random, 60), b = wide_double(&random, 60);
        mpfr_set_d(x, a, MPFR_RNDN);
        mpfr_add_d(y, x, b, MPFR_RNDN);
        set_dd(x, exact_sum(a, b));
        assert_true(mpfr_equal_p(x, y));
        mpfr_set_d(x, a, MPFR_RNDN);
        mpfr_mul_d(y, x, b, MPFR_RNDN);
        set_dd(x, exact_product(a, b));
        assert_true(mpfr_equal_p(x, y));
    }
    mpfr_clears(x, y, (mpfr_ptr)0);
}

/* The error factors of the header; for quotients that of the paper of 2022. */
static void test_double_double(void **state)
{
    uint64_t random = 21;
    mpfr_t x, y, z;
    mpfr_inits2(BITS_OF_SOME / 4, x, y, z, (mpfr_ptr)0);
    for (int i = 0; i < 100000; i++) {
        struct dd a = some_dd(&random), b = some_dd(&random);
        if (i % 4 == 0) b = dd_add(dd_negate(a), dd(a.high * 0x1p-60)); /* cancels */
        if (a.high == 0 || b.high == 0) continue;
        set_dd(x, a);
        set_dd(y, b);
        mpfr_add(z, x, y, MPFR_RNDN);
        if (!mpfr_zero_p(z)) assert_true(dd_error(dd_add(a, b), z) <= 3.01);
        mpfr_mul(z, x, y, MPFR_RNDN);
        assert_true(dd_error(dd_mul(a, b), z) <= 5);
        mpfr_div(z, x, y, MPFR_RNDN);
        assert_true(dd_error(dd_div(a, b), z) <= 10);
        mpfr_mul_d(z, x, b.high, MPFR_RNDN);
        assert_true(dd_error(dd_scale(a, b.high), z) <= 2);
        double step = -a.high / b.high * (i % 3 ? 1 : random_between(&random, 0, 2));
        mpfr_set_d(z, step, MPFR_RNDN);
        mpfr_mul_d(z, z, b.high, MPFR_RNDN);
        mpfr_add(z, z, x, MPFR_RNDN);
        if (!mpfr_zero_p(z)) assert_true(dd_error(dd_advance(a, step, b.high), z) <= 1.5);
        mpfr_abs(z, x, MPFR_RNDN);
        mpfr_sqrt(z, z, MPFR_RNDN);
        assert_true(dd_error(dd_sqrt(a.high < 0 ? dd_negate(a) : a), z) <= 3.125);
    }
    mpfr_clears(x, y, z, (mpfr_ptr)0);
}

/* Sums of products over the whole range of double, some of which cancel up to one last bit. */
static void test_accumulator(void **state)
{
    uint64_t random = 22;
    mpfr_t truth, product;
    mpfr_inits2(BITS_OF_ALL, truth, product, (mpfr_ptr)0);
    for (int i = 0; i < 1000; i++) {
        struct accumulator sum;
        accumulator_clear(&sum);
        mpfr_set_zero(truth, 1);
        double factors[EXACT_FACTORS];
        unsigned terms = 1 + random_below(&random, 6);
        for (unsigned k = 0; k < 2 * terms; k++) {
            unsigned count = 1 + random_below(&random, EXACT_FACTORS);
            bool subtract = random_below(&random, 2);
            mpfr_set_d(product, 1, MPFR_RNDN);
            for (unsigned f = 0; f < count; f++) {
                factors[f] = wide_double(&random, i % 2 ? 1074 : 20);
                if (!isfinite(factors[f])) factors[f] = 1;
                mpfr_mul_d(product, product, factors[f], MPFR_RNDN);
            }
            accumulator_add(&sum, factors, count, subtract);
            (subtract ? mpfr_sub : mpfr_add)(truth, truth, product, MPFR_RNDN);
        }
        assert_int_equal(accumulator_sign(&sum), mpfr_sgn(truth) > 0 ? 1 : -(mpfr_sgn(truth) < 0));
        if (mpfr_zero_p(truth)) continue;
        int exponent;
        struct dd value = accumulator_round(&sum, &exponent);
        mpfr_mul_2si(truth, truth, -exponent, MPFR_RNDN);
        assert_true(dd_error(value, truth) <= 4);
    }
    mpfr_clears(truth, product, (mpfr_ptr)0);
}

static void test_accumulator_cancels(void **state)
{
    const double least[2] = {0x1p-1074, 0x1p-1074}, large[2] = {DBL_MAX, DBL_MAX};
    struct accumulator sum;
    int exponent;
    accumulator_clear(&sum);
    assert_int_equal(accumulator_sign(&sum), 0);
    accumulator_add(&sum, large, 2, false);
    accumulator_add(&sum, least, 2, true);
    assert_int_equal(accumulator_sign(&sum), 1);
    accumulator_add(&sum, large, 2, true);
    assert_int_equal(accumulator_sign(&sum), -1);
    double value = accumulator_value(&sum, &exponent);
    assert_same(ldexp(value, exponent + 2148), -1);
    accumulator_add(&sum, least, 2, false);
    assert_int_equal(accumulator_sign(&sum), 0);
}

/* A finite number, sometimes subnormal, sometimes with a low part. */
static struct dd extreme_dd(uint64_t *random, int reach)
{
    double high = wide_double(random, reach);
    if (!isfinite(high)) high = DBL_MAX;
    if (random_below(random, 4)) return dd(high);
    return sum_of_ordered(high, high * 0x1p-54 * random_between(random, -1, 1));
}

/* += or -= a b c in both arithmetics. */
static void add_both(struct accumulator *sum, mpfr_t truth, uint64_t *random, unsigned degree,
                     int reach)
{
    struct dd factor[3] = {dd(1), dd(1), dd(1)};
    int sign = random_below(random, 2) ? 1 : -1;
    mpfr_t product, x;
    mpfr_inits2(BITS_OF_ALL, product, x, (mpfr_ptr)0);
    mpfr_set_si(product, sign, MPFR_RNDN);
    for (unsigned i = 0; i < degree; i++) {
        factor[i] = extreme_dd(random, reach);
        set_dd(x, factor[i]);
        mpfr_mul(product, product, x, MPFR_RNDN);
    }
    accumulator_add_dd(sum, sign, factor[0], factor[1], factor[2]);
    mpfr_add(truth, truth, product, MPFR_RNDN);
    mpfr_clears(product, x, (mpfr_ptr)0);
}

static void assert_equals(const struct accumulator *sum, mpfr_t truth)
{
    assert_int_equal(accumulator_sign(sum), (mpfr_sgn(truth) > 0) - (mpfr_sgn(truth) < 0));
    int exponent;
    struct dd value = accumulator_round(sum, &exponent);
    if (mpfr_zero_p(truth)) {
        assert_true(value.high == 0);
        return;
    }
    mpfr_mul_2si(truth, truth, -exponent, MPFR_RNDN);
    assert_true(dd_error(value, truth) <= 2);
}

/* Products of sums of degree 2 + 3 + 3, as for the cone, over the whole range of double. */
static void test_products_of_sums(void **state)
{
    static const unsigned degrees[3] = {2, 3, 3};
    static const int reaches[4] = {3, 60, 500, 1074};
    uint64_t random = 26;
    mpfr_t truth, product, factors[3];
    mpfr_inits2(BITS_OF_ALL, truth, product, factors[0], factors[1], factors[2], (mpfr_ptr)0);
    for (int i = 0; i < 800; i++) {
        struct accumulator sum, parts[3];
        accumulator_clear(&sum);
        mpfr_set_zero(truth, 1);
        unsigned products = 1 + random_below(&random, 3);
        for (unsigned k = 0; k < products; k++) {
            bool subtract = random_below(&random, 2), square = random_below(&random, 2);
            mpfr_set_ui(product, 1, MPFR_RNDN);
            for (unsigned f = 0; f < 3; f++) {
                accumulator_clear(&parts[f]);
                mpfr_set_zero(factors[f], 1);
                unsigned terms = 1 + random_below(&random, 4);
                for (unsigned t = 0; t < terms; t++)
                    add_both(&parts[f], factors[f], &random, degrees[f], reaches[i % 4]);
            }
            for (unsigned f = 0; f < 3; f++)
                mpfr_mul(product, product, factors[f == 2 && square ? 1 : f], MPFR_RNDN);
            accumulator_add_product(&sum, &parts[0], &parts[1], &parts[square ? 1 : 2], subtract);
            (subtract ? mpfr_sub : mpfr_add)(truth, truth, product, MPFR_RNDN);
        }
        assert_equals(&sum, truth);
    }
    mpfr_clears(truth, product, factors[0], factors[1], factors[2], (mpfr_ptr)0);
}

/* A number of a few bits: sums of these cancel. */
static double short_double(uint64_t *random)
{
    return (double)random_below(random, 2001) - 1000;
}

static struct vec3 triple_vector(uint64_t *random, int kind)
{
    if (kind == 0) return vec3(short_double(random), short_double(random), short_double(random));
    int reach = kind == 1 ? 3 : kind == 2 ? 60 : 1074;
    double v[3];
    for (int i = 0; i < 3; i++)
        v[i] = extreme_dd(random, reach).high;
    return vec3(v[0], v[1], v[2]);
}

/* d.(p x q) in MPFR. */
static void true_triple(mpfr_t truth, const struct dd p[3], const struct dd q[3], const double d[3])
{
    mpfr_t x, y;
    mpfr_inits2(BITS_OF_ALL, x, y, (mpfr_ptr)0);
    mpfr_set_zero(truth, 1);
    for (int i = 0; i < 6; i++) {
        int first = i % 3, j = (first + 1 + i / 3) % 3, k = (first + 2 - i / 3) % 3;
        set_dd(x, p[j]);
        set_dd(y, q[k]);
        mpfr_mul(x, x, y, MPFR_RNDN);
        mpfr_mul_d(x, x, i < 3 ? d[first] : -d[first], MPFR_RNDN);
        mpfr_add(truth, truth, x, MPFR_RNDN);
    }
    mpfr_clears(x, y, (mpfr_ptr)0);
}

/* Asserts that integer arithmetic, if the vectors fit, gives the same bits; counts the vectors that fit. */
static void assert_integers_agree(const struct dd3 *p, const struct dd3 *q, struct vec3 d,
                                  struct dd value, int exponent, unsigned *fitting)
{
    struct dd3 direction = dd3_of(d);
    struct integers ip, iq, id;
    if (!exact_integers(p, &ip) || !exact_integers(q, &iq) || !exact_integers(&direction, &id))
        return;
    int other_exponent;
    struct dd other = integers_triple(&ip, &iq, &id, &other_exponent);
    assert_memory_equal(&other, &value, sizeof value);
    assert_int_equal(other_exponent, exponent);
    ++*fitting;
}

/* Lines through points of an edge or beside it, from one end of the edge or from elsewhere. */
static void test_triple(void **state)
{
    uint64_t random = 27;
    unsigned zeros = 0, fitting = 0;
    mpfr_t truth;
    mpfr_init2(truth, BITS_OF_ALL);
    for (int i = 0; i < 8000; i++) {
        int kind = i % 4;
        struct vec3 a = triple_vector(&random, kind), b = triple_vector(&random, kind);
        struct vec3 o = triple_vector(&random, kind);
        if (kind == 3) o = vec3(0, 0, 0); /* differences of all of the range may overflow */
        struct dd3 p = exact_difference3(a, o), q = exact_difference3(b, o);
        struct vec3 d = triple_vector(&random, kind);
        if (i % 8 < 4) d = vec_add(vec_scale(dd3_round(p), 0.25), vec_scale(dd3_round(q), 0.75));
        if (!vec_is_finite(d)) continue;
        const struct dd ps[3] = {p.x, p.y, p.z}, qs[3] = {q.x, q.y, q.z};
        const double ds[3] = {d.x, d.y, d.z};
        true_triple(truth, ps, qs, ds);
        int exponent;
        struct dd value = exact_triple(&p, &q, d, &exponent);
        assert_integers_agree(&p, &q, d, value, exponent, &fitting);
        zeros += value.high == 0;
        assert_true((value.high == 0) == (mpfr_zero_p(truth) != 0));
        if (value.high == 0) continue;
        assert_true(fabs(value.high) >= 1 && fabs(value.high) <= 2);
        mpfr_mul_2si(truth, truth, -exponent, MPFR_RNDN);
        assert_true(dd_error(value, truth) <= 2);
    }
    assert_true(zeros >= 1000 && fitting >= 2000);
    mpfr_clear(truth);
}

/* (a + b)^2 - a^2 - 2 a b - b^2 = 0 */
static void test_polynomials(void **state)
{
    uint64_t random = 23;
    for (int i = 0; i < 2000; i++) {
        struct dd a = some_dd(&random), b = some_dd(&random);
        struct accumulator both, parts, sum;
        accumulator_clear(&both);
        accumulator_clear(&parts);
        accumulator_clear(&sum);
        accumulator_add_dd(&both, 1, a, dd(1), dd(1));
        accumulator_add_dd(&both, 1, b, dd(1), dd(1));
        accumulator_add_dd(&parts, 1, a, a, dd(1));
        accumulator_add_dd(&parts, 1, b, b, dd(1));
        accumulator_add_dd(&parts, 1, dd_ldexp(a, 1), b, dd(1));
        accumulator_add_product(&sum, &both, &both, NULL, false);
        assert_int_equal(accumulator_sign(&sum), 1);
        accumulator_add_product(&sum, &parts, NULL, NULL, true);
        assert_int_equal(accumulator_sign(&sum), 0);
    }
}

/* Vectors that are almost, or exactly, at right angles. */
static void test_dot(void **state)
{
    uint64_t random = 24;
    mpfr_t truth, x, y;
    mpfr_inits2(BITS_OF_SOME, truth, x, y, (mpfr_ptr)0);
    for (int i = 0; i < 20000; i++) {
        struct dd3 a = {some_dd(&random), some_dd(&random), dd(random_between(&random, 1, 2))};
        struct dd3 b = {some_dd(&random), some_dd(&random), dd(0)};
        if (i % 8 == 0) b = (struct dd3){a.y, dd_negate(a.x), dd(0)};
        struct dd rest = dd_add(dd_mul(a.x, b.x), dd_mul(a.y, b.y));
        if (i % 8) b.z = dd_negate(dd_div(rest, a.z));
        const struct dd as[3] = {a.x, a.y, a.z}, bs[3] = {b.x, b.y, b.z};
        mpfr_set_zero(truth, 1);
        for (int k = 0; k < 3; k++) {
            set_dd(x, as[k]);
            set_dd(y, bs[k]);
            mpfr_fma(truth, x, y, truth, MPFR_RNDN);
        }
        int exponent;
        struct dd dot = exact_dot3(a, b, &exponent);
        mpfr_mul_2si(truth, truth, -exponent, MPFR_RNDN);
        if (mpfr_zero_p(truth))
            assert_true(dot.high == 0);
        else
            assert_true(dd_error(dot, truth) <= 0x1p49);
    }
    mpfr_clears(truth, x, y, (mpfr_ptr)0);
}

/* Scaling by powers of two changes no bit. */
static void test_scaling(void **state)
{
    uint64_t random = 25;
    for (int i = 0; i < 10000; i++) {
        struct dd a = some_dd(&random), b = some_dd(&random);
        int k = (int)random_below(&random, 121) - 60;
        struct dd q = dd_ldexp(dd_div(a, b), k), scaled = dd_div(dd_ldexp(a, k), b);
        assert_memory_equal(&q, &scaled, sizeof q);
        struct dd s = dd_ldexp(dd_add(a, b), k);
        scaled = dd_add(dd_ldexp(a, k), dd_ldexp(b, k));
        assert_memory_equal(&s, &scaled, sizeof s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sums_and_products), cmocka_unit_test(test_double_double),
        cmocka_unit_test(test_accumulator),       cmocka_unit_test(test_accumulator_cancels),
        cmocka_unit_test(test_polynomials),       cmocka_unit_test(test_dot),
        cmocka_unit_test(test_products_of_sums),  cmocka_unit_test(test_triple),
        cmocka_unit_test(test_scaling),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    mpfr_free_cache();
    return failed;
}
