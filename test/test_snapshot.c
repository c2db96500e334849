/* Tests of snapshots: a failure is reported once, and rendering goes on. */
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/message.h"
#include "master/snapshot.h"
#include "test/unit.h"

static bool no_threads;

/* Threads begin their work once this is open: until then, a snapshot takes as long as on a very slow disk. */
static atomic_bool is_open = true;

static struct {
    void *(*start)(void *);
    void *argument;
} waiting;

static void *wait_and_start(void *unused)
{
    (void)unused;
    while (!is_open)
        usleep(1000);
    return waiting.start(waiting.argument);
}

int __real_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                          void *(*start)(void *), void *argument);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                          void *(*start)(void *), void *argument);

int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                          void *(*start)(void *), void *argument)
{
    if (no_threads) return EAGAIN;
    waiting.start = start;
    waiting.argument = argument;
    return __real_pthread_create(thread, attributes, wait_and_start, NULL);
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

static void wait_for(const struct snapshot *snapshot)
{
    while (!snapshot->is_written)
        usleep(1000);
}

/* The values of the file of a picture of two pixels. */
static void assert_file(const char *path, float first, float last)
{
    float values[6];
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fseek(file, -(long)sizeof values, SEEK_END), 0);
    assert_int_equal(fread(values, sizeof *values, 6, file), 6);
    assert_int_equal(fclose(file), 0);
    assert_true(values[0] == first && values[5] == last);
}

/* Each snapshot has the picture as it was when it was begun. While one is being written, nobody waits for it, and no
 * other one is begun; after the end none is, either. */
static void test_slow_disk(void **state)
{
    char path[64];
    struct canvas canvas;
    snprintf(path, sizeof path, "/tmp/farm-test-%ld.pfm", (long)getpid());
    struct snapshot snapshot = {.path = path, .seconds = 0.5};
    canvas_init(&canvas, 2, 1);
    for (int i = 1; i <= 2; i++) {
        is_open = false;
        for (int c = 0; c < 6; c++)
            canvas.rgb[c] = (float)(10 * i + c);
        snapshot_look(&snapshot, &canvas, 2 * i);
        for (int c = 0; c < 6; c++)
            canvas.rgb[c] = -1;
        snapshot_look(&snapshot, &canvas, 2 * i + 1); /* would wait for ever */
        assert_true(snapshot.is_writing && !snapshot_is_due(&snapshot, 2 * i + 1));
        is_open = true;
        wait_for(&snapshot);
        assert_file(path, (float)(10 * i), (float)(10 * i + 5));
        snapshot_look(&snapshot, &canvas, 2 * i + 1);
        assert_false(snapshot.is_writing);
    }
    snapshot_look(&snapshot, &canvas, 9);
    snapshot_end(&snapshot);
    assert_file(path, -1, -1);
    assert_int_equal(unlink(path), 0);
    snapshot_look(&snapshot, &canvas, 99);
    snapshot_end(&snapshot);
    assert_int_equal(access(path, F_OK), -1);
    canvas_free(&canvas);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unwritable),
        cmocka_unit_test(test_no_thread),
        cmocka_unit_test(test_taking_long),
        cmocka_unit_test(test_slow_disk),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
