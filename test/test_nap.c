/* Tests of naps: their lengths, and that they end on time. */
#include <sys/prctl.h>

#include "common/nap.h"
#include "test/unit.h"

static void test_sharpen(void **state)
{
    /* What is left of the 50 us that a process begins with must not count beside the shortest nap. */
    nap_sharpen();
    assert_true(prctl(PR_GET_TIMERSLACK) * 1e-9 <= NAP_SHORTEST / 10);
}

/* From the shortest to the longest, and back with nap_reset(). */
static void test_lengths(void **state)
{
    struct nap nap = {0};
    nap_take(&nap);
    assert_true(nap.seconds == 2 * NAP_SHORTEST);
    for (int i = 0; i < 7; i++)
        nap_take(&nap);
    assert_true(nap.seconds == NAP_LONGEST);
    nap_reset(&nap);
    assert_true(nap.seconds == NAP_SHORTEST && nap.waited == 0);
    /* After a long wait naps are long. */
    assert_true(nap_after(2 * NAP_LONGEST / NAP_PART, NAP_LONGEST) == 2 * NAP_LONGEST);
    assert_true(nap_after(1.5 * NAP_LONGEST / NAP_PART, NAP_LONGEST) == 1.5 * NAP_LONGEST);
    assert_true(nap_after(100, NAP_SELDOM) == NAP_SELDOM);
}

/* A waiter that hears something every 0.4 ms first sleeps for half of that; one that hears something all the time
 * polls at once. */
static void test_heard(void **state)
{
    struct nap nap = {0};
    double now = 0;
    for (int i = 0; i < 100; i++)
        nap_heard(&nap, now += 4e-4);
    assert_true(nap.seconds > 1.9e-4 && nap.seconds < 2.1e-4 && nap.waited == 0);
    nap_reset(&nap);
    assert_true(nap.seconds == NAP_SHORTEST);
    nap_heard(&nap, now += 10);
    assert_true(nap.seconds == NAP_LONGEST);
    for (int i = 0; i < 100; i++)
        nap_heard(&nap, now += 1e-6);
    assert_true(nap.seconds == NAP_SHORTEST);
}

/* A waiter that expects something soon polls for as long as a nap takes before the first one. A waiter that expects
 * nothing for some time sleeps for a part of that at once, but not for long. */
static void test_soon_and_calm(void **state)
{
    struct nap nap = {0};
    double begin = clock_wall();
    while (nap_spins(&nap)) {
    }
    assert_true(clock_wall() - begin >= NAP_SPIN);
    nap_reset(&nap);
    assert_true(nap_next_calm(&nap, 1e-3) == nap_calm(1e-3));
    assert_true(nap.waited == 0 && nap.seconds == NAP_SHORTEST);
    assert_true(nap_next_calm(&nap, 0) == NAP_SHORTEST);
    assert_true(nap.waited == NAP_SHORTEST);
    assert_true(nap_calm(4e-3) == 4e-3 * NAP_CALM_PART && nap_calm(1e9) == NAP_SELDOM);
    assert_true(nap_calm(-1) <= 0);
}

/* After a ring, naps are short until what the bell was rung for has come, or for a while. */
static void test_woken(void **state)
{
    struct nap nap = {0};
    assert_false(nap_is_rung(&nap));
    nap_woken(&nap);
    assert_true(nap_is_rung(&nap) && nap.seconds == NAP_SHORTEST);
    nap_reset(&nap);
    assert_false(nap_is_rung(&nap));
    nap_woken(&nap);
    double waited = 0;
    while (nap_is_rung(&nap))
        waited += nap_next(&nap);
    assert_true(waited > NAP_RUNG && waited <= NAP_RUNG + NAP_LONGEST);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sharpen), cmocka_unit_test(test_lengths),
        cmocka_unit_test(test_heard),   cmocka_unit_test(test_soon_and_calm),
        cmocka_unit_test(test_woken),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
