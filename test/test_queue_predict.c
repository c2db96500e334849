/* What tiles are predicted to cost: from the probes on, and by what is learnt from tiles that take longer. */
#include <math.h>

#include "master/queue_parts.h"
#include "test/near.h"
#include "test/queue_halves_fixture.h"
#include "test/unit.h"

/* Impossible costs of probed pixels are refused: with a NaN in the predictions, tiles could not be sorted. */
static void test_probes_are_checked(void **state)
{
    const float bad[] = {HUGE_VALF, -HUGE_VALF, NAN, -1, 2e9f};
    struct queue_config config = {
        .width = 100, .height = 100, .renderers = 2, .tile_edge = 10, .probe_edge = 10};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct queue *queue = queue_create(&config);
        struct tile lot[LOT_TILES];
        float seconds[64] = {0};
        assert_true(queue_next(queue, 0, 0, lot) > 0 && lot[0].pass == TILE_PROBE);
        assert_true(queue_probed(queue, &lot[0], seconds));
        seconds[tile_pixels(&lot[0]) - 1] = bad[i];
        assert_false(queue_probed(queue, &lot[0], seconds));
        queue_destroy(queue);
    }
}

/* A map of the costs of 3 x 5 blocks of 10 x 10 pixels. */
static struct cost_map costs_of_blocks(void)
{
    struct cost_map map;
    cost_init(&map, 30, 50, 10, 3);
    assert_true(map.columns == 3 && map.rows == 5 && map.probes == 5);
    return map;
}

/* Puts the costs of a row of blocks, seconds. */
static void put_row(struct cost_map *map, uint32_t row, float left, float middle, float right)
{
    struct tile probe = cost_probe(map, row);
    assert_true(cost_put(map, &probe, (const float[]){left, middle, right}));
}

/* What a block is predicted to cost per pixel. */
static struct cost block_cost(const struct cost_map *map, uint32_t column, uint32_t row)
{
    struct cost cost = cost_predict(map, 10 * column, 10 * row, 10, 10);
    return (struct cost){cost.work / 100, cost.worst / 100};
}

/* Costs are smoothed with the weights 4, 2 and 1, after three quarters of the cheapest are subtracted as the fixed cost
 * of a probe. A probe whose answer comes twice counts once. */
static void test_costs_are_smoothed(void **state)
{
    struct cost_map map = costs_of_blocks();
    put_row(&map, 0, 1, 1, 17);
    put_row(&map, 1, 33, 1, 1);
    put_row(&map, 1, 33, 1, 1);
    put_row(&map, 2, 1, 1, 1);
    cost_settle(&map);
    assert_close(block_cost(&map, 1, 1).work, (16.25 + 2 * 32.25 + 13 * 0.25) / 16, 1e-6);
    assert_close(block_cost(&map, 1, 1).worst, 32.25, 1e-6);
    /* A block at the edge stands for those beyond it. */
    assert_close(block_cost(&map, 2, 0).work, (9 * 16.25 + 7 * 0.25) / 16, 1e-6);
    double between = (block_cost(&map, 1, 1).work + block_cost(&map, 2, 1).work) / 2;
    assert_close(cost_predict(&map, 15, 10, 10, 10).work / 100, between, 1e-6);
    cost_free(&map);
}

/* Blocks of which no probe has come back are left out of the means around them, and cost the mean of all where there
 * is none. */
static void test_unknown_costs(void **state)
{
    struct cost_map map = costs_of_blocks();
    put_row(&map, 0, 1, 3, 2);
    put_row(&map, 0, 1, 3, 2);
    cost_settle(&map);
    assert_close(block_cost(&map, 1, 1).work, (0.25 + 2 * 2.25 + 1.25) / 4, 1e-6);
    assert_close(block_cost(&map, 1, 4).work, 2 - 0.75, 1e-6);
    cost_free(&map);
}

/* By a clock that stands still, probes take no time, yet something is predicted. */
static void test_costs_by_a_clock_that_stands_still(void **state)
{
    struct cost_map map = costs_of_blocks();
    put_row(&map, 0, 0, 0, 0);
    cost_settle(&map);
    assert_true(block_cost(&map, 1, 0).work > 0 && block_cost(&map, 1, 4).worst > 0);
    cost_free(&map);
}

/* For every fifth tile renderers report far more time than has passed, as may happen where many share a core. All
 * predictions stay finite, so that the run comes to its end. */
static void test_predictions_stay_numbers(void **state)
{
    const double told[] = {2, 5, 10, 100, 1e6, SECONDS_MOST};
    struct queue_config config = {
        .width = 128, .height = 96, .renderers = 2, .tile_edge = 16, .probe_edge = 8};
    for (size_t k = 0; k < sizeof told / sizeof *told; k++) {
        struct queue *queue = queue_create(&config);
        struct tile lot[LOT_TILES];
        double now = 0;
        uint32_t turns = 0, tiles = 0;
        for (; !queue_complete(queue) && turns < 10000; turns++) {
            uint32_t count = queue_next(queue, turns % 2, now += 1e-4, lot);
            for (uint32_t i = 0; i < count; i++) {
                bool probes = lot[i].pass == TILE_PROBE;
                float seconds[64];
                for (int p = 0; p < 64; p++)
                    seconds[p] = 1e-4f;
                if (probes) assert_true(queue_probed(queue, &lot[i], seconds));
                queue_finish(queue, turns % 2, lot[i].id, now += 1e-4,
                             !probes && tiles++ % 5 == 2 ? told[k] : 1e-4);
            }
        }
        assert_true(queue_complete(queue));
        queue_destroy(queue);
    }
}

/* The renderer answers its probes, which cost so many seconds a pixel. */
static void answer_alike(struct queue *queue, uint32_t renderer, const struct tile *lot,
                         uint32_t count, float cost)
{
    float seconds[64];
    for (uint32_t p = 0; p < 64; p++)
        seconds[p] = cost;
    for (uint32_t i = 0; i < count; i++) {
        assert_true(lot[i].pass == TILE_PROBE && queue_probed(queue, &lot[i], seconds));
        queue_finish(queue, renderer, lot[i].id, 1e-3, 1e-3);
    }
}

/* Tiles of later passes keep their work relative to what the map predicts, whenever that changes. The priority that
 * they were added with stays if costs were known then. Whoever waits for work is told of new predictions. */
static void test_added_tiles_are_predicted(void **state)
{
    const struct queue_config config = {
        .width = 64, .height = 64, .renderers = 2, .tile_edge = 16, .probe_edge = 8};
    struct queue *queue = queue_create(&config);
    struct tile lots[2][LOT_TILES], tile = {.w = 16, .h = 16, .step = 1, .pass = 1};
    uint32_t counts[2];
    for (uint32_t renderer = 0; renderer < 2; renderer++)
        counts[renderer] = queue_next(queue, renderer, 0, lots[renderer]);
    assert_int_equal(counts[0] + counts[1], queue->map.probes);
    uint32_t early = queue->item_count;
    queue_add(queue, &tile, 2 * queue_work(queue, &tile), 1e30);
    answer_alike(queue, 0, lots[0], counts[0], 1e-4f);
    uint64_t news = queue_news(queue);
    queue_end_probes(queue, 1e-3);
    assert_true(queue->settled && queue_news(queue) != news);
    double before = queue_work(queue, &tile);
    assert_close((double)queue->items[early].work, 2 * before, 1e-5);
    assert_true(queue->items[early].priority < 1e30);
    uint32_t late = queue->item_count;
    queue_add(queue, &tile, 3 * before, 77);
    news = queue_news(queue);
    answer_alike(queue, 1, lots[1], counts[1], 5e-4f);
    assert_true(queue_news(queue) != news);
    double after = queue_work(queue, &tile);
    assert_true(fabs(after / before - 1) > 0.1);
    assert_close((double)queue->items[early].work, 2 * after, 1e-5);
    assert_close((double)queue->items[late].work, 3 * after, 1e-5);
    assert_true(queue->items[late].priority == 77);
    queue_destroy(queue);
}

/* Renderer 0 finishes tiles in the predicted time until it gets one amid the cheap half whose successor still waits;
 * returns that tile. */
static struct tile begin_cheap(struct queue *queue, uint32_t width, double *now)
{
    struct tile lot[LOT_TILES];
    for (;;) {
        uint32_t count = queue_next(queue, 0, *now, lot);
        assert_true(count > 0);
        for (uint32_t i = 0; i < count; i++) {
            bool cheap = lot[i].x >= width / 2;
            double seconds = (cheap ? 1e-6 : 1e-4) * tile_pixels(&lot[i]);
            bool amidst = lot[i].x > width * 5 / 8 && lot[i].x < width * 7 / 8;
            if (amidst && heap_has(&queue->waiting, lot[i].id + 1)) return lot[i];
            queue_finish(queue, 0, lot[i].id, *now += seconds, seconds);
        }
    }
}

static uint32_t apart(uint32_t a, uint32_t b)
{
    return a > b ? a - b : b - a;
}

/* When a tile turns out far more expensive than predicted, by its answer or by a report that it takes long, the waiting
 * tiles around it are predicted to be as expensive and go first, also where they are parts of tiles that were split. */
static void test_neighbours_are_raised(void **state)
{
    const struct queue_config config = {
        .width = 640, .height = 320, .renderers = 1, .tile_edge = 16, .probe_edge = 8};
    for (int tells = 0; tells <= 1; tells++) {
        struct queue *queue = queue_create(&config);
        double now = 2e-3, seconds = 1;
        settle_halves(queue, config.width);
        struct tile tile = begin_cheap(queue, config.width, &now);
        split_tile(queue, tile.id + 1);
        split_tile(queue, tile.id + 1);
        double total = queue->pace.total, unit = pace_seconds(&queue->pace, 0, 1);
        double density = seconds / unit / tile_pixels(&tile);
        if (tells)
            queue_takes_long(queue, 0, tile.id, now, seconds);
        else
            assert_true(queue_finish(queue, 0, tile.id, now, seconds));
        uint32_t around = 0;
        for (uint32_t id = 0; id < queue->item_count; id++) {
            const struct item *item = &queue->items[id];
            if (!heap_has(&queue->waiting, id)) continue;
            bool near =
                apart(item->x / 16, tile.x / 16) <= 1 && apart(item->y / 16, tile.y / 16) <= 1;
            assert_int_equal((double)item->worst > 0.999 * density * (double)area(item), near);
            around += near;
        }
        assert_true(around >= 3); /* one of them in three parts */
        const struct item *first = &queue->items[heap_top(&queue->waiting)];
        assert_true(apart(first->x / 16, tile.x / 16) <= 1);
        assert_true(queue->pace.total > total);
        queue_destroy(queue);
    }
}

/* The tiles above and to the left are raised, too, where they wait. */
static void test_all_neighbours_are_raised(void **state)
{
    const struct queue_config config = {
        .width = 256, .height = 256, .renderers = 32, .tile_edge = 16};
    struct queue *queue = queue_create(&config); /* without probes: the first tiles are scattered */
    struct tile lot[LOT_TILES], tile = {0};
    uint32_t renderer = 0, count = queue_next(queue, 0, 0, lot);
    for (uint32_t i = 0; i < count; i++)
        queue_finish(queue, 0, lot[i].id, 1e-3, 1e-3);
    while (tile.x < 64 || tile.x > 176 || tile.y < 64 || tile.y > 176) {
        assert_true(queue_next(queue, ++renderer, 1e-3, lot) > 0);
        tile = lot[0];
    }
    queue_finish(queue, renderer, tile.id, 1, 1);
    uint32_t before = 0, behind = 0;
    for (uint32_t id = 0; id < queue->item_count; id++) {
        const struct item *item = &queue->items[id];
        if (!heap_has(&queue->waiting, id)) continue;
        bool near = apart(item->x / 16, tile.x / 16) <= 1 && apart(item->y / 16, tile.y / 16) <= 1;
        assert_int_equal((double)item->work > 2 * (double)area(item), near);
        before += near && item->y < tile.y;
        behind += near && item->y > tile.y;
    }
    assert_true(before == 3 && behind == 3);
    queue_destroy(queue);
}

/* Where tiles are large, only what is near the expensive one is taken to be as expensive, whatever tiles it is part of:
 * otherwise a few expensive pixels would make all predictions far too high. */
static void test_large_tiles_are_raised_in_part(void **state)
{
    for (uint32_t edge = 32; edge <= 128; edge *= 2) {
        const struct queue_config config = {
            .width = 1280, .height = 640, .renderers = 1, .tile_edge = edge, .probe_edge = 8};
        struct queue *queue = queue_create(&config);
        double now = 2e-3, seconds = 1;
        settle_halves(queue, config.width);
        struct tile tile = begin_cheap(queue, config.width, &now);
        double total = queue->pace.total, unit = pace_seconds(&queue->pace, 0, 1);
        double density = seconds / unit / tile_pixels(&tile);
        queue_finish(queue, 0, tile.id, now, seconds);
        double more = (queue->pace.total - total) / (density / 2);
        uint32_t around = (tile.w + 64) * (tile.h + 64) - tile_pixels(&tile);
        assert_true(more > 16 * 16 && more < around);
        queue_destroy(queue);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_probes_are_checked),
        cmocka_unit_test(test_costs_are_smoothed),
        cmocka_unit_test(test_unknown_costs),
        cmocka_unit_test(test_costs_by_a_clock_that_stands_still),
        cmocka_unit_test(test_predictions_stay_numbers),
        cmocka_unit_test(test_added_tiles_are_predicted),
        cmocka_unit_test(test_neighbours_are_raised),
        cmocka_unit_test(test_all_neighbours_are_raised),
        cmocka_unit_test(test_large_tiles_are_raised_in_part),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
