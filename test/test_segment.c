/* Memory that processes share. */
#include "test/fatal.h"

#include <stdbool.h>
#include <string.h>

#include "common/segment.h"

#define BYTES ((size_t)100001)

static void test_reach(void **state)
{
    (void)state;
    uint64_t reach = segment_reach();
    assert_true(reach != 0);
    assert_true(segment_reach() == reach);
    assert_true(segment_key() != segment_key());
}

/* Whether another process finds mark at the end, and could leave its own there. */
static bool answers(uint64_t key, char mark)
{
    int status;
    pid_t child = fork();
    if (child == 0) {
        size_t bytes = 0;
        char *segment = segment_open(key, &bytes);
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
    (void)state;
    uint64_t key = segment_key(), other_key = segment_key();
    char *segment = segment_create(key, BYTES);
    for (size_t i = 0; i < BYTES; i++)
        assert_int_equal(segment[i], 0);
    assert_true((uintptr_t)segment % 4096 == 0);
    segment[BYTES - 1] = 'a';
    assert_true(answers(key, 'a'));
    assert_int_equal(segment[BYTES - 1], 'b');
    assert_true(answers(key, 'b'));
    segment_forget();
    assert_int_equal(segment[BYTES - 1], 'c');
    char *other = segment_create(other_key, BYTES);
    assert_int_equal(other[BYTES - 1], 0);
    assert_true(answers(other_key, 0));
    segment_forget();
    segment_forget();
    segment_close(other, BYTES);
    segment_close(segment, BYTES);
}

struct wish {
    uint64_t key;
    size_t bytes;
};

static void open_one(void *state)
{
    const struct wish *wish = state;
    size_t bytes;
    (void)segment_open(wish->key, &bytes);
}

static void create_one(void *state)
{
    const struct wish *wish = state;
    (void)segment_create(wish->key, wish->bytes);
}

/* A name is taken, has been given up; no machine has so much. */
static void test_refused(void **state)
{
    (void)state;
    struct wish wish = {segment_key(), BYTES}, large = {segment_key(), (size_t)1 << 50};
    const char *none =
        "farm: rank 0: cannot open the memory that this machine's processes share: No such "
        "file or directory\n";
    char text[FATAL_TEXT];
    assert_fatal(open_one, &wish, none);
    void *segment = segment_create(wish.key, BYTES);
    assert_fatal(create_one, &wish,
                 "farm: rank 0: cannot create 0.1 MB of shared memory: File exists\n");
    segment_forget();
    assert_fatal(open_one, &wish, none);
    segment_close(segment, BYTES);
    catch_fatal(create_one, &large, text);
    assert_ptr_equal(
        strstr(text, "farm: rank 0: the scene needs 1125899906.8 MB of shared memory, but "), text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reach),
        cmocka_unit_test(test_shared),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
