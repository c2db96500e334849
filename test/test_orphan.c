/* A rank whose parent is gone ends when nothing comes any more. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "common/clock.h"
#include "common/orphan.h"

/* A pipe: [0] to read from, [1] to write to. */
struct way {
    int ends[2];
};

static struct way way_open(void)
{
    struct way way;
    assert_int_equal(pipe(way.ends), 0);
    return way;
}

/* The rank: it says that it has begun, and, if it goes on after so many seconds of silence, that it does. */
static void live(bool watches, bool orphaned, double silence, struct way begun, struct way told)
{
    pid_t parent = getppid();
    if (watches) orphan_watch();
    if (write(begun.ends[1], "", 1) != 1) _exit(1);
    while (orphaned && getppid() == parent)
        clock_sleep(1e-3);
    orphan_leave(silence, 2);
    _exit(write(told.ends[1], "", 1) != 1);
}

/* What has started the rank: it ends at once, or waits for it. */
static void start_rank(bool watches, bool orphaned, double silence, struct way told)
{
    struct way begun = way_open();
    pid_t rank = fork();
    char byte;
    if (rank == 0) live(watches, orphaned, silence, begun, told);
    bool has_begun = read(begun.ends[0], &byte, 1) == 1;
    if (!orphaned) waitpid(rank, NULL, 0);
    _exit(!has_begun);
}

static bool goes_on(bool watches, bool orphaned, double silence)
{
    struct way told = way_open();
    char byte;
    pid_t starter = fork();
    if (starter == 0) start_rank(watches, orphaned, silence, told);
    close(told.ends[1]);
    waitpid(starter, NULL, 0);
    bool does = read(told.ends[0], &byte, 1) == 1;
    close(told.ends[0]);
    return does;
}

static void test_orphan(void **state)
{
    (void)state;
    assert_false(goes_on(true, true, 2.5));
    assert_true(goes_on(true, true, 1.5));
    assert_true(goes_on(true, false, 2.5));
    assert_true(goes_on(false, true, 2.5));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_orphan)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
