#include <math.h>
#include <string.h>

#include "common/protocol.h"
#include "common/scene.h"
#include "test/unit.h"

enum { WIDTH = 100, HEIGHT = 60 };

static const struct tile good_tile = {.id = 7, .x = 96, .y = 56, .w = 4, .h = 4, .step = 1};

static bool tile_ok(struct tile tile)
{
    return tile_message_valid(&tile, WIDTH, HEIGHT);
}

static void test_counts_add(void **state)
{
    struct render_counts sum = {.rays = {1, 2, 3, 4},
                                .primary_hits = 9,
                                .nonfinite = 5,
                                .exact_fallbacks = 6,
                                .intersect_s = 0.5,
                                .shade_s = 0.25,
                                .truncation = 0.125,
                                .unmatched_media = 7,
                                .bound_rays = 9,
                                .open_media = 8,
                                .sampling = {1, 2},
                                .halfway = {3, 4},
                                .first = {.x = 3, .y = 2}};
    struct render_counts more = {.rays = {10, 20, 30, 40},
                                 .primary_hits = 90,
                                 .nonfinite = 50,
                                 .exact_fallbacks = 60,
                                 .intersect_s = 1,
                                 .shade_s = 2,
                                 .truncation = 0.0625,
                                 .unmatched_media = 70,
                                 .bound_rays = 90,
                                 .open_media = 80,
                                 .sampling = {0.5, 0.25},
                                 .halfway = {0.125, 0.0625},
                                 .first = {.x = 9, .y = 1}};
    render_counts_add(&sum, &more);
    for (unsigned kind = 0; kind < RAY_KINDS; kind++)
        assert_int_equal(sum.rays[kind], 11 * (kind + 1));
    assert_int_equal(sum.primary_hits, 99);
    assert_int_equal(sum.nonfinite, 55);
    assert_int_equal(sum.exact_fallbacks, 66);
    assert_true(sum.intersect_s == 1.5 && sum.shade_s == 2.25);
    assert_int_equal(sum.unmatched_media, 77);
    assert_int_equal(sum.open_media, 88);
    assert_int_equal(sum.bound_rays, 99);
    assert_true(sum.sampling.squares == 1.5 && sum.sampling.fourths == 2.25);
    assert_true(sum.halfway.squares == 3.125 && sum.halfway.fourths == 4.0625);
    assert_true(sum.first.x == 9 && sum.first.y == 1); /* in the upper row */
    assert_true(sum.truncation == 0.125);              /* the largest, not the sum */
    more.truncation = HUGE_VAL;
    render_counts_add(&sum, &more);
    assert_true(isinf(sum.truncation));
}

/* The first bad sample in picture order is kept, in whatever order they are added. */
static void test_first_bad_sample(void **state)
{
    struct render_counts sum = {.first = {.x = 0}}, none = {.first = {.x = 0}};
    const struct bad_sample samples[] = {{.x = 5, .y = 9},
                                         {.x = 7, .y = 4, .sample = 1},
                                         {.x = 7, .y = 4, .sample = 2},
                                         {.x = 8, .y = 4}};
    for (size_t i = 0; i < 4; i++)
        render_counts_bad(&sum, &samples[i]);
    render_counts_add(&sum, &none);
    assert_int_equal(sum.nonfinite, 4);
    assert_true(sum.first.x == 7 && sum.first.y == 4 && sum.first.sample == 1);
    assert_true(bad_sample_before(&samples[1], &samples[2]));
    assert_false(bad_sample_before(&samples[2], &samples[2]));
    render_counts_add(&none, &sum);
    assert_true(none.first.x == 7 && none.nonfinite == 4);
}

/* What came back dropped took time, but is no tile of the picture, nor are probes; and what took no time tells nothing
 * of when a renderer finished. */
static void test_renderer_stats_add(void **state)
{
    const struct tile tile = {.w = 4, .h = 2, .step = 1},
                      probe = {.w = 4, .h = 1, .step = 1, .pass = TILE_PROBE};
    struct renderer_stats stats = {.rank = 1};
    struct result_header header = {
        .pixels = 8, .start_s = 2, .busy_s = 3, .cpu_s = 1, .counts.primary_hits = 5};
    renderer_stats_add(&stats, &tile, &header);
    header.pixels = RESULT_DROPPED;
    renderer_stats_add(&stats, &tile, &header);
    header.pixels = 4;
    renderer_stats_add(&stats, &probe, &header);
    assert_true(stats.tiles == 1 && stats.pixels == 8 && stats.counts.primary_hits == 5);
    assert_true(stats.busy_s == 9 && stats.cpu_s == 3 && stats.finish_s == 5);
    renderer_stats_add(&stats, &tile, &(struct result_header){.pixels = RESULT_DROPPED});
    assert_true(stats.finish_s == 5);
    header = (struct result_header){.pixels = 8, .start_s = 6, .busy_s = 1e-6};
    renderer_stats_add(&stats, &tile, &header);
    assert_true(stats.finish_s == 6 + 1e-6);
}

static void test_tile_good(void **state)
{
    assert_true(tile_ok(good_tile));
    assert_true(tile_ok((struct tile){.w = WIDTH, .h = HEIGHT, .step = 1}));
    assert_true(tile_ok((struct tile){.x = WIDTH - 1, .y = HEIGHT - 1, .w = 1, .h = 1, .step = 1}));
    /* A processor's share may be empty of all but one pixel. */
    assert_true(tile_ok((struct tile){.w = WIDTH, .h = HEIGHT, .step = 9000, .phase = 5999}));
}

static void test_tile_outside(void **state)
{
    struct tile tile = good_tile;
    tile.w = 5;
    assert_false(tile_ok(tile));
    tile = good_tile, tile.h = 5;
    assert_false(tile_ok(tile));
    tile = good_tile, tile.x = UINT32_MAX;
    assert_false(tile_ok(tile));
    tile = good_tile, tile.y = UINT32_MAX - 2; /* y + h wraps round to 1 */
    assert_false(tile_ok(tile));
    tile = good_tile, tile.w = 0;
    assert_false(tile_ok(tile));
    tile = good_tile, tile.h = 0;
    assert_false(tile_ok(tile));
}

static void test_tile_size(void **state)
{
    struct tile tile = {.w = 1024, .h = 1024, .step = 1};
    assert_true(tile_message_valid(&tile, UINT32_MAX, UINT32_MAX));
    assert_false(tile_message_valid(&tile, 0, 0));
    tile.h = 1025;
    assert_false(tile_message_valid(&tile, UINT32_MAX, UINT32_MAX));
    tile.w = tile.h = 1u << 16; /* w * h is 0 in 32 bits */
    assert_false(tile_message_valid(&tile, UINT32_MAX, UINT32_MAX));
}

static void test_tile_order(void **state)
{
    struct tile tile = good_tile;
    tile.step = 0;
    assert_false(tile_ok(tile));
    tile.step = UINT32_MAX; /* tile_pixels() would overflow */
    assert_false(tile_ok(tile));
    tile = good_tile, tile.phase = 15;
    assert_true(tile_ok(tile));
    tile.phase = 16;
    assert_false(tile_ok(tile));
    tile = good_tile, tile.pass = 1;
    assert_true(tile_ok(tile));
    tile.pass = TILE_PROBE;
    assert_true(tile_ok(tile));
}

static void test_result(void **state)
{
    const size_t bytes = sizeof(struct result_header) + 16 * 3 * sizeof(float);
    const struct result_header good = {.tile_id = 7, .pixels = 16, .busy_s = 0};
    struct result_header header = good;
    assert_true(result_message_valid(&header, bytes, &good_tile, false));
    assert_false(result_message_valid(&header, bytes - 1, &good_tile, false));
    /* What follows may belong to another tile. */
    assert_true(result_message_valid(&header, bytes + 8, &good_tile, false));
    assert_false(result_message_valid(&header, 0, &good_tile, false));
    assert_false(result_message_valid(NULL, 0, &good_tile, false)); /* no byte of it is read */
    header.tile_id = 8;
    assert_false(result_message_valid(&header, bytes, &good_tile, false));
    header = good, header.pixels = 15;
    assert_false(result_message_valid(&header, bytes, &good_tile, false));
    header = good, header.start_s = -1e-9;
    assert_false(result_message_valid(&header, bytes, &good_tile, false));
    header = good, header.cpu_s = (double)NAN;
    assert_false(result_message_valid(&header, bytes, &good_tile, false));
    header = good, header.busy_s = -1e-9;
    assert_false(result_message_valid(&header, bytes, &good_tile, false));
    header.busy_s = (double)NAN;
    assert_false(result_message_valid(&header, bytes, &good_tile, false));
    header.busy_s = HUGE_VAL;
    assert_false(result_message_valid(&header, bytes, &good_tile, false));
    header.busy_s = 1.1 * SECONDS_MOST;
    assert_false(result_message_valid(&header, bytes, &good_tile, false));
    double *const sums[] = {&header.counts.sampling.squares, &header.counts.sampling.fourths,
                            &header.counts.halfway.squares, &header.counts.halfway.fourths};
    for (size_t i = 0; i < 4; i++) {
        header = good, *sums[i] = HUGE_VAL;
        assert_true(result_message_valid(&header, bytes, &good_tile, false));
        header = good, *sums[i] = (double)NAN;
        assert_false(result_message_valid(&header, bytes, &good_tile, false));
        header = good, *sums[i] = -1;
        assert_false(result_message_valid(&header, bytes, &good_tile, false));
    }
}

static void test_result_of_share(void **state)
{
    struct tile tile = {.id = 1, .w = 10, .h = 1, .step = 4, .phase = 3}; /* pixels 3 and 7 */
    struct result_header header = {.tile_id = 1, .pixels = 2};
    assert_true(result_message_valid(&header, sizeof header + 2 * 12, &tile, false));
    assert_false(result_message_valid(&header, sizeof header + 2 * 12 - 1, &tile, false));
    header.pixels = 3;
    assert_false(result_message_valid(&header, sizeof header + 3 * 12, &tile, false));
}

/* From pass 1 on, some of the tile's pixels get samples; each comes with its halves. */
static void test_result_of_pass(void **state)
{
    struct tile tile = good_tile;
    struct result_header header = {.tile_id = tile.id, .pixels = 16};
    assert_true(result_message_valid(&header, sizeof header + 16 * 32, &tile, true));
    assert_false(result_message_valid(&header, sizeof header + 16 * 32 - 1, &tile, true));
    header.pixels = 3;
    assert_false(result_message_valid(&header, sizeof header + 3 * 32, &tile, true));
    tile.pass = 4;
    assert_true(result_message_valid(&header, sizeof header + 3 * 32, &tile, true));
    assert_false(result_message_valid(&header, sizeof header + 3 * 32 - 1, &tile, true));
    header.pixels = 0;
    assert_true(result_message_valid(&header, sizeof header, &tile, true));
    header.pixels = 16;
    assert_true(result_message_valid(&header, sizeof header + 16 * 32, &tile, true));
    header.pixels = 17;
    assert_false(result_message_valid(&header, sizeof header + 17 * 32, &tile, true));
    assert_int_equal(tile_part_bytes(&tile), sizeof tile + 32);
    tile.pass = TILE_PROBE;
    assert_int_equal(tile_part_bytes(&tile), sizeof tile);
    assert_int_equal(result_bytes(&tile, 16, true), sizeof header + 16 * 16);
}

/* One number for each tile, or none. */
static void test_lot_header(void **state)
{
    struct lot_header header = {.answer_s = HUGE_VAL, .reports = LOT_TILES};
    assert_true(lot_header_valid(&header));
    header.reports++;
    assert_false(lot_header_valid(&header));
    header = (struct lot_header){.answer_s = 0, .wakes_master = 1};
    assert_true(lot_header_valid(&header));
    header.wakes_master = 2;
    assert_false(lot_header_valid(&header));
    header = (struct lot_header){.answer_s = (double)NAN};
    assert_false(lot_header_valid(&header));
    float report_s[3] = {0, 1, HUGE_VALF};
    assert_true(lot_report_valid(report_s, 3) && lot_report_valid(NULL, 0));
    report_s[1] = -1;
    assert_false(lot_report_valid(report_s, 3));
    report_s[1] = NAN;
    assert_false(lot_report_valid(report_s, 3));
    assert_int_equal(lot_report_bytes(0), 0);
    assert_int_equal(lot_report_bytes(3), 16);
    assert_int_equal(lot_report_bytes(LOT_TILES), 4 * LOT_TILES);
}

/* A header alone, of a tile that takes long. */
static void test_unfinished(void **state)
{
    struct result_header header = {.pixels = RESULT_UNFINISHED, .busy_s = 0.5};
    assert_true(unfinished_valid(&header) && !dropped_valid(&header));
    header.busy_s = (double)NAN;
    assert_false(unfinished_valid(&header));
    header.busy_s = -1;
    assert_false(unfinished_valid(&header));
    header = (struct result_header){.tile_id = good_tile.id, .pixels = RESULT_UNFINISHED};
    assert_false(result_message_valid(&header, SIZE_MAX, &good_tile, false));
    header.pixels = RESULT_DROPPED;
    assert_false(unfinished_valid(&header));
}

static void test_refinements(void **state)
{
    struct refinement refinements[3] = {{0, 1}, {2, 2}, {3, 5}};
    assert_true(refinements_valid(refinements, 3, 5));
    assert_false(refinements_valid(refinements, 3, 4));
    refinements[1].from = 3;
    assert_false(refinements_valid(refinements, 3, 5));
    assert_true(refinements_valid(refinements, 1, 5));
    refinements[0].from = 2;
    assert_false(refinements_valid(refinements, 1, 5));
}

static void test_stats(void **state)
{
    const struct renderer_stats good = {.rank = 3, .host = "node"};
    struct renderer_stats stats = good;
    assert_true(stats_message_valid(&stats, sizeof stats, 3));
    assert_false(stats_message_valid(&stats, sizeof stats, 2));
    assert_false(stats_message_valid(&stats, sizeof stats - 1, 3));
    stats.rank = UINT32_MAX;
    assert_false(stats_message_valid(&stats, sizeof stats, -1));
    stats = good, memset(stats.host, 'x', sizeof stats.host);
    assert_false(stats_message_valid(&stats, sizeof stats, 3));
    stats.host[sizeof stats.host - 1] = '\0';
    assert_true(stats_message_valid(&stats, sizeof stats, 3));
}

static void test_stats_numbers(void **state)
{
    struct renderer_stats stats = {.rank = 0, .host = "node"};
    double *const seconds[] = {&stats.busy_s,        &stats.cpu_s,    &stats.wait_s,
                               &stats.send_s,        &stats.finish_s, &stats.counts.intersect_s,
                               &stats.counts.shade_s};
    const double bad[] = {-1, (double)NAN, HUGE_VAL, -HUGE_VAL};
    for (size_t i = 0; i < sizeof seconds / sizeof *seconds; i++) {
        for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
            *seconds[i] = bad[k];
            assert_false(stats_message_valid(&stats, sizeof stats, 0));
        }
        *seconds[i] = 1;
    }
    stats.counts.truncation = HUGE_VAL;
    assert_true(stats_message_valid(&stats, sizeof stats, 0));
    stats.counts.truncation = (double)NAN;
    assert_false(stats_message_valid(&stats, sizeof stats, 0));
    stats.counts.truncation = 0;
    stats.counts.first.origin.x = (double)NAN; /* valid, as a bad sample may have such a ray */
    assert_true(stats_message_valid(&stats, sizeof stats, 0));
    uint32_t *const places[] = {&stats.counts.first.x, &stats.counts.first.y,
                                &stats.counts.first.sample};
    const uint32_t limits[] = {PICTURE_MAX_EDGE, PICTURE_MAX_EDGE, SAMPLES_MAX};
    for (size_t i = 0; i < 3; i++) {
        *places[i] = limits[i];
        assert_false(stats_message_valid(&stats, sizeof stats, 0));
        *places[i] = limits[i] - 1;
        assert_true(stats_message_valid(&stats, sizeof stats, 0));
    }
}

static void test_welcome(void **state)
{
    struct welcome welcome = {.magic = WELCOME_MAGIC, .build = "1.2.3"};
    assert_memory_equal(&welcome.magic, "FARM WL1", 8); /* as it goes over the wire */
    assert_true(welcome_valid(&welcome, "1.2.3"));
    assert_false(welcome_valid(&welcome, "1.2.4"));
    assert_false(welcome_valid(&welcome, "1.2.34"));
    assert_false(welcome_valid(&welcome, ""));
    welcome.magic ^= 1;
    assert_false(welcome_valid(&welcome, "1.2.3"));
    welcome.magic ^= 1;
    memset(welcome.build, '1', sizeof welcome.build);
    assert_false(welcome_valid(&welcome, "11111111111111111111111111111111"));
}

static void test_ready_and_start(void **state)
{
    struct ready ready = {.rank = 3, .host = "node"};
    assert_true(ready_message_valid(&ready, sizeof ready, 3));
    assert_false(ready_message_valid(&ready, sizeof ready, 2));
    assert_false(ready_message_valid(&ready, sizeof ready - 1, 3));
    ready.reserved = 1;
    assert_false(ready_message_valid(&ready, sizeof ready, 3));
    ready.reserved = 0;
    memset(ready.host, 'x', sizeof ready.host);
    assert_false(ready_message_valid(&ready, sizeof ready, 3));
    struct start start = {.elapsed_s = 0};
    assert_true(start_message_valid(&start, sizeof start));
    assert_false(start_message_valid(&start, sizeof start - 1));
    start.elapsed_s = -1;
    assert_false(start_message_valid(&start, sizeof start));
    start.elapsed_s = (double)NAN;
    assert_false(start_message_valid(&start, sizeof start));
    start = (struct start){.patience = -1};
    assert_false(start_message_valid(&start, sizeof start));
}

/* A field that only the master sets must be 0 in messages. */
static void test_silent_is_not_sent(void **state)
{
    struct renderer_stats stats = {.rank = 1};
    assert_true(stats_message_valid(&stats, sizeof stats, 1));
    stats.silent = 1;
    assert_false(stats_message_valid(&stats, sizeof stats, 1));
}

static void test_drop(void **state)
{
    struct drop drop = {.tile_id = 7};
    assert_true(drop_message_valid(&drop, sizeof drop));
    assert_false(drop_message_valid(&drop, sizeof drop - 1));
    drop.finished = 1;
    assert_true(drop_message_valid(&drop, sizeof drop));
    drop.finished = 2;
    assert_false(drop_message_valid(&drop, sizeof drop));
    struct drop drops[DROP_TILES + 1] = {{.tile_id = 7}};
    assert_true(drop_message_valid(drops, DROP_TILES * sizeof drop));
    assert_false(drop_message_valid(drops, sizeof drops));
    assert_false(drop_message_valid(drops, 0));
    drops[DROP_TILES - 1].finished = 2;
    assert_true(drop_message_valid(drops, (DROP_TILES - 1) * sizeof drop));
    assert_false(drop_message_valid(drops, DROP_TILES * sizeof drop));
    struct result_header header = {.pixels = RESULT_DROPPED, .busy_s = 0.1, .cpu_s = 0.1};
    assert_true(dropped_valid(&header));
    header.busy_s = -1;
    assert_false(dropped_valid(&header));
    header.busy_s = 0;
    header.cpu_s = (double)NAN;
    assert_false(dropped_valid(&header));
    header.cpu_s = 0;
    header.pixels = 1;
    assert_false(dropped_valid(&header));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_first_bad_sample),
        cmocka_unit_test(test_counts_add),
        cmocka_unit_test(test_renderer_stats_add),
        cmocka_unit_test(test_tile_good),
        cmocka_unit_test(test_tile_outside),
        cmocka_unit_test(test_tile_size),
        cmocka_unit_test(test_tile_order),
        cmocka_unit_test(test_result),
        cmocka_unit_test(test_ready_and_start),
        cmocka_unit_test(test_silent_is_not_sent),
        cmocka_unit_test(test_result_of_share),
        cmocka_unit_test(test_result_of_pass),
        cmocka_unit_test(test_lot_header),
        cmocka_unit_test(test_unfinished),
        cmocka_unit_test(test_refinements),
        cmocka_unit_test(test_stats),
        cmocka_unit_test(test_drop),
        cmocka_unit_test(test_stats_numbers),
        cmocka_unit_test(test_welcome),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
