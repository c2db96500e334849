/*
 * Where the master puts lots for a renderer on its node, and that one its results, in memory that both have:
 * the message tells only that something lies there. Who writes takes a slot that is empty, and says that it
 * is full; who reads says that it is empty. Nobody waits for the other: what finds no empty slot goes into
 * the message.
 *
 * A message is copied twice, through pages of MPI's that every message finds cold or, for its first hundreds,
 * never used before: page faults in these took a seventh of the master's time with 44 ranks.
 */
#ifndef FARM_COMMON_TRAY_H
#define FARM_COMMON_TRAY_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "common/bell.h"
#include "common/protocol.h"

/* Which slots of one direction are full. */
struct slots {
    atomic_uint full[TRAY_SLOTS];
};

/* So many bytes, in whole cache lines. */
#define TRAY_ROW(bytes) (((bytes) + 63) / 64 * 64)

struct tray {
    /* Messages that the master has sent to the renderer, and what wakes it: the master counts and rings behind
     * each. So the renderer knows without a look at MPI, which takes as long as some rays, whether there is
     * anything to hear. */
    _Alignas(64) atomic_uint said;
    struct bell bell;
    /* The two directions, and what lies in the slots, share no cache line. */
    _Alignas(64) struct slots lots;
    _Alignas(64) struct slots results;
    _Alignas(64) char lot[TRAY_SLOTS][TRAY_ROW(TRAY_LOT_BYTES)];
    _Alignas(64) char result[TRAY_SLOTS][TRAY_ROW(TRAY_RESULT_BYTES)];
};

static inline void tray_init(struct tray *tray)
{
    atomic_init(&tray->said, 0);
    bell_init(&tray->bell);
    for (int i = 0; i < TRAY_SLOTS; i++) {
        atomic_init(&tray->lots.full[i], 0);
        atomic_init(&tray->results.full[i], 0);
    }
}

static inline void tray_free(struct tray *tray)
{
    bell_free(&tray->bell);
}

/* By the master: it has sent a message. */
static inline void tray_say(struct tray *tray)
{
    atomic_fetch_add_explicit(&tray->said, 1, memory_order_release);
    bell_ring(&tray->bell);
}

/* By the renderer, who has heard so many: whether there are more. */
static inline bool tray_has_news(const struct tray *tray, unsigned heard)
{
    return atomic_load_explicit(&tray->said, memory_order_acquire) != heard;
}

/* By who writes: an empty slot; -1: there is none. */
static inline int slots_find(const struct slots *slots)
{
    for (int i = 0; i < TRAY_SLOTS; i++)
        if (!atomic_load_explicit(&slots->full[i], memory_order_acquire)) return i;
    return -1;
}

/* What was written into the slot is seen by who finds it full. */
static inline void slots_fill(struct slots *slots, int slot)
{
    atomic_store_explicit(&slots->full[slot], 1, memory_order_release);
}

/* By who reads, of a slot that a valid note names. */
static inline bool slots_full(const struct slots *slots, uint32_t slot)
{
    return atomic_load_explicit(&slots->full[slot], memory_order_acquire) != 0;
}

static inline void slots_empty(struct slots *slots, uint32_t slot)
{
    atomic_store_explicit(&slots->full[slot], 0, memory_order_release);
}

#endif
