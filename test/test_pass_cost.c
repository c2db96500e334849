/* What the parts of a pass are predicted to take, from what rays took before. */
#include <math.h>
#include <string.h>

#include "common/thread_pool.h"
#include "master/pass_cost.h"
#include "test/unit.h"

/* No multiples of the edges of blocks and cells. */
enum { WIDTH = 53, HEIGHT = 39, PIXELS = WIDTH * HEIGHT };

/* Where the right part begins, in which rays are more, and slower. */
enum { MIDDLE = 32 };

static struct view view = {.min_samples = 4, .max_samples = 256};
static const struct tile all = {.w = WIDTH, .h = HEIGHT, .step = 1};
static const struct tile left = {.w = MIDDLE, .h = HEIGHT, .step = 1};
static const struct tile right = {.x = MIDDLE, .w = WIDTH - MIDDLE, .h = HEIGHT, .step = 1};

static double rays_of(size_t pixel)
{
    return pixel % WIDTH < MIDDLE ? 2 : 5;
}

/* Rays of the samples of all pixels of a tile, so many of each pixel. */
static double rays_in(const struct tile *tile, double samples)
{
    double sum = 0;
    for (uint32_t y = tile->y; y < tile->y + tile->h; y++)
        for (uint32_t x = tile->x; x < tile->x + tile->w; x++)
            sum += samples * rays_of((size_t)y * WIDTH + x);
    return sum;
}

/* A picture whose pixels all have the first level. */
struct picture {
    struct canvas canvas;
    struct statistics statistics;
    struct pass_cost *cost;
    uint8_t next[PIXELS];
};

static void raise(struct picture *it, const struct tile *tile, uint8_t level)
{
    const float zero[3] = {0, 0, 0};
    for (uint32_t y = tile->y; y < tile->y + tile->h; y++)
        for (uint32_t x = tile->x; x < tile->x + tile->w; x++) {
            size_t i = (size_t)y * WIDTH + x;
            float rays = (float)rays_of(i);
            statistics_put(&it->statistics, i, level,
                           &(struct new_samples){zero, zero, zero, &rays});
        }
}

/* Pass 0 has taken so many seconds in the two parts of the picture. */
static void begin(struct picture *it, double left_s, double right_s)
{
    canvas_init(&it->canvas, WIDTH, HEIGHT);
    statistics_init(&it->statistics, &view, &it->canvas);
    it->cost = pass_cost_create(WIDTH, HEIGHT);
    raise(it, &all, 1);
    pass_cost_took(it->cost, &left, left_s);
    pass_cost_took(it->cost, &right, right_s);
    memset(it->next, 1, PIXELS);
}

static void end(struct picture *it)
{
    pass_cost_destroy(it->cost);
    statistics_free(&it->statistics);
    canvas_free(&it->canvas);
}

/* Asks for this level in all pixels of a tile, in addition to what was asked for. */
static void ask(struct picture *it, const struct tile *tile, uint8_t level)
{
    for (uint32_t y = tile->y; y < tile->y + tile->h; y++)
        memset(it->next + (size_t)y * WIDTH + tile->x, level, tile->w);
}

static void check_close(double seconds, double expected)
{
    if (!(fabs(seconds - expected) <= 1e-9 * fabs(expected) + 1e-12))
        fail_msg("%g s, not %g", seconds, expected);
}

/* Rays take as long as they took in the same part of the picture, whoever predicts; parts make up the whole; where
 * nothing is asked for, nothing is predicted. */
static void test_places(void **state)
{
    struct thread_pool *pool = thread_pool_create(3);
    for (int with_pool = 0; with_pool < 2; with_pool++) {
        struct picture it;
        begin(&it, 3, 20);
        assert_true(pass_cost_of(it.cost, &all) == 0);
        const struct tile a = {.x = 4, .y = 8, .w = 20, .h = 12, .step = 1};
        const struct tile b = {.x = 40, .y = 36, .w = 13, .h = 3, .step = 1};
        ask(&it, &a, 2); /* 4 more samples */
        ask(&it, &b, 4); /* 28 more */
        pass_cost_predict(it.cost, &it.statistics, it.next, with_pool ? pool : NULL);
        double in_a = 3 * rays_in(&a, 4) / rays_in(&left, 4);
        double in_b = 20 * rays_in(&b, 28) / rays_in(&right, 4);
        check_close(pass_cost_of(it.cost, &all), in_a + in_b);
        check_close(pass_cost_of(it.cost, &left), in_a);
        check_close(pass_cost_of(it.cost, &a), in_a);
        check_close(pass_cost_of(it.cost, &b), in_b);
        check_close(pass_cost_of(it.cost, &(struct tile){.x = 8, .y = 8, .w = 4, .h = 4}),
                    in_a * 16 / 240);
        check_close(pass_cost_of(it.cost, &(struct tile){.x = 5, .y = 10, .w = 1, .h = 1}),
                    in_a / 240);
        check_close(pass_cost_of(it.cost, &(struct tile){.y = 24, .w = 24, .h = 12}), 0);
        /* What was predicted before is forgotten. */
        ask(&it, &a, 1);
        pass_cost_predict(it.cost, &it.statistics, it.next, with_pool ? pool : NULL);
        check_close(pass_cost_of(it.cost, &all), in_b);
        end(&it);
    }
    thread_pool_destroy(pool);
}

/* What a pass has taken counts where it took it: its seconds are divided among the parts of a tile as predicted, and
 * the mean of all passes is what the next one is predicted from. */
static void test_later_passes(void **state)
{
    struct picture it;
    begin(&it, 3, 20);
    ask(&it, &all, 2);
    pass_cost_predict(it.cost, &it.statistics, it.next, NULL);
    raise(&it, &all, 2);
    pass_cost_took(it.cost, &all, 2 * 23); /* twice as long as predicted */
    ask(&it, &all, 3);
    pass_cost_predict(it.cost, &it.statistics, it.next, NULL);
    /* 8 samples took 3 + 6 s and 20 + 40 s; there are to be as many again. */
    check_close(pass_cost_of(it.cost, &left), 9);
    check_close(pass_cost_of(it.cost, &right), 60);
    end(&it);
}

/* A tile that begins and ends within blocks counts in these alone, as often as its part in them says: no second is lost
 * or counted twice. */
static void test_tile_across_blocks(void **state)
{
    struct picture it;
    const struct tile top = {.w = WIDTH, .h = 20, .step = 1};
    const struct tile bottom = {.y = 20, .w = WIDTH, .h = HEIGHT - 20, .step = 1};
    begin(&it, 0, 0);
    pass_cost_took(it.cost, &top, 3);
    pass_cost_took(it.cost, &bottom, 20);
    ask(&it, &all, 2); /* as many samples again */
    pass_cost_predict(it.cost, &it.statistics, it.next, NULL);
    check_close(pass_cost_of(it.cost, &all), 23);
    check_close(pass_cost_of(it.cost, &(struct tile){.w = WIDTH, .h = 16}), 3 * 16.0 / 20);
    check_close(pass_cost_of(it.cost, &(struct tile){.y = 32, .w = WIDTH, .h = HEIGHT - 32}),
                20 * (HEIGHT - 32.0) / (HEIGHT - 20));
    end(&it);
}

/* A picture that cells divide without a rest: tiles at its ends are no exception. */
static void test_whole_cells(void **state)
{
    enum { EDGE = 32 };
    const struct tile whole = {.w = EDGE, .h = EDGE, .step = 1};
    const float zero[3] = {0, 0, 0}, rays = 2;
    uint8_t next[EDGE * EDGE];
    struct canvas canvas;
    struct statistics statistics;
    canvas_init(&canvas, EDGE, EDGE);
    statistics_init(&statistics, &view, &canvas);
    struct pass_cost *cost = pass_cost_create(EDGE, EDGE);
    for (size_t i = 0; i < EDGE * EDGE; i++)
        statistics_put(&statistics, i, 1, &(struct new_samples){zero, zero, zero, &rays});
    pass_cost_took(cost, &whole, 8);
    memset(next, 2, sizeof next); /* as many samples again */
    pass_cost_predict(cost, &statistics, next, NULL);
    check_close(pass_cost_of(cost, &whole), 8);
    check_close(pass_cost_of(cost, &(struct tile){.x = 24, .y = 16, .w = 8, .h = 16}), 1);
    pass_cost_destroy(cost);
    statistics_free(&statistics);
    canvas_free(&canvas);
}

/* Where the clock has seen nothing, the mean of the picture counts; if it has never seen anything, nothing is known. */
static void test_unseen_time(void **state)
{
    struct picture it;
    begin(&it, 0, 20);
    ask(&it, &all, 2);
    pass_cost_predict(it.cost, &it.statistics, it.next, NULL);
    check_close(pass_cost_of(it.cost, &right), 20);
    check_close(pass_cost_of(it.cost, &left), 20 * rays_in(&left, 4) / rays_in(&all, 4));
    end(&it);
    begin(&it, 0, 0);
    ask(&it, &all, 2);
    pass_cost_predict(it.cost, &it.statistics, it.next, NULL);
    assert_true(pass_cost_of(it.cost, &all) == 0);
    end(&it);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_places),
        cmocka_unit_test(test_later_passes),
        cmocka_unit_test(test_tile_across_blocks),
        cmocka_unit_test(test_whole_cells),
        cmocka_unit_test(test_unseen_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
