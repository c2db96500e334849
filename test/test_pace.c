/* Tests of the pace: how fast renderers are, how much work they get, and how long the master may sleep. */
#include <math.h>

#include "master/pace.h"
#include "test/near.h"
#include "test/unit.h"

/* The fixed cost of answers if pixels cost 4 ns each, and if it cannot be determined because all answers have the same
 * number of pixels. */
static void test_service(void **state)
{
    struct pace pace;
    pace_init(&pace, 44);
    for (int i = 0; i < 200; i++) {
        double pixels = 64 * (1 + i * 7 % 30);
        pace_served(&pace, 1e-6 + 4e-9 * pixels, pixels);
    }
    assert_close(pace.service_s, 1e-6, 0.01);
    for (int i = 0; i < 400; i++)
        pace_served(&pace, 5e-6, 1000);
    assert_true(pace.service_s > 0 && pace.service_s <= 5e-6 * 1.001);
    pace_free(&pace);
    pace_init(&pace, 44);
    for (int i = 0; i < 50; i++)
        pace_served(&pace, 5e-6, 1000);
    assert_close(pace.service_s, 5e-6, 1e-6);
    pace_free(&pace);
}

/* Where a unit of work takes two seconds, one that is four times as fast takes half a second. */
static void test_faster_take_less(void **state)
{
    struct pace pace;
    pace_init(&pace, 2);
    pace.scale = 2;
    pace.renderers[1].speed = 4;
    assert_true(pace_seconds(&pace, 0, 3) == 6 && pace_seconds(&pace, 1, 3) == 1.5);
    pace_free(&pace);
}

/* Two renderers answer for one unit of work each, which takes them so many seconds, a hundred times. */
static void work_both(struct pace *pace, double *now, double first_s, double second_s)
{
    for (int i = 0; i < 100; i++) {
        pace_given(pace, 0, *now, 1);
        pace_given(pace, 1, *now, 1);
        *now += fmax(first_s, second_s);
        pace_answered(pace, 0, *now, 1, first_s, false);
        pace_answered(pace, 1, *now, 1, second_s, false);
    }
}

/* The speed of a renderer is measured by what its answers take it, in terms of the mean of all, and by the last ones
 * more than by the first ones. */
static void test_speeds(void **state)
{
    struct pace pace;
    double now = 0;
    pace_init(&pace, 2);
    pace.total = 1000;
    work_both(&pace, &now, 1, 3);
    assert_near(pace.renderers[0].speed, 2, 0.05);
    assert_near(pace.renderers[1].speed, 2.0 / 3, 0.05);
    work_both(&pace, &now, 3, 1);
    double mean = 2; /* seconds of both, over all answers */
    assert_true(pace.renderers[0].speed < 1 && pace.renderers[0].speed > mean / 3);
    assert_true(pace.renderers[1].speed > 1 && pace.renderers[1].speed < mean / 1);
    pace_free(&pace);
}

/* A first answer counts as much as an average lot at the speed of 1 that is assumed before: 2 s here. */
static void test_first_answer(void **state)
{
    struct pace pace;
    pace_init(&pace, 2);
    pace_given(&pace, 0, 0, 1);
    pace_given(&pace, 1, 0, 1);
    pace_answered(&pace, 0, 3, 1, 1, false);
    pace_answered(&pace, 1, 3, 1, 3, false);
    assert_near(pace.renderers[1].speed, (2 + 2) / (2 + 3.0), 1e-9);
    pace_free(&pace);
}

/* A renderer that has enough to do until all will be done gets no more of it. */
static void test_enough_until_the_end(void **state)
{
    struct pace pace;
    double now = 0;
    pace_init(&pace, 2);
    pace.total = 100;
    work_both(&pace, &now, 1, 1);
    pace_given(&pace, 0, now, 10);
    assert_near(pace_even_end(&pace, now, 4), (4 + 10) / 2.0, 1e-9);
    assert_true(pace_lot(&pace, 0, now, 4).work == 0 && pace_lot(&pace, 1, now, 4).work > 0);
    assert_true(pace_lot(&pace, 0, now, 40).work > 0);
    pace_free(&pace);
}

/* A lot of one second of work. */
static void work_once(struct pace *pace, double *now)
{
    pace_given(pace, 0, *now, 1);
    *now += 1;
    pace_answered(pace, 0, *now, 1, 1, false);
}

/* Lots are short enough for progress to show a few times per second, unless answers would then keep the master busy. */
static void test_longest_lot(void **state)
{
    struct pace pace;
    double now = 0;
    pace_init(&pace, 4);
    pace.total = 100;
    for (int i = 0; i < 20; i++)
        work_once(&pace, &now);
    pace_served(&pace, 1e-6, 1);
    assert_close(pace_seconds(&pace, 0, pace_lot(&pace, 0, now, 100).work), 0.25, 1e-6);
    for (int i = 0; i < 400; i++)
        pace_served(&pace, 1e-2, 1);
    assert_true(pace_seconds(&pace, 0, pace_lot(&pace, 0, now, 100).work) > 1);
    pace_free(&pace);
}

/* Partial answers to lots come a few times per second, however few renderers there are. Where so many send them, they
 * come less often: all together take the master half a hundredth of its time. */
static void test_partial_answers(void **state)
{
    static const uint32_t counts[] = {1, 2, 8, 250, 2500};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        struct pace pace;
        pace_init(&pace, counts[i]);
        for (int k = 0; k < 20; k++)
            pace_served(&pace, 5e-6, 1000);
        assert_close(pace_answer_after(&pace), fmax(0.25, 1e-3 * counts[i]), 1e-6);
        pace_free(&pace);
    }
}

/* pace_calm() is the time until the first working renderer is done; late ones do not count. */
static void test_calm(void **state)
{
    struct pace pace;
    pace_init(&pace, 2);
    assert_true(pace_calm(&pace, 0) == 0);
    pace_given(&pace, 0, 0, 10);
    assert_true(pace_calm(&pace, 0) == 0); /* it is not known how long that takes */
    pace_answered(&pace, 0, 20, 10, 20, false);
    assert_true(pace_calm(&pace, 20) == 0);
    pace_given(&pace, 0, 20, 4);
    double alone = pace_calm(&pace, 20);
    assert_true(alone > 4 && alone < 10);
    pace_given(&pace, 1, 20, 1);
    double both = pace_calm(&pace, 20);
    assert_true(both > 0 && both < alone);
    assert_close(pace_calm(&pace, 20.5), both - 0.5, 1e-9);
    assert_true(pace_calm(&pace, 20 + 1.001 * both) == 0);
    pace_check(&pace, 1000);
    assert_true(pace_calm(&pace, 20) == 0);
    pace_free(&pace);
}

/* Predictions from the first answers are trusted for no longer than these took, in the mean of all renderers. */
static void test_calm_of_few_answers(void **state)
{
    struct pace pace;
    pace_init(&pace, 4);
    for (uint32_t i = 0; i < 4; i++)
        pace_given(&pace, i, 0, 100);
    pace_answered(&pace, 0, 1, 1, 1, true);
    assert_close(pace_calm(&pace, 1), 0.25, 1e-9);
    for (uint32_t i = 1; i < 4; i++)
        pace_answered(&pace, i, 1, 1, 1, true);
    assert_close(pace_calm(&pace, 1), 1, 1e-9);
    pace_free(&pace);
}

/* A renderer that has just been given work may become late, too; more work gives it more time. */
static void test_late(void **state)
{
    struct pace pace;
    pace_init(&pace, 2);
    assert_true(isinf(pace_next_late(&pace)));
    pace_given(&pace, 0, 0, 1);
    assert_true(isinf(pace_next_late(&pace))); /* it is not known how long that takes */
    pace_answered(&pace, 0, 2, 1, 2, false);
    assert_true(isinf(pace_next_late(&pace)));
    pace_given(&pace, 0, 2, 1);
    double first = pace_next_late(&pace);
    assert_true(first > pace.renderers[0].free_at && first < 1000);
    pace_given(&pace, 0, 2, 1);
    double both = pace_next_late(&pace);
    assert_true(both > first + 1 && both < 1000);
    assert_false(pace_check(&pace, 0.999 * both));
    assert_true(pace_check(&pace, 1.001 * both));
    assert_true(pace.renderers[0].is_overdue && isinf(pace_next_late(&pace)));
    pace_free(&pace);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_service),
        cmocka_unit_test(test_faster_take_less),
        cmocka_unit_test(test_speeds),
        cmocka_unit_test(test_first_answer),
        cmocka_unit_test(test_enough_until_the_end),
        cmocka_unit_test(test_longest_lot),
        cmocka_unit_test(test_partial_answers),
        cmocka_unit_test(test_calm),
        cmocka_unit_test(test_calm_of_few_answers),
        cmocka_unit_test(test_late),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
