/* Tests of snapshots: a failure is reported once, and rendering goes on. */
#include <errno.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "common/message.h"
#include "master/snapshot.h"

static bool no_threads;

int __real_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                          void *(*start)(void *), void *argument);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                          void *(*start)(void *), void *argument);

int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                          void *(*start)(void *), void *argument)
{
    return no_threads ? EAGAIN : __real_pthread_create(thread, attributes, start, argument);
}

/* Takes three snapshots, one per second. */
static void take_three(struct snapshot *snapshot, char *said, size_t size)
{
    struct canvas canvas;
    canvas_init(&canvas, 3, 2);
    message_capture(said, size);
    for (int i = 1; i <= 3; i++) {
        assert_true(snapshot_is_due(snapshot, i));
        snapshot_look(snapshot, &canvas, i);
        while (snapshot->is_writing && !snapshot->is_written)
            usleep(1000);
        assert_false(snapshot->is_writing && snapshot_is_due(snapshot, i));
        snapshot_look(snapshot, &canvas, i);
        assert_false(snapshot_is_due(snapshot, i));
    }
    snapshot_end(snapshot);
    assert_false(snapshot_is_due(snapshot, 9));
    message_capture(NULL, 0);
    canvas_free(&canvas);
}

static void test_unwritable(void **state)
{
    (void)state;
    char said[1024];
    struct snapshot snapshot = {.path = "/proc/none/a.png", .seconds = 0.5};
    take_three(&snapshot, said, sizeof said);
    char *expected =
        format_text("/proc/none/a.png: warning: the picture so far cannot be written (%s): "
                    "rendering goes on, and it is tried again\n",
                    strerror(ENOENT));
    assert_string_equal(said, expected);
    free(expected);
}

static void test_no_thread(void **state)
{
    (void)state;
    char said[1024];
    struct snapshot snapshot = {.path = "never.png", .seconds = 0.5};
    no_threads = true;
    take_three(&snapshot, said, sizeof said);
    no_threads = false;
    assert_non_null(strstr(said, strerror(EAGAIN)));
    assert_ptr_equal(strchr(said, '\n'), said + strlen(said) - 1);
    assert_int_equal(access("never.png", F_OK), -1);
}

/* If snapshots take long, they are taken less often. */
static void test_taking_long(void **state)
{
    (void)state;
    char said[1024];
    struct canvas canvas;
    struct snapshot snapshot = {.path = "never.png", .seconds = 0.5};
    canvas_init(&canvas, 3, 2);
    no_threads = true;
    message_capture(said, sizeof said);
    snapshot_look(&snapshot, &canvas, 1);
    assert_true(snapshot_is_due(&snapshot, 1.5));
    snapshot_took(&snapshot, 1);
    snapshot_look(&snapshot, &canvas, 2);
    assert_false(snapshot_is_due(&snapshot, 21.9));
    assert_true(snapshot_is_due(&snapshot, 22.1));
    message_capture(NULL, 0);
    no_threads = false;
    snapshot_end(&snapshot);
    canvas_free(&canvas);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unwritable),
        cmocka_unit_test(test_no_thread),
        cmocka_unit_test(test_taking_long),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
