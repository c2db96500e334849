/* Tests of memory shared by processes. */
#include "test/fatal.h"

#include <fcntl.h>
#include <stdbool.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include "worker/segment.h"

#define BYTES ((size_t)100001)

/* The hash depends on everything that processes must have in common. */
static void test_realm(void **state)
{
    const struct segment_realm here = {
        .machine = "a", .user = 1, .ids = 2, .users = 3, .memory = 4};
    struct segment_realm others[] = {here, here, here, here, here};
    others[0].machine[1] = 'b';
    others[1].user++;
    others[2].ids++;
    others[3].users++;
    others[4].memory++;
    uint64_t hash = segment_realm_hash(&here);
    assert_true(hash != 0 && segment_realm_hash(&(struct segment_realm){0}) != 0);
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        assert_true(segment_realm_hash(&others[i]) != hash);
}

/* A process that is not dumpable cannot be opened by others, so that it has no reach. */
static void test_reach(void **state)
{
    uint64_t realm = segment_own_realm();
    assert_true(realm != 0);
    assert_true(segment_own_realm() == realm);
    assert_int_equal(prctl(PR_SET_DUMPABLE, 0), 0);
    uint64_t hidden = segment_own_realm();
    assert_int_equal(prctl(PR_SET_DUMPABLE, 1), 0);
    assert_true(hidden == 0);
}

/* Whether another process, without this one's descriptors, finds `mark` at the end of the segment and can write
 * there. */
static bool answers(struct segment_address address, char mark)
{
    int status;
    pid_t child = fork();
    if (child == 0) {
        size_t bytes = 0;
        close(address.file);
        char *segment = segment_open(address, &bytes);
        bool good = bytes == BYTES && segment[0] == 0 && segment[BYTES - 1] == mark;
        segment[BYTES - 1] = (char)(mark + 1);
        segment_close(segment, bytes);
        _exit(good ? 0 : 1);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

static void test_shared(void **state)
{
    struct segment_address address = segment_make(), other_address = segment_make();
    assert_true(fcntl(address.file, F_GETFD) & FD_CLOEXEC);
    char *segment = segment_extend(address, BYTES), *other = segment_extend(other_address, BYTES);
    for (size_t i = 0; i < BYTES; i++)
        assert_int_equal(segment[i], 0);
    assert_true((uintptr_t)segment % 4096 == 0);
    segment[BYTES - 1] = 'a';
    assert_true(segment_opens(address));
    assert_true(answers(address, 'a'));
    assert_int_equal(segment[BYTES - 1], 'b');
    assert_int_equal(other[BYTES - 1], 0);
    segment_release(address);
    assert_true(answers(other_address, 0));
    assert_int_equal(segment[BYTES - 1], 'b');
    assert_int_equal(other[BYTES - 1], 1);
    segment_release(other_address);
    segment_close(other, BYTES);
    segment_close(segment, BYTES);
}

/* The number of the next file that is opened. */
static int next_file(void)
{
    int file = open("/dev/null", O_RDONLY | O_CLOEXEC);
    close(file);
    return file;
}

/* A segment stays mapped without a descriptor, of which a process may have few. */
static void test_no_file_is_left_open(void **state)
{
    size_t bytes;
    struct segment_address address = segment_make();
    int next = next_file();
    char *made = segment_extend(address, BYTES);
    assert_true(segment_opens(address));
    char *opened = segment_open(address, &bytes);
    assert_int_equal(next_file(), next);
    segment_release(address);
    made[0] = 'a';
    assert_int_equal(opened[0], 'a');
    segment_close(opened, bytes);
    segment_close(made, BYTES);
}

static void open_one(void *state)
{
    size_t bytes;
    (void)segment_open(*(const struct segment_address *)state, &bytes);
}

static void extend_one(void *state)
{
    (void)segment_extend(*(const struct segment_address *)state, (size_t)1 << 50);
}

/* If no more files may be opened, no segment is made. */
static void test_none(void **state)
{
    struct rlimit limit, none;
    assert_int_equal(getrlimit(RLIMIT_NOFILE, &limit), 0);
    none = (struct rlimit){0, limit.rlim_max};
    assert_int_equal(setrlimit(RLIMIT_NOFILE, &none), 0);
    struct segment_address address = segment_make();
    assert_int_equal(setrlimit(RLIMIT_NOFILE, &limit), 0);
    assert_int_equal(address.file, -1);
    segment_release(address);
}

/* A size that no machine has, and a segment that does not exist. */
static void test_refused(void **state)
{
    char expected[256];
    struct segment_address address = segment_make();
    assert_fatal(extend_one, &address,
                 "farm: rank 0: out of memory: 1125899906842624 bytes were needed\n");
    segment_release(address);
    address.file = 1000; /* the next file that is opened has its number */
    snprintf(
        expected, sizeof expected,
        "farm: rank 0: cannot open memory of process %d, its file %d: No such file or directory\n",
        address.process, address.file);
    assert_false(segment_opens(address));
    assert_int_equal(address.process, getpid());
    assert_fatal(open_one, &address, expected);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_realm),  cmocka_unit_test(test_reach),
        cmocka_unit_test(test_shared), cmocka_unit_test(test_refused),
        cmocka_unit_test(test_none),   cmocka_unit_test(test_no_file_is_left_open),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
