/* The journal as a file: what was appended comes back, also after a kill or a full disk, and from another place. */
#include <errno.h>
#include <fcntl.h>
#include <linux/magic.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/syscall.h>
#include <sys/vfs.h>
#include <sys/wait.h>
#include <unistd.h>

#include "common/clock.h"
#include "master/journal_file.h"
#include "test/journal_fixture.h"
#include "test/unit.h"

#define MOVED "b.journal"

/* ---- system calls that this file controls, by defining functions of the C library ---- */

/* How often a file was brought to the disk; the error of that, 0: none. */
static unsigned syncs;
static int sync_error;
static double sync_s; /* how long it takes in place of a real one; 0: a real one */

int __real_fdatasync(int file);
int __wrap_fdatasync(int file);
int __wrap_fdatasync(int file)
{
    syncs++;
    errno = sync_error;
    if (sync_s > 0) clock_sleep(sync_s);
    if (sync_error || sync_s > 0) return sync_error ? -1 : 0;
    return __real_fdatasync(file);
}

/* How often a folder was brought to the disk. */
static unsigned folder_syncs;

int fsync(int file)
{
    struct stat status;
    folder_syncs += fstat(file, &status) == 0 && S_ISDIR(status.st_mode);
    return (int)syscall(SYS_fsync, file);
}

/* The most bytes of a write: each is interrupted first, and done only in part. */
static size_t write_most = SIZE_MAX;

ssize_t pwrite(int file, const void *bytes, size_t count, off_t offset)
{
    static bool interrupted;
    interrupted = write_most > 0 && write_most < SIZE_MAX && !interrupted;
    errno = EINTR;
    if (interrupted) return -1;
    return syscall(SYS_pwrite64, file, bytes, count < write_most ? count : write_most, offset);
}

/* The error of reserving room, 0: none; where it was reserved last. */
static int reserve_error;
static off_t reserved_at;

int fallocate(int file, int mode, off_t offset, off_t bytes)
{
    reserved_at = offset;
    errno = reserve_error;
    return reserve_error ? -1 : (int)syscall(SYS_fallocate, file, mode, offset, bytes);
}

/* The error of locking; 0: none. Called before the next lock, and then forgotten: before_lock. */
static int lock_error;
static void (*before_lock)(void);

int fcntl(int file, int command, ...)
{
    va_list arguments;
    va_start(arguments, command);
    void *argument = va_arg(arguments, void *);
    va_end(arguments);
    void (*before)(void) = command == F_OFD_SETLK ? before_lock : NULL;
    if (before) before_lock = NULL, before();
    errno = lock_error;
    return lock_error ? -1 : (int)syscall(SYS_fcntl, file, command, argument);
}

/* What is told of every file system. */
static struct statvfs file_system;
static bool has_file_system;

int fstatvfs(int file, struct statvfs *told)
{
    (void)file;
    *told = file_system;
    return has_file_system ? 0 : -1;
}

/* The kind of file system that is told of the file at PATH, and of all others; 0: that which it is. */
static long kind_at_path, kind_elsewhere;

int fstatfs(int file, struct statfs *told)
{
    if (!kind_at_path) return (int)syscall(SYS_fstatfs, file, told);
    *told = (struct statfs){.f_type = journal_is_at(PATH, file) ? kind_at_path : kind_elsewhere};
    return 0;
}

/* The error of shortening a file; 0: none. */
static int cut_error;

int ftruncate(int file, off_t bytes)
{
    errno = cut_error;
    return cut_error ? -1 : (int)syscall(SYS_ftruncate, file, bytes);
}

/* No file may be written to, also by root. */
static bool read_only;

int access(const char *path, int mode)
{
    errno = EACCES;
    return read_only && (mode & W_OK) ? -1 : (int)syscall(SYS_access, path, mode);
}

/* The error of removing; 0: none. */
static int remove_error;

int unlink(const char *path)
{
    errno = remove_error;
    return remove_error ? -1 : (int)syscall(SYS_unlink, path);
}

/* ---- tests ---- */

static void remove_journal(struct scratch *s, struct journal *journal)
{
    message_capture(s->said, sizeof s->said);
    journal_remove(journal);
    message_capture(NULL, 0);
}

static void test_round_trip(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 7);
    assert_string_equal(s->said, "");
    check_resume(s, 7, 0, 12);
    assert_true(journal_writable(PATH));
    struct journal *journal = open_as(s, PICTURE, &seen);
    remove_journal(s, journal);
    assert_string_equal(s->said, "");
    assert_true(journal_writable(PATH));
    assert_int_equal(access(PATH, F_OK), -1);
}

/* A file that has taken its path is not removed, and it is no matter if there is none any more. */
static void test_remove(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    for (int other = 0; other < 2; other++) {
        write_journal(s, 1);
        struct journal *journal = open_as(s, PICTURE, &seen);
        unlink(PATH);
        if (other) write_text(PATH, "of somebody else");
        remove_journal(s, journal);
        assert_string_equal(s->said, "");
        assert_int_equal(access(PATH, F_OK), other ? 0 : -1);
    }
    write_journal(s, 1);
    struct journal *journal = open_as(s, PICTURE, &seen);
    remove_error = EROFS;
    remove_journal(s, journal);
    remove_error = 0;
    assert_string_equal(s->said, PATH ": warning: the journal is of no use any more but cannot be "
                                      "removed: Read-only file system\n");
}

static void test_empty_payload(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 0);
    struct journal *journal = open_as(s, PICTURE, &seen);
    struct journal_record record = {.tile = {.w = 1, .h = 1, .step = 1}, .payload = ""};
    assert_true(journal_append(journal, &record));
    journal_close(journal);
    journal = open_as(s, PICTURE, &seen);
    assert_true(journal_found(journal).records == 1 && seen.wrong);
    journal_remove(journal);
}

/* The lowest free descriptor, which the next file gets. */
static int next_descriptor(void)
{
    int file = open(".", O_RDONLY);
    close(file);
    return file;
}

static void test_one_run_at_a_time(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 2);
    int file = next_descriptor();
    struct journal *first = open_as(s, PICTURE, &seen);
    assert_true(fcntl(file, F_GETFD) & FD_CLOEXEC); /* the lock ends with this process */
    assert_null(open_as(s, PICTURE, &seen));
    assert_string_equal(s->said, PATH ": another run is at work on this journal, wait for its end "
                                      "or choose another picture with output.image=FILE (and, "
                                      "where it is set, another output.journal)\n");
    /* Another picture's run does not take it away either. */
    assert_null(open_as(s, PICTURE + 1, &seen));
    assert_true(append(first, 2));
    journal_close(first);
    check_resume(s, 3, 0, 3);
}

static void rename_away(void)
{
    assert_int_equal(rename(PATH, "away"), 0);
}

/* Where another run has renamed the file between opening and locking, it is left to that run. */
static void test_renamed_before_lock(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 2);
    before_lock = rename_away;
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_true(journal && seen.records == 0 && journal_exists(journal));
    assert_true(append(journal, 0));
    journal_close(journal);
    assert_int_equal(rename("away", PATH), 0);
    check_resume(s, 2, 0, 2);
}

/* On a file system without locks there is none; every error that a lock of another run may give is one. */
static void test_lock_errors(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 2);
    lock_error = ENOLCK;
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_true(journal && seen.records == 2);
    journal_close(journal);
    static const int others[] = {EAGAIN, EACCES};
    for (size_t i = 0; i < 2; i++) {
        lock_error = others[i];
        assert_null(open_as(s, PICTURE, &seen));
        assert_non_null(strstr(s->said, "another run is at work"));
    }
    lock_error = 0;
}

/* Writes that are interrupted, or done only in part, are continued; one that does nothing means that there is no
 * room. */
static void test_interrupted_writes(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_most = 7;
    write_journal(s, 3);
    write_most = SIZE_MAX;
    check_resume(s, 3, 0, 3);
    struct journal *journal = open_as(s, PICTURE, &seen);
    write_most = 0;
    message_capture(s->said, sizeof s->said);
    assert_false(append(journal, 3));
    message_capture(NULL, 0);
    write_most = SIZE_MAX;
    assert_non_null(strstr(s->said, "(No space left on device)"));
    journal_close(journal);
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
        journal_close(journal);
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

/* Where what a failed write has left cannot be cut off, nothing is written behind it. */
static void test_stuck_tail(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 2);
    struct journal *journal = open_as(s, PICTURE, &seen);
    message_capture(s->said, sizeof s->said);
    struct rlimit old = limit_file_size(HEADER + 2 * RECORD + 50);
    cut_error = EIO;
    assert_false(append(journal, 2));
    setrlimit(RLIMIT_FSIZE, &old);
    assert_false(append(journal, 2));
    cut_error = 0;
    message_capture(NULL, 0);
    assert_non_null(strstr(s->said, "(File too large)"));
    assert_true(append(journal, 2));
    journal_close(journal);
    check_resume(s, 3, 0, 4);
}

/* The same when the journal is opened, which here gets its name back first. */
static void test_stuck_when_opened(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 3);
    assert_int_equal(truncate(PATH, HEADER + 3 * RECORD - 1) + rename(PATH, PATH ".1"), 0);
    cut_error = EIO;
    assert_null(open_as(s, PICTURE, &seen));
    cut_error = 0;
    assert_non_null(strstr(s->said, PATH ": the journal cannot be shortened: Input/output error"));
    check_resume(s, 2, RECORD - 1, 3);
}

/* A journal whose file is gone, or whose disk is full, goes on elsewhere with all its records, but never over another
 * file. */
static void test_moved(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    struct journal_reader reader = {take, &seen, PAYLOAD, 0};
    write_journal(s, 2);
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_true(journal_exists(journal));
    unlink(PATH);
    assert_false(journal_exists(journal));
    write_text(PATH, "of somebody else");
    assert_false(journal_exists(journal));
    assert_false(journal_move(journal, PATH, 0));
    assert_string_equal(journal_path(journal), PATH);
    signal(SIGXFSZ, SIG_IGN);
    struct rlimit old = limit_file_size(HEADER + 3 * RECORD);
    assert_false(journal_move(journal, MOVED, 2 * RECORD)); /* no copy that does not take all */
    assert_int_equal(access(MOVED, F_OK), -1);
    setrlimit(RLIMIT_FSIZE, &old);
    struct stat status;
    assert_true(journal_move(journal, MOVED, PAYLOAD));
    assert_string_equal(journal_path(journal), MOVED);
    assert_int_equal(stat(MOVED, &status), 0);
    assert_int_equal(status.st_size, HEADER + 2 * RECORD);
    assert_true(journal_exists(journal) && append(journal, 2));
    message_capture(s->said, sizeof s->said);
    assert_null(journal_open(MOVED, PICTURE, &reader)); /* it is locked */
    message_capture(NULL, 0);
    journal_close(journal);
    assert_int_equal(unlink(PATH) + rename(MOVED, PATH), 0);
    check_resume(s, 3, 0, 4);
}

/* Also a journal that is copied in several pieces. */
static void test_long_moved(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    enum { RECORDS = 1500 };
    write_journal(s, RECORDS);
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_true(journal_move(journal, MOVED, 0));
    journal_close(journal);
    assert_int_equal(rename(MOVED, PATH), 0);
    check_resume(s, RECORDS, 0, RECORDS);
}

/* There is no copy where there is no room for it, or if it cannot be written or brought to the disk; but there is one
 * where it is not known whether there is room. */
static void test_not_moved(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    static const int room_errors[] = {ENOSPC, EDQUOT, EOPNOTSUPP, 0};
    static const size_t writes[] = {SIZE_MAX, SIZE_MAX, 0, SIZE_MAX};
    static const int sync_errors[] = {0, 0, 0, EIO};
    write_journal(s, 2);
    struct journal *journal = open_as(s, PICTURE, &seen);
    for (size_t i = 0; i < 4; i++) {
        reserve_error = room_errors[i];
        write_most = writes[i];
        sync_error = sync_errors[i];
        assert_false(journal_move(journal, MOVED, 0));
        assert_int_equal(access(MOVED, F_OK), -1);
        assert_string_equal(journal_path(journal), PATH);
    }
    sync_error = 0;
    reserve_error = EOPNOTSUPP;
    assert_true(journal_move(journal, MOVED, 0));
    reserve_error = 0;
    journal_remove(journal);
    check_resume(s, 2, 0, 2);
}

/* A limit on the size of files that is just enough. */
static void test_moved_to_the_limit(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 2);
    struct journal *journal = open_as(s, PICTURE, &seen);
    struct rlimit old = limit_file_size(HEADER + 3 * RECORD);
    bool moved = journal_move(journal, MOVED, RECORD);
    setrlimit(RLIMIT_FSIZE, &old);
    assert_true(moved);
    journal_remove(journal);
}

/* Moves a journal of two records to MOVED and then to path. */
static struct journal *move_twice(struct scratch *s, const char *path)
{
    struct seen seen;
    write_journal(s, 2);
    struct journal *journal = open_as(s, PICTURE, &seen);
    journal_remove_original(journal); /* there is none yet */
    assert_null(journal_original(journal));
    assert_true(journal_move(journal, MOVED, 0) && journal_move(journal, path, 0));
    assert_int_equal(access(MOVED, F_OK), -1);
    assert_true(append(journal, 2));
    assert_string_equal(journal_original(journal), PATH);
    return journal;
}

/* The file that a journal was moved from is removed when it is asked for, and locked until then. */
static void test_original(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    struct journal *journal = move_twice(s, "twice.journal");
    assert_null(open_as(s, PICTURE, &seen));
    sync_error = EIO; /* the copy may be lost */
    journal_remove_original(journal);
    sync_error = 0;
    assert_string_equal(journal_original(journal), PATH);
    syncs = 0;
    journal_remove_original(journal);
    assert_int_equal(syncs, 1);
    assert_null(journal_original(journal));
    assert_int_equal(access(PATH, F_OK), -1);
    journal_close(journal);
    assert_int_equal(syncs, 1); /* nothing has come since */
    assert_int_equal(rename("twice.journal", PATH), 0);
    check_resume(s, 3, 0, 3);
}

/* It is kept if it may be another run's, or if there is no copy any more. */
static void test_original_stays(void **state)
{
    struct scratch *s = *state;
    struct journal *journal = move_twice(s, "twice.journal");
    assert_int_equal(rename("twice.journal", "away.journal"), 0);
    journal_remove_original(journal);
    assert_string_equal(journal_original(journal), PATH);
    assert_int_equal(rename("away.journal", "twice.journal") + unlink(PATH), 0);
    write_text(PATH, "of somebody else");
    journal_remove_original(journal);
    assert_null(journal_original(journal));
    assert_int_equal(access(PATH, F_OK), 0);
    journal_remove(journal);
    assert_int_equal(unlink(PATH), 0);
}

/* A copy in memory does not survive the death of the machine: it does not replace a file on a disk, only one that is in
 * memory, too. */
static void test_original_of_copy_in_memory(void **state)
{
    struct scratch *s = *state;
    static const struct {
        long original, copy;
        bool stays;
    } cases[] = {{EXT4_SUPER_MAGIC, TMPFS_MAGIC, true},
                 {EXT4_SUPER_MAGIC, RAMFS_MAGIC, true},
                 {TMPFS_MAGIC, RAMFS_MAGIC, false},
                 {RAMFS_MAGIC, TMPFS_MAGIC, false},
                 {TMPFS_MAGIC, EXT4_SUPER_MAGIC, false}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct journal *journal = move_twice(s, "twice.journal");
        kind_at_path = cases[i].original;
        kind_elsewhere = cases[i].copy;
        journal_remove_original(journal);
        kind_at_path = 0;
        assert_true((journal_original(journal) != NULL) == cases[i].stays);
        journal_remove(journal);
        if (cases[i].stays)
            check_resume(s, 2, 0, 2);
        else
            assert_int_equal(access(PATH, F_OK), -1);
    }
}

static blkcnt_t blocks_of(const char *path)
{
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    return status.st_blocks;
}

/* Whether a file that is empty so far has got room of 16 MB, which not every file system gives. */
static bool reserve(int file)
{
    return fallocate(file, FALLOC_FL_KEEP_SIZE, 0, 16 << 20) == 0;
}

static bool can_reserve(void)
{
    int file = open("reserved", O_WRONLY | O_CREAT | O_TRUNC, 0600);
    bool can = reserve(file);
    close(file);
    unlink("reserved");
    return can;
}

/* Room is set aside for what comes, and stays while it comes, also where something was cut off before; what is not used
 * is given back. */
static void test_reserved(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    struct stat status;
    for (int torn = 0; torn < 2; torn++) {
        write_journal(s, 2 + (uint32_t)torn);
        if (torn) assert_int_equal(truncate(PATH, HEADER + 3 * RECORD - 1), 0);
        struct journal *journal = open_as(s, PICTURE, &seen);
        journal_reserve(journal, 16 << 20);
        assert_int_equal(reserved_at, HEADER + 2 * RECORD);
        assert_int_equal(stat(PATH, &status), 0);
        assert_int_equal(status.st_size, HEADER + 2 * RECORD);
        assert_true(append(journal, 2));
        assert_true(!can_reserve() || blocks_of(PATH) * 512 >= 16 << 20);
        journal_close(journal);
        assert_true(blocks_of(PATH) * 512 < 1 << 20);
        check_resume(s, 3, 0, 4);
    }
}

/* A run that was killed has left this journal with room that it had reserved: that is given back when the journal is
 * opened, or set aside. */
static void check_given_back(struct scratch *s, uint32_t records, bool other)
{
    struct seen seen;
    write_journal(s, records);
    int file = open(PATH, O_WRONLY);
    bool reserves = reserve(file);
    close(file);
    if (!reserves) return; /* nor could a run on this file system */
    assert_true(blocks_of(PATH) * 512 >= 16 << 20);
    struct journal *journal = open_as(s, PICTURE + other, &seen);
    assert_true(blocks_of(other && records ? PATH ".1" : PATH) * 512 < 1 << 20);
    assert_int_equal(seen.records, other ? 0 : records);
    journal_close(journal);
    unlink(PATH ".1");
}

static void test_reserved_by_killed(void **state)
{
    for (int other = 0; other <= 1; other++) {
        check_given_back(*state, 2, other);
        check_given_back(*state, 0, other);
    }
}

static const struct statvfs small_disk = {
    .f_bsize = 5, .f_frsize = 7, .f_bfree = 13, .f_bavail = 11};

/* Of the free room, what an ordinary user may have. */
static void test_room(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 0);
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_true(journal_has_room(journal, UINT64_MAX)); /* not known */
    file_system = small_disk;
    has_file_system = true;
    assert_true(journal_has_room(journal, 77));
    message_capture(s->said, sizeof s->said);
    assert_false(journal_has_room(journal, 78));
    message_capture(NULL, 0);
    has_file_system = false;
    assert_non_null(strstr(s->said, "free some space"));
    journal_remove(journal);
}

/* Opens the journal of PICTURE + 1 on a disk with 77 bytes left. */
static struct journal *open_in_little_room(struct scratch *s, uint64_t room)
{
    struct seen seen = {.accepted = UINT32_MAX};
    struct journal_reader reader = {take, &seen, PAYLOAD, room};
    file_system = small_disk;
    has_file_system = true;
    message_capture(s->said, sizeof s->said);
    struct journal *journal = journal_open(PATH, PICTURE + 1, &reader);
    message_capture(NULL, 0);
    has_file_system = false;
    return journal;
}

/* Another picture's journal gives way only to one that has room for what it does not hold already. */
static void test_no_room_beside_another(void **state)
{
    struct scratch *s = *state;
    write_journal(s, 2);
    assert_null(open_in_little_room(s, 78));
    assert_int_equal(strncmp(s->said, PATH ": the journal takes up to ", strlen(PATH) + 26), 0);
    assert_true(access(PATH, F_OK) == 0 && access(PATH ".1", F_OK) != 0);
    struct journal *journal = open_in_little_room(s, 77);
    assert_true(journal && strstr(s->said, "it is now called " PATH ".1\n"));
    append(journal, 0);
    journal_close(journal);
    assert_int_equal(rename(PATH, PATH ".2") + rename(PATH ".1", PATH), 0);
    assert_null(open_in_little_room(s, 78 + HEADER + RECORD));
    assert_int_equal(strncmp(s->said, PATH ": the journal takes up to ", strlen(PATH) + 26), 0);
    assert_true(access(PATH ".2", F_OK) == 0 && access(PATH ".1", F_OK) != 0);
    journal = open_in_little_room(s, 77 + HEADER + RECORD);
    assert_true(journal && strstr(s->said, PATH ".2 is this picture's"));
    journal_remove(journal);
    assert_int_equal(unlink(PATH ".1"), 0);
}

/* That PATH is of no use is told before rendering. */
static void refuse(struct scratch *s, const char *line)
{
    message_capture(s->said, sizeof s->said);
    assert_false(journal_writable(PATH));
    message_capture(NULL, 0);
    assert_string_equal(s->said, line);
}

/* Nothing is opened at PATH, as was to be told before. */
static void check_irregular(struct scratch *s)
{
    struct seen seen;
    static const char line[] =
        PATH ": is no regular file, choose another place for the journal with "
             "output.journal=FILE\n";
    refuse(s, line);
    errno = 0;
    assert_null(open_as(s, PICTURE, &seen));
    assert_string_equal(s->said, line);
}

/* Where no journal can be opened, what is there is left as it is. */
static void test_no_place(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    struct journal_reader reader = {take, &seen, PAYLOAD, 0};
    unlink(PATH);
    assert_int_equal(mkdir(PATH, 0700), 0);
    check_irregular(s);
    assert_int_equal(rmdir(PATH) + mkfifo(PATH, 0600), 0);
    check_irregular(s);
    write_text("precious", "text");
    assert_int_equal(unlink(PATH) + symlink("precious", PATH), 0);
    check_irregular(s);
    unlink(PATH);
    write_journal(s, 0);
    read_only = true;
    refuse(s, PATH ": the journal cannot be opened: Permission denied, choose another place with "
                   "output.journal=FILE\n");
    read_only = false;
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
    syncs = folder_syncs = 0;
    append(journal, 0);
    journal_tick(journal, 0);
    assert_int_equal(syncs, 0);
    journal_tick(journal, HUGE_VAL);
    assert_true(syncs == 1 && folder_syncs == 1);
    journal_tick(journal, HUGE_VAL); /* nothing has come since */
    assert_int_equal(syncs, 1);
    append(journal, 1);
    journal_tick(journal, HUGE_VAL);
    assert_true(syncs == 2 && folder_syncs == 1);
    journal_remove(journal);
}

/* After a sync the next one waits for its pause, which is longer after a slow one. */
static void test_sync_again(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    unlink(PATH);
    struct journal *journal = open_as(s, PICTURE, &seen);
    double now = clock_wall() + 10;
    syncs = 0;
    sync_s = 0.04;
    append(journal, 0);
    journal_tick(journal, now);
    assert_int_equal(syncs, 1);
    append(journal, 1);
    journal_tick(journal, now + sync_s / JOURNAL_SYNC_SHARE); /* 8 s */
    assert_int_equal(syncs, 1);
    sync_s = 0;
    journal_tick(journal, now + 1e6);
    assert_int_equal(syncs, 2);
    append(journal, 2);
    sync_error = EIO;
    message_capture(s->said, sizeof s->said);
    journal_tick(journal, HUGE_VAL);
    message_capture(NULL, 0);
    sync_error = 0;
    assert_non_null(strstr(s->said, "cannot be written (Input/output error)"));
    journal_remove(journal);
}

/* What is left to a later run, or is moved, is on the disk, and so is its name. */
static void test_synced_at_the_end(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    for (int moved = 0; moved <= 1; moved++) {
        write_journal(s, 2);
        struct journal *journal = open_as(s, PICTURE, &seen);
        syncs = folder_syncs = 0;
        if (moved)
            assert_true(journal_move(journal, MOVED, 0));
        else
            assert_true(append(journal, 2));
        journal_close(journal);
        assert_true(syncs == 1 && folder_syncs == 1);
        check_resume(s, moved ? 2 : 3, 0, 3); /* it is not locked any more */
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
    write_text("scene.ini", texts[0]);
    struct scene *scene = scratch_scene(s, "scene.ini", NULL);
    struct scene *same = scratch_scene(s, "scene.ini", "farm.tile=8");
    struct scene *other = scratch_scene(s, "scene.ini", "sampling.samples=2");
    assert_true(journal_picture_hash(scene, 1) == journal_picture_hash(same, 1));
    same->view.processor++;
    same->view.variant++;
    assert_true(journal_picture_hash(scene, 1) == journal_picture_hash(same, 1));
    assert_true(journal_picture_hash(scene, 1) != journal_picture_hash(other, 1));
    assert_true(journal_picture_hash(scene, 1) != journal_picture_hash(scene, 2));
    /* What stands before the objects and lights is the same. */
    for (int i = 1; i < 3; i++) {
        write_text("other.ini", texts[i]);
        free(other);
        other = scratch_scene(s, "other.ini", NULL);
        assert_true(memcmp(scene, other, sizeof *scene) == 0 && scene->bytes == other->bytes);
        assert_true(journal_picture_hash(scene, 1) != journal_picture_hash(other, 1));
    }
    free(scene);
    free(same);
    free(other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_remove),
        cmocka_unit_test(test_empty_payload),
        cmocka_unit_test(test_one_run_at_a_time),
        cmocka_unit_test(test_renamed_before_lock),
        cmocka_unit_test(test_lock_errors),
        cmocka_unit_test(test_interrupted_writes),
        cmocka_unit_test(test_killed),
        cmocka_unit_test(test_full_disk),
        cmocka_unit_test(test_stuck_tail),
        cmocka_unit_test(test_stuck_when_opened),
        cmocka_unit_test(test_moved),
        cmocka_unit_test(test_long_moved),
        cmocka_unit_test(test_not_moved),
        cmocka_unit_test(test_moved_to_the_limit),
        cmocka_unit_test(test_reserved),
        cmocka_unit_test(test_reserved_by_killed),
        cmocka_unit_test(test_room),
        cmocka_unit_test(test_no_room_beside_another),
        cmocka_unit_test(test_no_place),
        cmocka_unit_test(test_sync_pause),
        cmocka_unit_test(test_sync_again),
        cmocka_unit_test(test_synced_at_the_end),
        cmocka_unit_test(test_picture),
        cmocka_unit_test(test_original),
        cmocka_unit_test(test_original_stays),
        cmocka_unit_test(test_original_of_copy_in_memory),
        cmocka_unit_test(test_no_file_stays_open),
    };
    return cmocka_run_group_tests(tests, journal_tests_open, scratch_close);
}
