/* Tests of which bytes are printable, of the sizes of allocated blocks, and of the end of a job. */
#include <malloc.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "test/fatal.h"
#include "test/unit.h"

/* Encodes the number in UTF-8 with this number of bytes, which may be more than it needs. */
static void encode(uint32_t number, size_t bytes, char text[5])
{
    static const unsigned char first[] = {0, 0, 0xc0, 0xe0, 0xf0};
    for (size_t i = bytes; i-- > 1; number >>= 6)
        text[i] = (char)(0x80 | (number & 0x3f));
    text[0] = (char)(first[bytes] | number);
    text[bytes] = '\0';
}

static size_t bytes_needed(uint32_t number)
{
    return number < 0x80 ? 1 : number < 0x800 ? 2 : number < 0x10000 ? 3 : 4;
}

static bool is_character(uint32_t number)
{
    bool control = number < 0x20 || (number >= 0x7f && number < 0xa0);
    bool surrogate = number >= 0xd800 && number < 0xe000;
    return !control && !surrogate && number < 0x110000;
}

/* Of all encodings of a given number of bytes, exactly the shortest ones of printable characters are accepted. */
static void test_printable(void **state)
{
    const uint32_t ends[] = {0, 0x80, 0x800, 0x10000, 0x200000};
    for (size_t bytes = 1; bytes <= 4; bytes++) {
        for (uint32_t number = 0; number < ends[bytes]; number++) {
            char text[5];
            encode(number, bytes, text);
            bool good = is_character(number) && bytes_needed(number) == bytes;
            assert_int_equal(printable_bytes(text), good ? bytes : 0);
        }
    }
}

/* Truncated characters, and bytes that begin none, are refused. */
static void test_unprintable(void **state)
{
    for (size_t bytes = 2; bytes <= 4; bytes++) {
        for (size_t end = 1; end < bytes; end++) {
            char text[5];
            encode(bytes == 2 ? 0xe4 : bytes == 3 ? 0x20ac : 0x1f600, bytes, text);
            text[end] = '\0';
            assert_int_equal(printable_bytes(text), 0);
            text[end] = 'a';
            assert_int_equal(printable_bytes(text), 0);
        }
    }
    for (int first = 0x80; first < 0x100; first++) {
        const char text[] = {(char)first, 'a', 'a', 'a', '\0'};
        assert_int_equal(printable_bytes(text), 0);
    }
    char *text = printable_text("a\x1b[0m\xc3\xa4\xff");
    assert_string_equal(text, "a?[0m\xc3\xa4?");
    free(text);
}

static void test_large_blocks(void **state)
{
    const size_t page = (size_t)2 << 20, sizes[] = {1, page - 1, page, page + 1, 3 * page - 1};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        void *block = allocate_large(sizes[i]);
        assert_true(malloc_usable_size(block) >= sizes[i]);
        assert_true(sizes[i] < page || (uintptr_t)block % page == 0);
        free(block);
        unsigned char *there = allocate_prefaulted(sizes[i], 1);
        for (size_t k = 0; k < sizes[i]; k++)
            assert_int_equal(there[k], 0);
        free(there);
    }
}

/* grow() makes room for one more element, and keeps the others. */
static void test_grow(void **state)
{
    uint32_t *items = NULL;
    for (uint32_t count = 0; count < 1000; count++) {
        items = grow(items, count, sizeof *items);
        assert_true(malloc_usable_size(items) >= (count + 1) * sizeof *items);
        items[count] = count;
        assert_int_equal(items[count / 2], count / 2);
    }
    free(items);
}

static void end_job(int status)
{
    fprintf(stderr, "all end\n");
    _exit(status);
}

static void fail_as_rank(void *rank)
{
    message_set_rank(*(int *)rank, end_job);
    fatal("there is no %s", "way on");
}

/* A rank that cannot go on says which it is, and ends the others as well. */
static void test_fatal(void **state)
{
    int rank = 12;
    assert_fatal(fail_as_rank, &rank, "farm: rank 12: there is no way on\nall end\n");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_printable),    cmocka_unit_test(test_unprintable),
        cmocka_unit_test(test_large_blocks), cmocka_unit_test(test_grow),
        cmocka_unit_test(test_fatal),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
