/* Journals of small records for tests: written, opened again, and compared with what was appended. */
#ifndef FARM_TEST_JOURNAL_FIXTURE_H
#define FARM_TEST_JOURNAL_FIXTURE_H

#include <dirent.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "master/journal.h"
#include "test/scratch.h"
#include "test/unit.h"

#define PICTURE UINT64_C(0x123456789abcdef0)
#define PATH    "a.journal"
#define PAYLOAD 40 /* bytes, of most records here */
#define HEADER  24 /* of the file, bytes */
#define RECORD  (64 + PAYLOAD)

/* The i-th of all records, made anew where it is needed. */
static inline struct journal_record make_record(uint32_t i, unsigned char payload[PAYLOAD])
{
    for (uint32_t j = 0; j < PAYLOAD; j++)
        payload[j] = (unsigned char)(i * 37 + j * j);
    return (struct journal_record){
        .tile = {.id = i, .x = 8 * i, .y = i, .w = 8, .h = 8, .step = 1, .pass = i / 3},
        .seconds = 0.25 * i,
        .payload = payload,
        .bytes = PAYLOAD};
}

/* What a reader has seen: only good records, in their order, though some may be missing. */
struct seen {
    uint32_t records;
    uint32_t accepted; /* no more than these are taken */
    uint32_t next;     /* the first that may come */
    bool wrong;
};

static inline bool take(void *state, const struct journal_record *record)
{
    struct seen *seen = state;
    unsigned char payload[PAYLOAD];
    if (seen->records == seen->accepted) return false;
    struct journal_record good = make_record(record->tile.id, payload);
    seen->wrong |= record->tile.id < seen->next || record->bytes != PAYLOAD ||
                   memcmp(record->payload, payload, PAYLOAD) != 0 ||
                   memcmp(&record->tile, &good.tile, sizeof good.tile) != 0 ||
                   record->seconds != good.seconds;
    seen->records++;
    seen->next = record->tile.id + 1;
    return true;
}

static inline struct journal *open_as(struct scratch *s, uint64_t picture, struct seen *seen)
{
    *seen = (struct seen){.accepted = UINT32_MAX};
    struct journal_reader reader = {take, seen, PAYLOAD, 0};
    message_capture(s->said, sizeof s->said);
    struct journal *journal = journal_open(PATH, picture, &reader);
    message_capture(NULL, 0);
    return journal;
}

static inline bool append(struct journal *journal, uint32_t i)
{
    unsigned char payload[PAYLOAD];
    struct journal_record record = make_record(i, payload);
    return journal_append(journal, &record);
}

/* A closed journal of so many records at PATH. */
static inline void write_journal(struct scratch *s, uint32_t records)
{
    struct seen seen;
    unlink(PATH);
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_non_null(journal);
    for (uint32_t i = 0; i < records; i++)
        assert_true(append(journal, i));
    journal_close(journal);
}

static inline size_t read_file(const char *path, char *bytes, size_t size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t count = fread(bytes, 1, size, file);
    fclose(file);
    return count;
}

/* How many files are open. */
static inline unsigned count_open(void)
{
    unsigned count = 0;
    DIR *files = opendir("/proc/self/fd");
    assert_non_null(files);
    while (readdir(files))
        count++;
    closedir(files);
    return count;
}

/* How many were before the first test. */
static unsigned open_at_first;

/* Group set-up. */
static inline int journal_tests_open(void **state)
{
    open_at_first = count_open();
    return scratch_open(state);
}

/* The last test of a group: no other one has left a file open. */
static inline void test_no_file_stays_open(void **state)
{
    assert_int_equal(count_open(), open_at_first);
}

/* The journal at PATH holds so many records and is damaged behind them by so many bytes; after the
 * rest is appended, all are there. */
static inline void check_resume(struct scratch *s, uint32_t records, size_t damaged, uint32_t all)
{
    struct seen seen;
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_non_null(journal);
    struct journal_found found = journal_found(journal);
    assert_true(!seen.wrong && seen.records == records && found.records == records);
    assert_true(found.damaged_bytes == damaged);
    assert_true((damaged > 0) == (strstr(s->said, "damaged") != NULL));
    for (uint32_t i = records; i < all; i++)
        assert_true(append(journal, i));
    journal_close(journal);
    journal = open_as(s, PICTURE, &seen);
    assert_true(!seen.wrong && seen.records == all && !*s->said);
    journal_close(journal);
}

static inline struct journal *open_damaged(struct scratch *s, const char *bytes, size_t size,
                                           struct seen *seen)
{
    unlink(PATH); /* some file systems flush what replaces the bytes of a file */
    write_bytes(PATH, bytes, size);
    struct journal *journal = open_as(s, PICTURE, seen);
    assert_non_null(journal);
    return journal;
}

#endif
