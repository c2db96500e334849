/* Tests of which renderers share cores. */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "common/clock.h"
#include "common/cores.h"
#include "master/crowd.h"
#include "test/random.h"
#include "test/unit.h"

/* A affinity with the cores from first to last. */
static struct affinity affinity_of(const char *machine, unsigned first, unsigned last)
{
    struct affinity affinity = {0};
    snprintf(affinity.machine, sizeof affinity.machine, "%s", machine);
    for (unsigned core = first; core <= last; core++)
        CPU_SET(core, &affinity.cores);
    return affinity;
}

/* The crowd of the affinities; asserts its numbers of groups and processors. */
static struct crowd crowd_of(const struct affinity *affinities, uint32_t count, uint32_t groups,
                             uint32_t processors)
{
    struct crowd crowd;
    crowd_init(&crowd, affinities, count);
    assert_int_equal(crowd.renderers, count);
    assert_int_equal(crowd.count, groups);
    assert_int_equal(crowd.processors, processors);
    return crowd;
}

static void test_machines(void **state)
{
    const struct affinity affinities[] = {affinity_of("a", 0, 1), affinity_of("b", 0, 7),
                                          affinity_of("a", 0, 1), affinity_of("b", 0, 7),
                                          affinity_of("a", 0, 1)};
    struct crowd crowd = crowd_of(affinities, 5, 2, 4);
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
    struct affinity affinities[4];
    for (unsigned i = 0; i < 4; i++)
        affinities[i] = affinity_of("a", i / 2, i / 2);
    struct crowd crowd = crowd_of(affinities, 4, 2, 2);
    assert_int_equal(crowd.group_of[0], crowd.group_of[1]);
    assert_int_not_equal(crowd.group_of[1], crowd.group_of[2]);
    crowd_free(&crowd);
    for (unsigned i = 0; i < 4; i++)
        affinities[i] = affinity_of("a", i, i);
    crowd = crowd_of(affinities, 4, 4, 4);
    assert_int_equal(crowd.cores, 4);
    crowd_free(&crowd);
}

/* The last renderer shares a core with two groups of three, which are merged. */
static void test_groups_merge(void **state)
{
    const struct affinity affinities[] = {affinity_of("a", 0, 0), affinity_of("a", 9, 9),
                                          affinity_of("a", 1, 1), affinity_of("a", 1, 1),
                                          affinity_of("a", 0, 1)};
    struct crowd crowd = crowd_of(affinities, 5, 2, 3);
    assert_int_equal(crowd.cores, 3);
    for (uint32_t i = 2; i < 5; i++)
        assert_int_equal(crowd.group_of[i], crowd.group_of[0]);
    assert_int_not_equal(crowd.group_of[1], crowd.group_of[0]);
    assert_int_equal(crowd.groups[crowd.group_of[0]].processors, 2);
    crowd_free(&crowd);
}

static void test_unknown(void **state)
{
    struct affinity affinities[6] = {0};
    affinities[2] = affinity_of("a", 0, 0);
    affinities[3] = affinities[5] = affinity_of("", 0, 0); /* not known to be the same */
    affinities[4].machine[0] = 'a';
    struct crowd crowd = crowd_of(affinities, 6, 6, 6);
    assert_int_equal(crowd.cores, 6);
    crowd_free(&crowd);
}

/* 100,000 machines are distinguished without comparing all pairs, which would take some 15 s. */
static void test_many_machines(void **state)
{
    enum { AFFINITIES = 100000 };
    struct affinity *affinities = calloc(AFFINITIES, sizeof *affinities);
    for (unsigned i = 0; i < AFFINITIES; i++) {
        char name[16];
        snprintf(name, sizeof name, "%u", i / 2);
        affinities[(i * 7919u) % AFFINITIES] = affinity_of(name, 0, i / 2 % 2);
    }
    double start = clock_thread_cpu();
    struct crowd crowd =
        crowd_of(affinities, AFFINITIES, AFFINITIES / 2, AFFINITIES / 2 + AFFINITIES / 4);
    assert_true(clock_thread_cpu() - start < 3);
    crowd_free(&crowd);
    free(affinities);
}

/* The groups are the same as by comparing all pairs until nothing changes. */
static void test_as_defined(void **state)
{
    enum { AFFINITIES = 40 };
    uint64_t seed = 1;
    for (int round = 0; round < 200; round++) {
        struct affinity affinities[AFFINITIES] = {0};
        uint32_t least[AFFINITIES];
        for (unsigned i = 0; i < AFFINITIES; i++) {
            char name[2] = {(char)('a' + random_below(&seed, 3)), 0};
            unsigned first = random_below(&seed, 60);
            affinities[i] = affinity_of(name, first, first + random_below(&seed, 4));
            least[i] = i;
        }
        for (bool changed = true; changed;) {
            changed = false;
            for (unsigned k = 0; k < AFFINITIES * AFFINITIES; k++) {
                unsigned a = k / AFFINITIES, b = k % AFFINITIES;
                cpu_set_t both;
                CPU_AND(&both, &affinities[a].cores, &affinities[b].cores);
                if (affinities[a].machine[0] != affinities[b].machine[0] || CPU_COUNT(&both) == 0)
                    continue;
                if (least[a] <= least[b]) continue;
                least[a] = least[b];
                changed = true;
            }
        }
        struct crowd crowd;
        uint32_t groups = 0;
        crowd_init(&crowd, affinities, AFFINITIES);
        for (unsigned i = 0; i < AFFINITIES; i++) {
            cpu_set_t all;
            CPU_ZERO(&all);
            uint32_t members = 0;
            for (unsigned k = 0; k < AFFINITIES; k++) {
                assert_int_equal(crowd.group_of[i] == crowd.group_of[k], least[i] == least[k]);
                if (least[i] != least[k]) continue;
                CPU_OR(&all, &all, &affinities[k].cores);
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
    struct affinity affinities[2];
    affinity_find(&affinities[0]);
    affinity_find(&affinities[1]);
    assert_true(affinities[0].machine[0] != '\0' && CPU_COUNT(&affinities[0].cores) > 0);
    struct crowd crowd = crowd_of(affinities, 2, 1, CPU_COUNT(&affinities[0].cores) < 2 ? 1 : 2);
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
