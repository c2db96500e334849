/*
 * A tray is a mailbox in shared memory, in which the master and one renderer of its node pass lots and results.
 *
 * Each direction has TRAY_SLOTS slots, which are filled in turn and emptied in the same order. Neither side
 * waits for the other: if the next slot is still full, or too small, the data is sent as an MPI message. Most
 * data therefore needs no call of MPI. The alternatives were measured: with an MPI note of 8 bytes for each
 * result and each lot the master took 1.5 times as long and more (0.14 us in place of 0.09), and with whole
 * messages page faults in MPI's buffers took a seventh of its time with 44 ranks.
 */
#ifndef FARM_COMMON_TRAY_H
#define FARM_COMMON_TRAY_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "common/bell.h"
#include "common/prefetch.h"
#include "common/protocol.h"
#include "common/whole.h"

_Static_assert(ATOMIC_INT_LOCK_FREE == 2 && ATOMIC_LLONG_LOCK_FREE == 2,
               "atomics work between processes");
_Static_assert((TRAY_SLOTS & (TRAY_SLOTS - 1)) == 0, "turns may begin anew at 0");

/* The slots of one direction: the number of bytes in each; 0: the slot is empty. */
struct slots {
    atomic_uint bytes[TRAY_SLOTS];
};

/* A size in bytes, rounded up to whole cache lines. */
#define TRAY_ROW(bytes) (((bytes) + 63) / 64 * 64)

struct tray {
    /*
     * The number of things that the master has sent to the renderer, in messages and in slots; it increments
     * this and rings the bell after each. The renderer thus knows whether there is anything to receive
     * without polling MPI, which takes as long as tracing some rays.
     */
    _Alignas(64) atomic_uint sent;
    struct bell bell;
    /* The two directions and the contents of the slots share no cache line. */
    _Alignas(64) struct slots lots;
    /* Value of `sent` before each lot, which orders it among messages. */
    unsigned sent_before[TRAY_SLOTS];
    _Alignas(64) struct slots results;
    _Alignas(64) char lot[TRAY_SLOTS][TRAY_ROW(TRAY_LOT_BYTES)];
    _Alignas(64) char result[TRAY_SLOTS][TRAY_ROW(TRAY_RESULT_BYTES)];
};

static inline void tray_init(struct tray *tray)
{
    atomic_init(&tray->sent, 0);
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

/* Called by the master after it has sent something. */
static inline void tray_count_sent(struct tray *tray)
{
    atomic_fetch_add_explicit(&tray->sent, 1, memory_order_release);
    bell_ring(&tray->bell);
}

/* Called by the renderer, which has received so many things: whether there are more. */
static inline bool tray_has_news(const struct tray *tray, unsigned received)
{
    return atomic_load_explicit(&tray->sent, memory_order_acquire) != received;
}

/* ---- slots; turn: the number of slots that the caller has filled, or emptied, before ---- */

/* Bytes in the slot whose turn it is; 0: it is empty. */
static inline uint32_t slots_bytes(const struct slots *slots, unsigned turn)
{
    return atomic_load_explicit(&slots->bytes[turn % TRAY_SLOTS], memory_order_acquire);
}

/* Called by the writer: publishes the bytes it has put into the slot. */
static inline void slots_fill(struct slots *slots, unsigned turn, uint32_t bytes)
{
    atomic_store_explicit(&slots->bytes[turn % TRAY_SLOTS], bytes, memory_order_release);
}

/* Called by the reader, after it has read the slot. */
static inline void slots_empty(struct slots *slots, unsigned turn)
{
    atomic_store_explicit(&slots->bytes[turn % TRAY_SLOTS], 0, memory_order_release);
}

/* Called by the master, which is about to put a lot of a few tiles into the slot whose turn it is: asks for the memory,
 * whose lines are in the caches of the renderer's core. */
static inline void tray_expect_lot(const struct tray *tray, unsigned turn)
{
    enum { FEW = 4 }; /* lots of 44 renderers have three tiles in the mean */
    prefetch_block(&tray->sent, 1);
    prefetch_block(&tray->lots, 1);
    prefetch_block(tray->lot[turn % TRAY_SLOTS],
                   sizeof(struct lot_header) + FEW * (sizeof(float) + sizeof(struct tile)));
}

/* Called by the master: puts a lot into the slot whose turn it is, which must be empty. */
static inline void tray_put_lot(struct tray *tray, unsigned turn, const void *lot, size_t bytes)
{
    memcpy(tray->lot[turn % TRAY_SLOTS], lot, bytes);
    tray->sent_before[turn % TRAY_SLOTS] = atomic_load_explicit(&tray->sent, memory_order_relaxed);
    slots_fill(&tray->lots, turn, (uint32_t)bytes);
    tray_count_sent(tray);
}

/* ---- arrivals: what the renderers that have trays have sent to the master ---- */

#define FLAGS_PER_WORD 64

struct arrivals {
    /* Number of messages that they have sent, so that the master knows without polling MPI whether there is
     * one. */
    _Alignas(64) atomic_uint messages;
    /* One bit for each rank of the farm: it has left results in its tray since the master last looked. */
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

/*
 * Called by a renderer: arrivals_send() before it sends a message, arrivals_leave() after it has filled a
 * slot. Were the message counted after it is sent, then a renderer stopped in between would leave the count
 * less than what the master has received, and that would hide another renderer's message.
 */
static inline void arrivals_send(struct arrivals *arrivals)
{
    atomic_fetch_add_explicit(&arrivals->messages, 1, memory_order_release);
}

static inline void arrivals_leave(struct arrivals *arrivals, uint32_t rank)
{
    atomic_fetch_or_explicit(&arrivals->flags[rank / FLAGS_PER_WORD],
                             UINT64_C(1) << rank % FLAGS_PER_WORD, memory_order_release);
}

/* Called by the master, which has received `taken` messages: whether there are more. */
static inline bool arrivals_has_messages(const struct arrivals *arrivals, unsigned taken)
{
    return atomic_load_explicit(&arrivals->messages, memory_order_acquire) != taken;
}

/*
 * Called by the master: returns the flags of a word and clears them. A tray may hold more results than its
 * flag was set for; the next flag may then find it empty.
 */
static inline uint64_t arrivals_take(struct arrivals *arrivals, uint32_t word)
{
    if (atomic_load_explicit(&arrivals->flags[word], memory_order_relaxed) == 0) return 0;
    return atomic_exchange_explicit(&arrivals->flags[word], 0, memory_order_acquire);
}

#endif
