/* Strings and numbers as JSON has them. */
#include <stdlib.h>

#include "common/message.h"
#include "master/json.h"
#include "test/unit.h"

static void assert_json_string(const char *value, const char *expected)
{
    struct json json;
    json_begin(&json);
    json_string(&json, NULL, value);
    char *text = json_end(&json), *whole = format_text("\"%s\"\n", expected);
    assert_string_equal(text, whole);
    free(whole);
    free(text);
}

static void test_json_strings(void **state)
{
    assert_json_string("", "");
    assert_json_string("a\"b\\c/\n\x7f\x01", "a\\\"b\\\\c/\\u000a\\u007f\\u0001");
    assert_json_string("\xc3\xa9 \xe2\x82\xac \xf0\x9f\x94\xa6",
                       "\xc3\xa9 \xe2\x82\xac \xf0\x9f\x94\xa6");
    assert_json_string("\xff", "\\ufffd");
    assert_json_string("a\xc3", "a\\ufffd");                     /* cut */
    assert_json_string("\xe2\x82", "\\ufffd\\ufffd");            /* cut */
    assert_json_string("\xc0\x80", "\\ufffd\\ufffd");            /* longer than need be */
    assert_json_string("\xe0\x80\x80", "\\ufffd\\ufffd\\ufffd"); /* the same */
    assert_json_string("\xed\xa0\x80", "\\ufffd\\ufffd\\ufffd"); /* a surrogate */
    assert_json_string("\xf4\x90\x80\x80", "\\ufffd\\ufffd\\ufffd\\ufffd"); /* above U+10FFFF */
}

static void test_json_numbers(void **state)
{
    const double values[] = {0.1, 1.0 / 3, 5e-324, 1.7976931348623157e308, 0, 123456789, -2.5};
    const char *const expected[] = {"0.1\n",
                                    "0.3333333333333333\n",
                                    "4.94065645841247e-324\n",
                                    "1.7976931348623157e+308\n",
                                    "0\n",
                                    "123456789\n",
                                    "-2.5\n"};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        struct json json;
        json_begin(&json);
        json_number(&json, NULL, values[i]);
        char *text = json_end(&json);
        assert_string_equal(text, expected[i]);
        assert_true(strtod(text, NULL) == values[i]);
        free(text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_json_strings),
        cmocka_unit_test(test_json_numbers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
