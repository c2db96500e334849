#include <math.h>
#include <stdio.h>
#include <sys/stat.h>

#include "master/image_file.h"
#include "master/truth.h"
#include "test/scratch.h"
#include "test/text.h"

static char path[] = "reference.pfm";

static char why[512]; /* was it refused */

static bool reads(const char *header, const float *values, size_t count)
{
    char text[512];
    size_t length = strlen(header);
    memcpy(text, header, length);
    memcpy(text + length, values, count * sizeof *values);
    struct canvas canvas;
    why[0] = '\0';
    message_capture(why, sizeof why);
    write_bytes(path, text, length + count * sizeof *values);
    bool read = truth_read(path, 2, 2, &canvas);
    message_capture(NULL, 0);
    assert_true(read == (why[0] == '\0'));
    if (read) {
        /* Rows from the bottom. */
        for (size_t i = 0; i < 6; i++)
            assert_true(canvas.rgb[i] == values[6 + i] && canvas.rgb[6 + i] == values[i]);
        canvas_free(&canvas);
    }
    return read;
}

static void test_reading(void **state)
{
    float values[13] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    assert_true(reads("PF\n2 2\n-1.0\n", values, 12));
    assert_true(reads("PF 2 2 -0.5\n", values, 12));
    assert_true(reads("PF\t2\r2\t-1\r", values, 12));
    assert_false(reads("PF\n2 2\n-1.0\n", values, 11));
    assert_has(why, "reference.pfm: is cut, expected a colour PFM of 2 x 2 pixels");
    assert_false(reads("PF\n2 2\n-1.0\n", values, 0));
    assert_has(why, " is cut,");
    assert_false(reads("PF\n2 2\n-1.0\n", values, 13));
    assert_has(why, " goes on behind its pixels,");
    assert_false(reads("PF\n2 3\n-1.0\n", values, 12));
    assert_has(why, " has 2 x 3 pixels,");
    assert_false(reads("PF\n3 2\n-1.0\n", values, 12));
    assert_false(reads("PF\n2 2\n0\n", values, 12));
    assert_false(reads("PF\n2 2\nx\n", values, 12));
    assert_false(reads("PF\n2 2\n-1x\n", values, 12));
    assert_false(reads("Pf\n2 2\n-1.0\n", values, 12));
    assert_false(reads("P6\n2 2\n255\n", values, 12));
    assert_false(reads("PF\n2 2", values, 0));
    assert_false(reads("", values, 0));
    assert_false(
        reads("PF\n22222222222222222222222222222222222222222222222 2\n-1.0\n", values, 12));
    values[7] = NAN;
    assert_false(reads("PF\n2 2\n-1.0\n", values, 12));
    assert_has(why, " has a pixel that is not finite,");
}

/* A pipe is not waited for, and a folder is not read. */
static void test_no_file(void **state)
{
    static const char *const paths[] = {"pipe.pfm", "folder.pfm", "nothing.pfm"};
    static const char *const wrong[] = {"is not a regular file", "is a folder", "cannot be opened"};
    struct canvas canvas;
    assert_int_equal(mkfifo(paths[0], 0600), 0);
    assert_int_equal(mkdir(paths[1], 0700), 0);
    for (size_t i = 0; i < sizeof paths / sizeof *paths; i++) {
        message_capture(why, sizeof why);
        assert_false(truth_read(paths[i], 2, 2, &canvas));
        message_capture(NULL, 0);
        assert_true(strncmp(why, paths[i], strlen(paths[i])) == 0);
        assert_has(why, wrong[i]);
        assert_true(strchr(why, '\n') == why + strlen(why) - 1);
    }
}

static void test_other_byte_order(void **state)
{
    const char text[] = "PF\n1 1\n1.0\n\x3f\x80\0\0\xc0\0\0\0\x3f\0\0\0";
    struct canvas canvas;
    write_bytes(path, text, sizeof text - 1);
    assert_true(truth_read(path, 1, 1, &canvas));
    assert_true(canvas.rgb[0] == 1 && canvas.rgb[1] == -2 && canvas.rgb[2] == 0.5f);
    canvas_free(&canvas);
}

/* The farm can read what it writes. */
static void test_round_trip(void **state)
{
    struct canvas canvas, back;
    canvas_init(&canvas, 7, 3);
    for (int i = 0; i < 63; i++)
        canvas.rgb[i] = (float)i / 7;
    assert_true(image_write("written.pfm", &canvas, NULL));
    assert_true(truth_read("written.pfm", 7, 3, &back));
    assert_memory_equal(canvas.rgb, back.rgb, 63 * sizeof *canvas.rgb);
    assert_true(truth_rmse(&canvas, &back) == 0);
    canvas_free(&canvas);
    canvas_free(&back);
}

static void test_differences(void **state)
{
    struct canvas canvas, reference;
    canvas_init(&canvas, 100, 100);
    canvas_init(&reference, 100, 100);
    for (int i = 0; i < 20; i++)
        canvas.rgb[3 * i] = 2; /* twenty pixels of 10000 are off, one of them farther */
    canvas.rgb[1] = -3;
    struct truth truth = truth_of(&canvas, &reference);
    assert_true(fabs(truth.rmse - sqrt((20 * 4 + 9) / 30000.0)) < 1e-12);
    assert_true(truth.most == 3 && truth.p999 == 2);
    for (int i = 0; i < 20; i++)
        canvas.rgb[3 * i] = 2 + (float)i / 7; /* 10 of them are larger than 99.9 % of all */
    truth = truth_of(&canvas, &reference);
    assert_true(truth.p999 == (double)(2 + 9.0f / 7));
    canvas.rgb[299] = NAN; /* the difference of such a pixel is not 0 */
    truth = truth_of(&canvas, &reference);
    assert_true(truth.most == HUGE_VAL && truth.p999 == (double)(2 + 10.0f / 7));
    canvas_free(&canvas);
    canvas_free(&reference);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reading),          cmocka_unit_test(test_no_file),
        cmocka_unit_test(test_other_byte_order), cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_differences),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
