/* Tests of the text on what a run spent its time on before it rendered. */
#include <stdlib.h>

#include "master/start_times.h"
#include "test/unit.h"

static void assert_text(const struct run_times *time, const char *expected)
{
    char *text = start_times_text(time);
    assert_string_equal(text, expected);
    free(text);
}

/* The longest phases come first, whatever their order in the run; three at most. */
static void test_longest_three(void **state)
{
    const struct run_times time = {
        .init = 2, .load = 1, .room = 49.75, .resume = 4, .broadcast = 3, .build = 5};
    assert_text(&time, "picture memory 49.8 s, building the BVH 5 s, opening journal 4 s");
}

/* What takes less than a hundredth of the total is left out. */
static void test_short_are_left_out(void **state)
{
    assert_text(&(struct run_times){.load = 100, .build = 1.1},
                "loading 100 s, building the BVH 1.1 s");
    assert_text(&(struct run_times){.load = 99, .build = 1}, "loading 99 s, building the BVH 1 s");
    assert_text(&(struct run_times){.load = 100, .build = 0.9}, "loading 100 s");
}

/* The times of rendering and after it do not count. */
static void test_before_rendering_alone(void **state)
{
    assert_text(&(struct run_times){.broadcast = 0.25, .render = 1000, .write = 1000},
                "sharing scene 0.25 s");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_longest_three),
        cmocka_unit_test(test_short_are_left_out),
        cmocka_unit_test(test_before_rendering_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
