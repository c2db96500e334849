/*
 * The journal: finished tiles in a file, so that a run that died goes on where it ended.
 *
 *   header | record | record | ...        record: 64 bytes, then the payload
 *
 * The header names the picture by a hash; a record holds a tile's place, its pass, and a checksum of
 * all its bytes, its place in the file and the picture, so that a record that was cut, damaged, moved
 * or taken from elsewhere is known as such. Reading goes on with the next good one behind it
 * (master/journal_scan.h); what is lost is rendered again.
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
    double seconds;      /* what it took to render */
    const void *payload; /* whatever the caller keeps of a tile */
    size_t bytes;        /* of the payload */
};

/* Takes what a journal holds. */
struct journal_reader {
    /*
     * Called for each good record in the order of writing; the payload is gone afterwards, and not
     * aligned to more than 8 bytes. false: the record is of no use to this run, as it is not of it or
     * rests on one that is lost; it is passed over and not offered again. The checksum does not stop
     * a forger: tile and payload are checked like a message.
     */
    bool (*take)(void *state, const struct journal_record *record);
    void *state;
    size_t largest; /* bytes of a payload; a record that says more is damaged */
};

/* What was found at the start. */
struct journal_found {
    uint64_t records;       /* taken */
    uint64_t damaged_bytes; /* that no good record has */
    uint64_t refused_bytes; /* of good records that were not taken */
};

struct journal;

/* The scene block with its view, but for settings that all give the same picture (processor, variant), is
 * all that makes it, and the program itself: program is a hash that tells one build from another. Where one
 * variant leaves lights or corners out of the block and the other does not, it is another one: two journals
 * of one picture. */
uint64_t journal_picture(const struct scene *scene, uint64_t program);

/* Whether a journal could be opened or made at path, tried before rendering as with output_writable(): nothing
 * is made or touched. false after user_error(). */
bool journal_writable(const char *path);

/*
 * Opens or makes the journal at path and hands what it holds to the reader. A journal of another
 * picture that is not empty, and what is no journal, is renamed (path.1, path.2, ...) with a
 * warning, and one of this picture that was comes back with a note; so is told how much is damaged or refused, once:
 * it is not read again. One whose header is damaged is known by any good record. NULL after user_error(): another run
 * has it open, it cannot be read, or there cannot be a file.
 */
struct journal *journal_open(const char *path, uint64_t picture,
                             const struct journal_reader *reader);

struct journal_found journal_found(const struct journal *journal);

/* Whether nothing was found, not even what is damaged or of no use to this run. */
bool journal_was_empty(const struct journal *journal);

/* Where it stands; until the journal is moved or closed. */
const char *journal_path(const struct journal *journal);

/* What a record with a payload of so many bytes takes in the file. */
uint64_t journal_record_bytes(size_t payload);

/* Bytes that its file system has room for; UINT64_MAX when that is unknown. */
uint64_t journal_room(const struct journal *journal);

/*
 * Sets room for so many more bytes aside, so that a disk that fills up meanwhile does not matter.
 * Where that cannot be done nothing happens.
 */
void journal_reserve(struct journal *journal, uint64_t bytes);

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

/* Whether the file still stands at its path: its folder may have been removed. */
bool journal_stands(const struct journal *journal);

/*
 * Goes on with a copy at path, where no file may stand, with room for so many bytes more; the old
 * file stays as it is. false, with nothing said and nothing changed, when there cannot be such a
 * copy.
 */
bool journal_move(struct journal *journal, const char *path, uint64_t more);

/* Ends the work on a journal, which stays for the next run: synced, unlocked. */
void journal_keep(struct journal *journal);

/* Removes the journal when the picture is safely written. */
void journal_remove(struct journal *journal);

#endif
