#include "master/number.h"

#include <locale.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

/* Every power of ten up to 10^22 = 2^22 5^22 is a double without rounding (5^22 < 2^53). */
static const double powers_of_ten[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                       1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                       1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
#define EXACT_EXPONENT 22
#define EXACT_MANTISSA (UINT64_C(1) << 53)
/* A mantissa below this can take one more digit and still be less than 2^64. */
#define MANTISSA_ROOM  (UINT64_C(1000000000000000000))
/* Larger exponents make no difference to strtod(): with any mantissa that fits in memory the result is 0 or
 * infinite. */
#define EXPONENT_CAP   100000000000000000

/* A number taken apart: mantissa * 10^exponent, if exact. */
struct decimal {
    uint64_t mantissa;
    int64_t exponent;
    size_t digits;
    bool exact; /* the mantissa holds all digits */
};

static const char *scan_digits(const char *at, struct decimal *decimal, int64_t shift)
{
    for (; (unsigned char)(*at - '0') < 10; at++) {
        decimal->digits++;
        if (decimal->mantissa >= MANTISSA_ROOM) {
            decimal->exact = false;
            continue;
        }
        decimal->mantissa = decimal->mantissa * 10 + (uint64_t)(*at - '0');
        decimal->exponent += shift;
    }
    return at;
}

/* An e without digits after it does not belong to the number. */
static const char *scan_exponent(const char *at, struct decimal *decimal)
{
    const char *digit = at + 1;
    bool negative = *digit == '-';
    if (*digit == '-' || *digit == '+') digit++;
    if ((unsigned char)(*digit - '0') >= 10) return at;
    int64_t exponent = 0;
    for (; (unsigned char)(*digit - '0') < 10; digit++)
        if (exponent < EXPONENT_CAP) exponent = exponent * 10 + (*digit - '0');
    decimal->exponent += negative ? -exponent : exponent;
    return digit;
}

static const char *scan_slowly(const char *text, const char *end, double *value)
{
    locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (!plain) return NULL;
    char *stop;
    double number = strtod_l(text, &stop, plain);
    freelocale(plain);
    if (stop != end) return NULL;
    *value = number;
    return end;
}

const char *number_scan(const char *text, double *value)
{
    struct decimal decimal = {.exact = true};
    bool negative = *text == '-';
    const char *at = text + (*text == '-' || *text == '+');
    at = scan_digits(at, &decimal, 0);
    if (*at == '.') at = scan_digits(at + 1, &decimal, -1);
    if (!decimal.digits) return NULL;
    if (*at == 'e' || *at == 'E') at = scan_exponent(at, &decimal);

    if (!decimal.exact || decimal.mantissa > EXACT_MANTISSA || decimal.exponent > EXACT_EXPONENT ||
        decimal.exponent < -EXACT_EXPONENT)
        return scan_slowly(text, at, value);
    /* Both operands are exact, so there is one rounding, that of the result, and it is correct. */
    double number = (double)decimal.mantissa;
    number = decimal.exponent < 0 ? number / powers_of_ten[-decimal.exponent]
                                  : number * powers_of_ten[decimal.exponent];
    *value = negative ? -number : number;
    return at;
}

bool number_parse(const char *text, double *value)
{
    double number;
    const char *end = number_scan(text, &number);
    if (!end || *end || !isfinite(number)) return false;
    *value = number;
    return true;
}

const char *number_scan_unsigned(const char *text, uint32_t *value)
{
    uint64_t number = 0;
    const char *at = text;
    for (; (unsigned char)(*at - '0') < 10; at++) {
        number = number * 10 + (uint64_t)(*at - '0');
        if (number > UINT32_MAX) return NULL;
    }
    if (at == text) return NULL;
    *value = (uint32_t)number;
    return at;
}

bool number_parse_unsigned(const char *text, uint32_t *value)
{
    uint32_t number;
    const char *end = number_scan_unsigned(text, &number);
    if (!end || *end) return false;
    *value = number;
    return true;
}

const char *number_format(double value, char text[NUMBER_TEXT_SIZE])
{
    /* %g drops trailing zeros, so 15 digits are not too many; a smaller precision would write 640 as 6.4e+02. */
    for (int precision = 15; precision <= 17; precision++) {
        double back;
        snprintf(text, NUMBER_TEXT_SIZE, "%.*g", precision, value);
        if (number_parse(text, &back) && back == value) break;
    }
    return text;
}
