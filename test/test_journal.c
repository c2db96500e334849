/* The journal: what was appended comes back, whatever happens to the file, and nothing else does. */
#include "test/scratch.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include "common/clock.h"
#include "master/journal.h"

#define PICTURE UINT64_C(0x123456789abcdef0)
#define PATH    "a.journal"
#define MOVED   "b.journal"
#define PAYLOAD 40 /* bytes, of most records here */
#define HEADER  24 /* of the file, bytes */
#define RECORD  (64 + PAYLOAD)

/* How often a file was brought to the disk. */
static unsigned syncs;

int __real_fdatasync(int file);
int __wrap_fdatasync(int file);
int __wrap_fdatasync(int file)
{
    syncs++;
    return __real_fdatasync(file);
}

/* The i-th of all records, made anew where it is needed. */
static struct journal_record make_record(uint32_t i, unsigned char payload[PAYLOAD])
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

static bool take(void *state, const struct journal_record *record)
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

static struct journal *open_as(struct scratch *s, uint64_t picture, struct seen *seen)
{
    *seen = (struct seen){.accepted = UINT32_MAX};
    struct journal_reader reader = {take, seen, PAYLOAD};
    message_capture(s->said, sizeof s->said);
    struct journal *journal = journal_open(PATH, picture, &reader);
    message_capture(NULL, 0);
    return journal;
}

static bool append(struct journal *journal, uint32_t i)
{
    unsigned char payload[PAYLOAD];
    struct journal_record record = make_record(i, payload);
    return journal_append(journal, &record);
}

/* A closed journal of so many records at PATH. */
static void write_journal(struct scratch *s, uint32_t records)
{
    struct seen seen;
    unlink(PATH);
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_non_null(journal);
    for (uint32_t i = 0; i < records; i++)
        assert_true(append(journal, i));
    journal_keep(journal);
}

static size_t read_file(const char *path, char *bytes, size_t size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t count = fread(bytes, 1, size, file);
    fclose(file);
    return count;
}

/* The journal at PATH holds so many records and is damaged behind them by so many bytes; after the
 * rest is appended, all are there. */
static void check_resume(struct scratch *s, uint32_t records, size_t damaged, uint32_t all)
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
    journal_keep(journal);
    journal = open_as(s, PICTURE, &seen);
    assert_true(!seen.wrong && seen.records == all && !*s->said);
    journal_keep(journal);
}

static void test_round_trip(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 7);
    assert_string_equal(s->said, "");
    check_resume(s, 7, 0, 12);
    struct journal *journal = open_as(s, PICTURE, &seen);
    journal_remove(journal);
    assert_int_equal(access(PATH, F_OK), -1);
}

static void test_empty_payload(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 0);
    struct journal *journal = open_as(s, PICTURE, &seen);
    struct journal_record record = {.tile = {.w = 1, .h = 1, .step = 1}, .payload = ""};
    assert_true(journal_append(journal, &record));
    journal_keep(journal);
    journal = open_as(s, PICTURE, &seen);
    assert_true(journal_found(journal).records == 1 && seen.wrong);
    journal_remove(journal);
}

/* What is torn goes when the journal is opened: a run that is killed leaves none of it. */
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
        scratch_write_bytes(PATH, bytes, length);
        size_t records = length < HEADER ? 0 : (length - HEADER) / RECORD;
        size_t damaged = length < HEADER ? 0 : (length - HEADER) % RECORD;
        if (length % 19 == 0) check_cut(s, HEADER + records * RECORD);
        if (length % 19 == 0) scratch_write_bytes(PATH, bytes, length);
        check_resume(s, (uint32_t)records, damaged, RECORDS);
    }
    assert_int_equal(access(PATH ".1", F_OK), -1);
}

static struct journal *open_damaged(struct scratch *s, const char *bytes, size_t size,
                                    struct seen *seen)
{
    scratch_write_bytes(PATH, bytes, size);
    struct journal *journal = open_as(s, PICTURE, seen);
    assert_non_null(journal);
    return journal;
}

/* With any bit turned, all records but that one are used, it is told what is damaged, once, and the
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
        if (bit % 19 == 0) append(journal, 3); /* synced at the end, which takes its time */
        journal_keep(journal);
        journal = open_as(s, PICTURE, &seen);
        assert_true(!seen.wrong && seen.records == RECORDS - hit + (bit % 19 == 0) && !*s->said);
        journal_keep(journal);
    }
    assert_int_equal(access(PATH ".1", F_OK), -1);
}

/* A journal that cannot be told from none is kept for its owner. */
static void test_nothing_whole(void **state)
{
    struct scratch *s = *state;
    enum { SIZE = HEADER + RECORD };
    char bytes[SIZE];
    struct seen seen;
    write_journal(s, 1);
    assert_int_equal(read_file(PATH, bytes, sizeof bytes), SIZE);
    bytes[3] ^= 1;
    bytes[SIZE - 1] ^= 1;
    struct journal *journal = open_damaged(s, bytes, SIZE, &seen);
    assert_int_equal(seen.records, 0);
    assert_string_equal(s->said, PATH ": warning: this is no journal, or its first bytes are "
                                      "damaged, it is now called " PATH ".1\n");
    journal_remove(journal);
    assert_int_equal(unlink(PATH ".1"), 0);
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
            journal_keep(journal);
            journal = open_as(s, PICTURE, &seen);
            assert_true(!seen.wrong && seen.records == RECORDS - hit + 1 && !*s->said);
            journal_keep(journal);
        }
    }
}

/* A block of a disk that cannot be read, which the program's pread() meets here. */
#define BLOCK 4096
static off_t unreadable = -BLOCK;

ssize_t pread(int file, void *bytes, size_t count, off_t offset)
{
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

/* It costs the records in it. */
static void test_unreadable_block(void **state)
{
    struct scratch *s = *state;
    enum { RECORDS = 400 };
    const uint32_t first = (2 * BLOCK - HEADER) / RECORD, last = (3 * BLOCK - 1 - HEADER) / RECORD;
    struct seen seen;
    write_journal(s, RECORDS);
    unreadable = 2 * BLOCK;
    struct journal *journal = open_as(s, PICTURE, &seen);
    unreadable = -BLOCK;
    assert_true(!seen.wrong && seen.records == RECORDS - (last - first + 1));
    assert_true(journal_found(journal).damaged_bytes == (last - first + 1) * RECORD);
    journal_keep(journal);
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
        assert_non_null(strstr(s->said, "damaged"));
        journal_keep(journal);
    }
    struct stat status;
    assert_int_equal(stat(PATH, &status), 0);
    assert_int_equal(status.st_size, HEADER);
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
    journal_keep(journal);
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
        journal_keep(journal);
    }
}

/* A journal of three records, the middle one full of what looks like so many beginnings of records with
 * a quarter of its payload, each so many bytes behind the other; then that one is damaged. Returns how many
 * records are taken. */
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
    journal_keep(journal);
    free(payload);
    FILE *file = fopen(PATH, "r+b");
    assert_true(file && fseek(file, HEADER + RECORD, SEEK_SET) == 0 && fputc('x', file) != EOF);
    fclose(file);
    seen = (struct seen){.accepted = UINT32_MAX};
    struct journal_reader reader = {take, &seen, BYTES};
    message_capture(s->said, sizeof s->said);
    journal = journal_open(PATH, PICTURE, &reader);
    message_capture(NULL, 0);
    assert_true(!seen.wrong && strstr(s->said, "damaged"));
    journal_remove(journal);
    return seen.records;
}

/* What looks like a record and is none does not hide a good one, but neither may it take long. */
static void test_many_beginnings(void **state)
{
    double start = clock_thread_cpu();
    assert_int_equal(count_around(*state, 4, 4096), 2);
    assert_int_equal(count_around(*state, SIZE_MAX, 1 << 20), 2);
    assert_int_equal(count_around(*state, SIZE_MAX, 64), 1);
    count_around(*state, SIZE_MAX, 4);
    assert_true(clock_thread_cpu() - start < 10);
}

static void test_other_pictures(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 3);
    struct journal *journal = open_as(s, PICTURE + 1, &seen);
    assert_true(journal && seen.records == 0);
    assert_string_equal(s->said, PATH ": warning: the journal holds another picture or other "
                                      "settings, it is now called " PATH ".1\n");
    append(journal, 0);
    journal_keep(journal);
    journal = open_as(s, PICTURE + 2, &seen);
    assert_true(journal && seen.records == 0 && strstr(s->said, PATH ".2"));
    journal_keep(journal);
    scratch_write(PATH, "[sphere]\nsomething else, of more bytes than a header\n");
    journal = open_as(s, PICTURE + 2, &seen);
    assert_non_null(journal);
    assert_string_equal(s->said, PATH ": warning: this is no journal, or its first bytes are "
                                      "damaged, it is now called " PATH ".3\n");
    journal_remove(journal);
    assert_int_equal(unlink(PATH ".1") + unlink(PATH ".2") + unlink(PATH ".3"), 0);
}

/* What was set aside comes back for its own picture, whether another one's stands there now or none. */
static void test_back_again(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    for (uint64_t i = 0; i < 3; i++) {
        struct journal *journal = open_as(s, PICTURE + i, &seen);
        for (uint32_t k = 0; k <= i; k++)
            append(journal, k);
        journal_keep(journal);
    }
    struct journal *journal = open_as(s, PICTURE + 1, &seen);
    assert_int_equal(seen.records, 2);
    assert_string_equal(s->said, PATH ": warning: the journal holds another picture or other "
                                      "settings, it is now called " PATH ".3\nfarm: " PATH
                                      ".2 is this picture's, it is called " PATH " again\n");
    journal_remove(journal);
    journal = open_as(s, PICTURE, &seen);
    assert_int_equal(seen.records, 1);
    journal_keep(journal);
    assert_int_equal(access(PATH ".1", F_OK), -1);
    check_resume(s, 1, 0, 2);
    journal = open_as(s, PICTURE + 2, &seen);
    assert_int_equal(seen.records, 3);
    journal_remove(journal);
    assert_int_equal(access(PATH ".2", F_OK) + access(PATH ".3", F_OK), -2);
    assert_int_equal(unlink(PATH ".1"), 0);
}

/* Of several the longest, also in the place of a header alone. */
static void test_longest_back_again(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    static const char *const apart[] = {"first", "second", "third"};
    static const char *const names[] = {PATH ".1", PATH ".12", PATH ".7"};
    for (uint32_t longest = 0; longest < 3; longest++) { /* a folder may name it first or last */
        for (uint32_t i = 0; i < 3; i++) {
            write_journal(s, i == longest ? 5 : 2);
            assert_int_equal(rename(PATH, apart[i]), 0);
        }
        write_journal(s, 0);
        for (uint32_t i = 0; i < 3; i++)
            assert_int_equal(rename(apart[i], names[i]), 0);
        struct journal *journal = open_as(s, PICTURE, &seen);
        assert_int_equal(seen.records, 5);
        journal_remove(journal);
        for (uint32_t i = 0; i < 3; i++)
            assert_int_equal(unlink(names[i]), i == longest ? -1 : 0);
    }
}

/* Neither what another run has open nor what only begins like it. */
static void test_not_back_again(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 0);
    assert_int_equal(rename(PATH, PATH ".2"), 0);
    write_journal(s, 2);
    assert_int_equal(link(PATH, PATH ".x") + link(PATH, "b" PATH ".1") + rename(PATH, PATH ".1"),
                     0);
    struct journal_reader reader = {take, &seen, PAYLOAD};
    struct journal *other = journal_open(PATH ".1", PICTURE, &reader);
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_true(journal && seen.records == 0 && !*s->said && journal_was_empty(journal));
    journal_keep(other);
    journal_remove(journal);
    assert_int_equal(unlink(PATH ".1") + unlink(PATH ".2"), 0);
    assert_int_equal(unlink(PATH ".x") + unlink("b" PATH ".1"), 0);
}

/* Another picture's journal without any tile holds nothing that could be lost. */
static void test_other_picture_without_tiles(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 0);
    struct journal *journal = open_as(s, PICTURE + 1, &seen);
    assert_true(journal && seen.records == 0 && !*s->said && journal_was_empty(journal));
    append(journal, 0);
    journal_keep(journal);
    assert_int_equal(access(PATH ".1", F_OK), -1);
    journal = open_as(s, PICTURE + 1, &seen);
    assert_true(seen.records == 1 && !*s->said && !journal_was_empty(journal));
    journal_remove(journal);
}

/* What the caller cannot use, and what is larger than it may be, ends the journal. */
static void test_unusable_records(void **state)
{
    struct scratch *s = *state;
    struct seen seen = {.accepted = 2};
    struct journal_reader reader = {take, &seen, PAYLOAD};
    write_journal(s, 4);
    message_capture(s->said, sizeof s->said);
    struct journal *journal = journal_open(PATH, PICTURE, &reader);
    message_capture(NULL, 0);
    assert_true(journal_found(journal).records == 2);
    journal_keep(journal);
    check_resume(s, 2, 0, 4);
    reader.largest = PAYLOAD - 1;
    message_capture(s->said, sizeof s->said);
    journal = journal_open(PATH, PICTURE, &reader);
    message_capture(NULL, 0);
    assert_true(journal_found(journal).records == 0);
    journal_remove(journal);
}

/* Nothing takes less than no time, or no time that is a number. */
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
        journal_keep(journal);
        check_resume(s, 1, RECORD, 2);
    }
}

static void test_one_run_at_a_time(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 2);
    struct journal *first = open_as(s, PICTURE, &seen);
    assert_null(open_as(s, PICTURE, &seen));
    assert_string_equal(s->said, PATH ": another run is at work on this journal, wait for its end "
                                      "or choose another place with output.journal=FILE\n");
    /* Another picture's run does not take it away either. */
    assert_null(open_as(s, PICTURE + 1, &seen));
    assert_true(append(first, 2));
    journal_keep(first);
    check_resume(s, 3, 0, 3);
}

/* A process that is killed while it writes. */
static void test_killed(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    for (int run = 0; run < 20; run++) {
        unlink(PATH);
        pid_t child = fork();
        if (child == 0) {
            struct journal *journal = open_as(s, PICTURE, &seen);
            for (uint32_t i = 0;; i++)
                append(journal, i);
        }
        usleep(500 * (useconds_t)run);
        kill(child, SIGKILL);
        waitpid(child, NULL, 0);
        struct journal *journal = open_as(s, PICTURE, &seen);
        assert_true(journal && !seen.wrong);
        journal_remove(journal);
    }
}

static struct rlimit limit_file_size(rlim_t bytes)
{
    struct rlimit old, limit;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &old), 0);
    limit = (struct rlimit){bytes, old.rlim_max};
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    return old;
}

/* The disk is full, at every byte of a record: the journal is as it was, and goes on when there is
 * room again. */
static void test_full_disk(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    signal(SIGXFSZ, SIG_IGN);
    for (rlim_t room = 0; room < RECORD; room++) {
        write_journal(s, 2);
        struct journal *journal = open_as(s, PICTURE, &seen);
        message_capture(s->said, sizeof s->said);
        struct rlimit old = limit_file_size(HEADER + 2 * RECORD + room);
        bool first = append(journal, 2), second = append(journal, 2);
        setrlimit(RLIMIT_FSIZE, &old);
        message_capture(NULL, 0);
        assert_false(first || second);
        assert_string_equal(s->said,
                            PATH ": warning: the journal cannot be written (File too large): "
                                 "rendering goes on, but what is finished from now on is not saved "
                                 "until there is room\n");
        struct stat status;
        assert_int_equal(stat(PATH, &status), 0);
        assert_int_equal(status.st_size, HEADER + 2 * RECORD);
        assert_true(append(journal, 2));
        journal_keep(journal);
        check_resume(s, 3, 0, 4);
    }
    struct rlimit old = limit_file_size(HEADER - 1);
    unlink(PATH);
    struct journal *journal = open_as(s, PICTURE, &seen);
    setrlimit(RLIMIT_FSIZE, &old);
    assert_null(journal);
    assert_string_equal(s->said, PATH ": the journal cannot be written: File too large, choose "
                                      "another place with output.journal=FILE\n");
    unlink(PATH);
}

/* What has lost its place, or is full, goes on elsewhere with all that it holds; never over another file. */
static void test_moved(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    struct journal_reader reader = {take, &seen, PAYLOAD};
    write_journal(s, 2);
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_true(journal_stands(journal));
    unlink(PATH);
    assert_false(journal_stands(journal));
    scratch_write(PATH, "of somebody else");
    assert_false(journal_stands(journal));
    assert_false(journal_move(journal, PATH, 0));
    assert_string_equal(journal_path(journal), PATH);
    signal(SIGXFSZ, SIG_IGN);
    struct rlimit old = limit_file_size(HEADER + 3 * RECORD);
    assert_false(journal_move(journal, MOVED, 2 * RECORD)); /* no copy that does not take all */
    assert_int_equal(access(MOVED, F_OK), -1);
    setrlimit(RLIMIT_FSIZE, &old);
    assert_true(journal_move(journal, MOVED, PAYLOAD));
    assert_string_equal(journal_path(journal), MOVED);
    assert_true(journal_stands(journal) && append(journal, 2));
    message_capture(s->said, sizeof s->said);
    assert_null(journal_open(MOVED, PICTURE, &reader)); /* it is locked */
    message_capture(NULL, 0);
    journal_keep(journal);
    assert_int_equal(unlink(PATH) + rename(MOVED, PATH), 0);
    check_resume(s, 3, 0, 4);
}

/* Room that was set aside and not used is given back. */
static void test_reserved(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    struct stat status;
    write_journal(s, 2);
    struct journal *journal = open_as(s, PICTURE, &seen);
    journal_reserve(journal, 16 << 20);
    assert_true(append(journal, 2));
    journal_keep(journal);
    assert_int_equal(stat(PATH, &status), 0);
    assert_true(status.st_blocks * 512 < 1 << 20);
    check_resume(s, 3, 0, 4);
}

static blkcnt_t blocks_of(const char *path)
{
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    return status.st_blocks;
}

/* What a run had reserved that was killed is free when its journal is opened, or set aside. */
static void test_reserved_by_killed(void **state)
{
    struct scratch *s = *state;
    for (int other = 0; other <= 1; other++) {
        struct seen seen;
        write_journal(s, 2);
        int file = open(PATH, O_WRONLY);
        bool reserves = fallocate(file, FALLOC_FL_KEEP_SIZE, 0, 16 << 20) == 0;
        close(file);
        if (!reserves) return; /* nor could a run on this file system */
        assert_true(blocks_of(PATH) * 512 >= 16 << 20);
        struct journal *journal = open_as(s, PICTURE + (uint64_t)other, &seen);
        assert_true(blocks_of(other ? PATH ".1" : PATH) * 512 < 1 << 20);
        assert_int_equal(seen.records, other ? 0 : 2);
        journal_keep(journal);
    }
    unlink(PATH ".1");
}

/* Where no journal can be, nothing is touched. */
static void test_no_place(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    struct journal_reader reader = {take, &seen, PAYLOAD};
    static const char line[] =
        PATH ": is no regular file, choose another place for the journal with "
             "output.journal=FILE\n";
    unlink(PATH);
    assert_int_equal(mkdir(PATH, 0700), 0);
    assert_null(open_as(s, PICTURE, &seen));
    assert_string_equal(s->said, line);
    assert_int_equal(rmdir(PATH) + mkfifo(PATH, 0600), 0);
    assert_null(open_as(s, PICTURE, &seen));
    assert_string_equal(s->said, line);
    scratch_write("precious", "text");
    assert_int_equal(unlink(PATH) + symlink("precious", PATH), 0);
    assert_null(open_as(s, PICTURE, &seen));
    assert_string_equal(s->said, line);
    unlink(PATH);
    message_capture(s->said, sizeof s->said);
    assert_null(journal_open("none/a.journal", PICTURE, &reader));
    message_capture(NULL, 0);
    assert_string_equal(s->said, "none/a.journal: the journal cannot be opened: No such file or "
                                 "directory, choose another place with output.journal=FILE\n");
}

/* Syncing costs at most its share, however slow the disk. */
static void test_sync_pause(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    for (double cost = 1e-6; cost < 1e4; cost *= 3) {
        double pause = journal_sync_pause(cost);
        assert_true(pause >= 5 && cost / (cost + pause) <= JOURNAL_SYNC_SHARE);
    }
    assert_true(journal_sync_pause(0.001) == 5);
    unlink(PATH);
    struct journal *journal = open_as(s, PICTURE, &seen);
    syncs = 0;
    append(journal, 0);
    journal_tick(journal, 0);
    assert_int_equal(syncs, 0);
    journal_tick(journal, HUGE_VAL);
    assert_int_equal(syncs, 1);
    journal_tick(journal, HUGE_VAL); /* nothing has come since */
    assert_int_equal(syncs, 1);
    journal_remove(journal);
}

/* What is left to a later run, or is moved, is on the disk. */
static void test_synced_at_the_end(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    for (int moved = 0; moved <= 1; moved++) {
        write_journal(s, 2);
        struct journal *journal = open_as(s, PICTURE, &seen);
        syncs = 0;
        if (moved)
            assert_true(journal_move(journal, MOVED, 0));
        else
            assert_true(append(journal, 2));
        journal_keep(journal);
        assert_int_equal(syncs, 1);
    }
    assert_int_equal(unlink(MOVED), 0);
}

static void test_picture(void **state)
{
    struct scratch *s = *state;
#define CAMERA "[camera]\neye = 0 0 9\nlook_at = 0 0 0\n"
    static const char *const texts[] = {
        CAMERA "[light]\nposition = 1 2 3\n[sphere a]\ncenter = 0 0 0\nradius = 1\n",
        CAMERA "[light]\nposition = 1 2 3\n[sphere a]\ncenter = 0 0 0\nradius = 2\n",
        CAMERA "[light]\nposition = 1 2 3\ncolor = 1 1 0.5\n"
               "[sphere a]\ncenter = 0 0 0\nradius = 1\n"};
    scratch_write("scene.ini", texts[0]);
    struct scene *scene = scratch_scene(s, "scene.ini", NULL);
    struct scene *same = scratch_scene(s, "scene.ini", "farm.tile=8");
    struct scene *other = scratch_scene(s, "scene.ini", "sampling.samples=2");
    assert_true(journal_picture(scene, 1) == journal_picture(same, 1));
    same->view.processor++;
    same->view.variant++;
    assert_true(journal_picture(scene, 1) == journal_picture(same, 1));
    assert_true(journal_picture(scene, 1) != journal_picture(other, 1));
    assert_true(journal_picture(scene, 1) != journal_picture(scene, 2));
    /* What stands before the objects and lights is the same. */
    for (int i = 1; i < 3; i++) {
        scratch_write("other.ini", texts[i]);
        free(other);
        other = scratch_scene(s, "other.ini", NULL);
        assert_true(memcmp(scene, other, sizeof *scene) == 0 && scene->bytes == other->bytes);
        assert_true(journal_picture(scene, 1) != journal_picture(other, 1));
    }
    free(scene);
    free(same);
    free(other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_empty_payload),
        cmocka_unit_test(test_torn_at_every_byte),
        cmocka_unit_test(test_every_bit_turned),
        cmocka_unit_test(test_nothing_whole),
        cmocka_unit_test(test_stretches),
        cmocka_unit_test(test_unreadable_block),
        cmocka_unit_test(test_damage_at_gaps),
        cmocka_unit_test(test_displaced_records),
        cmocka_unit_test(test_many_beginnings),
        cmocka_unit_test(test_other_pictures),
        cmocka_unit_test(test_back_again),
        cmocka_unit_test(test_longest_back_again),
        cmocka_unit_test(test_not_back_again),
        cmocka_unit_test(test_other_picture_without_tiles),
        cmocka_unit_test(test_unusable_records),
        cmocka_unit_test(test_impossible_seconds),
        cmocka_unit_test(test_one_run_at_a_time),
        cmocka_unit_test(test_killed),
        cmocka_unit_test(test_full_disk),
        cmocka_unit_test(test_moved),
        cmocka_unit_test(test_reserved),
        cmocka_unit_test(test_reserved_by_killed),
        cmocka_unit_test(test_no_place),
        cmocka_unit_test(test_sync_pause),
        cmocka_unit_test(test_synced_at_the_end),
        cmocka_unit_test(test_picture),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
