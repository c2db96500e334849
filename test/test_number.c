/* Tests of decimal numbers, compared with strtod(), and of texts that are no numbers. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/vec.h"
#include "master/number.h"
#include "test/random.h"
#include "test/unit.h"

static uint64_t bits_of(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static void check_like_strtod(const char *text)
{
    double value = -1;
    if (!number_parse(text, &value)) fail_msg("'%s' was refused", text);
    if (bits_of(value) != bits_of(strtod(text, NULL))) fail_msg("'%s' became %a", text, value);
}

static void test_plain_numbers(void **state)
{
    static const char *const texts[] = {"0",
                                        "-0",
                                        "+1",
                                        "1.",
                                        ".5",
                                        "-.5e1",
                                        "1e5",
                                        "1E+5",
                                        "1e-5",
                                        "0.1",
                                        "123456.789e-3",
                                        "9007199254740992",
                                        "9007199254740993",
                                        "18446744073709551616",
                                        "1e22",
                                        "1e23",
                                        "1e-22",
                                        "1e-23",
                                        "4.9e-324",
                                        "2.2250738585072011e-308",
                                        "1.7976931348623157e308",
                                        "1e-400",
                                        "0.000000000000000000000000000000001",
                                        "123456789012345678901234567890e-20",
                                        "0.30000000000000004440892098500626161694526672363281250",
                                        "1e-99999999999999999999",
                                        "1e-18446744073709551616", /* 0 modulo 2^64 */
                                        "00000000000000000000000000000000001.5",
                                        "0e999999999999999999999999"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        check_like_strtod(texts[i]);
}

static void test_no_numbers(void **state)
{
    static const char *const texts[] = {"",
                                        "+",
                                        "-",
                                        ".",
                                        "e5",
                                        ".e5",
                                        "1e",
                                        "1e+",
                                        "0x10",
                                        "inf",
                                        "nan",
                                        "-inf",
                                        "infinity",
                                        "1e400",
                                        "-1e309",
                                        "1,5",
                                        "1 ",
                                        " 1",
                                        "1.2.3",
                                        "--1",
                                        "1f",
                                        "1e5.0",
                                        "1.8e308",
                                        "1e99999999999999999999",
                                        "1e18446744073709551616"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        double value = 7;
        if (number_parse(texts[i], &value)) fail_msg("'%s' was accepted", texts[i]);
        assert_true(value == 7);
    }
}

static void test_random_numbers(void **state)
{
    uint64_t random = 88172645463325252u;
    static const char *const formats[] = {"%.3f", "%.6f", "%g", "%.17g", "%.25e", "%.1e"};
    for (int i = 0; i < 60000; i++) {
        char text[400];
        uint64_t bits = random_bits(&random);
        double value;
        memcpy(&value, &bits, sizeof value);
        if (i % 2) value = (double)(int64_t)bits * 1e-15; /* the usual sizes */
        if (!(value - value == 0)) continue;
        snprintf(text, sizeof text, formats[i % 6], value);
        check_like_strtod(text);
    }
}

static void test_scan_stops_behind_the_number(void **state)
{
    double value;
    const char *text = "-1.5e2/7";
    assert_ptr_equal(number_scan(text, &value), text + 6);
    assert_true(value == -150);
    text = "3e f";
    assert_ptr_equal(number_scan(text, &value), text + 1);
    assert_true(value == 3);
}

static void test_unsigned(void **state)
{
    uint32_t value;
    assert_true(number_parse_unsigned("4294967295", &value) && value == UINT32_MAX);
    assert_true(number_parse_unsigned("007", &value) && value == 7);
    static const char *const texts[] = {
        "", "-1", "+1", "1.0", "4294967296", "1e3", " 1", "1x", "99999999999999999999999999"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        assert_false(number_parse_unsigned(texts[i], &value));
}

static void test_format_reads_back(void **state)
{
    char text[NUMBER_TEXT_SIZE];
    assert_string_equal(number_format(0.1, text), "0.1");
    assert_string_equal(number_format(640, text), "640");
    assert_string_equal(number_format(0.001953125, text), "0.001953125");
    uint64_t random = 1234567;
    for (int i = 0; i < 5000; i++) {
        uint64_t bits = random_bits(&random);
        double value, back;
        memcpy(&value, &bits, sizeof value);
        if (!(value - value == 0)) continue;
        assert_true(number_parse(number_format(value, text), &back));
        assert_true(bits_of(back) == bits);
    }
}

/* Lengths and unit vectors over the whole range of double; scaling by 2^k changes no bit. */
static void test_unit_vectors(void **state)
{
    static const double sizes[] = {4.9e-324, 1e-320, 1e-308, 1e-200, 1e-136,
                                   1,        1e150,  1e300,  1.7e308};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        double s = sizes[i];
        struct vec3 u = vec_normalize(vec3(s, -s, s)), axis = vec_normalize(vec3(0, -s, 0));
        assert_true(fabs(vec_dot(u, u) - 1) < 1e-15 && u.x == u.z && u.x == -u.y);
        assert_true(axis.x == 0 && axis.y == -1 && axis.z == 0);
    }
    struct vec3 v = vec3(0.3, -0.7, 1.9), plain = vec_normalize(v);
    for (int k = -1000; k <= 1000; k++) {
        struct vec3 scaled = vec_normalize(vec_scale_exactly(v, k));
        assert_memory_equal(&scaled, &plain, sizeof plain);
        assert_true(vec_length(vec_scale_exactly(v, k)) == ldexp(vec_length(v), k));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unit_vectors),
        cmocka_unit_test(test_plain_numbers),
        cmocka_unit_test(test_no_numbers),
        cmocka_unit_test(test_random_numbers),
        cmocka_unit_test(test_scan_stops_behind_the_number),
        cmocka_unit_test(test_unsigned),
        cmocka_unit_test(test_format_reads_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
