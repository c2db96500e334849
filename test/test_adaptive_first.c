/* First samples of the pixels that are left when pass 0 is cut off. */
#include <math.h>

#include "test/adaptive_by_hand_fixture.h"
#include "test/adaptive_runs_fixture.h"
#include "test/lattice_of.h"
#include "test/unit.h"

/* The seconds that render_tile() counts for the first four samples of a pixel. */
static double first_seconds(void)
{
    return pow(4, EFFORT_POWER);
}

static const struct tile everything = {.w = EDGE, .h = EDGE, .step = 1};

/* Renders the first rows of pass 0, then cuts it off; returns how many pixels have no samples. */
static uint64_t cut_off(struct result *result, scene_function *f, const struct view *view,
                        double target)
{
    canvas_init(&result->canvas, EDGE, EDGE);
    result->adaptive = adaptive_create(view, &result->canvas, target);
    for (uint32_t x = 0; x < EDGE; x += 16)
        render_tile(result->adaptive, view, f, &(struct tile){.x = x, .w = 16, .h = 16, .step = 1});
    uint64_t left = adaptive_unsampled(result->adaptive);
    assert_int_equal(left, PIXELS - 16 * EDGE);
    assert_false(adaptive_is_complete(result->adaptive));
    adaptive_cut(result->adaptive, (double)left * first_seconds());
    assert_true(adaptive_is_complete(result->adaptive));
    return left;
}

/* The pass asks for the pixels of this lattice that have no samples yet, and for nothing else. */
static void check_lattice(const struct adaptive *adaptive, uint32_t lattice)
{
    static struct refinement asked[PIXELS];
    const uint8_t *levels = adaptive_levels(adaptive);
    assert_true(adaptive_limit(adaptive) == -1 - (double)lattice && adaptive_is_first(adaptive));
    adaptive_refinements(adaptive, &everything, asked);
    for (uint32_t i = 0; i < PIXELS; i++) {
        bool due = levels[i] == 0 && lattice_of(i % EDGE, i / EDGE) >= lattice;
        assert_true(asked[i].from == levels[i] && asked[i].to == (due ? 1 : levels[i]));
    }
}

/* What is left comes lattice by lattice, as there is time; when all is in, the picture and what is asked for next are
 * those of a pass 0 that was not cut off. */
static void test_cut_off(void **state)
{
    struct view view = view_of(4, 64);
    struct result whole, cut;
    static struct refinement expected[PIXELS], asked[PIXELS];
    canvas_init(&whole.canvas, EDGE, EDGE);
    whole.adaptive = adaptive_create(&view, &whole.canvas, 0);
    render_pass(whole.adaptive, &view, ball, 16, false);
    double needed = (double)cut_off(&cut, ball, &view, 0) * first_seconds();
    assert_true(adaptive_plan(cut.adaptive, 0.13 * needed));
    check_lattice(cut.adaptive, 3);
    adaptive_cut(cut.adaptive, 1e9); /* such passes are not cut off in turn */
    check_lattice(cut.adaptive, 3);
    assert_false(adaptive_is_complete(cut.adaptive));
    render_pass(cut.adaptive, &view, ball, 32, false);
    assert_true(isnan(forecast_of(cut.adaptive, 1e-4, 1.5)));
    assert_true(
        adaptive_plan(cut.adaptive, 0.2 * needed)); /* half of all less the eighth is too much */
    check_lattice(cut.adaptive, 2);
    render_pass(cut.adaptive, &view, ball, 32, true);
    assert_true(adaptive_plan(cut.adaptive, HUGE_VAL));
    check_lattice(cut.adaptive, 0);
    render_pass(cut.adaptive, &view, ball, 32, false);
    assert_int_equal(adaptive_unsampled(cut.adaptive), 0);
    assert_true(adaptive_is_first(cut.adaptive) && forecast_of(cut.adaptive, 1e-4, 1.5) > 0);
    assert_memory_equal(cut.canvas.rgb, whole.canvas.rgb, 3 * PIXELS * sizeof(float));
    assert_true(adaptive_plan(whole.adaptive, HUGE_VAL) && adaptive_plan(cut.adaptive, HUGE_VAL));
    adaptive_refinements(whole.adaptive, &everything, expected);
    adaptive_refinements(cut.adaptive, &everything, asked);
    assert_memory_equal(asked, expected, sizeof asked);
    assert_false(adaptive_is_first(cut.adaptive));
    drop(&whole);
    drop(&cut);
}

/* However small the error of those pixels that have samples, the target is not met before all have some. */
static void test_not_met_without_samples(void **state)
{
    struct view view = view_of(4, 64);
    struct result cut;
    cut_off(&cut, ball, &view, 1e9);
    assert_false(adaptive_is_met(cut.adaptive));
    assert_true(adaptive_plan(cut.adaptive, HUGE_VAL));
    render_pass(cut.adaptive, &view, ball, 32, false);
    assert_true(adaptive_is_met(cut.adaptive));
    drop(&cut);
}

/* Where there is no time at all, each pass asks for the coarsest lattice that has pixels without samples. */
static void test_no_time(void **state)
{
    struct view view = view_of(4, 64);
    struct result cut;
    cut_off(&cut, ball, &view, 0);
    for (uint32_t lattice = LATTICE_COARSEST + 1; lattice-- > 0;) {
        assert_true(adaptive_plan(cut.adaptive, 0));
        check_lattice(cut.adaptive, lattice);
        render_pass(cut.adaptive, &view, ball, 48, false);
    }
    assert_int_equal(adaptive_unsampled(cut.adaptive), 0);
    drop(&cut);
}

/* What the first samples of a pixel will take is told to adaptive_cut(); if not, it is taken to be what those took that
 * have come in. From then on it is what those of the last pass took. */
static void test_time_for_first_samples(void **state)
{
    const struct sent sent = {0.5f, 0, APART, {1, 1}};
    for (int told = 0; told <= 1; told++) {
        struct canvas canvas;
        struct view view = view_of(4, 64);
        canvas_init(&canvas, WIDE, HIGH);
        struct adaptive *adaptive = adaptive_create(&view, &canvas, 0);
        put(adaptive, columns(0, 8), sent, 64); /* 1 s each, and 128 pixels are left */
        adaptive_cut(adaptive, told ? 128 * 4 : 0);
        assert_true(adaptive_plan(adaptive, told ? 4 * 4 : 4));
        assert_true(adaptive_limit(adaptive) == -1 - 5 && adaptive_pixels(adaptive, &all) == 4);
        put(adaptive, all, sent, 4 * 10);
        assert_true(adaptive_plan(adaptive, 12 * 10));
        assert_true(adaptive_limit(adaptive) == -1 - 3 && adaptive_pixels(adaptive, &all) == 12);
        put(adaptive, all, sent, 12 * 2);
        assert_true(adaptive_plan(adaptive, 48 * 2));
        assert_true(adaptive_limit(adaptive) == -1 - 1 && adaptive_pixels(adaptive, &all) == 48);
        adaptive_destroy(adaptive);
        canvas_free(&canvas);
    }
}

/* A pass over a lattice can be planned again from its limit; limits that stand for no lattice are refused. */
static void test_lattice_again(void **state)
{
    struct view view = view_of(4, 64);
    struct result first, again;
    double needed = (double)cut_off(&first, ball, &view, 0) * first_seconds();
    cut_off(&again, ball, &view, 0);
    assert_true(adaptive_plan(first.adaptive, 0.3 * needed));
    const double strange[] = {0, 0.5, -0.5, -1.5, -2 - (double)LATTICE_COARSEST, -1e300, -HUGE_VAL};
    for (size_t i = 0; i < sizeof strange / sizeof *strange; i++)
        assert_false(adaptive_replan(again.adaptive, strange[i]));
    assert_true(adaptive_replan(again.adaptive, adaptive_limit(first.adaptive)));
    assert_true(adaptive_plan_hash(again.adaptive, &everything) ==
                adaptive_plan_hash(first.adaptive, &everything));
    render_pass(again.adaptive, &view, ball, 16, false);
    assert_false(adaptive_replan(again.adaptive, adaptive_limit(first.adaptive)));
    assert_true(adaptive_plan(again.adaptive, HUGE_VAL));
    render_pass(again.adaptive, &view, ball, 16, false);
    assert_false(adaptive_replan(again.adaptive, -1)); /* there is nothing left for it */
    drop(&first);
    drop(&again);
}

/* A limit that stands for no lattice does not cut pass 0 off; one that stands for a lattice does, as when a journal is
 * read. */
static void test_strange_limit_cuts_nothing(void **state)
{
    struct view view = view_of(4, 64);
    struct result result;
    canvas_init(&result.canvas, EDGE, EDGE);
    result.adaptive = adaptive_create(&view, &result.canvas, 0);
    const struct tile corner = {.w = 16, .h = 16, .step = 1};
    render_tile(result.adaptive, &view, ball, &corner);
    assert_false(adaptive_replan(result.adaptive, -1.5));
    assert_false(adaptive_replan(result.adaptive, -2 - (double)LATTICE_COARSEST));
    assert_false(adaptive_is_complete(result.adaptive));
    assert_true(adaptive_missing(result.adaptive) == 1 - 256.0 / PIXELS);
    assert_int_equal(adaptive_passes(result.adaptive), 1);
    assert_true(adaptive_replan(result.adaptive, -1));
    assert_int_equal(adaptive_passes(result.adaptive), 2);
    assert_true(adaptive_missing(result.adaptive) == 1);
    check_lattice(result.adaptive, 0);
    drop(&result);
}

/* Once pass 0 is complete, nothing is cut off. */
static void test_complete_is_not_cut(void **state)
{
    struct view view = view_of(4, 64);
    struct result result;
    canvas_init(&result.canvas, EDGE, EDGE);
    result.adaptive = adaptive_create(&view, &result.canvas, 0);
    render_pass(result.adaptive, &view, ball, 16, false);
    assert_true(adaptive_missing(result.adaptive) == 0);
    adaptive_cut(result.adaptive, 1);
    assert_true(adaptive_plan(result.adaptive, HUGE_VAL) && adaptive_limit(result.adaptive) >= 0);
    adaptive_cut(result.adaptive, 1);
    assert_false(adaptive_is_complete(result.adaptive));
    assert_true(adaptive_missing(result.adaptive) == 1); /* of those that the pass asks for */
    const struct tile half = {.w = EDGE, .h = EDGE / 2, .step = 1};
    uint32_t asked =
        adaptive_pixels(result.adaptive, &(struct tile){.w = EDGE, .h = EDGE, .step = 1});
    uint32_t above = adaptive_pixels(result.adaptive, &half);
    assert_true(above > 0 && above < asked);
    render_tile(result.adaptive, &view, ball, &half);
    assert_true(adaptive_missing(result.adaptive) == (double)(asked - above) / asked);
    drop(&result);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cut_off),
        cmocka_unit_test(test_not_met_without_samples),
        cmocka_unit_test(test_no_time),
        cmocka_unit_test(test_time_for_first_samples),
        cmocka_unit_test(test_lattice_again),
        cmocka_unit_test(test_strange_limit_cuts_nothing),
        cmocka_unit_test(test_complete_is_not_cut),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
