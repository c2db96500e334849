/* Tests of what counts of an earlier run if this run divides the picture into other tiles. */
#include <math.h>
#include <stdlib.h>

#include "master/found.h"
#include "test/unit.h"

#define EDGE 12

static struct tile box(uint32_t x, uint32_t y, uint32_t w, uint32_t h)
{
    return (struct tile){.x = x, .y = y, .w = w, .h = h, .step = 1};
}

/* A tile whose pixels take a second each and have an error that is their column. */
static struct found_tile told(struct tile tile)
{
    struct found_tile it = {.tile = tile, .busy_s = tile_pixels(&tile)};
    it.cpu_s = it.busy_s / 2;
    it.counts.rays[RAY_PRIMARY] = 4 * tile_pixels(&tile);
    for (uint32_t k = 0; k < tile_pixels(&tile); k++) {
        uint32_t x, y;
        tile_pixel(&tile, k, &x, &y);
        it.counts.sampling.squares += x;
        it.counts.halfway.squares += 2 * x;
    }
    return it;
}

static uint32_t add(struct found *found, struct tile tile)
{
    struct found_tile it = told(tile);
    return found_add(found, &it);
}

static uint32_t use(struct found *found, struct tile tile)
{
    return found_use(found, &tile);
}

static void test_same_cut(void **state)
{
    struct found found;
    found_init(&found, EDGE, EDGE);
    assert_int_equal(add(&found, box(0, 0, 4, 4)), 16);
    assert_int_equal(add(&found, box(8, 0, 4, 4)), 16);
    assert_int_equal(add(&found, box(8, 0, 4, 4)), 0); /* written twice */
    assert_int_equal(use(&found, box(0, 0, 4, 4)), 16);
    assert_int_equal(use(&found, box(4, 0, 4, 4)), 0);
    assert_int_equal(use(&found, box(8, 0, 4, 4)), 16);
    struct found_sums sums = found_sum(&found);
    assert_true(sums.busy_s == 32 && sums.cpu_s == 16 && sums.repeated_s == 0);
    assert_true(sums.counts.rays[RAY_PRIMARY] == 128);
    assert_true(sums.counts.sampling.squares == 4 * (0 + 1 + 2 + 3 + 8 + 9 + 10 + 11));
    found_free(&found);
}

/* The left half is used; the right half, which has other errors, is rendered again. */
static void test_rendered_again(void **state)
{
    struct found found;
    found_init(&found, EDGE, EDGE);
    add(&found, box(0, 0, 6, 8));
    add(&found, box(6, 0, 6, 8));
    assert_int_equal(use(&found, box(0, 0, 6, 4)), 24);
    assert_int_equal(use(&found, box(0, 4, 6, 4)), 24);
    assert_int_equal(use(&found, box(6, 0, 6, 12)), 48); /* not all of 72 */
    struct found_sums sums = found_sum(&found);
    assert_true(sums.busy_s == 48 && sums.repeated_s == 48);
    assert_true(sums.counts.rays[RAY_PRIMARY] == 4 * 48);
    assert_true(sums.counts.sampling.squares == 8 * 15 && sums.counts.halfway.squares == 8 * 30);
    found_free(&found);
}

/* A row across several tiles: each of them counts with its share. */
static void test_shares(void **state)
{
    struct found found;
    found_init(&found, EDGE, EDGE);
    for (uint32_t x = 0; x < EDGE; x += 3) {
        struct found_tile it = told(box(x, 0, 3, 4));
        if (x == 3) it.counts.nonfinite = it.counts.primary_hits = 1, it.counts.truncation = 0.5;
        found_add(&found, &it);
    }
    assert_int_equal(use(&found, box(0, 0, EDGE, 1)), EDGE);
    struct found_sums sums = found_sum(&found);
    assert_true(sums.busy_s == EDGE && sums.repeated_s == 3 * EDGE);
    assert_true(fabs(sums.counts.sampling.squares - 66) < 1e-12);
    assert_true(fabs(sums.counts.halfway.squares - 2 * 66) < 1e-12);
    assert_int_equal(sums.counts.rays[RAY_PRIMARY], 4 * EDGE);
    /* No count becomes 0 by rounding. */
    assert_int_equal(sums.counts.nonfinite, 1);
    assert_int_equal(sums.counts.primary_hits, 1);
    assert_true(sums.counts.truncation == 0.5);
    found_free(&found);
}

/* Pixels that were rendered twice count once, with the later tile. */
static void test_overlap(void **state)
{
    struct found found;
    found_init(&found, EDGE, EDGE);
    assert_int_equal(add(&found, box(0, 0, 4, 4)), 16);
    struct found_tile late = told(box(0, 0, EDGE, 2));
    late.busy_s *= 3;
    assert_int_equal(found_add(&found, &late), 2 * EDGE - 8);
    assert_int_equal(use(&found, box(0, 0, EDGE, 2)), 2 * EDGE);
    struct found_sums sums = found_sum(&found);
    assert_true(sums.busy_s == 3 * 2 * EDGE && sums.repeated_s == 8);
    assert_true(sums.counts.sampling.squares == 132);
    found_free(&found);
}

/* Tiles of later passes count as a whole. */
static void test_passes(void **state)
{
    struct found found;
    found_init(&found, EDGE, EDGE);
    add(&found, box(0, 0, EDGE, EDGE));
    struct tile tile = box(2, 2, 5, 5);
    tile.pass = 1;
    assert_int_equal(add(&found, tile), 0);
    assert_int_equal(use(&found, box(0, 0, EDGE, EDGE)), EDGE * EDGE);
    struct found_sums sums = found_sum(&found);
    assert_true(sums.busy_s == EDGE * EDGE + 25 && sums.repeated_s == 0);
    found_free(&found);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_cut), cmocka_unit_test(test_rendered_again),
        cmocka_unit_test(test_shares),   cmocka_unit_test(test_overlap),
        cmocka_unit_test(test_passes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
