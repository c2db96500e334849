/* How many samples the next pass gives to each pixel, by its error, by the cost of its samples and by the time there
 * is. */
#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "test/adaptive_by_hand_fixture.h"
#include "test/unit.h"

/* Pass 0 has come in, in 0.6 s; errors fall from the left to the right of the picture. */
static struct adaptive *begin_uneven(struct canvas *canvas)
{
    struct view view = view_of(4, 4096);
    canvas_init(canvas, WIDE, HIGH);
    struct adaptive *adaptive = adaptive_create(&view, canvas, 1e-3);
    for (uint32_t x = 0; x < WIDE; x += 4)
        put(adaptive, columns(x, 4), (struct sent){0.5f, 0, APART / (float)(1 + x), {1, 1}}, 0.1);
    return adaptive;
}

static void test_pass_within_seconds(void **state)
{
    const double seconds[] = {0, 0.2, 1, 3, 10, 1e6, HUGE_VAL};
    double any = 0;
    for (int i = 6; i >= 0; i--) {
        struct canvas canvas;
        struct adaptive *adaptive = begin_uneven(&canvas);
        assert_true(adaptive_plan(adaptive, seconds[i]) && adaptive_limit(adaptive) > 0);
        double samples = adaptive_work(adaptive, &all).samples;
        if (i == 6) any = samples;
        assert_true(samples > 0 && (samples == any) == (i > 3));
        /* 4 samples of each pixel took 0.6 s. Later ones take longer, but less so where a pixel gets more at once. */
        if (i > 0 && i < 4)
            assert_true(samples < 4 * ALL * seconds[i] / 0.6 * 1.2 &&
                        samples > 4 * ALL * seconds[i] / 0.6 * 0.4);
        adaptive_destroy(adaptive);
        canvas_free(&canvas);
    }
}

/* A plan can be made again from its limit. */
static void test_plan_by_its_limit(void **state)
{
    struct canvas canvases[2];
    struct adaptive *first = begin_uneven(&canvases[0]), *again = begin_uneven(&canvases[1]);
    assert_true(adaptive_limit(first) == 0);
    assert_true(adaptive_plan(first, 1));
    uint64_t plan = adaptive_plan_hash(first, &all);
    assert_true(adaptive_replan(again, adaptive_limit(first)));
    assert_true(adaptive_plan_hash(again, &all) == plan);
    assert_true(adaptive_limit(again) == adaptive_limit(first));
    assert_int_equal(adaptive_passes(again), 2);
    adaptive_destroy(again);
    canvas_free(&canvases[1]);
    again = begin_uneven(&canvases[1]);
    assert_true(adaptive_plan(again, HUGE_VAL));
    assert_true(adaptive_plan_hash(again, &all) != plan);
    adaptive_destroy(first);
    adaptive_destroy(again);
    for (int i = 0; i < 2; i++)
        canvas_free(&canvases[i]);
}

/* The squared error that a pass is expected to remove follows from the spread of all samples: within each pass, and
 * between passes. */
static void test_spread_of_all_passes(void **state)
{
    const struct sent later = {0.875f, 0, -0.0078125f, {1, 1}};
    struct canvas canvas;
    struct adaptive *adaptive = begin_even(&canvas, 4096, 1e-4);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    assert_int_equal(adaptive_work(adaptive, &all).samples, MORE * ALL);
    put(adaptive, all, later, 2);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    struct adaptive_work work = adaptive_work(adaptive, &all);
    assert_int_equal(work.samples, (16 - 1) * DENSE * ALL);
    double apart = (double)APART, more = (double)later.difference;
    double half = ((0.875 - 0.5) * (0.875 - 0.5) + (apart - more) * (apart - more) / 4) * 4 * MORE /
                  (DENSE * DENSE);
    double spread = ((4 * apart * apart + MORE * more * more) / DENSE + half) * DENSE / (DENSE - 2);
    double error = (4 * apart + MORE * more) / (2 * DENSE),
           variance = error * error * pow(DENSE, 1.5);
    double ratio = (variance + spread / 4) / (spread + spread / 4);
    double expected = (4 * variance + (DENSE - 2) * ratio * spread) / (DENSE + 2) / pow(DENSE, 1.5);
    assert_true(fabs(work.removed / (ALL * expected * (1 - LEFT)) - 1) < 1e-5);
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

/* Of pixels with the same error, those whose samples cost less get more. A sample counts as one ray at least, whatever
 * number comes in. */
static void test_dear_pixels_get_less(void **state)
{
    const float rays[] = {1, 0, NAN, HUGE_VALF};
    struct view view = view_of(4, 1024);
    struct canvas canvas;
    struct refinement cheap, dear;
    struct tile cheap_one = {.w = 1, .h = 1, .step = 1},
                dear_one = {.x = 12, .w = 1, .h = 1, .step = 1};
    for (int i = 0; i < 4; i++) {
        canvas_init(&canvas, WIDE, HIGH);
        struct adaptive *adaptive = adaptive_create(&view, &canvas, 0.4 * EVEN);
        const struct sent sent = {0.5f, 0, APART, {rays[i], 64}};
        put(adaptive, columns(0, 8), sent, 1);
        put(adaptive, columns(4, 20), sent, 1); /* columns 4 to 7 are in already */
        assert_true(adaptive_plan(adaptive, HUGE_VAL));
        adaptive_refinements(adaptive, &cheap_one, &cheap);
        adaptive_refinements(adaptive, &dear_one, &dear);
        assert_true(cheap.to == 5 && dear.to < 5);
        adaptive_destroy(adaptive);
        canvas_free(&canvas);
    }
}

/* The cost of a pixel is that of all its samples, not of the last ones alone. */
static void test_cost_of_all_samples(void **state)
{
    const float rays[][2] = {
        {256, 1}, {1, 256}}; /* per sample in the right half, in pass 0 and in the next one */
    struct view view = view_of(4, 4096);
    struct canvas canvas;
    struct refinement left, right;
    struct tile left_one = {.w = 1, .h = 1, .step = 1},
                right_one = {.x = 12, .w = 1, .h = 1, .step = 1};
    for (int i = 0; i < 2; i++) {
        canvas_init(&canvas, WIDE, HIGH);
        struct adaptive *adaptive = adaptive_create(&view, &canvas, 1e-3);
        put(adaptive, all, (struct sent){0.5f, 0, APART, {1, rays[i][0]}}, 1);
        assert_true(adaptive_plan(adaptive, HUGE_VAL));
        /* The error is 0.0025 then. */
        put(adaptive, all, (struct sent){0.5f, 0, -0.0113f, {1, rays[i][1]}}, 1);
        assert_true(adaptive_plan(adaptive, HUGE_VAL));
        adaptive_refinements(adaptive, &left_one, &left);
        adaptive_refinements(adaptive, &right_one, &right);
        assert_true(right.from == left.from && right.to < left.to);
        adaptive_destroy(adaptive);
        canvas_free(&canvas);
    }
}

/* A picture so large that it is planned in several parts, the lower half of which has larger errors: all parts count in
 * what fits into the time. */
static void test_large_picture(void **state)
{
    enum { ROW = 1024, ROWS = 1280, COUNT = ROW * ROWS };
    const struct tile whole = {.w = ROW, .h = ROWS, .step = 1};
    struct view view = view_of(4, 4096);
    struct canvas canvas;
    canvas_init(&canvas, ROW, ROWS);
    struct adaptive *adaptive = adaptive_create(&view, &canvas, 1e-3);
    float *part = allocate_zeroed(COUNT, REFINED_FLOATS * sizeof *part);
    struct pixel_floats to = pixel_floats(part, COUNT, true);
    for (uint32_t i = 0; i < COUNT; i++) {
        to.spread[i] = i < COUNT / 2 ? APART / 100 : APART;
        to.rays[i] = 1;
        for (uint32_t c = 3 * i; c < 3 * i + 3; c++)
            to.difference[c] = to.spread[i];
    }
    adaptive_put(adaptive, &whole, part, 1);
    assert_true(adaptive_plan(adaptive, 2));
    double share = adaptive_work(adaptive, &whole).samples / (2 * 4.0 * COUNT);
    assert_true(share > 0.4 && share < 1.2);
    free(part);
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pass_within_seconds),  cmocka_unit_test(test_plan_by_its_limit),
        cmocka_unit_test(test_spread_of_all_passes), cmocka_unit_test(test_dear_pixels_get_less),
        cmocka_unit_test(test_cost_of_all_samples),  cmocka_unit_test(test_large_picture),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
