/*
 * Where the master puts lots for a renderer on its node, and that one its results, in memory that both have.
 * Both are put into slots in turn, and taken in the same order. Nobody waits for the other: what finds its
 * slot still full, or is too long for it, goes as a message. So nobody calls MPI for most of what is said: with
 * a note of 8 bytes about each result and each lot these took the master half as long again and more (0.14 us in
 * place of 0.09), and in messages page faults in the buffers of MPI a seventh of its time with 44 ranks.
 */
#ifndef FARM_COMMON_TRAY_H
#define FARM_COMMON_TRAY_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "common/bell.h"
#include "common/protocol.h"
#include "common/whole.h"

_Static_assert(ATOMIC_INT_LOCK_FREE == 2 && ATOMIC_LLONG_LOCK_FREE == 2,
               "atomics work between processes");
_Static_assert((TRAY_SLOTS & (TRAY_SLOTS - 1)) == 0, "turns may begin anew at 0");

/* One direction: how many bytes lie in each slot; 0: it is empty. */
struct slots {
    atomic_uint bytes[TRAY_SLOTS];
};

/* So many bytes, in whole cache lines. */
#define TRAY_ROW(bytes) (((bytes) + 63) / 64 * 64)

struct tray {
    /* What the master has said to the renderer, in messages and in slots, and what wakes it: the master counts
     * and rings behind each. So the renderer knows without a look at MPI, which takes as long as some rays,
     * whether there is anything to hear. */
    _Alignas(64) atomic_uint said;
    struct bell bell;
    /* The two directions, and what lies in the slots, share no cache line. */
    _Alignas(64) struct slots lots;
    unsigned said_before[TRAY_SLOTS]; /* each of the lots */
    _Alignas(64) struct slots results;
    _Alignas(64) char lot[TRAY_SLOTS][TRAY_ROW(TRAY_LOT_BYTES)];
    _Alignas(64) char result[TRAY_SLOTS][TRAY_ROW(TRAY_RESULT_BYTES)];
};

static inline void tray_init(struct tray *tray)
{
    atomic_init(&tray->said, 0);
    bell_init(&tray->bell);
    for (int i = 0; i < TRAY_SLOTS; i++) {
        atomic_init(&tray->lots.bytes[i], 0);
        atomic_init(&tray->results.bytes[i], 0);
    }
}

static inline void tray_free(struct tray *tray)
{
    bell_free(&tray->bell);
}

/* By the master: it has said something. */
static inline void tray_say(struct tray *tray)
{
    atomic_fetch_add_explicit(&tray->said, 1, memory_order_release);
    bell_ring(&tray->bell);
}

/* By the renderer, who has heard so much: whether there is more. */
static inline bool tray_has_news(const struct tray *tray, unsigned heard)
{
    return atomic_load_explicit(&tray->said, memory_order_acquire) != heard;
}

/* ---- slots; turn: what its caller has put into them, or taken, before ---- */

/* Bytes of what lies in the slot whose turn it is; 0: it is empty. */
static inline uint32_t slots_bytes(const struct slots *slots, unsigned turn)
{
    return atomic_load_explicit(&slots->bytes[turn % TRAY_SLOTS], memory_order_acquire);
}

/* By who writes: so many bytes were put there, which is seen by who finds them. */
static inline void slots_fill(struct slots *slots, unsigned turn, uint32_t bytes)
{
    atomic_store_explicit(&slots->bytes[turn % TRAY_SLOTS], bytes, memory_order_release);
}

/* By who reads. */
static inline void slots_empty(struct slots *slots, unsigned turn)
{
    atomic_store_explicit(&slots->bytes[turn % TRAY_SLOTS], 0, memory_order_release);
}

/* By the master: a lot of so many bytes into the slot whose turn it is, which is empty. */
static inline void tray_put_lot(struct tray *tray, unsigned turn, const void *lot, size_t bytes)
{
    memcpy(tray->lot[turn % TRAY_SLOTS], lot, bytes);
    tray->said_before[turn % TRAY_SLOTS] = atomic_load_explicit(&tray->said, memory_order_relaxed);
    slots_fill(&tray->lots, turn, (uint32_t)bytes);
    tray_say(tray);
}

/* ---- what has arrived for the master from those who have trays ---- */

#define FLAGS_PER_WORD 64

struct arrivals {
    /* That they have sent: so the master knows without a look at MPI whether there is one. */
    _Alignas(64) atomic_uint messages;
    /* Who has left results in its tray since the master has looked: a bit for each rank of the farm. */
    _Alignas(64) _Atomic uint64_t flags[];
};

static inline uint32_t arrivals_words(uint32_t ranks)
{
    return divide_up(ranks, FLAGS_PER_WORD);
}

static inline void arrivals_init(struct arrivals *arrivals, uint32_t ranks)
{
    atomic_init(&arrivals->messages, 0);
    for (uint32_t word = 0; word < arrivals_words(ranks); word++)
        atomic_init(&arrivals->flags[word], 0);
}

/* By a renderer: it is about to send a message (behind that, if it were stopped in between, the count would be less
 * than what the master has taken in, and hide another one's); it has filled a slot. */
static inline void arrivals_send(struct arrivals *arrivals)
{
    atomic_fetch_add_explicit(&arrivals->messages, 1, memory_order_release);
}

static inline void arrivals_leave(struct arrivals *arrivals, uint32_t rank)
{
    atomic_fetch_or_explicit(&arrivals->flags[rank / FLAGS_PER_WORD],
                             UINT64_C(1) << rank % FLAGS_PER_WORD, memory_order_release);
}

/* By the master, who has taken in so many: whether there are more. */
static inline bool arrivals_has_messages(const struct arrivals *arrivals, unsigned taken)
{
    return atomic_load_explicit(&arrivals->messages, memory_order_acquire) != taken;
}

/* By the master: the flags of a word, which are down then. Who looks into a tray may find more than its flag was
 * raised for: the next flag is about nothing then. */
static inline uint64_t arrivals_take(struct arrivals *arrivals, uint32_t word)
{
    if (atomic_load_explicit(&arrivals->flags[word], memory_order_relaxed) == 0) return 0;
    return atomic_exchange_explicit(&arrivals->flags[word], 0, memory_order_acquire);
}

#endif
