#include "master/journal_scan.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/hash.h"
#include "common/message.h"

#define WINDOW 65536 /* bytes that are searched at a time */

struct journal_scan {
    int file;
    uint64_t size; /* of the file, bytes */
    uint64_t picture;
    size_t largest;   /* payload, bytes */
    void *payload;    /* room for it; owned */
    uint64_t in_vain; /* bytes read for what turned out not to be a record */
    /* A part of the file, which begins at or before the place that is looked at; owned. */
    char *window;
    uint64_t window_at;
    size_t window_bytes;
};

uint64_t record_checksum(uint64_t picture, uint64_t offset, const struct record_header *header,
                         const void *payload)
{
    const char *fields = (const char *)header + sizeof header->checksum;
    uint64_t hash = hash64(fields, sizeof *header - sizeof header->checksum, picture + offset);
    return header->magic == GAP_MAGIC ? hash : hash64(payload, header->bytes, hash);
}

/* Reads up to the end of the file or to where it cannot be read; returns how many bytes were read. */
static size_t read_some(int file, void *bytes, size_t count, uint64_t offset)
{
    size_t done = 0;
    while (done < count) {
        ssize_t got = pread(file, (char *)bytes + done, count - done, (off_t)(offset + done));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) break;
        done += (size_t)got;
    }
    return done;
}

bool read_at(int file, void *bytes, size_t count, uint64_t offset)
{
    return read_some(file, bytes, count, offset) == count;
}

struct journal_scan *journal_scan_begin(int file, uint64_t size, uint64_t picture, size_t largest)
{
    struct journal_scan *scan = allocate(1, sizeof *scan);
    *scan = (struct journal_scan){.file = file,
                                  .size = size,
                                  .picture = picture,
                                  .largest = largest,
                                  .payload = allocate(largest, 1),
                                  .window = allocate(WINDOW, 1)};
    return scan;
}

void journal_scan_end(struct journal_scan *scan)
{
    free(scan->window);
    free(scan->payload);
    free(scan);
}

/* Reads the header at a place; false if there is none whose payload lies within the file. It is taken from the
 * window if possible: a file full of what looks like headers would otherwise take a system call for each. */
static bool read_header(const struct journal_scan *scan, uint64_t at, struct record_header *header)
{
    if (at >= scan->size || scan->size - at < sizeof *header) return false;
    uint64_t end = scan->window_at + scan->window_bytes;
    if (at + sizeof *header <= end)
        memcpy(header, scan->window + (at - scan->window_at), sizeof *header);
    else if (!read_at(scan->file, header, sizeof *header, at))
        return false;
    return header->bytes <= scan->size - at - sizeof *header;
}

/* Whether there is a good record at this place; its payload is read then. */
static bool try_record(struct journal_scan *scan, uint64_t at, struct journal_record *record)
{
    struct record_header header;
    size_t read = sizeof header;
    if (read_header(scan, at, &header) && header.magic == RECORD_MAGIC &&
        header.bytes <= scan->largest) {
        read += header.bytes;
        *record = (struct journal_record){header.tile, header.seconds, scan->payload, header.bytes};
        if (read_at(scan->file, scan->payload, header.bytes, at + sizeof header) &&
            header.checksum == record_checksum(scan->picture, at, &header, scan->payload) &&
            isfinite(header.seconds) && header.seconds >= 0)
            return true;
    }
    scan->in_vain += read;
    return false;
}

/* The place after all gaps that begin at a place. */
static uint64_t pass_gaps(const struct journal_scan *scan, uint64_t at)
{
    struct record_header header;
    while (read_header(scan, at, &header) && header.magic == GAP_MAGIC &&
           header.checksum == record_checksum(scan->picture, at, &header, NULL))
        at += sizeof header + header.bytes;
    return at;
}

/* Fills the window from a place on, where there is room for a header; false: none can be read there. */
static bool fill_window(struct journal_scan *scan, uint64_t at)
{
    scan->window_at = at;
    scan->window_bytes = read_some(scan->file, scan->window, WINDOW, at);
    return scan->window_bytes >= sizeof(struct record_header);
}

/* Bytes of a block: unreadable parts of a disk are lost block by block, and the kernel reads pages of the same
 * size. */
#define BLOCK 4096

/* Moves *at to the next place where a record's header may be, by its magic number. */
static bool find_magic(struct journal_scan *scan, uint64_t *at)
{
    static const uint32_t magic = RECORD_MAGIC;
    const size_t before = offsetof(struct record_header, magic);
    while (*at < scan->size) {
        uint64_t end = scan->window_at + scan->window_bytes;
        bool is_inside = *at + before + sizeof magic <= end;
        if (!is_inside && !fill_window(scan, *at)) {
            *at = (*at / BLOCK + 1) * BLOCK;
            continue;
        }
        size_t from = (size_t)(*at - scan->window_at) + before;
        const char *hit =
            memmem(scan->window + from, scan->window_bytes - from, &magic, sizeof magic);
        if (hit) {
            *at = scan->window_at + (uint64_t)(hit - scan->window) - before;
            return true;
        }
        *at = scan->window_at + scan->window_bytes - before - sizeof magic + 1;
    }
    return false;
}

/* Bytes that look like records but are none are read up to SCAN_EFFORT times the length of the file, so that a
 * file that was made to take long does not. Damage alone causes less than the length of the file, once; so this
 * is ample. */
#define SCAN_EFFORT 8

bool journal_scan_next(struct journal_scan *scan, uint64_t *offset, uint64_t *skipped,
                       struct journal_record *record)
{
    uint64_t begin = pass_gaps(scan, *offset), at = begin;
    bool found = try_record(scan, at, record);
    while (!found && scan->in_vain / SCAN_EFFORT <= scan->size) {
        at++;
        if (!find_magic(scan, &at)) break;
        found = try_record(scan, at, record);
    }
    *skipped = (found ? at : scan->size) - begin;
    if (found) *offset = at;
    return found;
}
