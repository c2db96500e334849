/* A queue whose four renderers have their first lots, some of which are answered late. */
#ifndef FARM_TEST_QUEUE_LATE_FIXTURE_H
#define FARM_TEST_QUEUE_LATE_FIXTURE_H

#include "test/queue_fixture.h"
#include "test/unit.h"

/* So many tiles that lots are large. */
static const struct queue_config many = {
    .width = 256, .height = 256, .renderers = 4, .tile_edge = 4};

/* All four renderers get their first lots. */
static inline struct queue *begin_many(struct tile lots[4][LOT_TILES], uint32_t counts[4])
{
    struct queue *queue = queue_create(&many);
    for (uint32_t i = 0; i < 4; i++)
        counts[i] = queue_next(queue, i, 0, lots[i]);
    return queue;
}

/* All renderers have finished their first lots, except for the first `kept` tiles of renderer 0 and the first four of
 * renderer 1. */
static inline struct queue *begin_late(struct tile lots[4][LOT_TILES], uint32_t kept)
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

#endif
