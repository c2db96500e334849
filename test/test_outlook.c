/* How much of a run is done: in seconds, where predictions are off by kind. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "master/outlook.h"

static void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance)) fail_msg("%g instead of %g", value, expected);
}

static void test_nothing(void **state)
{
    (void)state;
    struct outlook outlook = {0};
    assert_near(outlook_share(&outlook).finished, 0, 0);
    outlook_add(&outlook, 0, 64);
    assert_near(outlook_share(&outlook).finished, 0, 0);
}

/* 10 dear tiles of 1 second each as predicted, 90 cheap ones that take five times what is predicted:
 * 0.1 s in place of 0.02 s. A sample of the cheap ones tells. */
static void test_kinds(void **state)
{
    (void)state;
    struct outlook outlook = {0};
    for (int i = 0; i < 10; i++)
        outlook_add(&outlook, 1, 64);
    for (int i = 0; i < 90; i++)
        outlook_add(&outlook, 0.02, 64);
    assert_near(outlook_share(&outlook).finished, 0, 0);
    for (int i = 0; i < 3; i++) {
        outlook_remove(&outlook, 0.02, 64);
        outlook_finish(&outlook, 0.02, 64, 0.1);
    }
    for (int i = 0; i < 10; i++) {
        outlook_remove(&outlook, 1, 64);
        outlook_finish(&outlook, 1, 64, 1);
    }
    /* All of the predicted work but 15 % is done, but 46 % of the seconds are left. */
    assert_near(outlook_share(&outlook).finished, 10.3 / 19, 0.01);
    assert_near(outlook_share(&outlook).seconds, 19, 0.4);
    for (int i = 0; i < 87; i++) {
        outlook_remove(&outlook, 0.02, 64);
        outlook_finish(&outlook, 0.02, 64, 0.1);
        double expected = (10.4 + 0.1 * i) / 19;
        assert_near(outlook_share(&outlook).finished, expected, 0.01);
    }
    assert_near(outlook_share(&outlook).finished, 1, 1e-12);
    assert_near(outlook_share(&outlook).seconds, 19, 1e-9);
}

/* Where nothing of a kind is finished, the nearest kind tells. */
static void test_neighbours(void **state)
{
    (void)state;
    struct outlook outlook = {0};
    outlook_finish(&outlook, 100, 64, 100);
    outlook_finish(&outlook, 1, 64, 3);
    outlook_add(&outlook, 0.5, 64);
    double left = 0.5 * 3; /* about: the dear ones are far away */
    assert_near(outlook_share(&outlook).finished, 103 / (103 + left), 0.001);
}

static void test_skipped(void **state)
{
    (void)state;
    struct outlook outlook = {0};
    outlook_skip(&outlook, 30, 64);
    outlook_add(&outlook, 60, 64);
    outlook_finish(&outlook, 10, 64, 20);
    struct outlook_share share = outlook_share(&outlook);
    assert_near(share.finished, 0.4, 1e-12);
    assert_near(share.skipped, 0.3, 1e-12);
}

/* What was taken off may be a little more than what was put there. */
static void test_never_more_than_all(void **state)
{
    (void)state;
    struct outlook outlook = {0};
    outlook_add(&outlook, 1, 64);
    outlook_remove(&outlook, 1 + 1e-9, 64);
    outlook_finish(&outlook, 1, 64, 1);
    assert_true(outlook_share(&outlook).finished == 1);
}

/* Work beyond all octaves, and none. */
static void test_extremes(void **state)
{
    (void)state;
    struct outlook outlook = {0};
    outlook_add(&outlook, 1e300, 1);
    outlook_add(&outlook, 1e-300, 1);
    outlook_add(&outlook, 0, 1);
    outlook_finish(&outlook, 1e-300, 1, 1e-9);
    double share = outlook_share(&outlook).finished;
    assert_true(share >= 0 && share <= 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nothing),
        cmocka_unit_test(test_kinds),
        cmocka_unit_test(test_neighbours),
        cmocka_unit_test(test_skipped),
        cmocka_unit_test(test_never_more_than_all),
        cmocka_unit_test(test_extremes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
