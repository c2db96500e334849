#include "bench/oracle.h"

#include <float.h>

#include "common/message.h"

void oracle_exact_begin(void)
{
    mpfr_clear_flags();
}

void oracle_exact_end(void)
{
    if (mpfr_flags_test(MPFR_FLAGS_INEXACT | MPFR_FLAGS_UNDERFLOW | MPFR_FLAGS_OVERFLOW |
                        MPFR_FLAGS_NAN))
        fatal("an oracle's exact arithmetic needs more than %d bits", ORACLE_BITS);
}

void reals_init(mpfr_t *reals, unsigned count)
{
    for (unsigned i = 0; i < count; i++)
        mpfr_init2(reals[i], ORACLE_BITS);
}

void reals_clear(mpfr_t *reals, unsigned count)
{
    for (unsigned i = 0; i < count; i++)
        mpfr_clear(reals[i]);
}

void real_set(mpfr_t out[3], struct vec3 a)
{
    mpfr_set_d(out[0], a.x, MPFR_RNDN);
    mpfr_set_d(out[1], a.y, MPFR_RNDN);
    mpfr_set_d(out[2], a.z, MPFR_RNDN);
}

void real_difference(mpfr_t out[3], struct vec3 a, struct vec3 b)
{
    real_set(out, a);
    mpfr_sub_d(out[0], out[0], b.x, MPFR_RNDN);
    mpfr_sub_d(out[1], out[1], b.y, MPFR_RNDN);
    mpfr_sub_d(out[2], out[2], b.z, MPFR_RNDN);
}

void real_dot(mpfr_t out, mpfr_t a[3], mpfr_t b[3])
{
    mpfr_fmma(out, a[0], b[0], a[1], b[1], MPFR_RNDN);
    mpfr_fma(out, a[2], b[2], out, MPFR_RNDN);
}

void real_cross(mpfr_t out[3], mpfr_t a[3], mpfr_t b[3])
{
    for (unsigned i = 0; i < 3; i++) {
        unsigned j = (i + 1) % 3, k = (i + 2) % 3;
        mpfr_fmms(out[i], a[j], b[k], a[k], b[j], MPFR_RNDN);
    }
}

static double scaled_difference(double value, mpfr_t truth, int exponent)
{
    mpfr_t difference;
    mpfr_init2(difference, ORACLE_BITS);
    mpfr_d_sub(difference, value, truth, MPFR_RNDN);
    mpfr_abs(difference, difference, MPFR_RNDN);
    mpfr_mul_2si(difference, difference, -exponent, MPFR_RNDN);
    double scaled = mpfr_get_d(difference, MPFR_RNDU);
    mpfr_clear(difference);
    return scaled;
}

double ulps(double value, mpfr_t truth)
{
    if (!isfinite(value)) return HUGE_VAL;
    if (mpfr_zero_p(truth)) return value == 0 ? 0 : HUGE_VAL;
    int last_place = (int)mpfr_get_exp(truth) - DBL_MANT_DIG;
    int smallest = DBL_MIN_EXP - DBL_MANT_DIG;
    return scaled_difference(value, truth, last_place > smallest ? last_place : smallest);
}

double roundoffs(double value, mpfr_t truth)
{
    if (!isfinite(value)) return HUGE_VAL;
    if (mpfr_zero_p(truth)) return value == 0 ? 0 : HUGE_VAL;
    long exponent;
    double mantissa = fabs(mpfr_get_d_2exp(&exponent, truth, MPFR_RNDN)); /* 0.5 .. 1 */
    /* A unit in the last place is 2^(exponent - 53), u |truth| is 2^-53 mantissa 2^exponent. */
    return scaled_difference(value, truth, (int)mpfr_get_exp(truth) - DBL_MANT_DIG) / mantissa;
}
