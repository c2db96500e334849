/* A note that is printed only where something takes long. */

#include "common/clock.h"
#include "common/message.h"
#include "master/late_note.h"
#include "test/unit.h"

static void test_late(void **state)
{
    char said[100] = "";
    struct late_note note;
    message_capture(said, sizeof said);
    double start = clock_wall();
    late_note_start(&note, "still there", 0.05);
    /* Until it is printed, which a busy machine may delay. */
    for (int i = 0; i < 10000 && !*(volatile char *)said; i++)
        clock_sleep(0.001);
    assert_true(clock_wall() - start >= 0.05);
    late_note_end(&note);
    message_capture(NULL, 0);
    assert_string_equal(said, "farm: still there\n");
}

/* What is done in time is not told, nor waited for, whether the thread that would tell it has begun to sleep or not. */
static void test_in_time(void **state)
{
    static const double takes[] = {0, 0.05};
    char said[100] = "";
    struct late_note note;
    double start = clock_wall();
    message_capture(said, sizeof said);
    for (int i = 0; i < 2; i++) {
        late_note_start(&note, "still there", 60);
        clock_sleep(takes[i]);
        late_note_end(&note);
    }
    message_capture(NULL, 0);
    assert_string_equal(said, "");
    assert_true(clock_wall() - start < 30);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_late),
        cmocka_unit_test(test_in_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
