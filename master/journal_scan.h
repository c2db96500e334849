/*
 * What a journal's records look like in the file (master/journal.h says what they are for), and how good
 * ones are found between damage.
 *
 * A record's checksum covers its place and its picture: what fits it is a good record, wherever the bytes
 * before it come from. So behind a damaged one the next good one is looked for at every byte.
 */
#ifndef FARM_MASTER_JOURNAL_SCAN_H
#define FARM_MASTER_JOURNAL_SCAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/tile.h"
#include "master/journal.h"

#define RECORD_MAGIC UINT32_C(0x454c4954) /* "TILE" */
#define GAP_MAGIC    UINT32_C(0x20504147) /* "GAP ": the bytes behind it are known to be of no use */

struct record_header {
    uint64_t checksum; /* record_checksum() */
    uint32_t magic;
    uint32_t reserved; /* 0 */
    struct tile tile;
    double seconds;
    uint64_t bytes; /* of the payload behind it */
};

_Static_assert(sizeof(struct record_header) == 64, "stands in files");

/* Of all but itself and, unless it is a gap's, of the payload; offset: where in the file it stands. */
uint64_t record_checksum(uint64_t picture, uint64_t offset, const struct record_header *header,
                         const void *payload);

/* Reads all of it; false at the end of the file or after an error. */
bool read_at(int file, void *bytes, size_t count, uint64_t offset);

/* What looks like records and is none is read as long as it comes to less than so many times the file: a file
 * made to take long does not. Damage alone leaves less than the file itself, once; so this is ample. */
#define SCAN_EFFORT 8

struct journal_scan;

/* Of a file of so many bytes, which stays open meanwhile; largest: bytes of a payload. */
struct journal_scan *journal_scan_begin(int file, uint64_t size, uint64_t picture, size_t largest);
void journal_scan_end(struct journal_scan *scan);

/*
 * Finds the first good record at *offset or behind it, and sets *offset to its place; *skipped: how many
 * bytes before it are damaged, but for gaps at *offset. The payload is the scan's until the next
 * call. false: there is none, or finding one takes too long; *skipped is then all that is left.
 */
bool journal_scan_next(struct journal_scan *scan, uint64_t *offset, uint64_t *skipped,
                       struct journal_record *record);

#endif
