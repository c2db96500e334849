/* Tests how much of a run is done, in seconds, if the error of predictions depends on the kind of tile. */
#include <math.h>
#include <stdlib.h>

#include "master/outlook.h"
#include "test/near.h"
#include "test/unit.h"

static void test_nothing(void **state)
{
    struct outlook outlook = {0};
    assert_near(outlook_share(&outlook).finished, 0, 0);
    outlook_add(&outlook, 0, 64);
    assert_near(outlook_share(&outlook).finished, 0, 0);
}

/* 10 expensive tiles take 1 s each, as predicted; 90 cheap ones take five times what is predicted, 0.1 s instead of
 * 0.02 s. A few finished cheap tiles show that. */
static void test_kinds(void **state)
{
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

/* If no tile of a class is finished, the nearest class is used. */
static void test_neighbours(void **state)
{
    struct outlook outlook = {0};
    outlook_finish(&outlook, 100, 64, 100);
    outlook_finish(&outlook, 1, 64, 3);
    outlook_add(&outlook, 0.5, 64);
    double left = 0.5 * 3; /* approximately, as the class of the expensive ones is far away */
    assert_near(outlook_share(&outlook).finished, 103 / (103 + left), 0.001);
}

static void test_skipped(void **state)
{
    struct outlook outlook = {0};
    outlook_skip(&outlook, 30, 64);
    outlook_add(&outlook, 60, 64);
    outlook_finish(&outlook, 10, 64, 20);
    struct outlook_share share = outlook_share(&outlook);
    assert_near(share.finished, 0.4, 1e-12);
    assert_near(share.skipped, 0.3, 1e-12);
}

/* By rounding, more may be subtracted than was added. */
static void test_never_more_than_all(void **state)
{
    struct outlook outlook = {0};
    outlook_add(&outlook, 1, 64);
    outlook_remove(&outlook, 1 + 1e-9, 64);
    outlook_finish(&outlook, 1, 64, 1);
    assert_true(outlook_share(&outlook).finished == 1);
}

/* Work beyond all octaves, and no work. */
static void test_extremes(void **state)
{
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
