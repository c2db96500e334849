/* What a pass does in a tile: what it asks for of each pixel, and what comes in of them. */
#include <math.h>

#include "test/adaptive_by_hand_fixture.h"
#include "test/unit.h"

/* While pass 0 is under way, only the pixels that are in count. Of a tile that is partly in, all pixels are sent again;
 * those that were in stay as they are. */
static void test_part_of_a_pass(void **state)
{
    struct view view = view_of(4, 64);
    struct canvas canvas;
    uint64_t pixels, samples;
    canvas_init(&canvas, WIDE, HIGH);
    struct adaptive *adaptive = adaptive_create(&view, &canvas, 1e-3);
    put(adaptive, columns(0, 12), (struct sent){1, 0, APART, {1, 1}}, 1);
    (void)adaptive_errors(adaptive, &pixels, &samples);
    assert_true(pixels == 12 * HIGH && samples == 4 * pixels);
    assert_true(isnan(forecast_of(adaptive, 1, 1.5)));
    struct tile half_new = columns(8, 8);
    struct adaptive_work work = adaptive_work(adaptive, &half_new);
    assert_int_equal(adaptive_pixels(adaptive, &half_new), 8 * HIGH);
    assert_int_equal(work.samples, 4 * 4 * HIGH);
    put(adaptive, half_new, (struct sent){100, 1, APART, {1, 1}}, 1);
    for (uint32_t y = 0; y < HIGH; y++)
        for (uint32_t x = 8; x < 16; x++)
            assert_true(canvas.rgb[3 * (y * WIDE + x)] ==
                        (x < 12 ? 1 : (float)(100 + 8 * y + x - 8)));
    assert_false(adaptive_is_complete(adaptive));
    (void)adaptive_errors(adaptive, &pixels, &samples);
    assert_int_equal(pixels, 16 * HIGH);
    put(adaptive, columns(16, 8), (struct sent){1, 0, APART, {1, 1}}, 1);
    assert_true(adaptive_is_complete(adaptive));
    (void)adaptive_errors(adaptive, &pixels, &samples);
    assert_int_equal(pixels, ALL);
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

/* So it is where only rows below the first one were in. */
static void test_lower_part_of_a_pass(void **state)
{
    struct view view = view_of(4, 64);
    struct canvas canvas;
    const struct tile lower = {.y = 3, .w = WIDE, .h = HIGH - 3, .step = 1};
    canvas_init(&canvas, WIDE, HIGH);
    struct adaptive *adaptive = adaptive_create(&view, &canvas, 1e-3);
    put(adaptive, lower, (struct sent){1, 0, APART, {1, 1}}, 1);
    put(adaptive, all, (struct sent){100, 1, APART, {1, 1}}, 1);
    for (uint32_t i = 0; i < ALL; i++)
        assert_true(canvas.rgb[3 * i] == (i < 3 * WIDE ? (float)(100 + i) : 1));
    assert_true(adaptive_is_complete(adaptive));
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

/* And where only the last pixel was in, of a high tile and of a wide one. */
static void test_last_pixel_of_a_tile(void **state)
{
    static const struct tile tiles[] = {{.x = 3, .y = 1, .w = 2, .h = 7, .step = 1},
                                        {.x = 1, .y = 3, .w = 20, .h = 4, .step = 1}};
    struct view view = view_of(4, 64);
    for (int i = 0; i < 2; i++) {
        const struct tile *tile = &tiles[i];
        uint32_t pixels = tile_pixels(tile), x, y;
        tile_pixel(tile, pixels - 1, &x, &y);
        struct canvas canvas;
        canvas_init(&canvas, WIDE, HIGH);
        struct adaptive *adaptive = adaptive_create(&view, &canvas, 1e-3);
        put(adaptive, (struct tile){.x = x, .y = y, .w = 1, .h = 1, .step = 1},
            (struct sent){1, 0, APART, {1, 1}}, 1);
        put(adaptive, *tile, (struct sent){100, 1, APART, {1, 1}}, 1);
        assert_true(canvas_at(&canvas, x, y)[0] == 1);
        assert_true(canvas_at(&canvas, tile->x, tile->y)[0] == 100);
        assert_true(adaptive_missing(adaptive) == (ALL - pixels) / (double)ALL);
        adaptive_destroy(adaptive);
        canvas_free(&canvas);
    }
}

/* A tile of every n-th pixel of a rectangle, from its first or second one on: what comes in goes to the pixels that
 * tile_pixel() names, and these are not asked for any more. */
static void test_tile_with_steps(void **state)
{
    struct tile tile = {.x = 3, .y = 1, .w = 7, .h = 5, .step = 1}, first = tile;
    struct refinement refinements[35];
    const uint32_t steps[] = {3, 7, 9, 16, 40, 2, 1};
    for (int i = 0; i < 7; i++) {
        tile.step = steps[i];
        tile.phase = tile.step != 2;
        struct view view = view_of(4, 64);
        struct canvas canvas;
        canvas_init(&canvas, WIDE, HIGH);
        struct adaptive *adaptive = adaptive_create(&view, &canvas, 1e-3);
        put(adaptive, tile, (struct sent){100, 1, APART, {1, 1}}, 1);
        unsigned painted = 0;
        for (uint32_t k = 0; k < tile_pixels(&tile); k++) {
            uint32_t x, y;
            tile_pixel(&tile, k, &x, &y);
            assert_true(canvas.rgb[3 * (y * WIDE + x)] == (float)(100 + k));
        }
        for (size_t k = 0; k < ALL; k++)
            painted += canvas.rgb[3 * k] > 0;
        assert_int_equal(painted, tile_pixels(&tile));
        assert_int_equal(adaptive_work(adaptive, &tile).samples, 0);
        adaptive_refinements(adaptive, &first, refinements);
        assert_int_equal(refinements_sampled(refinements, 35), 35 - painted);
        assert_int_equal(adaptive_work(adaptive, &first).samples, 4 * (35 - painted));
        adaptive_destroy(adaptive);
        canvas_free(&canvas);
    }
}

/* How many samples a pass asks for, and how much of the squared error they are expected to remove. Pixels that are in
 * are not asked for any more. */
static void test_work_of_a_pass(void **state)
{
    struct canvas canvas;
    uint64_t pixels, samples;
    struct adaptive *adaptive = begin_even(&canvas, 64, 1e-3);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    struct adaptive_work work = adaptive_work(adaptive, &all);
    assert_int_equal(adaptive_pixels(adaptive, &all), ALL);
    assert_int_equal(work.samples, MORE * ALL);
    assert_true(fabs(work.removed / (ALL * EVEN * EVEN * (1 - LEFT)) - 1) < 1e-5);
    put(adaptive, columns(0, 12), (struct sent){1, 0, APART, {1, 1}}, 1);
    assert_true(canvas.rgb[0] == (4 * 0.5f + MORE * 1) / DENSE);
    (void)adaptive_errors(adaptive, &pixels, &samples);
    assert_true(pixels == ALL && samples == (DENSE + 4) * ALL / 2);
    assert_int_equal(adaptive_pixels(adaptive, &all), ALL / 2);
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

/* Plans that ask for other numbers of samples, or for other pixels, have different hashes. */
static void test_plans_are_told_apart(void **state)
{
    struct view view = view_of(4, 1024);
    struct canvas canvases[2];
    struct adaptive *one, *other;
    for (int i = 0; i < 2; i++)
        canvas_init(&canvases[i], WIDE, HIGH);
    one = adaptive_create(&view, &canvases[0], 0.99 * EVEN);
    other = adaptive_create(&view, &canvases[1], 1e-3);
    const struct sent sent = {0.5f, 0, APART, {1, 1}};
    assert_true(adaptive_plan_hash(one, &all) == adaptive_plan_hash(other, &all));
    put(one, columns(0, 12), sent, 1);
    assert_true(adaptive_plan_hash(one, &all) != adaptive_plan_hash(other, &all));
    put(other, columns(12, 12), sent, 1);
    assert_true(adaptive_plan_hash(one, &all) != adaptive_plan_hash(other, &all));
    put(one, columns(12, 12), sent, 1);
    put(other, columns(0, 12), sent, 1);
    assert_true(adaptive_plan_hash(one, &all) == adaptive_plan_hash(other, &all));
    assert_true(adaptive_plan(one, HUGE_VAL) && adaptive_plan(other, HUGE_VAL)); /* 8 samples, 64 */
    assert_true(adaptive_plan_hash(one, &all) != adaptive_plan_hash(other, &all));
    for (int i = 0; i < 2; i++)
        canvas_free(&canvases[i]);
    adaptive_destroy(one);
    adaptive_destroy(other);
}

/* Every pixel of a tile counts, also of one with more pixels than are hashed in one call. */
static void test_plans_differ_by_a_pixel(void **state)
{
    const struct tile whole = {.w = 31, .h = 20, .step = 1};
    struct view view = view_of(4, 1024);
    struct canvas canvas;
    canvas_init(&canvas, whole.w, whole.h);
    struct adaptive *adaptive = adaptive_create(&view, &canvas, 1e-3);
    uint64_t before = adaptive_plan_hash(adaptive, &whole);
    for (uint32_t k = 0; k < tile_pixels(&whole); k++) {
        struct tile pixel = {.x = k % whole.w, .y = k / whole.w, .w = 1, .h = 1, .step = 1};
        put(adaptive, pixel, (struct sent){0.5f, 0, APART, {1, 1}}, 1);
        uint64_t after = adaptive_plan_hash(adaptive, &whole);
        assert_true(after != before);
        before = after;
    }
    canvas_free(&canvas);
    adaptive_destroy(adaptive);
}

static double cost_at(const float *costs, uint32_t x)
{
    return (double)costs[x];
}

/* The time of a tile is charged to the pixels that its result has, by the number of their samples: to all while first
 * samples are taken, also to those that were in before; later to those that are still to come. */
static void test_costs_of_samples(void **state)
{
    struct canvas canvas;
    float costs[ALL] = {0};
    struct tile half = columns(4, 8), mixed = columns(8, 8);
    struct view view = view_of(4, 64);
    canvas_init(&canvas, WIDE, HIGH);
    struct adaptive *adaptive = adaptive_create(&view, &canvas, 1e-3);
    put(adaptive, columns(0, 8), (struct sent){0.5f, 0, APART, {1, 1}}, 1);
    adaptive_spread(adaptive, &half, 8 * HIGH, costs);
    assert_true(cost_at(costs, 4) == 1 && cost_at(costs, 11) == 1 && cost_at(costs, 12) == 0);
    put(adaptive, columns(8, 16), (struct sent){0.5f, 0, APART, {1, 1}}, 1);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    put(adaptive, columns(0, 12), (struct sent){0.5f, 0, APART, {1, 1}}, 1);
    adaptive_spread(adaptive, &mixed, 8 * HIGH, costs);
    assert_true(cost_at(costs, 8) == 1 && cost_at(costs, 11) == 1); /* as before */
    assert_true(cost_at(costs, 12) == 2 && cost_at(costs, 15) == 2 && cost_at(costs, 16) == 0);
    assert_true(cost_at(costs, (HIGH - 1) * WIDE + 15) == 2);
    const struct tile done = columns(0, 8);
    adaptive_spread(adaptive, &done, 1, costs);
    assert_true(cost_at(costs, 0) == 0 && cost_at(costs, 4) == 1);
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

/* A pixel with error gets more samples than its quiet neighbours, and has all of the pass's time. */
static void test_costs_of_refined_pixels(void **state)
{
    struct canvas canvas;
    float costs[ALL] = {0};
    struct view view = view_of(4, 64);
    canvas_init(&canvas, WIDE, HIGH);
    struct adaptive *adaptive = adaptive_create(&view, &canvas, 1e-3);
    put(adaptive, columns(0, 12), (struct sent){0.5f, 0, 0, {1, 1}}, 1);
    put(adaptive, columns(12, 12), (struct sent){0.5f, 0, APART, {1, 1}}, 1);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    struct refinement asked[ALL];
    adaptive_refinements(adaptive, &all, asked);
    adaptive_spread(adaptive, &all, 1, costs);
    double sum = 0, samples = adaptive_work(adaptive, &all).samples;
    for (uint32_t i = 0; i < ALL; i++) {
        double mine = level_samples(&view, asked[i].to) - level_samples(&view, asked[i].from);
        assert_true(fabs((double)costs[i] - mine / samples) < 1e-7);
        sum += (double)costs[i];
    }
    assert_true(fabs(sum - 1) < 1e-5 && costs[0] == 0 && costs[WIDE - 1] > 0);
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_part_of_a_pass),       cmocka_unit_test(test_tile_with_steps),
        cmocka_unit_test(test_work_of_a_pass),       cmocka_unit_test(test_plans_are_told_apart),
        cmocka_unit_test(test_costs_of_samples),     cmocka_unit_test(test_costs_of_refined_pixels),
        cmocka_unit_test(test_lower_part_of_a_pass), cmocka_unit_test(test_plans_differ_by_a_pixel),
        cmocka_unit_test(test_last_pixel_of_a_tile),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
