/*
 * Where a renderer on the master's node puts its results, in memory that both have: the message tells only
 * that something lies there. The renderer takes a slot that is empty, renders into it and says that it is
 * full; the master reads it and says that it is empty. Nobody waits for the other: a renderer that finds no
 * empty slot sends the result itself.
 */
#ifndef FARM_COMMON_TRAY_H
#define FARM_COMMON_TRAY_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/protocol.h"

struct tray {
    /* The two sides' words and what lies in the slots share no cache line. */
    _Alignas(64) atomic_uint full[TRAY_SLOTS];
    _Alignas(64) char slots[TRAY_SLOTS][TRAY_BYTES];
};

static inline void tray_init(struct tray *tray)
{
    for (int i = 0; i < TRAY_SLOTS; i++)
        atomic_init(&tray->full[i], 0);
}

/* ---- the renderer ---- */

/* An empty slot; -1: there is none. */
static inline int tray_find(const struct tray *tray)
{
    for (int i = 0; i < TRAY_SLOTS; i++)
        if (!atomic_load_explicit(&tray->full[i], memory_order_acquire)) return i;
    return -1;
}

/* What was written into the slot is seen by who finds it full. */
static inline void tray_fill(struct tray *tray, int slot)
{
    atomic_store_explicit(&tray->full[slot], 1, memory_order_release);
}

/* ---- the master ---- */

/* What lies in the slot of a valid note, until tray_empty(); NULL: nothing does. */
static inline const char *tray_look(const struct tray *tray, const struct tray_note *note)
{
    bool full = atomic_load_explicit(&tray->full[note->slot], memory_order_acquire);
    return full ? tray->slots[note->slot] : NULL;
}

static inline void tray_empty(struct tray *tray, const struct tray_note *note)
{
    atomic_store_explicit(&tray->full[note->slot], 0, memory_order_release);
}

#endif
