/* The work queue: every pixel exactly once, whoever asks in whatever order. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "common/clock.h"
#include "common/cores.h"
#include "master/queue_parts.h"
#include "test/random.h"

static void mark(unsigned char *seen, const struct queue_config *config, const struct tile *tile)
{
    for (uint32_t k = 0; k < tile_pixels(tile); k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        assert_true(x < config->width && y < config->height);
        assert_int_equal(seen[(size_t)y * config->width + x]++, 0);
    }
}

/* Of pieces that were kept; returns how many count. */
static uint32_t hear_fates(struct queue *queue, unsigned char *seen,
                           const struct queue_config *config)
{
    struct fate fate;
    uint32_t count = 0;
    for (; queue_fate(queue, &fate); count += fate.counts) {
        struct tile tile = queue_tile_of(queue, fate.id);
        if (fate.counts) mark(seen, config, &tile);
    }
    return count;
}

struct held {
    uint32_t renderer, id;
};

/* Probes of any cost whatever. */
static void answer_probe(struct queue *queue, const struct tile *probe, uint64_t *seed)
{
    float seconds[64];
    uint32_t pixels = tile_pixels(probe);
    assert_true(pixels <= 64);
    for (uint32_t k = 0; k < pixels; k++)
        seconds[k] = 1e-6f * (float)random_below(seed, 1000);
    queue_probed(queue, probe, seconds);
}

/* Sums of floats that came and went. */
static void assert_sum(double value, double expected, double all)
{
    if (!(fabs(value - expected) <= 1e-5 * all)) fail_msg("%g instead of %g", value, expected);
}

/* What is counted along the way is what the tiles come to. */
static void check_sums(const struct queue *queue)
{
    struct outlook outlook = {0};
    double waiting_work = 0, total = 0;
    uint64_t waiting_pixels = 0, finished = 0;
    uint32_t waiting = 0;
    for (uint32_t id = 0; id < queue->item_count; id++) {
        const struct item *item = &queue->items[id];
        double work = (double)item->work;
        if (item->pass == 0) assert_true((double)item->worst >= work * (1 - 1e-5));
        if (agenda_has(&queue->waiting, id)) {
            assert_false(item->finished);
            waiting++;
            waiting_work += work;
            waiting_pixels += area(item);
        }
        if (!is_of_picture(item)) continue;
        if (!item->skipped) total += work;
        if (item->finished) finished += area(item);
        if (item->skipped) {
            outlook_skip(&outlook, work, area(item));
        } else if (item->finished) {
            outlook_finish(&outlook, work, area(item), (double)item->seconds);
        } else {
            outlook_add(&outlook, work, area(item));
        }
    }
    uint32_t lost = 0;
    for (uint32_t i = 0; i < queue->config.renderers; i++)
        lost += queue->pace.renderers[i].lost;
    assert_int_equal(queue->pace.lost_count, lost);
    assert_int_equal(queue->waiting.count, waiting);
    assert_int_equal(queue->waiting_pixels, waiting_pixels);
    assert_int_equal(queue->count.pixels_finished, finished);
    assert_sum(queue->waiting_work, waiting_work, waiting > 0 ? total : 0);
    assert_sum(queue->pace.total, total, total);
    for (uint32_t i = 0; i < OUTLOOK_CLASSES; i++) {
        assert_sum(queue->outlook.classes[i].left, outlook.classes[i].left, total);
        assert_sum(queue->outlook.classes[i].skipped, outlook.classes[i].skipped, total);
        assert_sum(queue->outlook.classes[i].done, outlook.classes[i].done, total);
        assert_sum(queue->outlook.classes[i].seconds, outlook.classes[i].seconds, 1);
    }
}

/*
 * Renderers chosen at random ask for lots and finish tiles, in no time that has to do with any
 * prediction, until nothing moves any more; renderer 0 likes to keep others waiting, and what others
 * have taken over is dropped or not. Every pixel is rendered once, and once more when it is handed out
 * again; the first answer counts, a piece with all others of its tile.
 */
static void drive(const struct queue_config *config, uint64_t seed)
{
    struct queue *queue = queue_create(config);
    assert_non_null(queue);
    size_t pixels = (size_t)config->width * config->height, most = 200 * (size_t)config->renderers;
    unsigned char *seen = calloc(pixels, 1);
    struct held *held = calloc(most, sizeof *held);
    struct tile lot[LOT_TILES], tile;
    uint32_t count = 0;
    double now = 0;
    while (!queue_complete(queue)) {
        uint32_t renderer = random_below(&seed, config->renderers);
        now += 1e-3 * random_below(&seed, 100);
        if (!queue->is_static && random_below(&seed, 64) == 0) check_sums(queue);
        uint32_t tiles = queue_next(queue, renderer, now, lot), sum = 0;
        for (uint32_t i = 0; i < tiles; i++) {
            assert_true(count < most);
            held[count++] = (struct held){renderer, lot[i].id};
            sum += tile_pixels(&lot[i]);
        }
        assert_true(sum <= queue_largest_lot(queue) || lot[0].pass == TILE_PROBE);
        if (tiles > 0 || count == 0) continue;
        uint32_t i = random_below(&seed, count);
        struct held back = held[i];
        if (back.renderer == 0 && random_below(&seed, 10) > 0) continue;
        held[i] = held[--count];
        if (queue_is_recalled(queue, back.renderer, back.id) && random_below(&seed, 2)) {
            queue_drop(queue, back.renderer, back.id, now, 0);
            continue;
        }
        assert_true(queue_find_held(queue, back.renderer, back.id, &tile));
        if (tile.pass == TILE_PROBE) answer_probe(queue, &tile, &seed);
        enum answer answer = queue_finish(queue, back.renderer, back.id, now, 1e-3);
        if (answer == ANSWER_COUNTS) mark(seen, config, &tile);
        hear_fates(queue, seen, config);
        assert_false(queue_find_held(queue, back.renderer, back.id, &tile));
    }
    for (size_t i = 0; i < pixels; i++)
        assert_int_equal(seen[i], 1);
    if (!queue->is_static) check_sums(queue);
    struct queue_count counted = queue_count(queue);
    assert_int_equal(counted.pixels_finished, pixels);
    assert_true(counted.share_finished > 0.999 && counted.share_finished <= 1);
    uint32_t next = 0;
    assert_false(queue_unfinished(queue, &next, &tile));
    free(held);
    free(seen);
    queue_destroy(queue);
}

static void test_every_pixel_once(void **state)
{
    (void)state;
    const uint32_t sizes[][2] = {{1, 1}, {7, 5}, {64, 48}, {97, 61}, {640, 3}, {1, 300}};
    const uint32_t renderers[] = {1, 2, 3, 5, 44, 400};
    const uint32_t edges[] = {1, 8, 24, 64};
    const uint32_t probe_edges[] = {0, 2, 8, 16};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        for (size_t r = 0; r < sizeof renderers / sizeof *renderers; r++) {
            struct queue_config config = {
                .width = sizes[s][0], .height = sizes[s][1], .renderers = renderers[r]};
            config.tile_edge = edges[(s + r) % 4];
            config.probe_edge = probe_edges[(s + 2 * r) % 4];
            for (int schedule = 0; schedule < SCHEDULES; schedule++) {
                config.schedule = (enum schedule)schedule;
                for (uint64_t seed = 1 + s * 100 + r; seed < 20000; seed += 1000)
                    drive(&config, seed);
            }
        }
    }
}

/* However cheap pixels are, no lot has more of them than its message has room for. */
static void test_large_lots(void **state)
{
    (void)state;
    const struct queue_config config = {
        .width = 2048, .height = 1024, .renderers = 1, .tile_edge = 64};
    for (uint64_t seed = 1; seed < 4; seed++)
        drive(&config, seed);
}

/* ---- in virtual time ---- */

/* A renderer of the virtual farm: it has up to two lots and renders tile after tile. */
struct virtual
{
    double speed, free_at; /* speed 0: never answers */
    struct tile lots[2][LOT_TILES];
    uint32_t counts[2], lots_held;
};

/* Dear in one corner, 50 times the rest. */
static double cost_of(const struct tile *tile)
{
    double sum = 0;
    for (uint32_t k = 0; k < tile_pixels(tile); k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        sum += x < 40 && y < 40 ? 50e-6 : 1e-6;
    }
    return sum;
}

static void ask(struct queue *queue, struct virtual *v, uint32_t i, double now)
{
    while (v->lots_held < 2) {
        uint32_t count = queue_next(queue, i, now, v->lots[v->lots_held]);
        if (count == 0) break;
        if (v->lots_held == 0) {
            double work = 0;
            for (uint32_t k = 0; k < count; k++)
                work += cost_of(&v->lots[0][k]);
            v->free_at = v->speed > 0 ? now + work / v->speed : HUGE_VAL;
        }
        v->counts[v->lots_held++] = count;
    }
}

static void answer(struct queue *queue, struct virtual *v, uint32_t i, double now)
{
    for (uint32_t k = 0; k < v->counts[0]; k++) {
        const struct tile *tile = &v->lots[0][k];
        float seconds[64];
        for (uint32_t p = 0; p < 64 && tile->pass == TILE_PROBE && p < tile_pixels(tile); p++) {
            struct tile pixel = {.w = 1, .h = 1, .step = 1};
            tile_pixel(tile, p, &pixel.x, &pixel.y);
            seconds[p] = (float)(cost_of(&pixel) / v->speed);
        }
        if (tile->pass == TILE_PROBE) queue_probed(queue, tile, seconds);
        queue_finish(queue, i, tile->id, now, cost_of(tile) / v->speed);
    }
    /* What was given out is taken off again, whatever was learnt of it meanwhile. */
    if (queue_tile_count(queue, i) == 0)
        assert_true(queue->pace.renderers[i].held <= 1e-9 * queue->pace.total);
    memcpy(v->lots[0], v->lots[1], sizeof v->lots[0]);
    v->counts[0] = v->counts[1];
    v->lots_held--;
    if (v->lots_held == 0) return;
    double work = 0;
    for (uint32_t k = 0; k < v->counts[0]; k++)
        work += cost_of(&v->lots[0][k]);
    v->free_at = now + work / v->speed;
}

/* What queue_ends() has said. */
struct foretold {
    uint32_t looks;
    double first; /* when it said something */
    double least, most;
};

static void look_at_end(const struct queue *queue, double now, struct foretold *foretold)
{
    double end = queue_ends(queue, now);
    if (queue_count(queue).share_finished < 1.0 / 32) return;
    if (foretold->looks++ == 0) *foretold = (struct foretold){1, now, end, end};
    foretold->least = fmin(foretold->least, end);
    foretold->most = fmax(foretold->most, end);
}

/* When the picture is complete; nobody who could work is left without when something waits. */
static double run_virtual_and_watch(const struct queue_config *config, struct virtual *virtuals,
                                    struct foretold *foretold)
{
    struct queue *queue = queue_create(config);
    double now = 0;
    while (!queue_complete(queue)) {
        uint32_t next = UINT32_MAX;
        queue_look(queue, now);
        double when = fmax(queue_wake(queue) + 1e-9, now);
        for (uint32_t i = 0; i < config->renderers; i++) {
            ask(queue, &virtuals[i], i, now);
            if (virtuals[i].lots_held > 0 && virtuals[i].free_at <= when) {
                next = i;
                when = virtuals[i].free_at;
            }
        }
        assert_true(when < 100);
        now = when;
        if (next != UINT32_MAX) answer(queue, &virtuals[next], next, now);
        look_at_end(queue, now, foretold);
    }
    queue_destroy(queue);
    return now;
}

static double run_virtual(const struct queue_config *config, struct virtual *virtuals)
{
    struct foretold foretold = {0};
    return run_virtual_and_watch(config, virtuals, &foretold);
}

#define VIRTUALS 16

/* 320 x 240 pixels on 16 renderers; the share of what they could do that is done. */
static double efficiency(double slow, uint32_t slow_count)
{
    const struct tile all = {.w = 320, .h = 240, .step = 1};
    struct queue_config config = {
        .width = 320, .height = 240, .renderers = VIRTUALS, .tile_edge = 8, .probe_edge = 8};
    struct virtual *virtuals = calloc(VIRTUALS, sizeof *virtuals);
    double speed = 0;
    for (uint32_t i = 0; i < VIRTUALS; i++) {
        virtuals[i].speed = i < slow_count ? slow : 1;
        speed += virtuals[i].speed;
    }
    double time = run_virtual(&config, virtuals);
    free(virtuals);
    return cost_of(&all) / (speed * time);
}

static void test_equal_renderers(void **state)
{
    (void)state;
    /* Probes take one in 64 of the pixels' time, which is no part of what is done. */
    assert_true(efficiency(1, 0) > 0.965);
}

/* A quarter of the speed: of one, and of half of them. Half of them come to 0.873, and to 0.82 where speeds are not
 * learnt, nobody is late, or lots may be dear: virtual time is the same everywhere. */
static void test_uneven_renderers(void **state)
{
    (void)state;
    assert_true(efficiency(0.25, 1) > 0.96);
    assert_true(efficiency(0.25, 8) > 0.86);
}

/* The others finish the picture, with little more than its share lost. */
static void test_stopped_renderers(void **state)
{
    (void)state;
    assert_true(efficiency(0, 1) > 0.97);
    assert_true(efficiency(0, 3) > 0.97);
}

/* The one tile of a lot under a schedule that deals them one by one. */
static bool next_tile(struct queue *queue, uint32_t renderer, struct tile *tile)
{
    struct tile lot[LOT_TILES];
    uint32_t count = queue_next(queue, renderer, 0, lot);
    assert_true(count <= 1);
    if (count == 1) *tile = lot[0];
    return count == 1;
}

/* Rows that one renderer gets, all its tiles together. */
static uint32_t rows_of(struct queue *queue, uint32_t renderer, uint32_t *first)
{
    uint32_t rows = 0;
    struct tile tile;
    while (next_tile(queue, renderer, &tile)) {
        if (rows == 0) *first = tile.y;
        assert_int_equal(tile.y, *first + rows);
        rows += tile.h;
        queue_finish(queue, renderer, tile.id, 0, 0);
    }
    assert_int_equal(queue_tile_count(queue, renderer), 0);
    return rows;
}

/* The paper: rows that do not divide evenly go to the first processors, one each. */
static void test_strips_are_the_papers(void **state)
{
    (void)state;
    struct queue_config config = {
        .schedule = SCHEDULE_STRIPS, .width = 640, .height = 480, .renderers = 44};
    struct queue *queue = queue_create(&config);
    uint32_t next = 0;
    for (uint32_t r = 0; r < 44; r++) {
        uint32_t first = 0;
        /* 480 = 44 * 10 + 40 */
        assert_int_equal(rows_of(queue, r, &first), r < 40 ? 11 : 10);
        assert_int_equal(first, next);
        next += r < 40 ? 11 : 10;
    }
    queue_destroy(queue);
}

static void test_cyclic_deals_pixels(void **state)
{
    (void)state;
    struct queue_config config = {
        .schedule = SCHEDULE_CYCLIC, .width = 333, .height = 200, .renderers = 7};
    struct queue *queue = queue_create(&config);
    for (uint32_t r = 0; r < 7; r++) {
        struct tile tile;
        while (next_tile(queue, r, &tile)) {
            for (uint32_t k = 0; k < tile_pixels(&tile); k++) {
                uint32_t x, y;
                tile_pixel(&tile, k, &x, &y);
                assert_int_equal((y * 333 + x) % 7, r);
            }
            queue_finish(queue, r, tile.id, 0, 0);
        }
    }
    assert_int_equal(queue_count(queue).pixels_finished, 333 * 200);
    queue_destroy(queue);
}

/* Tachyon: row y is processor y mod P's. */
static void test_cyclic_rows_deals_rows(void **state)
{
    (void)state;
    struct queue_config config = {
        .schedule = SCHEDULE_CYCLIC_ROWS, .width = 333, .height = 200, .renderers = 7};
    struct queue *queue = queue_create(&config);
    for (uint32_t r = 0; r < 7; r++) {
        struct tile tile;
        for (uint32_t y = r; next_tile(queue, r, &tile); y += 7) {
            assert_true(tile.x == 0 && tile.w == 333 && tile.y == y && tile.h == 1);
            queue_finish(queue, r, tile.id, 0, 0);
        }
    }
    assert_true(queue_complete(queue));
    queue_destroy(queue);
}

/* What was asked for or chosen, and no more rows than a share of the picture has. */
static void test_tile_edge(void **state)
{
    (void)state;
    static const struct {
        struct queue_config config;
        uint32_t edge;
    } cases[] = {
        {{.schedule = SCHEDULE_DYNAMIC, .tile_edge = 16}, 16},
        {{.schedule = SCHEDULE_TILES, .tile_edge = 64}, 64},
        {{.schedule = SCHEDULE_STRIPS, .tile_edge = 7}, 7},
        {{.schedule = SCHEDULE_STRIPS, .tile_edge = 30}, 25},
        {{.schedule = SCHEDULE_CYCLIC, .tile_edge = 30}, 30},
        {{.schedule = SCHEDULE_CYCLIC, .tile_edge = 300}, 100},
        {{.schedule = SCHEDULE_CYCLIC_ROWS}, 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct queue_config config = cases[i].config;
        config.width = config.height = 100, config.renderers = 4;
        struct queue *queue = queue_create(&config);
        assert_int_equal(queue_tile_edge(queue), cases[i].edge);
        queue_destroy(queue);
    }
}

/* One tile in work and one in reserve, but no reserve when others could start it at once. */
static void test_reserve(void **state)
{
    (void)state;
    struct queue_config config = {
        .schedule = SCHEDULE_TILES, .width = 80, .height = 10, .renderers = 2, .tile_edge = 10};
    struct queue *queue = queue_create(&config);
    struct tile tile;
    assert_int_equal(queue_count(queue).tiles, 8);
    assert_true(next_tile(queue, 0, &tile));
    assert_true(next_tile(queue, 0, &tile));
    assert_false(next_tile(queue, 0, &tile));
    assert_int_equal(queue_tile_count(queue, 0), 2);
    assert_true(queue_is_full(queue, 0) && !queue_is_full(queue, 1));
    assert_true(next_tile(queue, 1, &tile));
    for (uint32_t id = 0; id < 2; id++)
        queue_finish(queue, 0, id, 0, 0);
    assert_true(next_tile(queue, 0, &tile));
    assert_true(next_tile(queue, 0, &tile));
    assert_true(next_tile(queue, 1, &tile));
    queue_finish(queue, 1, 2, 0, 0);
    assert_int_equal(tile.id, 5);
    /* Two tiles wait, two renderers: renderer 1 still holds one and gets no second. */
    assert_false(next_tile(queue, 1, &tile));
    queue_finish(queue, 1, 5, 0, 0);
    assert_true(next_tile(queue, 1, &tile));
    queue_destroy(queue);
}

/* Renderers 0 and 2 do all that they get, in turn, until neither gets anything. */
static void work_on(struct queue *queue, unsigned char *seen, const struct queue_config *config)
{
    bool moved = true;
    while (moved) {
        moved = false;
        for (uint32_t renderer = 0; renderer < 3; renderer += 2) {
            struct tile tile;
            if (!next_tile(queue, renderer, &tile)) continue;
            moved = true;
            if (queue_finish(queue, renderer, tile.id, 0, 0)) mark(seen, config, &tile);
        }
    }
}

/* A small share travels in pieces, too: a part of it shows. But not in less than a row. */
static void test_bands_show_progress(void **state)
{
    (void)state;
    for (int schedule = SCHEDULE_STRIPS; schedule <= SCHEDULE_CYCLIC; schedule++) {
        struct queue_config config = {.schedule = (enum schedule)schedule, .renderers = 6};
        config.width = 320, config.height = 240;
        struct queue *queue = queue_create(&config);
        assert_in_range(queue_count(queue).tiles, 6 * 16, 6 * 20);
        queue_destroy(queue);
        config.renderers = 240;
        queue = queue_create(&config);
        assert_in_range(queue_count(queue).tiles, 240, 2 * 240);
        queue_destroy(queue);
    }
}

static uint32_t above_last_row(void *state, const struct tile *tile)
{
    (void)state;
    return tile->y < 50 ? tile_pixels(tile) : 0;
}

/* What an earlier run has finished of other shares does not fill the bar: it would stand there. */
static void test_progress_of_resumed_shares(void **state)
{
    (void)state;
    struct queue_config config = {
        .schedule = SCHEDULE_STRIPS, .width = 60, .height = 60, .renderers = 3, .tile_edge = 10};
    struct queue *queue = queue_create(&config);
    queue_skip(queue, above_last_row, NULL); /* all but half of the last share */
    struct queue_count count = queue_count(queue);
    assert_int_equal(count.pixels_finished, 50 * 60);
    assert_true(count.share_finished == 0.5 && count.share_skipped == 0.5);
    queue_destroy(queue);
}

/* The next tile of the renderer is back by now, and has taken so long; false: it gets none. */
static bool do_next(struct queue *queue, uint32_t renderer, double now, double seconds)
{
    struct tile tile;
    if (!next_tile(queue, renderer, &tile)) return false;
    queue_finish(queue, renderer, tile.id, now, seconds);
    return true;
}

/* The run ends with the share of which most is left, whatever of the others is finished. */
static void test_progress_of_shares(void **state)
{
    (void)state;
    for (int schedule = SCHEDULE_STRIPS; schedule < SCHEDULES; schedule++) {
        struct queue_config config = {.schedule = (enum schedule)schedule,
                                      .width = 60,
                                      .height = 60,
                                      .renderers = 3,
                                      .tile_edge = 2};
        struct queue *queue = queue_create(&config);
        double tile_s = schedule == SCHEDULE_CYCLIC ? 1.0 / 3 : 1; /* of 30 or 10 in a share */
        while (do_next(queue, 0, 10, tile_s) && do_next(queue, 2, 10, tile_s))
            ;
        struct queue_count count = queue_count(queue);
        assert_int_equal(count.pixels_finished, 2 * 60 * 60 / 3);
        assert_true(fabs(count.share_finished - 0.5) < 1e-9); /* as long as the others took */
        assert_true(do_next(queue, 1, 20, 2 * 10 * tile_s));
        count = queue_count(queue);
        assert_true(count.share_finished > 0.2 && count.share_finished < 0.5);
        while (do_next(queue, 1, 40, tile_s))
            ;
        assert_true(queue_count(queue).share_finished == 1);
        queue_destroy(queue);
    }
}

/* What a renderer holds that gives no sign any more, and its share, go to others; when it comes back
 * after all, what it brings is no news. */
static void test_silent(void **state)
{
    (void)state;
    for (int schedule = 0; schedule < SCHEDULES; schedule++) {
        if (schedule == SCHEDULE_DYNAMIC) continue; /* it knows who is late: test_stopped */
        struct queue_config config = {.schedule = (enum schedule)schedule,
                                      .width = 60,
                                      .height = 50,
                                      .renderers = 3,
                                      .tile_edge = 4};
        struct queue *queue = queue_create(&config);
        unsigned char seen[60 * 50] = {0};
        struct tile first = {0}, second = {0}, tile;
        assert_true(next_tile(queue, 1, &first) && next_tile(queue, 1, &second));
        work_on(queue, seen, &config);
        assert_false(queue_complete(queue) || queue_over(queue, 0));
        uint64_t news = queue_news(queue);
        queue_set_silent(queue, 1, true);
        assert_true(queue_news(queue) != news);
        work_on(queue, seen, &config);
        assert_true(queue_complete(queue) && queue_over(queue, 0));
        for (size_t i = 0; i < sizeof seen; i++)
            assert_int_equal(seen[i], 1);
        assert_int_equal(queue_count(queue).repeated, 2);
        queue_set_silent(queue, 1, false);
        assert_false(queue_finish(queue, 1, first.id, 0, 0));
        assert_true(queue_is_recalled(queue, 1, second.id));
        queue_drop(queue, 1, second.id, 0, 0);
        assert_false(queue_find_held(queue, 1, second.id, &tile));
        queue_destroy(queue);
    }
}

/* The idle look for work of the silent where there are any: among so many renderers they would have to look at
 * 10^10 of them, some 20 s. */
static void test_nobody_is_silent(void **state)
{
    (void)state;
    enum { RENDERERS = 100000 };
    struct queue_config config = {
        .schedule = SCHEDULE_STRIPS, .width = 1, .height = RENDERERS, .renderers = RENDERERS};
    struct queue *queue = queue_create(&config);
    struct tile tile;
    double start = clock_thread_cpu();
    queue_set_silent(queue, 7, true);
    queue_set_silent(queue, 7, true);
    queue_set_silent(queue, 7, false);
    for (uint32_t renderer = 0; renderer < RENDERERS; renderer++) {
        assert_true(next_tile(queue, renderer, &tile));
        queue_finish(queue, renderer, tile.id, 0, 0);
        assert_false(next_tile(queue, renderer, &tile));
    }
    assert_true(queue_complete(queue));
    assert_true(clock_thread_cpu() - start < 4);
    queue_destroy(queue);
}

static void test_stop(void **state)
{
    (void)state;
    for (int schedule = 0; schedule < SCHEDULES; schedule++) {
        struct queue_config config = {.schedule = (enum schedule)schedule,
                                      .width = 100,
                                      .height = 100,
                                      .renderers = 2,
                                      .tile_edge = 10};
        struct queue *queue = queue_create(&config);
        struct tile lot[LOT_TILES], more[LOT_TILES], tile;
        uint32_t count = queue_next(queue, 0, 0, lot);
        assert_true(count > 0);
        queue_stop(queue);
        assert_int_equal(queue_next(queue, 0, 0, more), 0);
        assert_int_equal(queue_next(queue, 1, 0, more), 0);
        assert_true(queue_over(queue, 1));
        assert_false(queue_over(queue, 0));
        assert_true(queue_find_held(queue, 0, lot[0].id, &tile));
        queue_finish(queue, 0, lot[0].id, 0, 0);
        assert_int_equal(queue_count(queue).finished, 1);
        assert_false(queue_complete(queue));
        queue_destroy(queue);
    }
}

static void test_answers_are_checked(void **state)
{
    (void)state;
    struct queue_config config = {.width = 100, .height = 100, .renderers = 2, .tile_edge = 10};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES], tile;
    assert_true(queue_next(queue, 0, 0, lot) > 0);
    assert_true(queue_find_held(queue, 0, lot[0].id, &tile));
    assert_false(queue_find_held(queue, 1, lot[0].id, &tile));
    assert_false(queue_find_held(queue, 0, lot[0].id + 1, &tile));
    assert_false(queue_find_held(queue, 0, UINT32_MAX, &tile));
    queue_destroy(queue);
}

/* A number that is none would go into all predictions, of which no order could be made. */
static void test_probes_are_checked(void **state)
{
    (void)state;
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

/* Renderers tell of far more time than there was for every fifth tile, as one may of many that share a core. */
static void test_predictions_stay_numbers(void **state)
{
    (void)state;
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

/* Pixels in the left half are a hundred times as dear. */
static void probe_halves(struct queue *queue, const struct tile *probe, uint32_t width)
{
    float seconds[256];
    assert_true(tile_pixels(probe) <= 256);
    for (uint32_t k = 0; k < tile_pixels(probe); k++) {
        uint32_t x, y;
        tile_pixel(probe, k, &x, &y);
        seconds[k] = x < width / 2 ? 1e-4f : 1e-6f;
    }
    queue_probed(queue, probe, seconds);
}

/* Gives renderer 0 all the probes and answers them: the left half is a hundred times as dear. */
static void settle_halves(struct queue *queue, uint32_t width)
{
    struct tile lot[LOT_TILES];
    uint32_t count;
    while ((count = queue_next(queue, 0, 0, lot)) > 0)
        for (uint32_t i = 0; i < count; i++) {
            if (lot[i].pass == TILE_PROBE) probe_halves(queue, &lot[i], width);
            queue_finish(queue, 0, lot[i].id, 1e-3, 1e-4);
            if (queue->settled) return;
        }
}

/* A lot begins with dear tiles, and cheap ones come with them: never so many that none are left for the
 * end. */
static void test_cheap_go_with_dear(void **state)
{
    (void)state;
    struct queue_config config = {
        .width = 640, .height = 320, .renderers = 1, .tile_edge = 8, .probe_edge = 8};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES];
    settle_halves(queue, 640);
    assert_true(queue->settled);
    double now = 2e-3;
    uint32_t with_both = 0, lots = 0;
    while (queue->waiting_work > 0.1 * queue->pace.total) {
        uint32_t count = queue_next(queue, 0, now, lot), cheap = 0;
        for (uint32_t i = 0; i < count; i++) {
            cheap += lot[i].x >= 320;
            if (cheap == 0) assert_true(lot[i].x < 320);
            now += lot[i].x < 320 ? 1e-4 : 1e-6;
            queue_finish(queue, 0, lot[i].id, now, lot[i].x < 320 ? 1e-4 : 1e-6);
        }
        if (count > 0) assert_true(lot[0].x < 320);
        with_both += cheap > 0 && cheap < count;
        lots += count > 0;
    }
    assert_true(lots > 0 && 2 * with_both > lots);
    assert_true(queue->waiting_pixels > 640 * 320 / 10);
    queue_destroy(queue);
}

/* Pixels of the largest tile that anybody gets of a picture whose left half costs 1e-4 a pixel, the right one a
 * hundredth of that, on the left or the right. */
static uint32_t largest_with(double most_work, bool right)
{
    const struct queue_config config = {.width = 640,
                                        .height = 320,
                                        .renderers = 1,
                                        .tile_edge = 16,
                                        .probe_edge = 8,
                                        .most_work = most_work};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES];
    uint32_t largest = 0;
    settle_halves(queue, config.width);
    for (double now = 2e-3; !queue_complete(queue);) {
        uint32_t count = queue_next(queue, 0, now, lot);
        for (uint32_t i = 0; i < count; i++) {
            uint32_t pixels = tile_pixels(&lot[i]);
            double seconds = (lot[i].x < 320 ? 1e-4 : 1e-6) * pixels;
            if ((lot[i].x >= 320) == right && pixels > largest) largest = pixels;
            queue_finish(queue, 0, lot[i].id, now += seconds, seconds);
        }
    }
    queue_destroy(queue);
    return largest;
}

/* What may be predicted to take so long at most is split, and nothing else. */
static void test_tiles_take_so_long_at_most(void **state)
{
    (void)state;
    assert_int_equal(largest_with(0, false), 256);
    assert_int_equal(largest_with(16e-4, false), 16);
    assert_int_equal(largest_with(16e-4, true), largest_with(0, true));
}

/* A tile in the cheap half that renderer 0 gets while the next one waits; all before were as dear as
 * predicted. */
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
            if (amidst && agenda_has(&queue->waiting, lot[i].id + 1)) return lot[i];
            queue_finish(queue, 0, lot[i].id, *now += seconds, seconds);
        }
    }
}

static uint32_t apart(uint32_t a, uint32_t b)
{
    return a > b ? a - b : b - a;
}

/* When a tile is far dearer than predicted, what waits around it is taken to be so, too, and goes first, what
 * was split off it before as well: as soon as it is known to take long. */
static void test_neighbours_are_warned(void **state)
{
    (void)state;
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
            if (!agenda_has(&queue->waiting, id)) continue;
            bool near =
                apart(item->x / 16, tile.x / 16) <= 1 && apart(item->y / 16, tile.y / 16) <= 1;
            assert_int_equal((double)item->worst > 0.999 * density * (double)area(item), near);
            around += near;
        }
        assert_true(around >= 3); /* one of them in three parts */
        const struct item *first = &queue->items[agenda_first(&queue->waiting)];
        assert_true(apart(first->x / 16, tile.x / 16) <= 1);
        assert_true(queue->pace.total > total);
        queue_destroy(queue);
    }
}

/* Pixels of the largest tile in the dear half of the first full lot after the probes. */
static uint32_t largest_dear(const struct queue_config *config)
{
    struct queue *queue = queue_create(config);
    struct tile lot[LOT_TILES];
    uint32_t count, largest = 0;
    double now = 2e-3;
    settle_halves(queue, config->width);
    count = queue_next(queue, 1, now, lot);
    for (uint32_t i = 0; i < count; i++) {
        double seconds = (lot[i].x < config->width / 2 ? 1e-6 : 1e-8) * tile_pixels(&lot[i]);
        queue_finish(queue, 1, lot[i].id, now += seconds, seconds);
    }
    count = queue_next(queue, 2, now, lot);
    for (uint32_t i = 0; i < count; i++)
        if (lot[i].x < config->width / 2 && tile_pixels(&lot[i]) > largest)
            largest = tile_pixels(&lot[i]);
    queue_destroy(queue);
    return largest;
}

/* Of a small picture no tile is begun that might be much of a share, though the lot has room for it; of a
 * large one tiles with the same part of all work are. */
static void test_dear_of_few_are_split(void **state)
{
    (void)state;
    struct queue_config config = {
        .width = 128, .height = 128, .renderers = 4, .tile_edge = 16, .probe_edge = 8};
    uint32_t few = largest_dear(&config);
    assert_true(few > 0 && few < 16 * 16);
    config.width = config.height = 512;
    config.tile_edge = 64;
    assert_int_equal(largest_dear(&config), 64 * 64);
}

/* Pixels of the largest tile in some lots, of which a tile of 4 x 4 pixels is two; a first one, before anything is
 * known of how long it takes, has left parts of one. */
static uint32_t largest_of_lots(uint32_t samples)
{
    const uint32_t renderers = 16;
    const struct queue_config config = {.width = 4 * 2 * renderers,
                                        .height = 4,
                                        .renderers = renderers,
                                        .tile_edge = 4,
                                        .samples = samples};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES];
    uint32_t count = queue_next(queue, 1, 0, lot), largest = 0;
    double now = 0;
    for (uint32_t i = 0; i < count; i++) {
        double seconds = 1e-2 * tile_pixels(&lot[i]);
        queue_finish(queue, 1, lot[i].id, now += seconds, seconds);
    }
    for (uint32_t renderer = 2; renderer < 6; renderer++) {
        count = queue_next(queue, renderer, now, lot);
        assert_true(count > 0);
        for (uint32_t i = 0; i < count; i++)
            if (tile_pixels(&lot[i]) > largest) largest = tile_pixels(&lot[i]);
    }
    queue_destroy(queue);
    return largest;
}

/* Parts of a small tile cost more than it does where a pixel has few samples, and only there it stays whole. */
static void test_small_are_split_by_their_samples(void **state)
{
    (void)state;
    assert_int_equal(largest_of_lots(0), 16);
    assert_int_equal(largest_of_lots(1), 16);
    assert_int_equal(largest_of_lots(16), 16);
    assert_int_equal(largest_of_lots(17), 8);
    assert_int_equal(largest_of_lots(4096), 8);
}

/* The dear ones are the left half of these columns alone: so few that a tile of them is much of a share. */
#define DEAR_WIDTH 32

static void answer_probes(struct queue *queue, uint32_t renderer, const struct tile *probes,
                          uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        probe_halves(queue, &probes[i], DEAR_WIDTH);
        queue_finish(queue, renderer, probes[i].id, 1e-3, 1e-3);
    }
}

/* Every renderer but 0 has a lot that it got before anything was known: the probes come back behind it, last those of
 * renderer 0. */
static void begin_blind(struct queue *queue, struct tile (*lots)[LOT_TILES], uint32_t *counts)
{
    struct tile own[LOT_TILES], probes[LOT_TILES];
    uint32_t count = queue_next(queue, 0, 0, own);
    for (uint32_t i = 1; i < queue->config.renderers; i++) {
        counts[i] = queue_next(queue, i, 0, lots[i]);
        if (lots[i][0].pass != TILE_PROBE) continue;
        uint32_t given = counts[i];
        memcpy(probes, lots[i], given * sizeof *probes);
        counts[i] = queue_next(queue, i, 0, lots[i]);
        answer_probes(queue, i, probes, given);
    }
    assert_false(queue->settled);
    answer_probes(queue, 0, own, count);
    assert_true(queue->settled);
}

/* What late ones have got before anything was known of it, and have not begun, goes to others as it is, unless it is
 * dear: then it waits in pieces. */
static void test_dear_of_late_are_broken_up(void **state)
{
    (void)state;
    const struct queue_config config = {
        .width = 640, .height = 480, .renderers = 44, .tile_edge = 8, .probe_edge = 16};
    struct queue *queue = queue_create(&config);
    struct tile lots[44][LOT_TILES], lot[LOT_TILES];
    uint32_t counts[44], dear = 0, cheap = 0;
    begin_blind(queue, lots, counts);
    double now = 0.01;
    do {
        uint32_t count = queue_next(queue, 0, now, lot);
        assert_true(count > 0);
        for (uint32_t i = 0; i < count; i++)
            queue_finish(queue, 0, lot[i].id, now, 1e-3);
        queue_look(queue, now = 100);
    } while (queue->pace.spare.count > 0);
    for (uint32_t i = 1; i < config.renderers; i++) {
        for (uint32_t k = 1; k < counts[i]; k++) {
            const struct item *item = &queue->items[lots[i][k].id];
            bool is_dear = item->x < DEAR_WIDTH / 2, is_near = item->x < DEAR_WIDTH;
            if (!is_dear && is_near) continue; /* it may be as dear as its neighbours */
            assert_int_equal(item->pieces > 0, is_dear);
            assert_true(is_dear || item->finished);
            dear += is_dear;
            cheap += !is_dear;
        }
    }
    assert_true(dear > 0 && cheap > 0);
    queue_destroy(queue);
}

/* Renderer 0 sits on two lots, others have done all the rest at once: one who asks then gets half of
 * what 0 has not begun, the last ones, and 0 hears of every one of them. */
static void test_idle_take_unbegun(void **state)
{
    (void)state;
    struct queue_config config = {.width = 160, .height = 80, .renderers = 4, .tile_edge = 8};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES], stolen[LOT_TILES];
    assert_true(queue_next(queue, 1, 0, lot) > 0);
    assert_true(queue_finish(queue, 1, lot[0].id, 1e-3, 1e-3));
    uint32_t had = queue_next(queue, 0, 1e-3, lot), first = lot[0].id;
    had += queue_next(queue, 0, 1e-3, lot);
    assert_true(had >= 5);
    struct tile tile;
    struct recall recall;
    uint32_t others, next = 0;
    do { /* 1 still holds what is left of its first lot */
        others = queue_next(queue, 2, 2e-3, lot);
        for (uint32_t i = 0; i < others; i++)
            assert_true(queue_finish(queue, 2, lot[i].id, 2e-3, 1e-6));
    } while (others > 0 && queue_count(queue).repeated == 0);
    while (queue_unfinished(queue, &next, &tile))
        if (queue_find_held(queue, 1, tile.id, &tile)) queue_finish(queue, 1, tile.id, 2e-3, 1e-6);
    while (queue_next_recall(queue, &recall)) {
    }
    uint32_t holds = queue_tile_count(queue, 0);
    uint32_t count = queue_next(queue, 3, 2e-3, stolen), told = 0;
    assert_true(holds >= 4 && count >= 2 && count <= holds / 2);
    for (uint32_t i = 0; i < count; i++) {
        assert_true(stolen[i].id != first);
        assert_true(queue_is_recalled(queue, 0, stolen[i].id));
    }
    for (; queue_next_recall(queue, &recall); told++)
        assert_true(recall.renderer == 0 && !recall.finished);
    assert_int_equal(told, count);
    queue_destroy(queue);
}

/* All is done but one tile, which renderer 0 has begun; returns what 1 has got of it in the end. */
static uint32_t leave_last(struct queue *queue, struct tile *last, struct tile *lot, double *now)
{
    uint32_t count = queue_next(queue, 0, *now, lot);
    *last = lot[0];
    for (uint32_t i = 1; i < count; i++)
        assert_true(queue_finish(queue, 0, lot[i].id, *now, 1e-4));
    while ((count = queue_next(queue, 1, *now, lot)) > 0 && !queue_count(queue).repeated)
        for (uint32_t i = 0; i < count; i++, *now += 1e-5)
            assert_true(queue_finish(queue, 1, lot[i].id, *now, 1e-4));
    assert_int_equal(queue_count(queue).finished, queue_count(queue).tiles - 1);
    return count;
}

/* The same; 2 and 3 stand idle. Returns the number of its pieces that 2 got, or the others if it got none. */
static uint32_t break_last(struct queue *queue, struct tile *last, struct tile pieces[LOT_TILES])
{
    double now = 1e-3;
    uint32_t count = leave_last(queue, last, pieces, &now);
    now += 100; /* overdue by far */
    queue_look(queue, now);
    return count > 0 ? count : queue_next(queue, 2, now, pieces);
}

static const struct queue_config four = {
    .width = 64, .height = 48, .renderers = 4, .tile_edge = 16};

/* Whether it counts at once. */
static bool finish_and_mark(struct queue *queue, uint32_t renderer, const struct tile *tile,
                            unsigned char seen[64 * 48])
{
    enum answer answer = queue_finish(queue, renderer, tile->id, 0, 1e-4);
    if (answer == ANSWER_COUNTS) mark(seen, &four, tile);
    hear_fates(queue, seen, &four);
    return answer == ANSWER_COUNTS;
}

/* Pieces count when all are there. */
static void test_pieces_replace(void **state)
{
    (void)state;
    struct queue *queue = queue_create(&four);
    struct tile last, lot[LOT_TILES];
    unsigned char seen[64 * 48] = {0};
    uint32_t count = break_last(queue, &last, lot),
             renderer = queue_tile_count(queue, 2) > 0 ? 2 : 1;
    uint32_t kept = 0, counted = 0, tiles = queue_count(queue).tiles;
    assert_true(count > 0 && tile_pixels(&lot[0]) < tile_pixels(&last));
    do {
        for (uint32_t i = 0; i < count; i++, kept++) {
            assert_true(counted == 0 && !queue_complete(queue));
            assert_int_equal(queue_finish(queue, renderer, lot[i].id, 101, 1e-4), ANSWER_KEPT);
            counted = hear_fates(queue, seen, &four); /* no pixel twice */
        }
        count = queue_next(queue, renderer, 101, lot);
    } while (count > 0);
    assert_true(queue_complete(queue) && counted == kept);
    assert_int_equal(queue_count(queue).tiles, tiles - 1 + kept);
    assert_int_equal(queue_count(queue).pixels_finished, 64 * 48);
    assert_true(queue_count(queue).share_finished == 1);
    for (uint32_t k = 0; k < tile_pixels(&last); k++) {
        uint32_t x, y;
        tile_pixel(&last, k, &x, &y);
        assert_int_equal(seen[y * 64 + x], 1);
    }
    double wasted = queue_count(queue).wasted_s;
    assert_int_equal(queue_finish(queue, 0, last.id, 102, 1), ANSWER_IN_VAIN);
    assert_true(queue_count(queue).wasted_s == wasted + 1);
    assert_int_equal(queue_count(queue).pixels_finished, 64 * 48);
    queue_destroy(queue);
}

/* An answer takes the master so long, beside what its pixels take it. */
static void serve_for(struct queue *queue, double seconds)
{
    for (int i = 0; i < 200; i++)
        queue_served(queue, seconds, 1);
}

/* Pieces are as many as the idle can use, but no more than the master takes in while they are rendered: of 100 seconds
 * 2 where an answer takes it 25. */
static void test_pieces_are_worth_an_answer(void **state)
{
    (void)state;
    for (int dear = 0; dear <= 1; dear++) {
        struct queue *queue = queue_create(&four);
        struct tile last, lot[LOT_TILES];
        double now = 1e-3;
        serve_for(queue, 1e-2); /* so that it is no use yet to break up anything */
        assert_int_equal(leave_last(queue, &last, lot, &now), 0);
        now += 100;
        queue_look(queue, now);
        serve_for(queue, dear ? 25 : 1e-6);
        assert_true(queue_next(queue, 2, now, lot) > 0);
        assert_int_equal(queue->items[last.id].pieces, dear ? 2 : 8);
        queue_destroy(queue);
    }
}

/* What is nearly done is not given up for a first piece: the whole counts if it comes before the last one. */
static void test_whole_before_last_piece(void **state)
{
    (void)state;
    struct queue *queue = queue_create(&four);
    struct tile last, lot[LOT_TILES];
    unsigned char seen[64 * 48] = {0};
    uint32_t count = break_last(queue, &last, lot),
             renderer = queue_tile_count(queue, 2) > 0 ? 2 : 1;
    uint32_t pieces = queue->items[last.id].pieces, tiles = queue_count(queue).tiles, kept = 0;
    assert_true(pieces > 2);
    for (; kept + 1 < pieces; count = queue_next(queue, renderer, 101, lot))
        for (uint32_t i = 0; i < count && kept + 1 < pieces; i++, kept++)
            assert_int_equal(queue_finish(queue, renderer, lot[i].id, 101, 1e-4), ANSWER_KEPT);
    double wasted = queue_count(queue).wasted_s;
    assert_int_equal(queue_finish(queue, 0, last.id, 102, 1), ANSWER_COUNTS);
    assert_int_equal(hear_fates(queue, seen, &four), 0);
    assert_true(fabs(queue_count(queue).wasted_s - wasted - kept * 1e-4) < 1e-9);
    assert_true(queue_complete(queue));
    assert_int_equal(queue_count(queue).tiles, tiles);
    assert_int_equal(queue_count(queue).pixels_finished, 64 * 48);
    queue_destroy(queue);
}

/* A piece may be broken up in turn: its pieces stand for it, or it stands for them. */
static void test_pieces_of_a_piece(void **state)
{
    (void)state;
    for (int by_parts = 0; by_parts < 2; by_parts++) {
        struct queue *queue = queue_create(&four);
        struct tile lot[LOT_TILES], tile;
        unsigned char seen[64 * 48] = {0};
        uint32_t count = queue_next(queue, 0, 0, lot), whole = lot[0].id;
        uint64_t news = queue_news(queue);
        assert_true(pieces_make(queue, whole, 2, 0));
        assert_true(queue_news(queue) != news); /* to those who have got nothing */
        uint32_t piece = queue->items[whole].first_piece;
        for (uint32_t i = 1; i < count; i++)
            assert_true(finish_and_mark(queue, 0, &lot[i], seen));
        for (bool held = false; (count = queue_next(queue, 1, 0, lot)) > 0;) {
            for (uint32_t i = 0; i < count; i++)
                if (lot[i].id != piece) finish_and_mark(queue, 1, &lot[i], seen);
            if (held || !queue_find_held(queue, 1, piece, &tile)) continue;
            held = true;
            assert_true(pieces_make(queue, piece, 4, 0));
            if (!by_parts) assert_false(finish_and_mark(queue, 1, &tile, seen));
        }
        assert_true(queue_complete(queue) && queue->items[whole].finished);
        for (uint32_t i = 0; i < 64 * 48; i++)
            assert_int_equal(seen[i], 1);
        assert_int_equal(queue_finish(queue, 0, whole, 0, 1), ANSWER_IN_VAIN);
        if (by_parts) assert_int_equal(queue_finish(queue, 1, piece, 0, 1), ANSWER_IN_VAIN);
        queue_destroy(queue);
    }
}

/* Forgets what renderers are to be told; returns how much of it says that this renderer's tile is
 * finished. */
static uint32_t told_finished(struct queue *queue, uint32_t renderer, uint32_t id)
{
    struct recall recall;
    uint32_t count = 0;
    while (queue_next_recall(queue, &recall))
        count += recall.finished && recall.renderer == renderer && recall.id == id;
    return count;
}

/* Who still renders what others have finished hears of it, once, and may leave it half done: the whole
 * when all pieces have come, pieces when the whole has. */
static void test_finished_is_told(void **state)
{
    (void)state;
    for (int whole = 0; whole < 2; whole++) {
        struct queue *queue = queue_create(&four);
        struct tile last, lot[LOT_TILES];
        uint32_t count = break_last(queue, &last, lot),
                 renderer = queue_tile_count(queue, 2) > 0 ? 2 : 1;
        assert_true(count > 0 && queue_is_recalled(queue, 0, last.id));
        assert_int_equal(told_finished(queue, 0, last.id), 0); /* that others have it, yes */
        const struct tile *late = whole ? &lot[0] : &last;
        uint32_t loser = whole ? renderer : 0;
        assert_int_equal(queue_is_recalled(queue, loser, late->id), !whole);
        if (whole) assert_int_equal(queue_finish(queue, 0, last.id, 101, 1e-4), ANSWER_COUNTS);
        for (; !whole && count > 0; count = queue_next(queue, renderer, 101, lot)) {
            for (uint32_t i = 0; i < count; i++) {
                assert_int_equal(told_finished(queue, 0, last.id), 0);
                assert_true(queue_finish(queue, renderer, lot[i].id, 101, 1e-4) == ANSWER_KEPT);
            }
            if (queue_complete(queue)) break;
        }
        assert_true(queue_is_recalled(queue, loser, late->id));
        assert_int_equal(told_finished(queue, loser, late->id), 1);
        assert_int_equal(told_finished(queue, loser, late->id), 0);
        double wasted = queue_count(queue).wasted_s;
        queue_drop(queue, loser, late->id, 102, 0.5);
        struct tile tile;
        assert_false(queue_find_held(queue, loser, late->id, &tile));
        assert_true(fabs(queue_count(queue).wasted_s - wasted - 0.5) < 1e-9);
        queue_destroy(queue);
    }
}

/* The same of a tile that was passed on as it is: whoever is second hears of it. */
static void test_finished_copy_is_told(void **state)
{
    (void)state;
    for (int original = 0; original < 2; original++) {
        struct queue_config config = {.width = 160, .height = 80, .renderers = 4, .tile_edge = 8};
        struct queue *queue = queue_create(&config);
        struct tile lot[LOT_TILES], stolen[LOT_TILES];
        uint32_t others = queue_next(queue, 1, 0, lot);
        assert_true(others > 0 && queue_finish(queue, 1, lot[0].id, 1e-3, 1e-3));
        for (uint32_t i = 1; i < others; i++)
            assert_true(queue_finish(queue, 1, lot[i].id, 1e-3, 1e-3));
        assert_true(queue_next(queue, 0, 1e-3, lot) >= 4);
        do {
            others = queue_next(queue, 1, 1e-3, stolen);
            for (uint32_t i = 0; i < others && queue_count(queue).repeated == 0; i++)
                assert_true(queue_finish(queue, 1, stolen[i].id, 1e-3, 1e-4));
        } while (others > 0 && queue_count(queue).repeated == 0);
        assert_true(others > 0);
        uint32_t winner = original ? 0 : 1, id = stolen[0].id;
        assert_int_equal(told_finished(queue, 1 - winner, id), 0);
        assert_true(queue_finish(queue, winner, id, 2e-3, 1e-4));
        assert_int_equal(told_finished(queue, 1 - winner, id), 1);
        queue_drop(queue, 1 - winner, id, 3e-3, 1e-4);
        assert_false(queue_is_recalled(queue, 1 - winner, id));
        queue_destroy(queue);
    }
}

/* Who has nothing to do and had better not take what another one is about to finish asks again when that
 * is overdue, long before it is given up for late. */
static void test_idle_ask_again(void **state)
{
    (void)state;
    struct queue *queue = queue_create(&four);
    struct tile lot[LOT_TILES], last;
    uint32_t count = queue_next(queue, 0, 0, lot);
    last = lot[0];
    for (int i = 0; i < 100; i++)
        queue_served(queue, 1e-4, 0); /* an answer is dear: so is a short lot */
    for (uint32_t i = 1; i < count; i++)
        assert_true(queue_finish(queue, 0, lot[i].id, 1e-3, 1e-4));
    while (queue_count(queue).finished < queue_count(queue).tiles - 1) {
        count = queue_next(queue, 1, 1e-3, lot);
        assert_true(count > 0);
        for (uint32_t i = 0; i < count; i++)
            assert_true(queue_finish(queue, 1, lot[i].id, 1e-3, 1e-4));
    }
    assert_true(queue_tile_count(queue, 0) == 1 && queue_tile_count(queue, 1) == 0);
    assert_int_equal(queue_next(queue, 2, 1e-3, lot), 0);
    double wake = queue_wake(queue);
    assert_true(wake > 1e-3 && wake < pace_next_late(&queue->pace));
    queue_look(queue, wake);
    assert_true(queue_wake(queue) > wake);
    assert_true(queue_next(queue, 2, wake, lot) > 0);
    assert_true(queue_is_recalled(queue, 0, last.id));
    queue_destroy(queue);
}

/* A single pixel that two have already is not what the idle wait for, whether it is to be done first or last: they get
 * pieces of what is overdue besides. */
static void test_idle_pass_over_a_pixel(void **state)
{
    (void)state;
    const struct queue_config config = {.width = 3, .height = 1, .renderers = 5, .tile_edge = 3};
    const struct tile row = {.w = 3, .h = 1, .step = 1, .pass = 1},
                      first = {.w = 1, .h = 1, .step = 1, .pass = 1};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES];
    assert_int_equal(queue_next(queue, 0, 0, lot), 1);
    uint32_t overdue = queue_add(queue, &row, 3, 2), pixel = queue_add(queue, &first, 1, 1);
    assert_true(queue_finish(queue, 0, lot[0].id, 1, 1)); /* a third of a second for each pixel */
    assert_true(queue_next(queue, 1, 1, lot) == 1 && lot[0].id == overdue);
    assert_true(queue_next(queue, 2, 1.4, lot) == 1 && lot[0].id == pixel);
    /* 2 should have been done. */
    assert_true(queue_next(queue, 3, 1.8, lot) == 1 && lot[0].id == pixel);
    double now = 2.01;
    assert_true(queue->pace.renderers[3].free_at > now && pace_next_late(&queue->pace) > now);
    assert_true(queue_next(queue, 4, now, lot) > 0);
    assert_int_equal(queue->items[lot[0].id].whole, overdue);
    queue_destroy(queue);
}

/* One who has nothing to do takes over from one who has just been given something, too. */
static void test_idle_take_what_was_just_given(void **state)
{
    (void)state;
    const struct queue_config config = {.width = 6, .height = 3, .renderers = 4, .tile_edge = 3};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES], more[LOT_TILES];
    assert_int_equal(queue_next(queue, 0, 0, lot), 1);
    assert_true(queue_finish(queue, 0, lot[0].id, 1, 1));
    assert_int_equal(queue_next(queue, 0, 1, lot), 1);
    assert_int_equal(queue->waiting.count, 0);
    assert_true(queue_next(queue, 1, 1, more) > 0);
    assert_true(queue_is_recalled(queue, 0, lot[0].id));
    queue_destroy(queue);
}

/* A tile that takes far too long is broken up while others still wait, but not early in the run. */
static void test_overdue_is_broken_up(void **state)
{
    (void)state;
    struct queue *queue = queue_create(&four);
    struct tile first, lot[LOT_TILES];
    uint32_t count = queue_next(queue, 0, 0, lot);
    first = lot[0];
    for (uint32_t i = 1; i < count; i++)
        assert_true(queue_finish(queue, 0, lot[i].id, 1e-3, 1e-3));
    count = queue_next(queue, 1, 1e-3, lot);
    for (uint32_t i = 0; i < count; i++)
        assert_true(queue_finish(queue, 1, lot[i].id, 2e-3, 1e-3));
    assert_true(queue->waiting.count > 0 && queue_tile_count(queue, 0) == 1);
    queue_look(queue, 0.1); /* overdue, but most of the run is to come */
    count = queue_next(queue, 1, 0.1, lot);
    assert_true(count > 0);
    for (uint32_t i = 0; i < count; i++) /* or it would be what is taken over first */
        assert_true(queue_finish(queue, 1, lot[i].id, 0.1, 1e-3));
    assert_int_equal(queue->items[first.id].pieces, 0);
    queue_look(queue, 100);
    count = queue_next(queue, 2, 100, lot);
    assert_true(count > 0 && queue->waiting.count > 0);
    assert_true(queue->items[first.id].pieces > 1);
    assert_true(queue->items[lot[0].id].is_piece);
    assert_int_equal(queue->items[lot[0].id].whole, first.id);
    queue_destroy(queue);
}

static const struct queue_config many = {
    .width = 256, .height = 256, .renderers = 4, .tile_edge = 4};

/* All four get their first lots. */
static struct queue *begin_many(struct tile lots[4][LOT_TILES], uint32_t counts[4])
{
    struct queue *queue = queue_create(&many);
    for (uint32_t i = 0; i < 4; i++)
        counts[i] = queue_next(queue, i, 0, lots[i]);
    return queue;
}

/* Answers a part of a lot. */
static void finish_part(struct queue *queue, uint32_t renderer, const struct tile *lot,
                        uint32_t from, uint32_t to)
{
    for (uint32_t i = from; i < to; i++)
        assert_true(queue_finish(queue, renderer, lot[i].id, 1e-3, 1e-3));
}

/* All are done with their first lots, but for so many tiles of 0, and four of 1. */
static struct queue *begin_late(struct tile lots[4][LOT_TILES], uint32_t kept)
{
    uint32_t counts[4];
    struct queue *queue = begin_many(lots, counts);
    assert_true(counts[1] >= 4);
    finish_part(queue, 0, lots[0], kept, counts[0]);
    finish_part(queue, 1, lots[1], 4, counts[1]);
    finish_part(queue, 2, lots[2], 0, counts[2]);
    finish_part(queue, 3, lots[3], 0, counts[3]);
    return queue;
}

/* When the rest is less than what the others' last answers take the master, its own renderer leaves it to them; unless
 * nobody counts on any of them. */
static void test_own_renderer_leaves_the_end(void **state)
{
    (void)state;
    for (int own = 0; own <= 1; own++) {
        struct queue_config config = many;
        config.master_renders = own;
        struct queue *queue = queue_create(&config);
        struct tile lot[LOT_TILES];
        for (uint32_t i = 0; i < 4; i++)
            finish_part(queue, i, lot, 0, queue_next(queue, i, 0, lot));
        assert_true(queue_next(queue, 1, 1e-3, lot) > 0);
        serve_for(queue, 1e-6);
        assert_true(queue_next(queue, 0, 1e-3, lot) > 0);
        finish_part(queue, 0, lot, 0, queue_tile_count(queue, 0));
        serve_for(queue, 1);
        assert_true(queue->waiting.count > 0);
        assert_int_equal(queue_next(queue, 0, 1e-3, lot) == 0, own);
        assert_true(queue_next(queue, 2, 1e-3, lot) > 0);
        queue_look(queue, 1e6);
        assert_int_equal(queue->pace.holders, 0);
        if (own) assert_true(queue_next(queue, 0, 1e6, lot) > 0);
        queue_destroy(queue);
    }
}

/* What nobody has begun is passed on as it is, whoever else is overdue. */
static void test_unbegun_is_not_broken_up(void **state)
{
    (void)state;
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    struct queue *queue = begin_late(lots, 1);
    queue_look(queue, 0.02);
    queue_look(queue, 1000);
    double now = 1000;
    for (uint32_t ask = 0; ask < 4; ask++) {
        uint32_t asker = 2 + ask % 2, count = queue_next(queue, asker, now, tiles);
        for (uint32_t i = 1; i < 4; i++)
            assert_int_equal(queue->items[lots[1][i].id].pieces, 0);
        for (uint32_t i = 0; i < count; i++)
            assert_true(queue_finish(queue, asker, tiles[i].id, now += 1e-4, 1e-3));
    }
    queue_destroy(queue);
}

/* All that one who is overdue has not begun goes into one lot, and with it what waits. */
static void test_late_in_one_lot(void **state)
{
    (void)state;
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    struct queue *queue = begin_late(lots, 0);
    queue_look(queue, 0.5);
    assert_true(queue->waiting.count > 0);
    assert_true(queue_next(queue, 2, 0.5, tiles) > 3);
    for (uint32_t i = 0; i < 3; i++)
        assert_int_equal(tiles[i].id, lots[1][3 - i].id); /* the last first */
    assert_false(queue_is_recalled(queue, 1, lots[1][0].id));
    assert_int_equal(queue_count(queue).repeated, 3);
    assert_true(queue_tile_count(queue, 2) > 3);
    queue_destroy(queue);
}

/* Who has answered in the meantime is not asked to leave the tile to others. */
static void test_answered_is_not_recalled(void **state)
{
    (void)state;
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    struct queue *queue = begin_late(lots, 0);
    struct recall recall;
    uint32_t told = 0;
    queue_look(queue, 0.5);
    assert_true(queue_next(queue, 2, 0.5, tiles) > 3);
    assert_true(queue_is_recalled(queue, 1, lots[1][3].id));
    assert_true(queue_finish(queue, 1, lots[1][3].id, 0.5, 1e-3));
    for (; queue_next_recall(queue, &recall); told += recall.renderer == 1)
        assert_true(recall.renderer != 1 || recall.id != lots[1][3].id);
    assert_int_equal(told, 2);
    queue_destroy(queue);
}

/* It is taken over though somebody else is overdue longer, who has nothing that he has not begun. */
static void test_late_behind_a_later_one(void **state)
{
    (void)state;
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    struct queue *queue = begin_late(lots, 1);
    queue_look(queue, 0.5);
    assert_true(queue->pace.renderers[0].lost && queue->pace.renderers[1].lost);
    assert_true(queue->pace.renderers[0].free_at < queue->pace.renderers[1].free_at);
    assert_true(queue_next(queue, 2, 0.5, tiles) >= 3);
    for (uint32_t i = 0; i < 3; i++)
        assert_int_equal(tiles[i].id, lots[1][3 - i].id);
    queue_destroy(queue);
}

/* What takes a renderer long, as it tells, is not what the others are to wait for, nor what it has behind it;
 * but early in the run it goes on with that itself. */
static void test_takes_long(void **state)
{
    (void)state;
    for (int early = 0; early <= 1; early++) {
        struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
        struct queue *queue = begin_late(lots, 0);
        uint32_t first = lots[1][0].id;
        double rest = pace_even_end(&queue->pace, 2e-3, queue->waiting_work);
        float tells[LOT_TILES];
        assert_int_equal(queue_tells(queue, 1, lots[1], 1, tells), 1);
        double tell_s = (double)tells[0], seconds = early ? rest / 4 : rest;
        double predicted = pace_seconds(&queue->pace, 1, (double)queue->items[first].work);
        assert_true(tell_s > predicted && tell_s < 4 * predicted + pace_least(&queue->pace, 1));
        assert_true(tell_s < rest / 4);
        queue_takes_long(queue, 1, first, 2e-3, seconds);
        assert_int_equal(queue->pace.renderers[1].lost, !early);
        uint32_t count = queue_next(queue, 2, 2e-3, tiles);
        assert_true(count >= 3);
        for (uint32_t i = 0; i < 3; i++)
            assert_int_equal(tiles[i].id == lots[1][3 - i].id, !early);
        assert_int_equal(queue_is_recalled(queue, 1, lots[1][1].id), !early);
        assert_false(queue_is_recalled(queue, 1, first));
        /* The neighbours are dear, too; its pieces are at least so dear. */
        assert_true((double)queue->items[first].seconds >= seconds * 0.999);
        queue_finish(queue, 1, first, 3e-3, 1);
        assert_false(queue->pace.renderers[1].lost);
        queue_destroy(queue);
    }
}

/* Where time says nothing of a tile, nobody tells. */
static void test_who_tells(void **state)
{
    (void)state;
    struct queue_config config = four;
    struct tile tiles[LOT_TILES];
    float tells[LOT_TILES];
    for (int i = 0; i < 3; i++) {
        config.probe_edge = i == 1 ? 8 : 0;
        config.schedule = i == 2 ? SCHEDULE_STRIPS : SCHEDULE_DYNAMIC;
        struct queue *queue = queue_create(&config);
        assert_true(queue_next(queue, 0, 0, tiles) > 0);
        assert_int_equal(queue_tells(queue, 0, tiles, 1, tells), i == 0);
        assert_false(queue_lot_seconds(queue, 0, tiles, 1) > 0);
        queue_destroy(queue);
    }
}

/* Where probes say that tiles are cheap beside what there is to do, they are joined; those that somebody has
 * are not, nor dear ones. */
static void test_cheap_are_joined(void **state)
{
    (void)state;
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
                bool is_dear = tiles[i].x >= 150;
                double seconds = 1e-6 * tile_pixels(&tiles[i]) * (is_dear ? 100 : 1);
                float probed[LOT_TILES];
                if (tiles[i].pass == TILE_PROBE) {
                    for (uint32_t k = 0; k < tile_pixels(&tiles[i]); k++)
                        probed[k] = tiles[i].x + 8 * k >= 150 ? 1e-4f : 1e-6f;
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

/* One renderer's probes are out for long: the others do not work off small tiles until then. */
static void test_joined_before_all_probes(void **state)
{
    (void)state;
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
    assert_true(owned > 0 && queue->probes_back < queue->probes);
    for (uint32_t id = 0; id < queue->item_count; id++)
        joined += agenda_has(&queue->waiting, id) && area(&queue->items[id]) > 64;
    assert_true(joined > 100);
    check_sums(queue);
    answer_probes(queue, 0, own, owned);
    assert_int_equal(queue->probes_back, queue->probes);
    check_sums(queue);
    queue_destroy(queue);
}

/* One who has stopped is not forgotten because somebody has asked who had the tile, too. */
static void test_stopped_behind_a_late_one(void **state)
{
    (void)state;
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    uint32_t counts[4];
    struct queue *queue = begin_many(lots, counts);
    uint32_t kept = lots[0][counts[0] - 2].id, taken = lots[0][counts[0] - 1].id, most = 0;
    finish_part(queue, 0, lots[0], 0, counts[0] - 2);
    for (uint32_t i = 1; i < 4; i++)
        finish_part(queue, i, lots[i], 0, counts[i]);
    queue_look(queue, 0.1);
    assert_true(queue_next(queue, 1, 0.1, tiles) > 0);
    assert_int_equal(tiles[0].id, taken); /* and 1 stops */
    queue_look(queue, 0.2);
    assert_true(queue_finish(queue, 0, kept, 0.21, 0.2));
    uint32_t count = queue_next(queue, 0, 0.21, tiles);
    queue_drop(queue, 0, taken, 0.21, 0);
    for (uint32_t i = 0; i < count; i++)
        queue_finish(queue, 0, tiles[i].id, 0.22, 1e-3);
    for (double now = 0.3; !queue_complete(queue) && most < 100000; now += 1e-3, most++) {
        queue_look(queue, now);
        for (uint32_t renderer = 0; renderer < 4; renderer++) {
            if (renderer == 1) continue;
            count = queue_next(queue, renderer, now, tiles);
            for (uint32_t i = 0; i < count; i++)
                queue_finish(queue, renderer, tiles[i].id, now, 1e-3);
        }
    }
    assert_true(queue_complete(queue));
    queue_destroy(queue);
}

static void test_whole_before_pieces(void **state)
{
    (void)state;
    struct queue *queue = queue_create(&four);
    struct tile last, lot[LOT_TILES], tile;
    uint32_t next = 0, count = break_last(queue, &last, lot), tiles = queue_count(queue).tiles;
    uint32_t renderer = queue_tile_count(queue, 2) > 0 ? 2 : 1;
    assert_true(count > 0 && tile_pixels(&lot[0]) < tile_pixels(&last));
    /* Nor are pieces split like other tiles: the whole one counts on as many as it has. */
    for (uint32_t i = 0; i < count; i++) {
        assert_true(queue->items[lot[i].id].is_piece);
        assert_false(split_is_possible(queue, lot[i].id));
    }
    assert_true(queue_finish(queue, 0, last.id, 101, 1));
    assert_true(queue_complete(queue));
    assert_int_equal(queue_count(queue).tiles, tiles);
    assert_int_equal(queue_count(queue).pixels_finished, 64 * 48);
    assert_false(queue_unfinished(queue, &next, &tile));
    for (uint32_t i = 0; i < count; i++)
        assert_false(queue_finish(queue, renderer, lot[i].id, 102, 1e-4));
    assert_int_equal(queue_next(queue, 3, 103, lot), 0);
    queue_destroy(queue);
}

static void test_too_many_tiles(void **state)
{
    (void)state;
    struct queue_config config = {.width = 16384, .height = 16384, .renderers = 1, .tile_edge = 1};
    assert_null(queue_create(&config));
}

static void test_auto_edge(void **state)
{
    (void)state;
    assert_int_equal(queue_auto_edge(SCHEDULE_TILES, 640, 480, 1, 1), 32);
    assert_int_equal(queue_auto_edge(SCHEDULE_TILES, 640, 480, 1, 44), 8);
    assert_int_equal(queue_auto_edge(SCHEDULE_TILES, 1920, 1080, 1, 2), 64);
    assert_int_equal(queue_auto_edge(SCHEDULE_TILES, 1, 1, 1, 100), 8);
    assert_int_equal(queue_auto_edge(SCHEDULE_TILES, 65535, 65535, 1, 44), 64);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 1, 2), 16);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 1, 12), 16);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 1, 44), 8);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 15, 12), 16);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 16, 12), 8);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 16, 2), 16);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 1920, 1440, 16, 12), 16);
    assert_int_equal(queue_auto_edge(SCHEDULE_TILES, 640, 480, 16, 1), 32);
}

static void test_auto_probe_edge(void **state)
{
    (void)state;
    assert_int_equal(queue_auto_probe_edge(640, 480, 1, 1), 24);
    assert_int_equal(queue_auto_probe_edge(640, 480, 16, 1), 6);
    assert_int_equal(queue_auto_probe_edge(640, 480, 4096, 1), 4);
    assert_int_equal(queue_auto_probe_edge(64, 48, 1, 1), 0);
    /* 25 for each, but never more than one in 125 samples. */
    assert_int_equal(queue_auto_probe_edge(640, 480, 1, 20), 24);
    assert_int_equal(queue_auto_probe_edge(640, 480, 1, 44), 16);
    assert_int_equal(queue_auto_probe_edge(640, 480, 1, 1000), 12);
    assert_int_equal(queue_auto_probe_edge(640, 480, 16, 44), 6);
    assert_int_equal(queue_auto_probe_edge(1, 1, 65535, 1), 0);
}

/* Three pixels of four are finished already, in squares of 16, which are no tiles of ours. */
static bool was_finished(uint32_t x, uint32_t y)
{
    return x / 16 % 2 || y / 16 % 2;
}

static uint32_t finished_pixels(void *state, const struct tile *tile)
{
    uint32_t count = 0;
    (void)state;
    for (uint32_t k = 0; k < tile_pixels(tile); k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        count += was_finished(x, y);
    }
    return count;
}

static uint32_t all_finished(void *state, const struct tile *tile)
{
    (void)state;
    return tile_pixels(tile);
}

static void test_skip(void **state)
{
    (void)state;
    for (int schedule = 0; schedule < SCHEDULES; schedule++) {
        const struct queue_config config = {.schedule = (enum schedule)schedule,
                                            .width = 50,
                                            .height = 40,
                                            .renderers = 3,
                                            .tile_edge = 7,
                                            .probe_edge = 10};
        struct queue *queue = queue_create(&config);
        struct tile lot[LOT_TILES];
        unsigned char seen[50 * 40] = {0};
        uint64_t seed = 1;
        uint32_t last = 0;
        bool splits = schedule == SCHEDULE_DYNAMIC || schedule == SCHEDULE_TILES;
        queue_skip(queue, finished_pixels, NULL);
        if (splits) assert_true(queue_count(queue).share_skipped > 0.5);
        if (!splits)
            assert_true(queue_count(queue).share_skipped == queue_count(queue).share_finished);
        while (!queue_complete(queue)) {
            uint32_t renderer = last++ % 3;
            uint32_t count = queue_next(queue, renderer, last, lot);
            for (uint32_t i = 0; i < count; i++) {
                if (lot[i].pass == TILE_PROBE) answer_probe(queue, &lot[i], &seed);
                if (queue_finish(queue, renderer, lot[i].id, last, 1e-3))
                    mark(seen, &config, &lot[i]);
            }
            assert_true(last < 100000);
            if (splits) check_sums(queue);
        }
        assert_int_equal(queue_count(queue).pixels_finished, 50 * 40);
        uint32_t again = 0;
        for (uint32_t i = 0; i < 50 * 40; i++) {
            assert_true(seen[i] || was_finished(i % 50, i / 50));
            again += seen[i] && was_finished(i % 50, i / 50);
        }
        if (splits) assert_true(again < 50 * 40 / 8);
        queue_destroy(queue);
        queue = queue_create(&config);
        queue_skip(queue, all_finished, NULL);
        assert_true(queue_complete(queue) && queue_over(queue, 0));
        assert_int_equal(queue_next(queue, 0, 0, lot), 0);
        queue_destroy(queue);
    }
}

/* What comes behind a first pass that an earlier run had finished is predicted as if it had not. */
static void test_passes_behind_a_finished_one(void **state)
{
    (void)state;
    struct queue_config config = {.schedule = SCHEDULE_DYNAMIC,
                                  .width = 64,
                                  .height = 64,
                                  .renderers = 2,
                                  .tile_edge = 16,
                                  .probe_edge = 8};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES], tile = {.w = 64, .h = 64, .step = 1, .pass = 1};
    uint32_t probes = 0, count;
    uint64_t seed = 1;
    queue_skip(queue, all_finished, NULL);
    assert_int_equal(queue_next(queue, 0, 0, lot), 0);
    for (tile.w = tile.h = 16; tile.x < 64; tile.x += 16)
        queue_add(queue, &tile, queue_work(queue, &tile), 1);
    check_sums(queue);
    for (uint32_t who = 0; !queue->settled; who = 1 - who) {
        count = queue_next(queue, who, 0, lot);
        for (uint32_t i = 0; i < count; i++, probes++) {
            assert_int_equal(lot[i].pass, TILE_PROBE);
            answer_probe(queue, &lot[i], &seed);
            queue_finish(queue, who, lot[i].id, 0, 1e-3);
        }
        assert_true(count > 0);
    }
    assert_true(probes > 0);
    queue_destroy(queue);
}

static const struct queue_config withdrawing = {.schedule = SCHEDULE_DYNAMIC,
                                                .width = 256,
                                                .height = 192,
                                                .renderers = 3,
                                                .tile_edge = 16,
                                                .probe_edge = 8};

/* One of so many asks, and finishes some of what he has. */
static void take_turn(struct queue *queue, uint32_t renderers, uint64_t *seed, double now,
                      unsigned char *seen)
{
    struct tile lot[LOT_TILES];
    uint32_t renderer = random_below(seed, renderers), ids[2 * LOT_TILES], held = 0;
    queue_next(queue, renderer, now, lot);
    const struct holdings *holdings = &queue->holdings;
    for (uint32_t i = holdings->holders[renderer].first; i != HOLD_NONE;
         i = holdings->holds[i].next)
        ids[held++] = holdings->holds[i].id;
    for (uint32_t i = 0; i < held && random_below(seed, 4) > 0; i++) {
        struct tile tile = queue_tile_of(queue, ids[i]);
        if (queue_is_recalled(queue, renderer, ids[i]) && random_below(seed, 2)) {
            queue_drop(queue, renderer, ids[i], now, 0);
            continue;
        }
        if (tile.pass == TILE_PROBE) answer_probe(queue, &tile, seed);
        if (queue_finish(queue, renderer, ids[i], now, 1e-3) == ANSWER_COUNTS)
            mark(seen, &withdrawing, &tile);
        hear_fates(queue, seen, &withdrawing);
    }
}

/* Until the queue is complete; takes out what waits behind so many turns. */
static void withdraw_after(struct queue *queue, uint32_t turns, uint64_t *seed, double *now,
                           unsigned char *seen)
{
    for (uint32_t turn = 0; !queue_complete(queue); turn++) {
        take_turn(queue, 3, seed, *now += 1e-3, seen);
        assert_true(turn < 100000);
        if (turn != turns) continue;
        queue_withdraw(queue);
        check_sums(queue);
    }
    check_sums(queue);
}

/* What nobody has had is taken out; what is out comes back, or goes to others, and then there is room for other
 * work. */
static void test_withdraw(void **state)
{
    (void)state;
    static unsigned char seen[256 * 192];
    for (uint64_t round = 1; round <= 40; round++) {
        struct queue *queue = queue_create(&withdrawing);
        uint64_t seed = round;
        double now = 0;
        memset(seen, 0, sizeof seen);
        withdraw_after(queue, random_below(&seed, 150), &seed, &now, seen);
        uint64_t finished = queue_count(queue).pixels_finished;
        uint32_t marked = 0;
        for (uint32_t i = 0; i < 256 * 192; i++)
            marked += seen[i];
        assert_int_equal(marked, finished);
        assert_true(finished < 256 * 192 && queue_count(queue).share_finished == 1);
        struct tile tile = {.w = 128, .h = 128, .step = 1, .pass = 1};
        memset(seen, 0, sizeof seen);
        queue_add(queue, &tile, queue_work(queue, &tile), 1);
        withdraw_after(queue, UINT32_MAX, &seed, &now, seen);
        assert_int_equal(queue_count(queue).pixels_finished, finished + 128 * 128);
        for (uint32_t i = 0; i < 256 * 192; i++)
            assert_int_equal(seen[i], i % 256 < 128 && i / 256 < 128);
        queue_destroy(queue);
    }
}

/* One who has stopped with tiles that are not wanted any more keeps nobody waiting. */
static void test_withdraw_from_stopped(void **state)
{
    (void)state;
    static unsigned char seen[256 * 192];
    struct queue *queue = queue_create(&withdrawing);
    uint64_t seed = 7;
    double now = 0;
    memset(seen, 0, sizeof seen);
    while (!queue->settled || queue_tile_count(queue, 2) == 0)
        take_turn(queue, 3, &seed, now += 1e-6, seen); /* nobody is late yet */
    queue_withdraw(queue);
    assert_false(queue_complete(queue) || queue->pace.renderers[2].lost);
    for (int i = 0; i < 10000 && !queue_complete(queue); i++) {
        take_turn(queue, 2, &seed, now += 1e-3, seen);
        queue_look(queue, now);
    }
    assert_true(queue_complete(queue) && queue_tile_count(queue, 2) > 0);
    check_sums(queue);
    queue_destroy(queue);
}

/* Probe tiles that somebody has. */
static uint32_t probes_out(const struct queue *queue)
{
    uint32_t out = 0;
    for (uint32_t i = 0; i < queue->probes; i++)
        out += queue->items[queue->first_probe + i].copies;
    return out;
}

/* Wherever the pre-pass is ended, no probe goes out any more, and of those that are out each renderer may leave all but
 * the one that it is at; the queue predicts from the first that is back, and the picture is as whole as ever. */
static void test_probes_end(void **state)
{
    (void)state;
    static unsigned char seen[256 * 192];
    uint32_t ended_with_none = 0, ended_with_some = 0;
    for (uint64_t round = 1; round <= 60; round++) {
        struct queue *queue = queue_create(&withdrawing);
        uint64_t seed = round;
        double now = 0;
        memset(seen, 0, sizeof seen);
        for (uint32_t turn = 0; turn < round % 6 || probes_out(queue) == 0; turn++)
            take_turn(queue, 3, &seed, now += 1e-3, seen);
        uint32_t out = probes_out(queue), given = queue->next_probe, recalls = 0;
        bool knew = queue->settled, knows = queue->map.blocks_known > 0;
        queue_end_probes(queue, now);
        assert_true(queue->settled == (knew || knows));
        for (struct recall recall; queue_next_recall(queue, &recall); recalls++)
            assert_true(!recall.finished && queue->items[recall.id].pass == TILE_PROBE);
        assert_true(knew || (out - recalls >= 1 && out - recalls <= 3));
        for (uint32_t turn = 0; !queue_complete(queue); turn++) {
            take_turn(queue, 3, &seed, now += 1e-3, seen);
            assert_true(turn < 100000 && probes_out(queue) <= out);
            for (uint32_t i = given; !knew && i < queue->probes; i++) {
                uint64_t id = (uint64_t)i * queue->probe_stride % queue->probes;
                assert_int_equal(queue->items[queue->first_probe + id].copies, 0);
            }
        }
        for (uint32_t i = 0; i < 256 * 192; i++)
            assert_int_equal(seen[i], 1);
        check_sums(queue);
        ended_with_none += !knows;
        ended_with_some += knows && !knew;
        queue_destroy(queue);
    }
    assert_true(ended_with_none > 2 && ended_with_some > 2);
}

/* The end is known when some of the picture is finished, from what cheap and dear tiles have taken. */
static void test_end_is_foretold(void **state)
{
    (void)state;
    const struct queue_config config = {.schedule = SCHEDULE_DYNAMIC,
                                        .width = 320,
                                        .height = 240,
                                        .renderers = 4,
                                        .tile_edge = 8,
                                        .probe_edge = 8};
    struct virtual virtuals[4] = {{.speed = 1}, {.speed = 1}, {.speed = 1}, {.speed = 1}};
    struct foretold foretold = {0};
    double end = run_virtual_and_watch(&config, virtuals, &foretold);
    assert_true(foretold.looks > 20);
    assert_true(foretold.first < 0.2 * end);
    if (!(foretold.least > 0.8 * end && foretold.most < 1.25 * end))
        fail_msg("%g to %g, not %g", foretold.least, foretold.most, end);
}

/* Four renderers on two cores of one machine. */
static struct crowd crowd_on_two_cores(void)
{
    struct berth berths[4];
    struct crowd crowd;
    for (uint32_t i = 0; i < 4; i++) {
        berths[i] = (struct berth){.machine = "one"};
        CPU_SET(0, &berths[i].cores);
        CPU_SET(1, &berths[i].cores);
    }
    crowd_init(&crowd, berths, 4);
    return crowd;
}

/* All but a tile of each of the first so many renderers is finished, and nothing waits. */
static struct queue *leave_tiles(const struct queue_config *config, uint32_t keepers)
{
    struct queue *queue = queue_create(config);
    struct tile lot[LOT_TILES];
    for (uint32_t renderer = 0; renderer < keepers; renderer++)
        finish_part(queue, renderer, lot, 1, queue_next(queue, renderer, 0, lot));
    while (queue->waiting.count > 0)
        finish_part(queue, 3, lot, 0, queue_next(queue, 3, 1e-3, lot));
    return queue;
}

/* With more renderers than cores nobody takes what others have while these can use all cores; those who are
 * late do not. */
static void test_idle_without_a_core(void **state)
{
    (void)state;
    struct crowd crowd = crowd_on_two_cores();
    struct queue_config config = four;
    config.crowd = &crowd;
    for (uint32_t keepers = 1; keepers < 4; keepers++) {
        struct queue *queue = leave_tiles(&config, keepers);
        struct tile lot[LOT_TILES];
        uint32_t working = 0;
        for (uint32_t i = 0; i < 4; i++)
            working += queue_tile_count(queue, i) > 0;
        assert_int_equal(working, keepers);
        assert_int_equal(queue_idle_cores(queue), keepers == 1);
        assert_int_equal(queue_has_core(queue, 3), keepers == 1);
        assert_true(queue_wake(queue) < 100);
        queue_look(queue, 100);
        assert_int_equal(queue_idle_cores(queue),
                         keepers == 3 ? 1 : 2); /* for as many who are idle */
        assert_true(queue_next(queue, 3, 100, lot) > 0);
        queue_destroy(queue);
    }
    crowd_free(&crowd);
}

/* Who has finished leaves his core to others at once. */
static void test_finished_leaves_a_core(void **state)
{
    (void)state;
    struct crowd crowd = crowd_on_two_cores();
    struct queue_config config = four;
    config.crowd = &crowd;
    struct queue *queue = leave_tiles(&config, 2);
    assert_int_equal(queue_idle_cores(queue), 0);
    queue_finish(queue, 0, queue->holdings.holds[queue->holdings.holders[0].first].id, 1e-3, 1e-3);
    assert_int_equal(queue_idle_cores(queue), 1);
    queue_destroy(queue);
    crowd_free(&crowd);
}

/* A lot is answered, whatever it is of. */
static void finish_lot(struct queue *queue, uint32_t renderer, const struct tile *lot,
                       uint32_t count, double now)
{
    uint64_t seed = 1;
    for (uint32_t i = 0; i < count; i++) {
        if (lot[i].pass == TILE_PROBE) answer_probe(queue, &lot[i], &seed);
        queue_finish(queue, renderer, lot[i].id, now, 1e-3);
    }
}

static const struct queue_config probed = {
    .width = 64, .height = 48, .renderers = 4, .tile_edge = 8, .probe_edge = 2};

/* As many as there are cores have stopped with their probes, of which nobody hears that they are late: what
 * another one has who stops later is rescued all the same. */
static void test_stopped_with_probes(void **state)
{
    (void)state;
    struct crowd crowd = crowd_on_two_cores();
    struct queue_config config = probed;
    config.crowd = &crowd;
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES], kept[LOT_TILES];
    for (uint32_t renderer = 0; renderer < 2; renderer++)
        assert_true(queue_next(queue, renderer, 0, lot) > 0 && lot[0].pass == TILE_PROBE);
    finish_lot(queue, 2, lot, queue_next(queue, 2, 0, lot), 0);
    assert_true(queue_next(queue, 2, 0, kept) > 0 && kept[0].pass != TILE_PROBE);
    for (uint32_t count; (count = queue_next(queue, 3, 1e-3, lot)) > 0;)
        finish_lot(queue, 3, lot, count, 1e-3);
    assert_int_equal(queue->waiting.count, 0);
    queue_look(queue, 100);
    for (uint32_t count; (count = queue_next(queue, 3, 100, lot)) > 0;)
        finish_lot(queue, 3, lot, count, 100);
    assert_true(queue_complete(queue));
    queue_destroy(queue);
    crowd_free(&crowd);
}

/* Who has become late with probes behind his last tile gets more when they are back. */
static void test_late_with_probes(void **state)
{
    (void)state;
    struct queue *queue = queue_create(&probed);
    struct tile tiles[LOT_TILES], probes[LOT_TILES];
    uint32_t count = 0;
    for (uint32_t lots = 0; lots < 3; lots++)
        finish_lot(queue, 0, tiles, queue_next(queue, 0, 0, tiles), 1e-3);
    count = queue_next(queue, 0, 1e-3, tiles);
    assert_true(count > 0 && tiles[0].pass != TILE_PROBE);
    uint32_t probe_count = queue_next(queue, 0, 1e-3, probes);
    assert_true(probe_count > 0 && probes[0].pass == TILE_PROBE);
    finish_lot(queue, 0, tiles, count, 2e-3);
    queue_look(queue, 100);
    assert_true(queue->pace.renderers[0].lost);
    finish_lot(queue, 0, probes, probe_count, 100);
    assert_false(queue->settled || queue->pace.renderers[0].lost);
    assert_true(queue_next(queue, 0, 100, tiles) > 0);
    queue_destroy(queue);
}

/* Whose turn it was says nothing about a tile; where everybody has a core, the wall does. */
static void test_seconds_of_a_crowd(void **state)
{
    (void)state;
    struct crowd crowd = crowd_on_two_cores();
    struct queue_config config = four;
    struct queue *queue = queue_create(&config);
    assert_true(queue_seconds(queue, 0, 3, 1) == 3);
    queue_destroy(queue);
    config.crowd = &crowd;
    queue = queue_create(&config);
    assert_true(queue_seconds(queue, 0, 1, 1) == 2); /* two to a core */
    assert_true(queue_seconds(queue, 1, 7, 1) == 4); /* and somebody else, too */
    queue_destroy(queue);
    crowd_free(&crowd);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_idle_without_a_core),
        cmocka_unit_test(test_seconds_of_a_crowd),
        cmocka_unit_test(test_stopped_with_probes),
        cmocka_unit_test(test_finished_leaves_a_core),
        cmocka_unit_test(test_late_with_probes),
        cmocka_unit_test(test_every_pixel_once),
        cmocka_unit_test(test_large_lots),
        cmocka_unit_test(test_strips_are_the_papers),
        cmocka_unit_test(test_cyclic_deals_pixels),
        cmocka_unit_test(test_cyclic_rows_deals_rows),
        cmocka_unit_test(test_tile_edge),
        cmocka_unit_test(test_bands_show_progress),
        cmocka_unit_test(test_progress_of_shares),
        cmocka_unit_test(test_progress_of_resumed_shares),
        cmocka_unit_test(test_reserve),
        cmocka_unit_test(test_equal_renderers),
        cmocka_unit_test(test_uneven_renderers),
        cmocka_unit_test(test_stopped_renderers),
        cmocka_unit_test(test_silent),
        cmocka_unit_test(test_nobody_is_silent),
        cmocka_unit_test(test_stop),
        cmocka_unit_test(test_answers_are_checked),
        cmocka_unit_test(test_probes_are_checked),
        cmocka_unit_test(test_predictions_stay_numbers),
        cmocka_unit_test(test_cheap_go_with_dear),
        cmocka_unit_test(test_tiles_take_so_long_at_most),
        cmocka_unit_test(test_neighbours_are_warned),
        cmocka_unit_test(test_dear_of_few_are_split),
        cmocka_unit_test(test_small_are_split_by_their_samples),
        cmocka_unit_test(test_dear_of_late_are_broken_up),
        cmocka_unit_test(test_idle_take_unbegun),
        cmocka_unit_test(test_pieces_replace),
        cmocka_unit_test(test_pieces_are_worth_an_answer),
        cmocka_unit_test(test_whole_before_last_piece),
        cmocka_unit_test(test_pieces_of_a_piece),
        cmocka_unit_test(test_finished_is_told),
        cmocka_unit_test(test_finished_copy_is_told),
        cmocka_unit_test(test_overdue_is_broken_up),
        cmocka_unit_test(test_idle_ask_again),
        cmocka_unit_test(test_idle_pass_over_a_pixel),
        cmocka_unit_test(test_idle_take_what_was_just_given),
        cmocka_unit_test(test_own_renderer_leaves_the_end),
        cmocka_unit_test(test_unbegun_is_not_broken_up),
        cmocka_unit_test(test_late_in_one_lot),
        cmocka_unit_test(test_answered_is_not_recalled),
        cmocka_unit_test(test_late_behind_a_later_one),
        cmocka_unit_test(test_takes_long),
        cmocka_unit_test(test_who_tells),
        cmocka_unit_test(test_cheap_are_joined),
        cmocka_unit_test(test_joined_before_all_probes),
        cmocka_unit_test(test_stopped_behind_a_late_one),
        cmocka_unit_test(test_whole_before_pieces),
        cmocka_unit_test(test_too_many_tiles),
        cmocka_unit_test(test_auto_edge),
        cmocka_unit_test(test_auto_probe_edge),
        cmocka_unit_test(test_skip),
        cmocka_unit_test(test_passes_behind_a_finished_one),
        cmocka_unit_test(test_withdraw),
        cmocka_unit_test(test_withdraw_from_stopped),
        cmocka_unit_test(test_probes_end),
        cmocka_unit_test(test_end_is_foretold),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
