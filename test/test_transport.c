/* What MPI is told before it starts. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "common/transport.h"

static void test_what_is_short_is_eager(void **state)
{
    (void)state;
    unsetenv("UCX_RNDV_THRESH");
    transport_prefer_eager();
    assert_string_equal(getenv("UCX_RNDV_THRESH"), "128k");
}

static void test_users_choice_stays(void **state)
{
    (void)state;
    setenv("UCX_RNDV_THRESH", "4k", 1);
    transport_prefer_eager();
    assert_string_equal(getenv("UCX_RNDV_THRESH"), "4k");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_is_short_is_eager),
        cmocka_unit_test(test_users_choice_stays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
