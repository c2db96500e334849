/* Tests of the levels of processor, whichever this one supports. */
#include <stdlib.h>

#include "common/processor.h"
#include "test/unit.h"

static enum processor_level highest;

static bool has(enum processor_level level)
{
    return level <= highest;
}

static void check_choices(enum processor_level most, const char *expected)
{
    highest = most;
    char *text = processor_choices(has);
    assert_string_equal(text, expected);
    free(text);
}

static void test_choices(void **state)
{
    check_choices(PROCESSOR_PORTABLE, "auto or portable");
    check_choices(PROCESSOR_AVX2, "auto, portable or avx2");
    check_choices(PROCESSOR_AVX512, "auto, portable, avx2 or avx512");
}

/* "auto" resolves to a level that this processor supports. */
static void test_resolve(void **state)
{
    enum processor_level level = processor_resolve(PROCESSOR_AUTO);
    assert_true(level != PROCESSOR_AUTO && processor_has(level));
    assert_int_equal(processor_resolve(PROCESSOR_PORTABLE), PROCESSOR_PORTABLE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_choices),
        cmocka_unit_test(test_resolve),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
