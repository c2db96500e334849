/* The tiles of a later pass in the queue: what they are predicted to cost, also when they are split, and which go
 * first. */
#include <math.h>

#include "master/pass_tiles.h"
#include "master/queue_parts.h"
#include "test/adaptive_by_hand_fixture.h"
#include "test/unit.h"

static const struct queue_config config = {
    .width = WIDE, .height = HIGH, .renderers = 4, .tile_edge = 4};

static struct canvas canvas;
static struct adaptive *adaptive;
static struct queue *queue;

static void begin(const struct queue_config *of, double target)
{
    struct view view = view_of(4, 1024);
    canvas_init(&canvas, WIDE, HIGH);
    adaptive = adaptive_create(&view, &canvas, target);
    queue = queue_create(of);
}

/* Pass 0 is in: so many rays per sample in the left half and in the right one, each half has taken as many seconds.
 * Halves of pixels differ in the columns from `from` on alone. */
static void begin_after_pass_0(const struct queue_config *of, uint32_t from, float in_left,
                               float in_right)
{
    begin(of, 1e-3);
    for (uint32_t x = 0; x < WIDE; x++)
        put(adaptive, columns(x, 1),
            (struct sent){0.5f, 0, x < from ? 0 : APART, {in_left, in_right}},
            (double)(x < WIDE / 2 ? in_left : in_right) / (0.5 * WIDE));
}

static void end(void)
{
    queue_destroy(queue);
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

/* Puts the tiles of the pass, so many, into the queue. Returns the first. */
static uint32_t add_pass(uint32_t tiles)
{
    uint32_t first = queue->item_count;
    pass_tiles_add(queue, adaptive);
    assert_int_equal(queue->item_count, first + tiles);
    return first;
}

static double work_of(uint32_t id)
{
    return (double)queue->items[id].work;
}

/* All that is asked for is in the queue. Its work is predicted from the seconds of pass 0, not from pixels: all pixels
 * get as many samples again, but those on the right take three times as long. A tile that is split has that work in its
 * parts. */
static void test_work(void **state)
{
    begin_after_pass_0(&config, 0, 1, 3);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    double samples = adaptive_work(adaptive, &all).samples / (4 * ALL);
    uint32_t first = add_pass(3); /* of 8 x 8 pixels */
    /* Without probes the work of pass 0 is its pixels: 4 s of them. */
    double second = samples * ALL / 4;
    assert_true(fabs(work_of(first) - second * 8 / 12) < 1e-3);
    assert_true(fabs(work_of(first + 1) - second * (4 + 4 * 3) / 12) < 1e-3);
    assert_true(fabs(work_of(first + 2) - second * 8 * 3 / 12) < 1e-3);
    split_tile(queue, first + 1);
    assert_true(fabs(work_of(first + 1) - second * 4 / 12) < 1e-3);
    assert_true(fabs(work_of(first + 3) - second * 4 * 3 / 12) < 1e-3);
    end();
}

/* A run that goes on with a pass of an earlier one predicts only what is left of it. */
static void test_rest(void **state)
{
    begin_after_pass_0(&config, 0, 1, 1);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    adaptive_predict_work(adaptive);
    double whole = adaptive_work_seconds(adaptive, &all);
    put(adaptive, columns(0, 6), (struct sent){0.5f, 0, APART, {1, 1}}, whole / 4);
    uint32_t first = add_pass(3);
    assert_true(fabs(adaptive_work_seconds(adaptive, &all) - whole * 3 / 4) < 1e-9 * whole);
    assert_true(fabs(work_of(first) / work_of(first + 2) - 2.0 / 8) < 1e-6);
    end();
}

static double all_on_the_right(const void *state, const struct tile *part)
{
    return part->x >= 2;
}

/* Tiles of pass 0 are split as the map of the picture says. */
static void test_pass_0(void **state)
{
    queue = queue_create(&config);
    queue_set_part_work(queue, all_on_the_right, NULL);
    double work = work_of(0);
    split_tile(queue, 0);
    assert_true(work > 0 && work_of(0) == work / 2);
    queue_destroy(queue);
}

/* Where the clock has seen nothing of pass 0, a tile is to cost per sample what its pixels did then, also if some of
 * the next pass was timed. */
static void test_no_time(void **state)
{
    for (uint32_t timed = 0; timed <= 8; timed += 8) {
        begin(&config, 1e-3);
        put(adaptive, all, (struct sent){0.5f, 0, APART, {1, 3}}, 0);
        assert_true(adaptive_plan(adaptive, HUGE_VAL));
        if (timed) put(adaptive, columns(0, timed), (struct sent){0.5f, 0, APART, {1, 3}}, 5);
        uint32_t first = add_pass((WIDE - timed) / 8);
        for (uint32_t id = first; id < queue->item_count; id++) {
            struct tile tile = item_tile(&queue->items[id]);
            double samples = adaptive_work(adaptive, &tile).samples;
            assert_true(fabs(work_of(id) - samples / 4) < 1e-3);
        }
        end();
    }
}

/* So it is where a tile's share is lost in the rounding of the sums that it is the difference of. */
static void test_lost_time(void **state)
{
    begin(&config, 1e-3);
    put(adaptive, columns(0, 16), (struct sent){0.5f, 0, APART, {1, 1}}, 1e25);
    put(adaptive, columns(16, 8), (struct sent){0.5f, 0, APART, {1, 1}}, 1e-3);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    uint32_t first = add_pass(3);
    assert_true(adaptive_work_seconds(adaptive, &(struct tile){.x = 16, .w = 8, .h = 8}) == 0);
    assert_true(work_of(first + 2) > 0);
    end();
}

/* Tiles are as wide and high as a lot has pixels for, and those at the edges of the picture end there. */
static void test_edges(void **state)
{
    struct queue_config larger = config;
    larger.width = larger.height = 16;
    begin_after_pass_0(&larger, 0, 1, 1);
    assert_int_equal(queue_largest_lot(queue), 16 * 16);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    uint32_t first = add_pass(2);
    for (uint32_t i = 0; i < 2; i++) {
        struct tile tile = item_tile(&queue->items[first + i]);
        assert_true(tile.x == 16 * i && tile.w == (i ? WIDE - 16 : 16) && tile.h == HIGH);
    }
    queue_destroy(queue);
    struct queue_config smaller = config;
    smaller.width = smaller.height = 5;
    queue = queue_create(&smaller);
    first = add_pass(2 * WIDE / 4);
    for (uint32_t i = 0; i < 2 * WIDE / 4; i++) {
        struct tile tile = item_tile(&queue->items[first + i]);
        assert_true(tile.x == i % 6 * 4 && tile.y == i / 6 * 4 && tile.w == 4 && tile.h == 4);
    }
    end();
}

/* First samples that pass 0 did not get to: what probes tell to be expensive goes first, as in pass 0. */
static void test_first_samples(void **state)
{
    struct queue_config probed = config;
    probed.probe_edge = 4;
    begin(&probed, 0);
    put(adaptive, columns(0, 1), (struct sent){0.5f, 0, APART, {1, 1}}, 1);
    adaptive_cut(adaptive, 0);
    assert_true(adaptive_plan(adaptive, HUGE_VAL) && adaptive_is_first(adaptive));
    struct tile lot[LOT_TILES];
    for (uint32_t i = 0; !queue->settled; i++) {
        uint32_t count = queue_next(queue, i % 4, 0, lot);
        for (uint32_t k = 0; k < count; k++) {
            float seconds[64];
            for (uint32_t p = 0; p < tile_pixels(&lot[k]); p++) {
                uint32_t x, y;
                tile_pixel(&lot[k], p, &x, &y);
                seconds[p] = x < WIDE / 2 ? 1e-6f : 1e-4f;
            }
            assert_true(queue_probed(queue, &lot[k], seconds));
            queue_finish(queue, i % 4, lot[k].id, 1e-3, 1e-3);
        }
    }
    uint32_t first = add_pass(3);
    assert_true(queue->items[first + 1].priority > queue->items[first].priority);
    assert_true(queue->items[first + 2].priority > queue->items[first + 1].priority);
    end();
}

/* Of two tiles that are expected to become better by as much, the one that takes less time goes first. */
static void test_order(void **state)
{
    begin_after_pass_0(&config, 0, 3, 1);
    struct tile lot[LOT_TILES];
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    for (uint32_t count, i = 0; (count = queue_next(queue, i, 0, lot)) > 0; i = (i + 1) % 4)
        for (uint32_t k = 0; k < count; k++)
            queue_finish(queue, i, lot[k].id, 1e-3, 1e-3);
    assert_true(queue_complete(queue));
    pass_tiles_add(queue, adaptive);
    assert_true(queue_next(queue, 0, 2e-3, lot) > 0);
    assert_int_equal(lot[0].x, 16);
    assert_int_equal(lot[0].pass, 1);
    end();
}

/* Tiles in which nothing is asked for are left out. */
static void test_nothing_to_do(void **state)
{
    begin_after_pass_0(&config, 20, 1, 1);
    assert_true(adaptive_plan(adaptive, HUGE_VAL));
    const struct tile rest = {.w = 16, .h = HIGH, .step = 1};
    assert_true(adaptive_work(adaptive, &rest).samples == 0);
    assert_int_equal(queue->items[add_pass(1)].x, 16);
    end();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_work),          cmocka_unit_test(test_rest),
        cmocka_unit_test(test_pass_0),        cmocka_unit_test(test_order),
        cmocka_unit_test(test_nothing_to_do), cmocka_unit_test(test_no_time),
        cmocka_unit_test(test_lost_time),     cmocka_unit_test(test_edges),
        cmocka_unit_test(test_first_samples),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
