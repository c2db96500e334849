/* Joining adjacent cheap tiles once there are predictions. */
#include <stdlib.h>

#include "test/queue_fixture.h"
#include "test/queue_halves_fixture.h"
#include "test/unit.h"

/* Tiles that are cheap beside all work, as probes tell, are joined; those that a renderer holds are not, nor expensive
 * ones. */
static void test_cheap_are_joined(void **state)
{
    const struct queue_config config = {
        .width = 200, .height = 136, .renderers = 2, .tile_edge = 8, .probe_edge = 8};
    struct queue *queue = queue_create(&config);
    struct tile tiles[LOT_TILES];
    unsigned char *seen = calloc(config.width, config.height);
    uint32_t count, joined = 0, dear = 0;
    double now = 0;
    while (!queue->settled || !queue_complete(queue)) {
        if (queue->settled) check_sums(queue);
        for (uint32_t renderer = 0; renderer < 2; renderer++) {
            count = queue_next(queue, renderer, now, tiles);
            for (uint32_t i = 0; i < count; i++) {
                /* The right quarter is a hundred times as dear. */
                bool is_dear = tiles[i].x >= 144;
                double seconds = 1e-6 * tile_pixels(&tiles[i]) * (is_dear ? 100 : 1);
                float probed[LOT_TILES];
                if (tiles[i].pass == TILE_PROBE) {
                    for (uint32_t k = 0; k < tile_pixels(&tiles[i]); k++)
                        probed[k] =
                            tiles[i].x + 8 * k >= 144 ? 1e-4f : 1e-8f * (float)(tiles[i].x + 8 * k);
                    queue_probed(queue, &tiles[i], probed);
                } else {
                    mark(seen, &config, &tiles[i]);
                    joined += tiles[i].w > 8 || tiles[i].h > 8;
                    dear += is_dear && (tiles[i].w > 8 || tiles[i].h > 8);
                }
                queue_finish(queue, renderer, tiles[i].id, now += seconds, seconds);
            }
        }
    }
    for (uint32_t i = 0; i < config.width * config.height; i++)
        assert_int_equal(seen[i], 1);
    assert_true(joined > 20 && dear == 0);
    assert_int_equal(queue_count(queue).pixels_finished, config.width * config.height);
    free(seen);
    queue_destroy(queue);
}

/* Of cheap tiles, those that may be expensive stay as they are. */
static void test_uncertain_stay_apart(void **state)
{
    const struct queue_config config = {
        .width = 512, .height = 512, .renderers = 2, .tile_edge = 8};
    struct queue *queue = queue_create(&config);
    queue->items[1].worst *= 10;
    queue_join(queue);
    assert_true(area(&queue->items[0]) == 64 && area(&queue->items[2]) == 256);
    assert_int_equal(queue_count(queue).tiles, 64 * 64 / 4 + 2);
    queue_destroy(queue);
}

/* Tiles are joined before the last probes are back, so that one slow renderer does not keep the others at small
 * tiles. */
static void test_joined_before_all_probes(void **state)
{
    const struct queue_config config = {
        .width = 640, .height = 480, .renderers = 44, .tile_edge = 8, .probe_edge = 16};
    struct queue *queue = queue_create(&config);
    struct tile own[LOT_TILES], lot[LOT_TILES];
    uint32_t owned = queue_next(queue, 0, 0, own), joined = 0;
    for (uint32_t who = 1; !queue->settled; who = who % 43 + 1) {
        uint32_t count = queue_next(queue, who, 1e-3, lot);
        assert_true(count > 0);
        for (uint32_t i = 0; i < count; i++)
            if (lot[i].pass == TILE_PROBE)
                answer_probes(queue, who, &lot[i], 1);
            else
                queue_finish(queue, who, lot[i].id, 1e-3, 1e-5);
    }
    assert_true(owned > 0 && queue->probes_back < queue->map.probes);
    for (uint32_t id = 0; id < queue->item_count; id++)
        joined += heap_has(&queue->waiting, id) && area(&queue->items[id]) > 64;
    assert_true(joined > 100);
    check_sums(queue);
    answer_probes(queue, 0, own, owned);
    assert_int_equal(queue->probes_back, queue->map.probes);
    check_sums(queue);
    queue_destroy(queue);
}

/* Whether any tiles of one cost per pixel are joined once the probes are back, and if so all by fours. Those of 8 x 8
 * pixels are 0.8 % of a renderer's share in a picture with an edge of 2048 pixels. */
static bool are_joined(uint32_t edge, uint32_t tile_edge)
{
    const struct queue_config config = {
        .width = edge, .height = edge, .renderers = 512, .tile_edge = tile_edge, .probe_edge = 16};
    struct queue *queue = queue_create(&config);
    float seconds[LOT_TILES];
    bool joined;
    for (uint32_t k = 0; k < LOT_TILES; k++)
        seconds[k] = 1e-6f;
    for (uint32_t i = 0; !queue->settled; i++) {
        struct tile lot[LOT_TILES];
        uint32_t count = queue_next(queue, i % 512, 0, lot);
        for (uint32_t k = 0; k < count; k++) {
            assert_int_equal(lot[k].pass, TILE_PROBE);
            queue_probed(queue, &lot[k], seconds);
            queue_finish(queue, i % 512, lot[k].id, 0, 1e-6);
        }
    }
    joined = area(&queue->items[0]) == 4 * tile_edge * tile_edge;
    assert_true(joined || area(&queue->items[0]) == tile_edge * tile_edge);
    check_sums(queue);
    queue_destroy(queue);
    return joined;
}

/* Four of 128 tiles of a renderer's share are joined, two of eight are not. */
static void test_joined_are_a_small_part_of_a_share(void **state)
{
    assert_true(are_joined(2048, 8));
    assert_false(are_joined(512, 8));
}

/* Tiles that are as large as is best for renderers are not joined, however cheap they are. */
static void test_large_are_not_joined(void **state)
{
    assert_false(are_joined(2048, 16));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cheap_are_joined),
        cmocka_unit_test(test_uncertain_stay_apart),
        cmocka_unit_test(test_joined_before_all_probes),
        cmocka_unit_test(test_joined_are_a_small_part_of_a_share),
        cmocka_unit_test(test_large_are_not_joined),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
