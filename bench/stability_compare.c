#include "bench/stability_compare.h"

static void compare(struct score *score, const struct hit *hit, bool expected, mpfr_t t,
                    double (*error)(double, mpfr_t), uint64_t sample)
{
    if ((hit->primitive != PRIMITIVE_NONE) != expected)
        score_wrong(score, sample);
    else if (expected)
        score_error(score, error(hit->t, t), sample);
}

void compare_both(const struct stage *stage, const struct ray *ray, bool expected, mpfr_t t,
                  double (*error)(double, mpfr_t), struct tally *tally, uint64_t sample)
{
    struct hit ours = stage_nearest(stage, stage->ours, ray, &tally->fallbacks);
    struct hit paper = stage_nearest(stage, stage->paper, ray, NULL);
    compare(&tally->ours, &ours, expected, t, error, sample);
    compare(&tally->paper, &paper, expected, t, error, sample);
    tally->samples++;
}
