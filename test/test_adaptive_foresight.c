/* The seconds that adaptive sampling predicts for a lower error, and what it learns from passes for that. */
#include <math.h>

#include "test/adaptive_by_hand_fixture.h"
#include "test/adaptive_runs_fixture.h"
#include "test/unit.h"

/* Stripes of one to two pixels' width. */
static double stripes(double x, double y)
{
    return fmod(0.31 * x + y, 3) < 1.25 ? 0.9 : 0.1;
}

/* The seconds that a run to an error of `goal` predicts for a lower error, divided by those that a run to finer_goal
 * takes. The first run must take less than this part of the other one's time. It learns how slow later passes are. */
static double foresight(scene_function *f, double goal, double finer_goal, double part)
{
    struct view view = view_of(4, 4096);
    struct result coarse, fine;
    run(&fine, f, &view, finer_goal, 32, false);
    run(&coarse, f, &view, goal, 32, false);
    double before = adaptive_seconds(coarse.adaptive), took = adaptive_seconds(fine.adaptive);
    double foreseen = before + forecast_of(coarse.adaptive, fine.estimated, 1.5);
    assert_true(before < part * took);
    /* The power that is passed in counts only as long as no later pass has told another one. */
    double told = before + forecast_of(coarse.adaptive, fine.estimated, 2);
    assert_true(fabs(told / foreseen - 1) < 1e-12);
    assert_true(forecast_of(coarse.adaptive, 1, 1.5) == 0);
    drop(&fine);
    drop(&coarse);
    return foreseen / took;
}

/* Predictions from runs to many goals are right within the factor mean_within in the mean, nearly all of them within
 * the factor `within`. */
static void check_foresight(scene_function *f, double mean_within, double within)
{
    double sum = 0;
    const int goals = 32;
    int far = 0;
    for (int k = 0; k < goals; k++) {
        double goal = 0.03 * pow(0.96, k), off = log(foresight(f, goal, goal / 2, 0.9));
        far += !(fabs(off) < log(within));
        if (!(fabs(off) < 2 * log(within))) fail_msg("goal %g: foreseen %g times", goal, exp(off));
        sum += off;
    }
    if (!(fabs(sum / goals) < log(mean_within)))
        fail_msg("foreseen %g times in the mean", exp(sum / goals));
    if (far > 2) fail_msg("%d of %d foresights are off by more than %g times", far, goals, within);
}

/* In pictures whose error is in many pixels. The first samples miss many of the balls. */
static void test_seconds_are_foreseen(void **state)
{
    assert_true(fabs(foresight(stripes, 0.02, 0.01, 0.7) - 1) < 0.1);
    check_foresight(stripes, 1.12, 1.25);
    check_foresight(balls, 1.2, 1.8);
    struct view view = view_of(4, 4096);
    struct result first, coarse;
    run(&first, balls, &view, 1, 32, false);
    assert_true(first.passes == 1);
    assert_true(forecast_of(first.adaptive, 0.02, 2) <
                0.9 * forecast_of(first.adaptive, 0.02, 1.5));
    drop(&first);
    /* So few samples are not enough for this error. */
    view.max_samples = 8;
    run(&coarse, ball, &view, 0.006, 32, false);
    assert_true(forecast_of(coarse.adaptive, 1e-5, 1.5) == HUGE_VAL);
    assert_true(adaptive_forecast(coarse.adaptive, 1e-3, 1.5, 8) == HUGE_VAL);
    assert_true(adaptive_forecast(coarse.adaptive, 1e-3, 1.5, 4096) < HUGE_VAL);
    drop(&coarse);
}

/* The next pass comes in, in 2 s, such that each pixel's error is this much afterwards. */
static void follow_even(struct adaptive *adaptive, double error)
{
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    assert_int_equal(adaptive_work(adaptive, &all).samples, MORE * ALL);
    put(adaptive, all,
        (struct sent){0.5f, 0, (float)((DENSE * 2 * error - 4 * 2 * EVEN) / MORE), {1, 1}}, 2);
}

/* The seconds that are predicted to 0.6 of this error, for which all samples are doubled. */
static double foresee_doubling(struct adaptive *adaptive, double error)
{
    return forecast_of(adaptive, 0.6 * error, 1.5);
}

/* After pass 0, as many samples again are predicted to take 1.26 times as long. Once later passes are in, what they
 * took counts, and that prediction with a fifth of pass 0's weight beside it. Samples of several passes are treated as
 * if all had come at once. How many rays pixels take does not matter where all take the same. */
static void test_seconds_of_a_doubling(void **state)
{
    struct canvas canvas;
    struct adaptive *adaptive = begin_even(&canvas, 1024, 1e-3);
    assert_true(fabs(foresee_doubling(adaptive, EVEN) - 1.26) < 1e-6);
    follow_even(adaptive, EVEN * sqrt(LEFT));
    double effort = pow(2 * DENSE - 4, EFFORT_POWER), had = pow(MORE, EFFORT_POWER);
    double all_s = effort * (2 + 0.2 * 1.26) / (had + 0.2 * pow(4, EFFORT_POWER));
    assert_true(fabs(foresee_doubling(adaptive, EVEN * sqrt(LEFT)) / (all_s - 2) - 1) < 0.001);
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
    struct view view = view_of(4, 1024);
    canvas_init(&canvas, WIDE, HIGH);
    adaptive = adaptive_create(&view, &canvas, 1e-3);
    put(adaptive, all, (struct sent){0.5f, 0, APART, {7, 7}}, 1);
    assert_true(fabs(foresee_doubling(adaptive, EVEN) - 1.26) < 1e-6);
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

/* A pass was expected to leave the part LEFT of the squared error: the more it has left, the more seconds are
 * predicted, and none if the error has grown. */
static void test_promises_are_kept_in_mind(void **state)
{
    const double left[] = {LEFT, 2 * LEFT, 1, 100};
    double before = 0;
    for (int i = 0; i < 4; i++) {
        struct canvas canvas;
        struct adaptive *adaptive = begin_even(&canvas, 4096, 1e-3);
        double error = EVEN * sqrt(left[i]);
        follow_even(adaptive, error);
        assert_true(adaptive_plan(adaptive, HUGE_VAL));
        double foreseen = foresee_doubling(adaptive, error);
        assert_true(i < 3 ? foreseen > before && foreseen < HUGE_VAL : isnan(foreseen));
        before = foreseen;
        adaptive_destroy(adaptive);
        canvas_free(&canvas);
    }
}

/* Once the target is met, to ask for another pass changes nothing. */
static void test_asked_again(void **state)
{
    struct canvas canvas;
    double foreseen[250];
    struct adaptive *adaptive = begin_even(&canvas, 1024, EVEN / 1.5);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    assert_true(!adaptive_is_met(adaptive));
    put(adaptive, columns(0, 20), (struct sent){0.5f, 0, 0, {1, 1}}, 2);
    assert_true(!adaptive_is_met(adaptive)); /* which nobody knows before the pass is complete */
    put(adaptive, columns(20, 4), (struct sent){0.5f, 0, 0, {1, 1}}, 2);
    assert_true(adaptive_is_met(adaptive)); /* nobody has asked for another pass yet */
    assert_true(!adaptive_plan(adaptive, HUGE_VAL) && adaptive_is_met(adaptive));
    for (int i = 0; i < 250; i++)
        foreseen[i] = forecast_of(adaptive, 2e-4 * (i + 1), 1.5);
    assert_true(!adaptive_plan(adaptive, HUGE_VAL) && adaptive_is_met(adaptive));
    for (int i = 0; i < 250; i++)
        assert_true(forecast_of(adaptive, 2e-4 * (i + 1), 1.5) == foreseen[i]);
    assert_int_equal(adaptive_passes(adaptive), 2);
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

/* After the second pass all halves agree by chance, so that no error shows. The contrasts between pixels call for
 * another pass, and then seconds are predicted again. */
static void test_agreement_by_chance(void **state)
{
    struct view view = view_of(4, 4096);
    struct canvas canvas;
    struct sent sent = {0, 0.25f, 0.1875f, {1, 1}};
    canvas_init(&canvas, WIDE, HIGH);
    struct adaptive *adaptive = adaptive_create(&view, &canvas, 0);
    put(adaptive, all, sent, 1);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    sent.difference *= -4 * ALL / (float)adaptive_work(adaptive, &all).samples;
    put(adaptive, all, sent, 1);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    put(adaptive, all, sent, 1);
    double foreseen = forecast_of(adaptive, 0.002, 1.5);
    assert_true(foreseen > 0 && foreseen < HUGE_VAL);
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

/* Pixels that have max_samples cannot become better: no time is enough for a lower error. */
static void test_nothing_left_to_double(void **state)
{
    struct canvas canvas;
    struct adaptive *adaptive = begin_even(&canvas, DENSE, 1e-3);
    assert_true(foresee_doubling(adaptive, EVEN) < HUGE_VAL);
    follow_even(adaptive, EVEN / 2);
    assert_true(foresee_doubling(adaptive, EVEN / 2) == HUGE_VAL);
    assert_true(!adaptive_plan(adaptive, HUGE_VAL) && !adaptive_is_met(adaptive));
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

/* What a run with more max_samples would take does not depend on those of this run. */
static void test_with_more_max_samples(void **state)
{
    double foreseen[2];
    for (int i = 0; i < 2; i++) {
        struct canvas canvas;
        uint32_t most = i ? 64 : 4096;
        struct adaptive *adaptive = begin_even(&canvas, most, 1e-3);
        foreseen[i] = adaptive_forecast(adaptive, EVEN / 100, 1.5, 4096);
        adaptive_destroy(adaptive);
        canvas_free(&canvas);
    }
    assert_true(foreseen[0] > 0 && foreseen[0] < HUGE_VAL && foreseen[1] == foreseen[0]);
}

/* Where all halves agree, nothing tells what a lower error would take. */
static void test_no_error_shows(void **state)
{
    struct view view = view_of(4, 1024);
    struct canvas canvas;
    canvas_init(&canvas, WIDE, HIGH);
    struct adaptive *adaptive = adaptive_create(&view, &canvas, 0);
    put(adaptive, all, (struct sent){0.5f, 0, 0, {1, 1}}, 1);
    assert_true(isnan(forecast_of(adaptive, 1e-3, 1.5)));
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_seconds_are_foreseen),
        cmocka_unit_test(test_seconds_of_a_doubling),
        cmocka_unit_test(test_promises_are_kept_in_mind),
        cmocka_unit_test(test_asked_again),
        cmocka_unit_test(test_agreement_by_chance),
        cmocka_unit_test(test_nothing_left_to_double),
        cmocka_unit_test(test_with_more_max_samples),
        cmocka_unit_test(test_no_error_shows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
