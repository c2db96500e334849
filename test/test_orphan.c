/* A rank whose parent is gone ends when nothing comes any more. */
#include <stdbool.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "common/clock.h"
#include "common/orphan.h"
#include "test/unit.h"

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

/* What the rank does: it goes on after so many seconds of silence, or waits for a semaphore, which another process may
 * post after some time. */
struct life {
    bool watches, orphaned;
    double silence;
    sem_t *posted; /* NULL: it does not wait */
};

#define PATIENCE 2

/* The rank: it says that it has begun, and, if it goes on, that it does. */
static void live(const struct life *life, struct way begun, struct way told)
{
    pid_t parent = getppid();
    if (life->watches) orphan_watch();
    if (write(begun.ends[1], "", 1) != 1) _exit(1);
    while (life->orphaned && getppid() == parent)
        clock_sleep(1e-3);
    if (life->posted)
        orphan_wait(life->posted, PATIENCE);
    else
        orphan_leave(life->silence, PATIENCE);
    _exit(write(told.ends[1], "", 1) != 1);
}

/* What has started the rank: it ends at once, or waits for it. */
static void start_rank(const struct life *life, struct way told)
{
    struct way begun = way_open();
    pid_t rank = fork();
    char byte;
    if (rank == 0) live(life, begun, told);
    bool has_begun = read(begun.ends[0], &byte, 1) == 1;
    if (!life->orphaned) waitpid(rank, NULL, 0);
    _exit(!has_begun);
}

static bool lives_on(const struct life *life)
{
    struct way told = way_open();
    char byte;
    pid_t starter = fork();
    if (starter == 0) start_rank(life, told);
    close(told.ends[1]);
    waitpid(starter, NULL, 0);
    bool does = read(told.ends[0], &byte, 1) == 1;
    close(told.ends[0]);
    return does;
}

static bool goes_on(bool watches, bool orphaned, double silence)
{
    return lives_on(&(struct life){.watches = watches, .orphaned = orphaned, .silence = silence});
}

static void test_orphan(void **state)
{
    assert_false(goes_on(true, true, 2.5));
    assert_true(goes_on(true, true, 1.5));
    assert_true(goes_on(true, false, 2.5));
    assert_true(goes_on(false, true, 2.5));
}

/* Whether a rank that waits for a semaphore goes on; post_after: seconds until it is posted; < 0: never. */
static bool gets_through(bool orphaned, double post_after)
{
    void *shared =
        mmap(NULL, sizeof(sem_t), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    assert_true(shared != MAP_FAILED);
    struct life life = {.watches = true, .orphaned = orphaned, .posted = shared};
    assert_int_equal(sem_init(life.posted, 1, 0), 0);
    pid_t poster = fork();
    if (poster == 0) {
        if (post_after < 0) _exit(0);
        clock_sleep(post_after);
        _exit(sem_post(life.posted) != 0);
    }
    bool does = lives_on(&life);
    waitpid(poster, NULL, 0);
    sem_destroy(life.posted);
    munmap(shared, sizeof(sem_t));
    return does;
}

/* An orphan that waits gets what comes in time; one that is none waits longer than its patience. */
static void test_orphan_wait(void **state)
{
    assert_false(gets_through(true, -1));
    assert_true(gets_through(true, 0));
    assert_true(gets_through(true, 1.5));
    assert_true(gets_through(false, PATIENCE + 1.5));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_orphan),
        cmocka_unit_test(test_orphan_wait),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
