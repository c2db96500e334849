/* Fuzzes numbers in text: the result must have the same bits as that of strtod(). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/number.h"
#include "test/fuzz/fuzz.h"

/* strtod() accepts more: blanks before the number, hexadecimal, inf and nan. */
static bool is_decimal(const char *text)
{
    size_t sign = *text == '-' || *text == '+';
    size_t whole = strspn(text + sign, "0123456789");
    if (text[sign] == '0' && (text[sign + 1] == 'x' || text[sign + 1] == 'X')) return false;
    const char *point = text + sign + whole;
    return whole || (*point == '.' && strspn(point + 1, "0123456789"));
}

/* So that -0 is not equal to 0. */
static bool same_bits(double a, double b)
{
    return a == b && signbit(a) == signbit(b);
}

static void check_format(double value)
{
    char text[NUMBER_TEXT_SIZE];
    double back;
    PROMISE(number_parse(number_format(value, text), &back) && back == value);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char *text = allocate(size + 1, 1), *end;
    memcpy(text, data, size);
    text[size] = '\0';
    double value = 1, finite, expected = strtod(text, &end);
    uint32_t whole = 7;
    const char *stop = number_scan(text, &value);
    if (is_decimal(text)) {
        PROMISE(stop == end && same_bits(value, expected));
    } else {
        PROMISE(!stop || (stop == text + 1 + (*text == '-' || *text == '+') && value == 0));
    }
    if (number_parse(text, &finite)) check_format(finite);
    if (number_parse_unsigned(text, &whole)) PROMISE(strtoull(text, NULL, 10) == whole);
    free(text);
    return 0;
}
