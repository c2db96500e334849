/*
 * The journal: a file of finished tiles, so that after the death of a run the next one can continue it.
 *
 *   header | record | record | ...        record: 64 bytes, then the payload
 *
 * The header identifies the picture by a hash. A record holds a tile's place and pass, and a checksum over all
 * its bytes, its offset in the file and the picture: so a record that was cut off, damaged, moved or taken from
 * elsewhere is recognised. Reading then continues with the next good record (master/journal_scan.h); what is
 * lost is rendered again.
 *
 * What is appended survives the death of all processes of the run at once, as the kernel has it then;
 * journal_tick() makes it survive the death of the machine. Only one run at a time has a journal open: a lock
 * that ends with the process keeps others out.
 *
 * Numbers are stored as in memory; a journal of a machine of the other byte order is treated as one of another
 * picture. Messages go through common/message.h.
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
    double seconds;      /* wall seconds that it took to render */
    const void *payload; /* what the caller stores of a tile, uninterpreted */
    size_t bytes;        /* of the payload */
};

/* Receives what a journal holds. */
struct journal_reader {
    /*
     * Called for each good record, in the order of writing. The payload is valid during the call only, and not
     * aligned to more than 8 bytes. Returns false if the record is of no use to this run, as it does not belong
     * to it or depends on one that is lost: it is skipped and not offered again. The checksum does not protect
     * against forgery: tile and payload have to be checked like a message.
     */
    bool (*take)(void *state, const struct journal_record *record);
    void *state;
    size_t largest; /* most bytes of a payload; a record that claims more is damaged */
    uint64_t room;  /* bytes that a new journal has to have room for */
};

/* What was found when the journal was opened. */
struct journal_found {
    uint64_t records;       /* records taken by the reader */
    uint64_t damaged_bytes; /* bytes that belong to no good record */
    uint64_t refused_bytes; /* bytes of good records that were not taken */
};

struct journal;

/*
 * The hash that identifies a picture: of the scene block with its view, without settings that do not change the
 * picture (processor, variant), and of `program`, a hash that tells one build from another. Where one variant
 * leaves lights or corners out of the block and another does not, the hash differs: there are two journals of
 * one picture.
 */
uint64_t journal_picture_hash(const struct scene *scene, uint64_t program);

/* Whether a journal could be opened or created at path, tested before rendering as output_writable() does:
 * nothing is created or changed. false after user_error(). */
bool journal_writable(const char *path);

/*
 * Opens or creates the journal at path and passes what it holds to the reader. Returns NULL after user_error():
 * another run has it open, it cannot be read, no file can be created, or another journal would have to give way to a
 * new one for which there is no room.
 *
 * A journal of another picture that is not empty is renamed (path.1, path.2, ...) with a warning, and so is a
 * file that is no journal. A journal of this picture that was renamed so is renamed back, with a note. How much
 * is damaged or refused is reported once: it is not read again. A journal whose header is damaged is recognised
 * by any good record.
 */
struct journal *journal_open(const char *path, uint64_t picture,
                             const struct journal_reader *reader);

struct journal_found journal_found(const struct journal *journal);

/* Whether it holds nothing that another run could use. */
bool journal_is_bare(const struct journal *journal);

/* Whether nothing was found, not even damaged bytes or records that are of no use to this run. */
bool journal_was_empty(const struct journal *journal);

/* Its path; valid until the journal is moved or closed. */
const char *journal_path(const struct journal *journal);

/* Bytes that a record takes in the file; payload: bytes of its payload. */
uint64_t journal_record_bytes(size_t payload);

/* Whether its file system has room for `bytes` more, or that is not known; false after user_error(). */
bool journal_has_room(const struct journal *journal, uint64_t bytes);

/* Reserves space for `bytes` more, so that it does not matter if the disk fills up meanwhile. Has no effect
 * where that is not possible. */
void journal_reserve(struct journal *journal, uint64_t bytes);

/* Gives back what was reserved and is not used: all has been appended. */
void journal_give_back(struct journal *journal);

/*
 * Appends a record. false when it could not be written (disk full, ...): the journal is then as it was before,
 * the first failure is reported as a warning, and a later call may succeed. Rendering goes on in any case;
 * records that failed can be appended later.
 */
bool journal_append(struct journal *journal, const struct journal_record *record);

/* From now on failures are not reported: rendering has ended, and the caller tells what is lost, if it matters. */
void journal_hush(struct journal *journal);

/*
 * To be called now and then with clock_wall(): syncs what was appended to disk, when it is time. Syncing never
 * takes more than JOURNAL_SYNC_SHARE of the time, so that a slow disk is synced less often.
 */
void journal_tick(struct journal *journal, double now);
#define JOURNAL_SYNC_SHARE 0.005

/* Seconds from a sync that took `cost` seconds to the next one. */
double journal_sync_pause(double cost);

/* Whether the file still exists at its path: its folder may have been removed. */
bool journal_exists(const struct journal *journal);

/*
 * Continues the journal in a copy at path, where no file may exist, with space for `more` bytes. The file that was
 * opened stays as it is, and locked until the end; a copy of an earlier call is removed. false, with no message and
 * nothing changed, when there cannot be such a copy.
 */
bool journal_move(struct journal *journal, const char *path, uint64_t more);

/*
 * Removes the file that was opened, for when all records are in the copy that journal_move() has made. It is kept if
 * another file has taken its path, if the copy is gone or cannot be synced, or if only the copy would be lost with the
 * death of the machine, as it is in memory.
 */
void journal_remove_original(struct journal *journal);

/* The path of the file that was opened, if it is still there and the journal goes on in a copy; else NULL. Valid until
 * the journal is closed. */
const char *journal_original(const struct journal *journal);

/* Syncs, unlocks and closes the journal, which stays for the next run. Frees it. */
void journal_close(struct journal *journal);

/* Removes the journal's file, for when the picture is safely written, but no other one that has taken its path. Frees
 * it. */
void journal_remove(struct journal *journal);

#endif
