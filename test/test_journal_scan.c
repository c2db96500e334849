/* Damaged journals: all records that are whole and in their place are found, and nothing else. */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "common/clock.h"
#include "master/journal_scan.h"
#include "test/journal_fixture.h"
#include "test/unit.h"

/* Syncs would take most of the time; test_journal.c tests when there is one. */
int fdatasync(int file)
{
    (void)file;
    return 0;
}

int fsync(int file)
{
    (void)file;
    return 0;
}

/* A torn record is cut off as soon as the journal is opened, so that it is gone even if that run is killed. */
static void check_cut(struct scratch *s, size_t size)
{
    struct seen seen;
    struct stat status;
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_non_null(journal);
    assert_int_equal(stat(PATH, &status), 0);
    assert_int_equal(status.st_size, size);
    journal_remove(journal);
}

/* Cut anywhere, the whole records before the cut are used. */
static void test_torn_at_every_byte(void **state)
{
    struct scratch *s = *state;
    enum { RECORDS = 4, SIZE = HEADER + RECORDS * RECORD };
    char bytes[SIZE + 1];
    write_journal(s, RECORDS);
    assert_int_equal(read_file(PATH, bytes, sizeof bytes), SIZE);
    for (size_t length = 0; length <= SIZE; length++) {
        unlink(PATH);
        write_bytes(PATH, bytes, length);
        size_t records = length < HEADER ? 0 : (length - HEADER) / RECORD;
        size_t damaged = length < HEADER ? 0 : (length - HEADER) % RECORD;
        check_cut(s, HEADER + records * RECORD);
        write_bytes(PATH, bytes, length);
        check_resume(s, (uint32_t)records, damaged, RECORDS);
    }
    assert_int_equal(access(PATH ".1", F_OK), -1);
}

/* With any bit flipped, all records are used but the one that has it. A warning says once how much is damaged, and the
 * record may be appended again. */
static void test_every_bit_turned(void **state)
{
    struct scratch *s = *state;
    enum { RECORDS = 3, SIZE = HEADER + RECORDS * RECORD };
    char bytes[SIZE];
    struct seen seen;
    write_journal(s, RECORDS);
    assert_int_equal(read_file(PATH, bytes, sizeof bytes), SIZE);
    for (size_t bit = 0; bit < 8 * SIZE; bit++) {
        bytes[bit / 8] = (char)(bytes[bit / 8] ^ 1 << bit % 8);
        struct journal *journal = open_damaged(s, bytes, SIZE, &seen);
        bytes[bit / 8] = (char)(bytes[bit / 8] ^ 1 << bit % 8);
        uint32_t hit = bit / 8 >= HEADER;
        assert_true(!seen.wrong && seen.records == RECORDS - hit);
        assert_true(journal_found(journal).damaged_bytes == hit * RECORD);
        assert_string_equal(s->said, hit ? PATH ": warning: 104 bytes of the journal are damaged, "
                                                "what they held is rendered again\n"
                                         : PATH ": warning: the first bytes of the journal are "
                                                "damaged, what stands behind them is used\n");
        append(journal, 3);
        journal_close(journal);
        journal = open_as(s, PICTURE, &seen);
        assert_true(!seen.wrong && seen.records == RECORDS - hit + 1 && !*s->said);
        journal_close(journal);
    }
    assert_int_equal(access(PATH ".1", F_OK), -1);
}

/* Any stretch of bytes overwritten: all records are used that it does not touch. */
static void test_stretches(void **state)
{
    struct scratch *s = *state;
    enum { RECORDS = 6, SIZE = HEADER + RECORDS * RECORD };
    char bytes[SIZE], damaged[SIZE];
    struct seen seen;
    write_journal(s, RECORDS);
    assert_int_equal(read_file(PATH, bytes, sizeof bytes), SIZE);
    for (size_t begin = HEADER; begin < SIZE; begin += 31) {
        for (size_t end = begin + 1; end <= SIZE; end += 47) {
            memcpy(damaged, bytes, SIZE);
            memset(damaged + begin, 0xa5, end - begin);
            size_t hit = (end - 1 - HEADER) / RECORD - (begin - HEADER) / RECORD + 1;
            struct journal *journal = open_damaged(s, damaged, SIZE, &seen);
            assert_true(!seen.wrong && seen.records == RECORDS - hit);
            assert_true(journal_found(journal).damaged_bytes == hit * RECORD);
            append(journal, RECORDS);
            journal_close(journal);
            journal = open_as(s, PICTURE, &seen);
            assert_true(!seen.wrong && seen.records == RECORDS - hit + 1 && !*s->said);
            journal_close(journal);
        }
    }
}

/* A block of a disk that cannot be read, which the program's pread() meets here. */
#define BLOCK 4096
static off_t unreadable = -BLOCK;

/* The most bytes of a read: each is interrupted first, and done only in part; 0: the file has become shorter. */
static size_t read_most = SIZE_MAX;

ssize_t pread(int file, void *bytes, size_t count, off_t offset)
{
    static bool interrupted;
    interrupted = read_most > 0 && read_most < SIZE_MAX && !interrupted;
    if (interrupted) errno = EINTR;
    if (interrupted) return -1;
    if (count > read_most) count = read_most;
    off_t end = offset + (off_t)count;
    if (offset < unreadable + BLOCK && end > unreadable) {
        if (offset >= unreadable) {
            errno = EIO;
            return -1;
        }
        count = (size_t)(unreadable - offset);
    }
    return syscall(SYS_pread64, file, bytes, count, offset);
}

static void check_unreadable(struct scratch *s, off_t at)
{
    enum { RECORDS = 500 };
    const uint32_t first = (uint32_t)(at - HEADER) / RECORD;
    const uint32_t last = (uint32_t)(at + BLOCK - 1 - HEADER) / RECORD;
    struct seen seen;
    write_journal(s, RECORDS);
    unreadable = at;
    struct journal *journal = open_as(s, PICTURE, &seen);
    unreadable = -BLOCK;
    assert_true(!seen.wrong && seen.records == RECORDS - (last - first + 1));
    assert_true(journal_found(journal).damaged_bytes == (last - first + 1) * RECORD);
    journal_close(journal);
}

/* An unreadable block costs the records in it, and no others. */
static void test_unreadable_block(void **state)
{
    check_unreadable(*state, 2 * BLOCK);
    check_unreadable(*state, 10 * BLOCK); /* a record begins at its end */
}

static void check_unread(struct scratch *s)
{
    struct seen seen;
    errno = 0;
    assert_null(open_as(s, PICTURE, &seen));
    assert_string_equal(s->said, PATH ": the journal cannot be read: Input/output error, choose "
                                      "another place with output.journal=FILE\n");
}

/* A journal whose first bytes cannot be read stays as it is. */
static void test_unread(void **state)
{
    struct scratch *s = *state;
    write_journal(s, 2);
    unreadable = 0;
    check_unread(s);
    unreadable = -BLOCK;
    read_most = 0;
    check_unread(s);
    read_most = SIZE_MAX;
    check_resume(s, 2, 0, 3);
}

/* Reads that are interrupted, or done only in part, are continued. */
static void test_interrupted_reads(void **state)
{
    struct scratch *s = *state;
    write_journal(s, 4);
    read_most = 7;
    check_resume(s, 4, 0, 5);
    read_most = SIZE_MAX;
}

/* What stands behind a known gap may be damaged, too. */
static void test_damage_at_gaps(void **state)
{
    struct scratch *s = *state;
    enum { RECORDS = 5, SIZE = HEADER + RECORDS * RECORD };
    char bytes[SIZE];
    struct seen seen;
    write_journal(s, RECORDS);
    static const uint32_t order[] = {2, 1, 3, 4, 0};
    for (uint32_t i = 0; i < RECORDS; i++) {
        size_t size = read_file(PATH, bytes, SIZE);
        bytes[HEADER + order[i] * RECORD + RECORD - 1] ^= 1;
        struct journal *journal = open_damaged(s, bytes, size, &seen);
        assert_true(!seen.wrong && seen.records == RECORDS - 1 - i);
        assert_false(journal_was_empty(journal));
        assert_non_null(strstr(s->said, "damaged"));
        journal_close(journal);
    }
    struct stat status;
    assert_int_equal(stat(PATH, &status), 0);
    assert_int_equal(status.st_size, HEADER);
}

/* A damaged record without a payload is a gap that is just large enough to be known. */
static void test_smallest_gap(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    const struct journal_record empty = {.tile = {.w = 1, .h = 1, .step = 1}, .payload = ""};
    write_journal(s, 1);
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_true(journal_append(journal, &empty) && append(journal, 1));
    journal_close(journal);
    FILE *file = fopen(PATH, "r+b");
    assert_true(file && fseek(file, HEADER + RECORD, SEEK_SET) == 0 && fputc('x', file) != EOF);
    fclose(file);
    check_resume(s, 2, 64, 3);
}

/* A record without a payload, whose 64 bytes are all that follows an unreadable block, is found. */
static void test_last_without_payload(void **state)
{
    struct scratch *s = *state;
    enum { RECORDS = (11 * BLOCK - HEADER) / RECORD };
    struct seen seen;
    const struct journal_record empty = {.tile = {.w = 1, .h = 1, .step = 1}, .payload = ""};
    _Static_assert(HEADER + RECORDS * RECORD == 11 * BLOCK, "the next one begins a block");
    write_journal(s, RECORDS);
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_true(journal_append(journal, &empty));
    journal_close(journal);
    unreadable = 10 * BLOCK;
    journal = open_as(s, PICTURE, &seen);
    unreadable = -BLOCK;
    assert_int_equal(journal_found(journal).records, (10 * BLOCK - HEADER) / RECORD + 1);
    journal_remove(journal);
}

/* A gap whose length would lead back to its beginning, or just behind the end, in files that were made so. */
static void test_impossible_gaps(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    const uint64_t lengths[] = {UINT64_MAX - 63, PAYLOAD + 1};
    char bytes[HEADER + RECORD];
    for (int i = 0; i < 2; i++) {
        struct record_header gap = {.magic = GAP_MAGIC, .bytes = lengths[i]};
        write_journal(s, 1);
        assert_int_equal(read_file(PATH, bytes, sizeof bytes), sizeof bytes);
        gap.checksum = record_checksum(PICTURE, HEADER, &gap, NULL);
        memcpy(bytes + HEADER, &gap, sizeof gap);
        struct journal *journal = open_damaged(s, bytes, sizeof bytes, &seen);
        assert_int_equal(journal_found(journal).damaged_bytes, RECORD);
        journal_remove(journal);
    }
}

/* The file is searched in windows of this many bytes, of which the first begins at the second byte of the first record
 * that is damaged. */
#define WINDOW_END (HEADER + 1 + 65536)

/* A record that begins near the end of the first window is found: of three short ones and many others, all before that
 * are damaged. */
static void test_across_windows(void **state)
{
    struct scratch *s = *state;
    enum { RECORDS = 640, SIZE = HEADER + RECORDS * RECORD };
    static char bytes[SIZE];
    /* The record of interest begins 33 bytes before the end and, at last, 9 behind it. */
    for (size_t more = 0; more <= 42; more++) {
        struct seen seen;
        unlink(PATH);
        struct journal *journal = open_as(s, PICTURE, &seen);
        for (uint32_t i = 0; i < RECORDS; i++) {
            unsigned char payload[PAYLOAD];
            struct journal_record record = make_record(i, payload);
            if (i < 3) record.bytes = (more + i) / 3;
            assert_true(journal_append(journal, &record));
        }
        journal_close(journal);
        size_t size = read_file(PATH, bytes, SIZE), at = HEADER;
        uint32_t damaged = 0;
        for (; at <= WINDOW_END - 64; damaged++) {
            bytes[at + 63] ^= 1;
            at += damaged < 3 ? 64 + (more + damaged) / 3 : RECORD;
        }
        journal = open_damaged(s, bytes, size, &seen);
        assert_true(!seen.wrong && seen.records == RECORDS - damaged);
        journal_remove(journal);
    }
}

/* Bytes that are too few to be marked as a gap are told of each time, and do not hide what stands behind them. */
static void test_bytes_between_records(void **state)
{
    struct scratch *s = *state;
    enum { MORE = 63, AT = HEADER + RECORD + MORE, SIZE = AT + RECORD };
    char bytes[SIZE];
    struct seen seen;
    struct record_header header;
    write_journal(s, 2);
    assert_int_equal(read_file(PATH, bytes, SIZE), HEADER + 2 * RECORD);
    memmove(bytes + AT, bytes + HEADER + RECORD, RECORD);
    memset(bytes + HEADER + RECORD, 'x', MORE);
    memcpy(&header, bytes + AT, sizeof header);
    header.checksum = record_checksum(PICTURE, AT, &header, bytes + AT + sizeof header);
    memcpy(bytes + AT, &header, sizeof header);
    journal_close(open_damaged(s, bytes, SIZE, &seen));
    for (int i = 0; i < 2; i++) {
        struct journal *journal = open_as(s, PICTURE, &seen);
        assert_true(!seen.wrong && seen.records == 2);
        assert_int_equal(journal_found(journal).damaged_bytes, MORE);
        journal_close(journal);
    }
}

/* Nor does a gap whose own header is damaged hide the records behind it. */
static void test_damage_in_gaps(void **state)
{
    struct scratch *s = *state;
    enum { RECORDS = 4, SIZE = HEADER + RECORDS * RECORD, GAP = HEADER + RECORD };
    char bytes[SIZE];
    struct seen seen;
    write_journal(s, RECORDS);
    assert_int_equal(read_file(PATH, bytes, SIZE), SIZE);
    bytes[GAP + RECORD - 1] ^= 1;
    journal_close(open_damaged(s, bytes, SIZE, &seen));
    assert_int_equal(read_file(PATH, bytes, SIZE), SIZE);
    for (size_t bit = 0; bit < 8 * sizeof(struct record_header); bit++) {
        bytes[GAP + bit / 8] ^= (char)(1 << bit % 8);
        struct journal *journal = open_damaged(s, bytes, SIZE, &seen);
        assert_true(!seen.wrong && seen.records == RECORDS - 1);
        journal_close(journal);
        bytes[GAP + bit / 8] ^= (char)(1 << bit % 8);
    }
}

/* Good records at a place that is not theirs: doubled, swapped, from another picture's journal. */
static void test_displaced_records(void **state)
{
    struct scratch *s = *state;
    enum { SIZE = HEADER + 3 * RECORD };
    char bytes[SIZE], other[SIZE], displaced[SIZE];
    struct seen seen;
    unlink(PATH);
    struct journal *journal = open_as(s, PICTURE + 1, &seen);
    for (uint32_t i = 0; i < 3; i++)
        append(journal, i);
    journal_close(journal);
    assert_int_equal(read_file(PATH, other, SIZE), SIZE);
    write_journal(s, 3);
    assert_int_equal(read_file(PATH, bytes, SIZE), SIZE);
    const char *from[] = {bytes + HEADER + 2 * RECORD, other + HEADER + RECORD};
    for (size_t i = 0; i < sizeof from / sizeof *from; i++) {
        memcpy(displaced, bytes, SIZE);
        memcpy(displaced + HEADER + RECORD, from[i], RECORD);
        journal = open_damaged(s, displaced, SIZE, &seen);
        assert_true(!seen.wrong && seen.records == 2 && seen.next == 3);
        assert_true(journal_found(journal).damaged_bytes == RECORD);
        journal_close(journal);
    }
}

/* Writes three records. The payload of the middle one has so many false beginnings of records, so many bytes apart,
 * each of which claims a quarter of that payload. Then damages the middle record; returns how many records are read. */
static uint32_t count_around(struct scratch *s, size_t beginnings, size_t distance)
{
    enum { BYTES = 1 << 24 };
    unlink(PATH);
    char *payload = calloc(BYTES, 1);
    assert_non_null(payload);
    for (size_t at = 0; beginnings-- > 0 && at + 64 <= BYTES; at += distance) {
        memcpy(payload + at + 8, "TILE", 4);
        if (distance >= 64) payload[at + 56 + 2] = BYTES >> 18;
    }
    struct seen seen;
    struct journal *journal = open_as(s, PICTURE, &seen);
    struct journal_record record = {
        .tile = {.w = 1, .h = 1, .step = 1, .pass = 1}, .payload = payload, .bytes = BYTES};
    assert_true(append(journal, 0) && journal_append(journal, &record) && append(journal, 1));
    journal_close(journal);
    free(payload);
    FILE *file = fopen(PATH, "r+b");
    assert_true(file && fseek(file, HEADER + RECORD, SEEK_SET) == 0 && fputc('x', file) != EOF);
    fclose(file);
    seen = (struct seen){.accepted = UINT32_MAX};
    struct journal_reader reader = {take, &seen, BYTES, 0};
    message_capture(s->said, sizeof s->said);
    journal = journal_open(PATH, PICTURE, &reader);
    message_capture(NULL, 0);
    assert_true(!seen.wrong && strstr(s->said, "damaged"));
    journal_remove(journal);
    return seen.records;
}

/* What looks like the beginning of a record does not hide a good record, unless there is so much of it that to check
 * all would take too long. */
static void test_many_beginnings(void **state)
{
    double start = clock_thread_cpu();
    assert_int_equal(count_around(*state, 4, 4096), 2);
    assert_int_equal(count_around(*state, SIZE_MAX, 1 << 20), 2);
    assert_int_equal(count_around(*state, SIZE_MAX, 64), 1);
    count_around(*state, SIZE_MAX, 4);
    assert_true(clock_thread_cpu() - start < 10);
}

static struct journal *open_by(struct scratch *s, const struct journal_reader *reader)
{
    message_capture(s->said, sizeof s->said);
    struct journal *journal = journal_open(PATH, PICTURE, reader);
    message_capture(NULL, 0);
    assert_non_null(journal);
    return journal;
}

/* A record that the reader refuses, or that is larger than it allows, ends the journal. */
static void test_unusable_records(void **state)
{
    struct scratch *s = *state;
    struct seen seen = {.accepted = 2};
    struct journal_reader reader = {take, &seen, PAYLOAD, 0};
    write_journal(s, 4);
    struct journal *journal = open_by(s, &reader);
    assert_true(journal_found(journal).records == 2);
    assert_int_equal(journal_found(journal).refused_bytes, 2 * RECORD);
    assert_string_equal(s->said, PATH ": warning: 208 bytes of the journal cannot be used, what "
                                      "they hold is rendered again\n");
    journal_close(journal);
    check_resume(s, 2, 0, 4);
    reader.largest = PAYLOAD - 1;
    seen.accepted = UINT32_MAX;
    journal = open_by(s, &reader);
    assert_true(journal_found(journal).records == 0);
    assert_int_equal(journal_found(journal).damaged_bytes, 4 * RECORD);
    journal_remove(journal);
}

/* Records that are of no use may be all that there is, or depend on one that is damaged. */
static void test_refused_alone(void **state)
{
    struct scratch *s = *state;
    enum { SIZE = HEADER + 3 * RECORD };
    char bytes[SIZE];
    struct seen seen = {.accepted = 0};
    struct journal_reader reader = {take, &seen, PAYLOAD, 0};
    write_journal(s, 3);
    assert_int_equal(read_file(PATH, bytes, SIZE), SIZE);
    struct journal *journal = open_by(s, &reader);
    assert_true(journal_found(journal).records == 0 && !journal_was_empty(journal));
    journal_close(journal);
    bytes[HEADER] ^= 1;
    write_bytes(PATH, bytes, SIZE);
    journal = open_by(s, &reader);
    assert_string_equal(s->said,
                        PATH ": warning: 104 bytes of the journal are damaged, what they held is "
                             "rendered again\n" PATH ": warning: 208 bytes of the journal cannot "
                             "be used without those, what they hold is rendered again\n");
    journal_remove(journal);
}

/* A record whose seconds are below 0 or not finite counts as damaged. */
static void test_impossible_seconds(void **state)
{
    struct scratch *s = *state;
    const double seconds[] = {-1, HUGE_VAL, (double)NAN};
    for (int i = 0; i < 3; i++) {
        unsigned char payload[PAYLOAD];
        struct seen seen;
        write_journal(s, 1);
        struct journal *journal = open_as(s, PICTURE, &seen);
        struct journal_record record = make_record(1, payload);
        record.seconds = seconds[i];
        assert_true(journal_append(journal, &record));
        journal_close(journal);
        check_resume(s, 1, RECORD, 2);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_torn_at_every_byte), cmocka_unit_test(test_every_bit_turned),
        cmocka_unit_test(test_stretches),          cmocka_unit_test(test_unreadable_block),
        cmocka_unit_test(test_damage_at_gaps),     cmocka_unit_test(test_damage_in_gaps),
        cmocka_unit_test(test_displaced_records),  cmocka_unit_test(test_many_beginnings),
        cmocka_unit_test(test_unusable_records),   cmocka_unit_test(test_refused_alone),
        cmocka_unit_test(test_smallest_gap),       cmocka_unit_test(test_bytes_between_records),
        cmocka_unit_test(test_interrupted_reads),  cmocka_unit_test(test_unread),
        cmocka_unit_test(test_impossible_gaps),    cmocka_unit_test(test_last_without_payload),
        cmocka_unit_test(test_across_windows),     cmocka_unit_test(test_impossible_seconds),
        cmocka_unit_test(test_no_file_stays_open),
    };
    return cmocka_run_group_tests(tests, journal_tests_open, scratch_close);
}
