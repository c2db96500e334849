/* Tests the allocation of samples: the rule of master/adaptive.h for single pixels, and sums over all. */
#include <math.h>
#include <stdbool.h>

#include "master/allocation.h"
#include "test/unit.h"

static bool is_about(double value, double wanted)
{
    return fabs(value - wanted) <= 1e-12 * wanted;
}

/* Each doubling divides e / cost by 2^5/2. A pixel whose gain is at the limit gets no more samples. */
static void test_doublings(void **state)
{
    for (unsigned count = 0; count <= 5; count++) {
        double limit = 0.01, most = limit * exp2(2.5 * count);
        assert_int_equal(allocation_doublings(0.999 * most, limit, LEVEL_MAX), count);
        assert_int_equal(allocation_doublings(1.001 * most, limit, LEVEL_MAX), count + 1);
        assert_int_equal(allocation_doublings(1.001 * most, limit, count), count);
    }
    assert_int_equal(allocation_doublings(1, 1, LEVEL_MAX), 0);
    assert_int_equal(allocation_doublings(0, 0, LEVEL_MAX), 0);
}

/* Each doubling leaves 2^-3/2 of what halves tell; what two of them bring, three times as many samples as one,
 * is taken at once. Not more of them than there are. */
static void test_outcome(void **state)
{
    struct allocation *allocation = allocation_create(1);
    allocation_add(allocation, 1, 3, 10, 5);
    allocation_add(allocation, 1, 5, 20, 1); /* once at the most */
    allocation_add(allocation, 1, 7, 30, 5);
    assert_true(allocation_squares(allocation) == 15);
    struct allocation_outcome none = allocation_under(allocation, 2);
    assert_true(none.left == 15 && none.effort == 0);
    struct allocation_outcome twice = allocation_under(allocation, 0.1);
    assert_true(is_about(twice.left, 5 * exp2(-1.5) + 10 * exp2(-3)));
    assert_true(is_about(twice.effort, 20 + 40 * pow(3, EFFORT_POWER)));
    allocation_add(allocation, 1, 4, 0, 0); /* never */
    allocation_add(allocation, 2, 8, 0, 0);
    assert_true(is_about(allocation_under(allocation, 0.1).left, twice.left + 12));
    allocation_destroy(allocation);
}

/* The limit for a goal leaves at most the goal, and the next higher limit leaves more. */
static void test_limit(void **state)
{
    struct allocation *allocation = allocation_create(1);
    for (int i = 1; i < 40; i++)
        allocation_add(allocation, exp2(-0.3 * i), i, 1, 3);
    double most = allocation_squares(allocation), least = allocation_under(allocation, 0).left;
    for (double share = 0.1; share < 1; share += 0.1) {
        double goal = share * most, limit = allocation_limit(allocation, goal);
        double left = allocation_under(allocation, limit).left;
        assert_true(left <= goal && allocation_under(allocation, 1.126 * limit).left > goal);
        /* A goal that can be reached exactly is reached exactly. */
        assert_true(allocation_under(allocation, allocation_limit(allocation, left)).left == left);
    }
    assert_true(allocation_limit(allocation, least) > 0);
    assert_true(allocation_limit(allocation, 0.99 * least) == 0);
    allocation_destroy(allocation);
}

/* The pixels of test_limit_within(), one by one: the effort that they take under a limit. */
static double effort_under(double limit)
{
    double effort = 0;
    for (int i = 1; i < 40; i++)
        effort += i * pow(exp2(allocation_doublings(exp2(-0.3 * i), limit, 3)) - 1, EFFORT_POWER);
    return effort;
}

/* The limit within an effort takes at most that effort, also of the pixels one by one, and the next lower limit takes
 * more. */
static void test_limit_within(void **state)
{
    struct allocation *allocation = allocation_create(1);
    for (int i = 1; i < 40; i++)
        allocation_add(allocation, exp2(-0.3 * i), 1, i, 3);
    double most = allocation_under(allocation, 0).effort;
    for (double share = 0.01; share < 1; share += 0.09) {
        double effort = share * most, limit = allocation_limit_within(allocation, effort);
        double taken = allocation_under(allocation, limit).effort;
        assert_true(taken > 0 && taken <= effort && effort_under(limit) <= 1.000001 * effort);
        assert_true(allocation_under(allocation, limit / 1.126).effort > effort);
        limit = allocation_limit_within(allocation, taken);
        assert_true(allocation_under(allocation, limit).effort == taken);
    }
    double limit = allocation_limit_within(allocation, 2 * most);
    assert_true(allocation_under(allocation, limit).effort == most);
    /* The least there is, if even that is too much; all, if nobody knows what it takes. */
    for (int i = 0; i < 2; i++) {
        limit = allocation_limit_within(allocation, 0.9 * i);
        assert_true(allocation_under(allocation, limit).effort == 1);
    }
    limit = allocation_limit_within(allocation, (double)NAN);
    assert_true(allocation_under(allocation, limit).effort == most);
    allocation_destroy(allocation);
    allocation = allocation_create(1);
    assert_true(allocation_limit_within(allocation, 1) == 0);
    allocation_add(allocation, 1, 1, 1, 0);
    assert_true(allocation_limit_within(allocation, 1) == 0);
    allocation_destroy(allocation);
}

/* A gain of nothing is not worth a sample, however small, and one beyond all pictures is; nothing is lost. */
static void test_extremes(void **state)
{
    const double gains[] = {0, 1e-300, 0x1p-120, 0x1p99, 0x1p100, 1e300};
    struct allocation *allocation = allocation_create(1);
    for (int i = 0; i < 6; i++)
        allocation_add(allocation, gains[i], exp2(i), 1, 1);
    assert_true(allocation_squares(allocation) == 63);
    assert_true(allocation_under(allocation, HUGE_VAL).left == 63);
    double least = allocation_under(allocation, 1e-30).left;
    assert_true(is_about(least, 1 + 2 + 4 + (8 + 16 + 32) * exp2(-1.5)));
    allocation_destroy(allocation);
}

/* Two allocations with a part of the pixels each, joined, equal one with all pixels, also where only the other has
 * pixels of some gain. */
static void test_join(void **state)
{
    struct allocation *whole = allocation_create(1), *halves[2];
    for (int half = 0; half < 2; half++)
        halves[half] = allocation_create(1);
    for (int i = 0; i < 64; i++) {
        double gain = exp2(i / 4 - 8);
        allocation_add(whole, gain, gain, i, (unsigned)i % LEVEL_MAX);
        allocation_add(halves[i % 2 || i >= 48], gain, gain, i, (unsigned)i % LEVEL_MAX);
    }
    allocation_join(halves[0], halves[1]);
    assert_true(allocation_squares(halves[0]) == allocation_squares(whole));
    for (double limit = 1e-3; limit < 1e3; limit *= 7) {
        struct allocation_outcome a = allocation_under(whole, limit),
                                  b = allocation_under(halves[0], limit);
        assert_true(a.left == b.left && a.effort == b.effort);
    }
    for (int half = 0; half < 2; half++)
        allocation_destroy(halves[half]);
    allocation_destroy(whole);
}

/* Pixels that are all alike, with a gain where two bins meet: what is reckoned with comes. */
static void test_alike(void **state)
{
    for (int eighths = 8; eighths < 16; eighths++) {
        double gain = eighths / 64.0;
        struct allocation *allocation = allocation_create(1);
        allocation_add(allocation, gain, 1, 1, LEVEL_MAX);
        double limit = allocation_limit(allocation, 0.5);
        assert_true(allocation_under(allocation, limit).left == exp2(-1.5));
        assert_int_equal(allocation_doublings(gain, limit, LEVEL_MAX), 1);
        allocation_destroy(allocation);
    }
}

/* If all errors are scaled by 2^k, the results are the same, bit for bit. */
static void test_brightness(void **state)
{
    const int powers[] = {-400, -160, 150, 300};
    for (int i = 0; i < 4; i++) {
        double unit = ldexp(1, powers[i]);
        struct allocation *plain = allocation_create(5), *scaled = allocation_create(5 * unit);
        for (int k = 1; k < 40; k++) {
            allocation_add(plain, exp2(-0.3 * k), k, 1, 3);
            allocation_add(scaled, exp2(-0.3 * k) * unit, k * unit, 1, 3);
        }
        double limit = allocation_limit(plain, 100);
        assert_true(limit > 0 && allocation_limit(scaled, 100 * unit) == limit * unit);
        struct allocation_outcome left = allocation_under(plain, limit),
                                  scaled_left = allocation_under(scaled, limit * unit);
        assert_true(scaled_left.left == left.left * unit && scaled_left.effort == left.effort);
        allocation_destroy(plain);
        allocation_destroy(scaled);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_doublings), cmocka_unit_test(test_outcome),
        cmocka_unit_test(test_limit),     cmocka_unit_test(test_limit_within),
        cmocka_unit_test(test_extremes),  cmocka_unit_test(test_join),
        cmocka_unit_test(test_alike),     cmocka_unit_test(test_brightness),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
