/* Tests the text of --help: it has all settings, in lines that fit. */
#include <string.h>

#include "master/help.h"
#include "test/unit.h"

#define TEXT_MOST 65536

static void make_text(char text[TEXT_MOST], int columns)
{
    FILE *out = fmemopen(text, TEXT_MOST, "w");
    print_help(out, columns);
    assert_int_equal(fclose(out), 0);
}

static void test_lists_all_keys(void **state)
{
    static char text[TEXT_MOST];
    make_text(text, 1000);
    static const char *const words[] = {
        "\n  image.width = 640                    pixels from left to right\n",
        "cyclic, cyclic-rows\n",
        "\n  [cone NAME]\n",
        "\n    apex_radius    a finite number >= 0 (0)\n",
        "[include NAME]",
        "the world outside has 1): a finite number > 0 (1.5)"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (!strstr(text, words[i])) fail_msg("no %s", words[i]);
}

/* Checks all lines but the examples, which are not broken, so that they can be copied; no line ends with a blank. */
static void check_lines(const char *text, size_t columns)
{
    const char *end = strstr(text, "examples:");
    for (const char *line = text; line < end; line += strcspn(line, "\n") + 1)
        if (strcspn(line, "\n") > columns) fail_msg("%.90s", line);
    assert_null(strstr(text, " \n"));
}

/* Continuation lines of broken text begin in its column. */
static void test_fits(void **state)
{
    static char text[TEXT_MOST];
    make_text(text, 70);
    assert_non_null(strstr(text,
                           "\n  camera.fov = 45                      vertical angle from edge to\n"
                           "                                       edge, degrees\n"));
    assert_non_null(strstr(text,
                           "\n    a              corners, counter-clockwise seen from the front:\n"
                           "                   three finite numbers separated by spaces\n"));
    check_lines(text, 70);
}

/* If there is no room for a column beside the names, what they mean stands below them. */
static void test_no_room(void **state)
{
    static char text[TEXT_MOST];
    make_text(text, 50);
    assert_non_null(strstr(text, "\n  camera.fov = 45\n"
                                 "        vertical angle from edge to edge, degrees\n"
                                 "  background.color\n"));
    assert_non_null(strstr(text, "\n  --allow-outside  read files that the scene names\n"
                                 "                   outside of its folder, too\n"));
    check_lines(text, 50);
    make_text(text, 30);
    assert_non_null(strstr(text, "\n    a\n"
                                 "        corners,\n"
                                 "        counter-clockwise seen\n"));
}

/* Without a terminal lines have the width that all terminals have. */
static void test_no_terminal(void **state)
{
    static char whole[TEXT_MOST], text[TEXT_MOST];
    make_text(whole, 0);
    make_text(text, 80);
    assert_string_equal(whole, text);
    check_lines(whole, 80);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lists_all_keys),
        cmocka_unit_test(test_fits),
        cmocka_unit_test(test_no_room),
        cmocka_unit_test(test_no_terminal),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
