/* What samples cost: in effort, and in seconds as measured. */
#include <math.h>

#include "master/allocation.h"
#include "master/effort.h"
#include "test/near.h"
#include "test/unit.h"

/* Levels of 4, 8, ... 64 samples, and one more of 100 when they are extended. */
static struct levels some_levels(bool extended)
{
    const struct view view = {.min_samples = 4, .max_samples = 64};
    struct levels levels;
    levels_init(&levels, &view);
    if (extended) levels_extend(&levels, 100);
    return levels;
}

/* The effort between any two levels is that of the samples by which they differ. */
static void test_effort_between_levels(void **state)
{
    struct effort effort;
    struct levels levels = some_levels(false);
    effort_init(&effort, &levels);
    assert_close(effort_between(&effort, 0, 1), pow(4, EFFORT_POWER), 1e-12);
    assert_close(effort_between(&effort, 1, 2), pow(4, EFFORT_POWER), 1e-12);
    assert_close(effort_between(&effort, 2, 5), pow(56, EFFORT_POWER), 1e-12);
    levels = some_levels(true);
    effort_set_levels(&effort, &levels);
    assert_close(effort_between(&effort, 5, 6), pow(36, EFFORT_POWER), 1e-12);
    assert_close(effort_between(&effort, 0, LEVEL_MAX), pow(100, EFFORT_POWER), 1e-12);
}

/* Until later samples have been measured they are taken to cost 1.26 times as much per effort as first ones; when they
 * have had a fifth of the effort of those, both count alike, and then they alone. */
static void test_seconds_of_later_samples(void **state)
{
    struct effort effort;
    struct levels levels = some_levels(false);
    effort_init(&effort, &levels);
    assert_true(isnan(effort_seconds_per_unit(&effort)));
    double unit = effort_between(&effort, 0, 1); /* 4 samples, here as between levels 1 and 2 */
    effort_add(&effort, 0, 1, 10);
    effort.on_first.seconds += 50 * unit;
    assert_close(effort_seconds_per_unit(&effort), 1.26 * 5, 1e-12);
    effort_add(&effort, 1, 2, 2);
    effort.on_later.seconds += 4 * unit;
    assert_close(effort_seconds_per_unit(&effort), (1.26 * 5 + 2) / 2, 1e-12);
    effort_add(&effort, 1, 2, 1e15);
    effort.on_later.seconds += 3e15 * unit;
    assert_close(effort_seconds_per_unit(&effort), 3, 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_effort_between_levels),
        cmocka_unit_test(test_seconds_of_later_samples),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
