/*
 * Fuzzes journal files: damages a good one. What is read back must be some of its records in their order. If the
 * damaged records got valid checksums, as a forger would give them, what is read back must be records within their
 * bounds.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/hash.h"
#include "common/message.h"
#include "master/journal.h"
#include "test/fuzz/fuzz.h"

#define PICTURE UINT64_C(0x5eed)
#define RECORDS 4
#define PAYLOAD 24 /* bytes */
#define HEADER  24 /* of the file */
#define RECORD  (64 + PAYLOAD)
#define BYTES   (HEADER + RECORDS * RECORD)

/* The i-th record of the good journal. */
static struct journal_record make_record(uint32_t i, char payload[PAYLOAD])
{
    memset(payload, (int)i + 1, PAYLOAD);
    return (struct journal_record){.tile = {.id = i, .x = i, .w = 2, .h = 1, .step = 1},
                                   .seconds = i,
                                   .payload = payload,
                                   .bytes = PAYLOAD};
}

struct seen {
    uint32_t records;
    uint32_t next; /* the lowest number that the next record may have */
    bool sealed;   /* checksums are valid, so fields may have any value */
};

static bool take(void *state, const struct journal_record *record)
{
    struct seen *seen = state;
    char payload[PAYLOAD], copy[PAYLOAD];
    struct journal_record good = make_record(record->tile.id % RECORDS, payload);
    PROMISE(record->bytes <= PAYLOAD && record->seconds >= 0);
    memcpy(copy, record->payload, record->bytes);
    if (!seen->sealed)
        PROMISE(record->tile.id >= seen->next && record->tile.id < RECORDS &&
                record->bytes == PAYLOAD && memcmp(copy, payload, PAYLOAD) == 0 &&
                memcmp(&record->tile, &good.tile, sizeof good.tile) == 0);
    seen->records++;
    seen->next = good.tile.id + 1;
    return true;
}

static struct journal *open_journal(const char *path, struct seen *seen)
{
    struct journal_reader reader = {take, seen, PAYLOAD, 0};
    return journal_open(path, PICTURE, &reader);
}

static void make_good(char good[BYTES])
{
    struct seen seen = {0};
    char payload[PAYLOAD];
    const char *path = fuzz_new_file("fuzz.journal", "", 0);
    struct journal *journal = open_journal(path, &seen);
    for (uint32_t i = 0; i < RECORDS; i++) {
        struct journal_record record = make_record(i, payload);
        PROMISE(journal_append(journal, &record));
    }
    journal_close(journal);
    FILE *file = fopen(path, "rb");
    PROMISE(file && fread(good, 1, BYTES, file) == BYTES);
    fclose(file);
}

/* Gives each record a valid checksum, for the length that it claims. */
static void seal(char *bytes, size_t count)
{
    for (size_t at = HEADER; at + 64 <= count;) {
        uint64_t length;
        memcpy(&length, bytes + at + 56, sizeof length);
        if (length > count - at - 64) return;
        uint64_t hash = hash64(bytes + at + 8, 56, PICTURE + at);
        hash = hash64(bytes + at + 64, length, hash);
        memcpy(bytes + at, &hash, sizeof hash);
        at += 64 + length;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static char good[BYTES];
    static bool made;
    char bytes[BYTES];
    if (!made) make_good(good);
    made = true;
    struct seen seen = {.sealed = size && data[0] % 2};
    memcpy(bytes, good, BYTES);
    size_t kept = size ? fuzz_damage(data + 1, size - 1, bytes, BYTES) : BYTES;
    if (seen.sealed) seal(bytes, kept);
    const char *path = fuzz_new_file("fuzz.journal", bytes, kept);
    fuzz_listen();
    struct journal *journal = open_journal(path, &seen);
    message_capture(NULL, 0);
    PROMISE(journal && journal_found(journal).records == seen.records);
    journal_remove(journal);
    char *aside = format_text("%s.1", path);
    bool was_renamed = unlink(aside) == 0;
    PROMISE(was_renamed == (strstr(fuzz_said(), "is now called") != NULL));
    free(aside);
    return 0;
}
