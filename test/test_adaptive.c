/* Whole runs of adaptive sampling: when they end, what does not change them, and which pixels get samples. */
#include <math.h>
#include <string.h>

#include "master/watch.h"
#include "test/adaptive_runs_fixture.h"
#include "test/unit.h"

/* What a run comes to, without its picture. */
static struct result outcome(scene_function *f, const struct view *view, double target)
{
    struct result result;
    run(&result, f, view, target, 32, false);
    drop(&result);
    return result;
}

static double flat(double x, double y)
{
    (void)x, (void)y;
    return 0.7;
}

static void test_flat_needs_one_pass(void **state)
{
    struct view view = view_of(4, 1024);
    struct result result = outcome(flat, &view, 1e-4);
    assert_int_equal(result.passes, 1);
    assert_true(result.samples == 4 && result.estimated == 0);
    /* Without a target, too, there is nothing more to be found. */
    assert_int_equal(outcome(flat, &view, 0).passes, 1);
}

/* Squares of whole pixels: within a pixel nothing differs, and yet something might be hidden at their borders. */
static double squares(double x, double y)
{
    return fmod(floor(x / 6) + floor(y / 6), 2);
}

static void test_contrast_is_looked_into(void **state)
{
    struct view view = view_of(4, 16);
    struct result result = outcome(squares, &view, 0);
    assert_true(result.passes > 1 && result.samples > 4 && result.estimated == 0);
}

/* One thread and several plan the same, bit for bit. */
static void test_pools_plan_the_same(void **state)
{
    struct view view = view_of(4, 1024);
    struct result alone, together;
    run(&alone, ball, &view, 0.001, 16, false);
    struct thread_pool *pool = thread_pool_create(3);
    canvas_init(&together.canvas, EDGE, EDGE);
    together.adaptive = adaptive_create(&view, &together.canvas, 0.001);
    adaptive_set_pool(together.adaptive, pool);
    do
        render_pass(together.adaptive, &view, ball, 16, false);
    while (adaptive_plan(together.adaptive, HUGE_VAL));
    assert_int_equal(alone.passes, adaptive_passes(together.adaptive));
    assert_true(alone.passes > 2);
    assert_memory_equal(alone.canvas.rgb, together.canvas.rgb, 3 * PIXELS * sizeof(float));
    thread_pool_destroy(pool);
    drop(&alone);
    drop(&together);
}

/* In the error log, the row after the last pass shows that the target is met, and those after earlier passes that it
 * was not, however many rows were added in between. */
static void test_rows_show_why_it_ended(void **state)
{
    const double target = 0.002;
    struct view view = view_of(4, 1024);
    struct canvas canvas;
    canvas_init(&canvas, EDGE, EDGE);
    struct adaptive *adaptive = adaptive_create(&view, &canvas, target);
    struct watch watch = {.canvas = &canvas, .adaptive = adaptive};
    assert_true(watch_start(&watch, NULL));
    double now = 0, high;
    do {
        render_pass(adaptive, &view, ball, 16, false);
        for (int i = 0; i < 10; i++)
            watch_look(&watch, now = 2 * now + 1);
        watch_pass(&watch, now);
        high = watch.log.rows[watch.log.count - 1].estimate.high;
        assert_true((high <= target) == !adaptive_plan(adaptive, HUGE_VAL));
    } while (high > target);
    assert_true(adaptive_passes(adaptive) > 2 && adaptive_is_met(adaptive));
    watch_free(&watch);
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

/* How the passes are cut into tiles, and in what order these come back, changes no bit. */
static void test_tiles_do_not_matter(void **state)
{
    struct view view = view_of(4, 1024);
    struct result first;
    run(&first, ball, &view, 0.002, 32, false);
    assert_true(first.passes > 2);
    const uint32_t edges[] = {96, 17, 5};
    for (int i = 0; i < 3; i++) {
        struct result other;
        run(&other, ball, &view, 0.002, edges[i], i != 1);
        assert_int_equal(other.passes, first.passes);
        assert_true(other.samples == first.samples);
        assert_memory_equal(other.canvas.rgb, first.canvas.rgb, PIXELS * 3 * sizeof(float));
        drop(&other);
    }
    drop(&first);
}

static double light = 1;

static double lit_ball(double x, double y)
{
    return light * ball(x, y);
}

/* The same picture in another unit of light gets the same samples, also where squares of its errors would leave the
 * range of floats. */
static void test_brightness_does_not_matter(void **state)
{
    static uint32_t wanted[PIXELS];
    const double lights[] = {1, 0x1p80, 0x1p-80};
    struct view view = view_of(4, 1024);
    unsigned passes = 0;
    for (int i = 0; i < 3; i++) {
        struct result result;
        light = lights[i];
        run(&result, lit_ball, &view, 0.002 * light, 16, false);
        assert_true(adaptive_is_met(result.adaptive));
        if (i == 0) memcpy(wanted, sampled, sizeof wanted);
        if (i == 0) passes = result.passes;
        assert_int_equal(result.passes, passes);
        assert_memory_equal(sampled, wanted, sizeof wanted);
        drop(&result);
    }
    assert_true(passes > 2);
}

/* The first samples meet the wire in few of its pixels; from these nearly all of the others are found. */
static void test_wire_is_followed(void **state)
{
    struct view view = view_of(4, 4096);
    struct result result;
    run(&result, wire, &view, 0.003, 32, false);
    unsigned met = 0, refined = 0;
    for (uint32_t x = 0; x < EDGE; x++)
        refined += sampled[(uint32_t)wire_at(x + 0.5) * EDGE + x] >= 16;
    struct canvas first_canvas;
    canvas_init(&first_canvas, EDGE, EDGE);
    struct adaptive *first = adaptive_create(&view, &first_canvas, 0);
    render_pass(first, &view, wire, 32, false);
    for (uint32_t x = 0; x < EDGE; x++) {
        uint32_t y = (uint32_t)wire_at(x + 0.5);
        met += (double)first_canvas.rgb[3 * (y * EDGE + x)] > 0.11;
    }
    assert_true(met < EDGE / 2);
    assert_true(refined >= EDGE * 95 / 100);
    adaptive_destroy(first);
    canvas_free(&first_canvas);
    drop(&result);
}

static void test_max_samples_end_it(void **state)
{
    struct view view = view_of(2, 12);
    double high = outcome(ball, &view, 1e-9).high;
    uint32_t most = 0;
    for (uint32_t i = 0; i < PIXELS; i++)
        if (sampled[i] > most) most = sampled[i];
    assert_int_equal(most, 12);
    assert_true(high > 1e-9);
    /* Without a target, but with plenty of time, all pixels get them. */
    assert_true(outcome(ball, &view, 0).samples == 12);
}

/* Where max_samples keep the target out of reach, not all pixels get them: be it that those with an error come to
 * max_samples in a pass, or in several. */
static void test_out_of_reach(void **state)
{
    for (uint32_t most = 64; most <= 1024; most *= 4) {
        struct view view = view_of(4, most), all_view = view_of(most - 2, most);
        struct result result = outcome(ball, &view, 1e-5), all = outcome(ball, &all_view, 1);
        assert_int_equal(all.passes, 1);
        assert_true(result.high > 1e-5);
        assert_true(result.estimated < 1.1 * all.estimated);
        assert_true(result.samples < 0.15 * all.samples);
    }
}

/* A target that max_samples just reach is met; one that they miss does not make all pixels get them. */
static void test_just_in_reach(void **state)
{
    struct view view = view_of(4, 64);
    double least = outcome(ball, &view, 1e-6).high;
    assert_true(outcome(ball, &view, 1.03 * least).high <= 1.03 * least);
    struct result missed = outcome(ball, &view, 0.7 * least);
    assert_true(missed.high > 0.7 * least && missed.samples < 0.15 * 64);
}

/* A target that max_samples of all pixels meet is met, although less was expected of them. */
static void test_better_than_expected(void **state)
{
    struct view view = view_of(4, 64);
    double least = outcome(scattered, &view, 0).high;
    assert_true(outcome(scattered, &view, 1.1 * least).high <= 1.1 * least);
}

/* A pixel that is not finite, or whose contrast is not, spoils neither the estimate nor the plan of the
 * others. */
static double broken(double x, double y)
{
    return x > 10 && x < 11 && y > 10 && y < 11 ? (double)NAN : ball(x, y);
}

static double blinding(double x, double y)
{
    return x > 10 && x < 11 && y > 10 && y < 11 ? 1e25 : ball(x, y);
}

static void test_not_finite(void **state)
{
    struct view view = view_of(4, 256);
    double good = outcome(ball, &view, 0.004).samples;
    scene_function *const scenes[] = {broken, blinding};
    for (int i = 0; i < 2; i++) {
        struct result bad = outcome(scenes[i], &view, 0.004);
        assert_true(bad.high <= 0.004);
        assert_true(fabs(bad.samples - good) < 0.1 * good);
    }
}

/* To plan by a limit that no pixel reaches, as a journal of unknown origin may have, changes nothing. */
static void test_vain_plan_changes_nothing(void **state)
{
    struct view view = view_of(4, 1024);
    struct result plain, disturbed;
    run(&plain, scattered, &view, 0.012, 16, false);
    canvas_init(&disturbed.canvas, EDGE, EDGE);
    disturbed.adaptive = adaptive_create(&view, &disturbed.canvas, 0.012);
    do {
        render_pass(disturbed.adaptive, &view, scattered, 16, false);
        assert_false(adaptive_replan(disturbed.adaptive, 1e300));
    } while (adaptive_plan(disturbed.adaptive, HUGE_VAL));
    assert_true(plain.passes > 3);
    assert_int_equal(plain.passes, adaptive_passes(disturbed.adaptive));
    assert_memory_equal(plain.canvas.rgb, disturbed.canvas.rgb, 3 * PIXELS * sizeof(float));
    drop(&plain);
    drop(&disturbed);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_flat_needs_one_pass),
        cmocka_unit_test(test_contrast_is_looked_into),
        cmocka_unit_test(test_pools_plan_the_same),
        cmocka_unit_test(test_rows_show_why_it_ended),
        cmocka_unit_test(test_tiles_do_not_matter),
        cmocka_unit_test(test_brightness_does_not_matter),
        cmocka_unit_test(test_wire_is_followed),
        cmocka_unit_test(test_max_samples_end_it),
        cmocka_unit_test(test_out_of_reach),
        cmocka_unit_test(test_just_in_reach),
        cmocka_unit_test(test_better_than_expected),
        cmocka_unit_test(test_not_finite),
        cmocka_unit_test(test_vain_plan_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
