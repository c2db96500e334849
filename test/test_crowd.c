/* Tests of which renderers share cores. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "common/clock.h"
#include "common/cores.h"
#include "master/crowd.h"
#include "test/random.h"

/* A berth with the cores from first to last. */
static struct berth berth_of(const char *machine, unsigned first, unsigned last)
{
    struct berth berth = {0};
    snprintf(berth.machine, sizeof berth.machine, "%s", machine);
    for (unsigned core = first; core <= last; core++)
        CPU_SET(core, &berth.cores);
    return berth;
}

/* The crowd of the berths; asserts its numbers of groups and processors. */
static struct crowd crowd_of(const struct berth *berths, uint32_t count, uint32_t groups,
                             uint32_t processors)
{
    struct crowd crowd;
    crowd_init(&crowd, berths, count);
    assert_int_equal(crowd.renderers, count);
    assert_int_equal(crowd.count, groups);
    assert_int_equal(crowd.processors, processors);
    return crowd;
}

static void test_machines(void **state)
{
    (void)state;
    const struct berth berths[] = {berth_of("a", 0, 1), berth_of("b", 0, 7), berth_of("a", 0, 1),
                                   berth_of("b", 0, 7), berth_of("a", 0, 1)};
    struct crowd crowd = crowd_of(berths, 5, 2, 4);
    assert_int_equal(crowd.group_of[0], crowd.group_of[4]);
    assert_int_not_equal(crowd.group_of[0], crowd.group_of[1]);
    const struct crowd_group *three = &crowd.groups[crowd.group_of[0]];
    assert_true(three->renderers == 3 && three->processors == 2);
    const struct crowd_group *two = &crowd.groups[crowd.group_of[1]];
    assert_true(two->renderers == 2 && two->processors == 2);
    assert_int_equal(crowd.cores, 2 + 8);
    crowd_free(&crowd);
}

/* Renderers that are each bound to another core do not share any. */
static void test_bound(void **state)
{
    (void)state;
    struct berth berths[4];
    for (unsigned i = 0; i < 4; i++)
        berths[i] = berth_of("a", i / 2, i / 2);
    struct crowd crowd = crowd_of(berths, 4, 2, 2);
    assert_int_equal(crowd.group_of[0], crowd.group_of[1]);
    assert_int_not_equal(crowd.group_of[1], crowd.group_of[2]);
    crowd_free(&crowd);
    for (unsigned i = 0; i < 4; i++)
        berths[i] = berth_of("a", i, i);
    crowd = crowd_of(berths, 4, 4, 4);
    assert_int_equal(crowd.cores, 4);
    crowd_free(&crowd);
}

/* The last renderer shares a core with two groups of three, which are merged. */
static void test_groups_merge(void **state)
{
    (void)state;
    const struct berth berths[] = {berth_of("a", 0, 0), berth_of("a", 9, 9), berth_of("a", 1, 1),
                                   berth_of("a", 1, 1), berth_of("a", 0, 1)};
    struct crowd crowd = crowd_of(berths, 5, 2, 3);
    assert_int_equal(crowd.cores, 3);
    for (uint32_t i = 2; i < 5; i++)
        assert_int_equal(crowd.group_of[i], crowd.group_of[0]);
    assert_int_not_equal(crowd.group_of[1], crowd.group_of[0]);
    assert_int_equal(crowd.groups[crowd.group_of[0]].processors, 2);
    crowd_free(&crowd);
}

static void test_unknown(void **state)
{
    (void)state;
    struct berth berths[5] = {0};
    berths[2] = berth_of("a", 0, 0);
    berths[3] = berth_of("", 0, 0);
    berths[4].machine[0] = 'a';
    struct crowd crowd = crowd_of(berths, 5, 5, 5);
    assert_int_equal(crowd.cores, 5);
    crowd_free(&crowd);
}

/* 100,000 machines are distinguished without comparing all pairs, which would take some 15 s. */
static void test_many_machines(void **state)
{
    (void)state;
    enum { BERTHS = 100000 };
    struct berth *berths = calloc(BERTHS, sizeof *berths);
    for (unsigned i = 0; i < BERTHS; i++) {
        char name[16];
        snprintf(name, sizeof name, "%u", i / 2);
        berths[(i * 7919u) % BERTHS] = berth_of(name, 0, i / 2 % 2);
    }
    double start = clock_thread_cpu();
    struct crowd crowd = crowd_of(berths, BERTHS, BERTHS / 2, BERTHS / 2 + BERTHS / 4);
    assert_true(clock_thread_cpu() - start < 3);
    crowd_free(&crowd);
    free(berths);
}

/* The groups are the same as by comparing all pairs until nothing changes. */
static void test_as_defined(void **state)
{
    (void)state;
    enum { BERTHS = 40 };
    uint64_t seed = 1;
    for (int round = 0; round < 200; round++) {
        struct berth berths[BERTHS] = {0};
        uint32_t least[BERTHS];
        for (unsigned i = 0; i < BERTHS; i++) {
            char name[2] = {(char)('a' + random_below(&seed, 3)), 0};
            unsigned first = random_below(&seed, 60);
            berths[i] = berth_of(name, first, first + random_below(&seed, 4));
            least[i] = i;
        }
        for (bool changed = true; changed;) {
            changed = false;
            for (unsigned k = 0; k < BERTHS * BERTHS; k++) {
                unsigned a = k / BERTHS, b = k % BERTHS;
                cpu_set_t both;
                CPU_AND(&both, &berths[a].cores, &berths[b].cores);
                if (berths[a].machine[0] != berths[b].machine[0] || CPU_COUNT(&both) == 0) continue;
                if (least[a] <= least[b]) continue;
                least[a] = least[b];
                changed = true;
            }
        }
        struct crowd crowd;
        uint32_t groups = 0;
        crowd_init(&crowd, berths, BERTHS);
        for (unsigned i = 0; i < BERTHS; i++) {
            cpu_set_t all;
            CPU_ZERO(&all);
            uint32_t members = 0;
            for (unsigned k = 0; k < BERTHS; k++) {
                assert_int_equal(crowd.group_of[i] == crowd.group_of[k], least[i] == least[k]);
                if (least[i] != least[k]) continue;
                CPU_OR(&all, &all, &berths[k].cores);
                members++;
            }
            const struct crowd_group *group = &crowd.groups[crowd.group_of[i]];
            uint32_t cores = (uint32_t)CPU_COUNT(&all);
            assert_int_equal(group->renderers, members);
            assert_int_equal(group->processors, cores < members ? cores : members);
            groups += least[i] == i;
        }
        assert_int_equal(crowd.count, groups);
        crowd_free(&crowd);
    }
}

/* Two processes here say the same. */
static void test_find(void **state)
{
    (void)state;
    struct berth berths[2];
    berth_find(&berths[0]);
    berth_find(&berths[1]);
    assert_true(berths[0].machine[0] != '\0' && CPU_COUNT(&berths[0].cores) > 0);
    struct crowd crowd = crowd_of(berths, 2, 1, CPU_COUNT(&berths[0].cores) < 2 ? 1 : 2);
    crowd_free(&crowd);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_machines),     cmocka_unit_test(test_bound),
        cmocka_unit_test(test_groups_merge), cmocka_unit_test(test_unknown),
        cmocka_unit_test(test_find),         cmocka_unit_test(test_many_machines),
        cmocka_unit_test(test_as_defined),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
