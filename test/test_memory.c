/* Tests of sizes that memory cannot hold: they are refused before anything is allocated. */
#include "test/scratch.h"

#include <sys/resource.h>

#include "common/memory.h"
#include "master/text_file.h"
#include "test/fatal.h"

#define GIB ((size_t)1 << 30)

/* The address sanitizer alone takes more of the address space than any limit leaves. */
#ifdef __SANITIZE_ADDRESS__
#define SKIP_IF_SANITIZED() skip()
#else
#define SKIP_IF_SANITIZED() (void)0
#endif

/* Sets the limit of ulimit -v; returns the old one. */
static struct rlimit set_limit(size_t bytes)
{
    struct rlimit old, limit;
    assert_int_equal(getrlimit(RLIMIT_AS, &old), 0);
    limit = (struct rlimit){bytes, old.rlim_max};
    assert_int_equal(setrlimit(RLIMIT_AS, &limit), 0);
    return old;
}

static void test_limit(void **state)
{
    SKIP_IF_SANITIZED();
    size_t before = memory_limit();
    assert_true(before > 16 << 20);
    struct rlimit old = set_limit(before / 2);
    size_t within = memory_limit();
    bool holds = memory_holds(before / 2), too_much = memory_holds(before / 2 + 1);
    setrlimit(RLIMIT_AS, &old);
    set_limit((size_t)1 << 20);
    bool small = memory_holds(((size_t)64 << 20) - 1), large = memory_holds((size_t)64 << 20);
    setrlimit(RLIMIT_AS, &old);
    assert_true(small && !large); /* less than 64 MiB is not checked */
    assert_int_equal(within, before / 2);
    assert_true(holds && !too_much);
    assert_int_equal(memory_limit(), before);
}

/* A scene file, and a picture, that are larger than memory. */
static void test_refused(void **state)
{
    struct scratch *s = *state;
    SKIP_IF_SANITIZED();
    write_text("big.nff", "s 0 0 0 1\n");
    assert_int_equal(truncate("big.nff", (off_t)(2 * GIB)), 0);
    write_text("big.ini", "[image]\nwidth = 16384\nheight = 16384\n[light]\nposition = 0 0 0\n");
    struct job job;
    struct rlimit old = set_limit(GIB);
    bool scene = scratch_load(s, "big.nff", NULL, &job);
    char *said = copy_text(s->said);
    bool picture = scratch_load(s, "big.ini", NULL, &job);
    char *large = copy_text(s->said);
    bool part = scratch_load(s, "big.ini", "image.region=0 0 100 100", &job);
    setrlimit(RLIMIT_AS, &old);
    assert_false(scene || picture);
    assert_string_equal(said, "big.nff: has 2147483648 bytes, expected at most 1073741824\n");
    assert_string_equal(large, "big.ini:2: the picture takes 3221.2 MB of memory, expected at most "
                               "the 1073.7 MB that this process may have\n");
    free(said);
    free(large);
    scratch_refused(s, "big.nff", NULL, "big.nff:2: a NUL byte, expected plain text");
    assert_true(part);
    job_free(&job);
    unlink("big.nff");
}

struct block {
    size_t count, size;
};

static void allocate_block(void *state)
{
    const struct block *block = state;
    free(allocate(block->count, block->size));
}

/* Asserts that allocating such a block ends the job with this message. */
static void check_fatal(size_t count, size_t size, const char *expected)
{
    assert_fatal(allocate_block, &(struct block){count, size}, expected);
}

static void test_blocks(void **state)
{
    volatile size_t huge = SIZE_MAX / 2;
    char expected[256];
    snprintf(expected, sizeof expected,
             "farm: rank 0: out of memory: %zu bytes were needed in one piece, there are %zu in "
             "all\n",
             huge, memory_limit());
    check_fatal(huge, 1, expected);
    snprintf(expected, sizeof expected, "farm: rank 0: out of memory: %zu x 4 bytes were needed\n",
             huge);
    check_fatal(huge, 4, expected);
}

/* Blocks of a huge page or more are whole huge pages, and all of the block is writable. */
static void test_large(void **state)
{
    const size_t page = (size_t)2 << 20, sizes[] = {1, page - 1, page, 3 * page + 1};
    for (unsigned i = 0; i < 4; i++) {
        char *block = allocate_large(sizes[i]);
        memset(block, 1, sizes[i]);
        assert_true(sizes[i] < page || (uintptr_t)block % page == 0);
        assert_int_equal(block[0] + block[sizes[i] - 1], 2);
        free(block);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_limit),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_large),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
