/*
 * The journal: finished tiles in a file, so that a run that died goes on where it ended.
 *
 *   header | record | record | ...        record: 64 bytes, then the payload
 *
 * The header names the picture by a hash; a record holds a tile's place, its pass, and a checksum of
 * all its bytes, its place in the file and the picture, so that a record that was cut, damaged, moved
 * or taken from elsewhere is known as such. Reading ends at the first one; what follows is cut off
 * and rendered again.
 *
 * What is appended is safe from the death of every process of the run at once, being the kernel's
 * then; journal_tick() makes it safe from the death of the machine. Only one run at a time has a
 * journal open: a lock that goes with the process keeps others out.
 *
 * Numbers are as the machine holds them; a journal from one of the other byte order is as another
 * picture's. Messages go through common/message.h.
 */
#ifndef FARM_MASTER_JOURNAL_H
#define FARM_MASTER_JOURNAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/scene.h"
#include "common/tile.h"

struct journal_record {
    struct tile tile;
    uint32_t pass;
    double seconds;      /* what it took to render */
    const void *payload; /* whatever the caller keeps of a tile */
    size_t bytes;        /* of the payload */
};

/* Takes what a journal holds. */
struct journal_reader {
    /*
     * Called for each good record in the order of writing; the payload is gone afterwards, and not
     * aligned to more than 8 bytes. false: the record cannot be of this run, the journal ends before
     * it. The checksum does not stop a forger: tile and payload are checked like a message.
     */
    bool (*take)(void *state, const struct journal_record *record);
    void *state;
    size_t largest; /* bytes of a payload; a record that says more is damaged */
};

/* What was found at the start. */
struct journal_found {
    uint64_t records;
    uint64_t damaged_bytes; /* cut off at the end */
    double seconds;         /* of rendering, that are saved */
};

struct journal;

/* The scene block with its view is all that makes the picture, but for the program itself: build
 * tells one from another. */
uint64_t journal_picture(const struct scene *scene, const char *build);

/*
 * Opens or makes the journal at path and hands what it holds to the reader. A journal of another
 * picture, and what is no journal, is renamed (path.1, path.2, ...) with a warning; so is told how
 * much of a damaged end was dropped. NULL after user_error(): another run has it open, or there
 * cannot be a file.
 */
struct journal *journal_open(const char *path, uint64_t picture,
                             const struct journal_reader *reader);

struct journal_found journal_found(const struct journal *journal);

/*
 * Appends a record. false when it could not be written (disk full, ...): the journal is then as it
 * was before, the first failure is told as a warning, and a later call may succeed again. Rendering
 * goes on in any case; records that failed can be appended later.
 */
bool journal_append(struct journal *journal, const struct journal_record *record);

/*
 * To be called now and then with clock_wall(): brings to disk what was appended, when it is time. As
 * syncing is never allowed more than JOURNAL_SYNC_SHARE of the time, a slow disk is synced seldom.
 */
void journal_tick(struct journal *journal, double now);
#define JOURNAL_SYNC_SHARE 0.005

/* Seconds until the next sync after one that took so long. */
double journal_sync_pause(double cost);

/* Ends the work on a journal, which stays for the next run: synced, unlocked. */
void journal_keep(struct journal *journal);

/* Removes the journal when the picture is safely written. */
void journal_remove(struct journal *journal);

#endif
