/*
 * The format of a journal's records (master/journal.h says what they are for), and the search for good records
 * among damaged bytes.
 *
 * A record's checksum covers its offset and its picture: a record that matches it is good, whatever the bytes
 * before it are. So after a damaged record the next good one is searched for at every byte.
 */
#ifndef FARM_MASTER_JOURNAL_SCAN_H
#define FARM_MASTER_JOURNAL_SCAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/tile.h"
#include "master/journal.h"

#define RECORD_MAGIC UINT32_C(0x454c4954) /* "TILE" */
/* "GAP ": the bytes that follow are known to be of no use */
#define GAP_MAGIC    UINT32_C(0x20504147)

struct record_header {
    uint64_t checksum; /* record_checksum() */
    uint32_t magic;
    uint32_t reserved; /* 0 */
    struct tile tile;
    double seconds;
    uint64_t bytes; /* of the payload that follows */
};

_Static_assert(sizeof(struct record_header) == 64, "it is stored in files");

/* The checksum of a record: of its header without the checksum, and, unless it is a gap, of its payload; offset:
 * its place in the file. */
uint64_t record_checksum(uint64_t picture, uint64_t offset, const struct record_header *header,
                         const void *payload);

/* Reads `count` bytes; false at the end of the file or after an error. */
bool read_at(int file, void *bytes, size_t count, uint64_t offset);

struct journal_scan;

/* Starts to scan a file of `size` bytes, which stays open meanwhile; largest: most bytes of a payload. Freed by
 * journal_scan_end(). */
struct journal_scan *journal_scan_begin(int file, uint64_t size, uint64_t picture, size_t largest);
void journal_scan_end(struct journal_scan *scan);

/*
 * Finds the first good record at *offset, which never decreases from call to call, or after it, and sets *offset to
 * its place. *skipped: how many bytes before it are damaged, without gaps at *offset. The payload is valid until the
 * next call. false: there is none, or finding one takes too long; *skipped is then all that is left, and this must
 * not be called again.
 */
bool journal_scan_next(struct journal_scan *scan, uint64_t *offset, uint64_t *skipped,
                       struct journal_record *record);

#endif
