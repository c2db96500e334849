/* What several tests of the work queue share: configurations, answers of renderers, and checks of what the queue
 * counts. */
#ifndef FARM_TEST_QUEUE_FIXTURE_H
#define FARM_TEST_QUEUE_FIXTURE_H

#include <math.h>

#include "master/queue_parts.h"
#include "test/random.h"
#include "test/unit.h"

/* Four renderers and twelve tiles. */
static const struct queue_config four = {
    .width = 64, .height = 48, .renderers = 4, .tile_edge = 16};

/* The same picture with smaller tiles and a pre-pass of probes. */
static const struct queue_config with_probes = {
    .width = 64, .height = 48, .renderers = 4, .tile_edge = 8, .probe_edge = 2};

/* Notes the tile's pixels as rendered; none of them may have been rendered before. */
static inline void mark(unsigned char *seen, const struct queue_config *config,
                        const struct tile *tile)
{
    for (uint32_t k = 0; k < tile_pixels(tile); k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        assert_true(x < config->width && y < config->height);
        assert_int_equal(seen[(size_t)y * config->width + x]++, 0);
    }
}

/* Notes the pixels of those kept pieces that count as rendered; returns how many pieces these are. */
static inline uint32_t hear_fates(struct queue *queue, unsigned char *seen,
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

/* Answers a probe tile with random costs. */
static inline void answer_probe(struct queue *queue, const struct tile *probe, uint64_t *seed)
{
    float seconds[64];
    uint32_t pixels = tile_pixels(probe);
    assert_true(pixels <= 64);
    for (uint32_t k = 0; k < pixels; k++)
        seconds[k] = 1e-6f * (float)random_below(seed, 1000);
    queue_probed(queue, probe, seconds);
}

/* The renderer finishes the tiles `from` to `to` - 1 of its lot. */
static inline void finish_part(struct queue *queue, uint32_t renderer, const struct tile *lot,
                               uint32_t from, uint32_t to)
{
    for (uint32_t i = from; i < to; i++)
        assert_true(queue_finish(queue, renderer, lot[i].id, 1e-3, 1e-3));
}

/* The renderer finishes its lot, be it of tiles of the picture or of probes. */
static inline void finish_lot(struct queue *queue, uint32_t renderer, const struct tile *lot,
                              uint32_t count, double now)
{
    uint64_t seed = 1;
    for (uint32_t i = 0; i < count; i++) {
        if (lot[i].pass == TILE_PROBE) answer_probe(queue, &lot[i], &seed);
        queue_finish(queue, renderer, lot[i].id, now, 1e-3);
    }
}

/* The queue learns that an answer takes the master so many seconds, however few pixels it has. */
static inline void serve_for(struct queue *queue, double seconds)
{
    for (int i = 0; i < 200; i++)
        queue_served(queue, seconds, 1);
}

/* Takes all recalls from the queue; returns how many of them tell this renderer that this tile is finished. */
static inline uint32_t told_finished(struct queue *queue, uint32_t renderer, uint32_t id)
{
    struct recall recall;
    uint32_t count = 0;
    while (queue_next_recall(queue, &recall))
        count += recall.finished && recall.renderer == renderer && recall.id == id;
    return count;
}

/* The value is a running sum of floats, which may be off by rounding in proportion to `all` that was ever added to
 * it. */
static inline void assert_sum(double value, double expected, double all)
{
    if (!(fabs(value - expected) <= 1e-5 * all)) fail_msg("%g instead of %g", value, expected);
}

/* The queue knows of each renderer how many lots it has, and how many tiles it may still pass on to others, which are
 * neither finished nor broken up. It has no tile twice. None are taken from one that is not late. */
static inline void check_holders(const struct queue *queue)
{
    const struct holdings *holdings = &queue->holdings;
    for (uint32_t renderer = 0; renderer < queue->config.renderers; renderer++) {
        const struct holder *holder = &holdings->holders[renderer];
        uint32_t count = 0, open = 0, lots = 0, lot = 0;
        for (uint32_t i = holder->first; i != HOLD_NONE; i = holdings->holds[i].next) {
            const struct hold *hold = &holdings->holds[i];
            const struct item *item = &queue->items[hold->id];
            bool is_open = hold->may_pass && !hold->recalled;
            open += is_open;
            assert_ptr_equal(holdings_find(holdings, renderer, hold->id), hold);
            assert_true(!is_open || (!item->finished && item->pieces == 0));
            lots += count++ == 0 || hold->lot != lot;
            lot = hold->lot;
        }
        assert_true(holder->count == count && holder->open == open && holder->lots == lots);
        assert_true(queue->pace.renderers[renderer].is_overdue ||
                    !heap_has(&queue->pace.spare, renderer));
    }
}

/* The running counts and sums over renderers are what adding them up gives. */
static inline void check_pace(const struct pace *pace)
{
    double speed = 0, holding = 0, until = 0;
    uint32_t holders = 0, overdue = 0;
    for (uint32_t i = 0; i < pace->count; i++) {
        const struct pace_renderer *r = &pace->renderers[i];
        overdue += r->is_overdue;
        speed += r->is_overdue ? 0 : r->speed;
        if (r->is_overdue || !r->holds) continue;
        holders++;
        holding += r->speed;
        until += r->speed * r->free_at;
    }
    assert_true(pace->overdue_count == overdue && pace->holders == holders);
    assert_sum(pace->speed, speed, pace->count);
    assert_sum(pace->holding, holding, pace->count);
    assert_sum(pace->holding_until, until, pace->count + fabs(until));
}

/* The running counts and sums of the queue are what adding up all of its tiles gives. */
static inline void check_sums(const struct queue *queue)
{
    struct outlook outlook = {0};
    double waiting_work = 0, total = 0;
    uint64_t waiting_pixels = 0, finished = 0;
    uint32_t waiting = 0;
    for (uint32_t id = 0; id < queue->item_count; id++) {
        const struct item *item = &queue->items[id];
        double work = (double)item->work;
        if (item->pass == 0) assert_true((double)item->worst >= work * (1 - 1e-5));
        if (heap_has(&queue->waiting, id)) {
            assert_false(item->finished);
            assert_true(queue->waiting.entries[queue->waiting.places[id]].key == item->priority);
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
    check_holders(queue);
    check_pace(&queue->pace);
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

#endif
