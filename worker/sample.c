#include "worker/sample.h"

/*
 * The R2 sequence (M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018):
 * steps of 1/g and 1/g^2, with g = 1.3247... the real root of g^3 = g + 1. Low discrepancy for any
 * number of samples, each added sample included.
 */
#define R2_STEP_X 0.75487766624669276
#define R2_STEP_Y 0.56984029099805327

/* A 64-bit mix in which every input bit reaches every output bit (the finaliser of SplitMix64,
 * G. Steele, D. Lea & C. Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014). */
static uint64_t mix(uint64_t bits)
{
    bits += UINT64_C(0x9e3779b97f4a7c15);
    bits = (bits ^ bits >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    bits = (bits ^ bits >> 27) * UINT64_C(0x94d049bb133111eb);
    return bits ^ bits >> 31;
}

static double fraction(double x)
{
    return x - floor(x);
}

void sample_position(uint32_t x, uint32_t y, uint32_t sample, uint32_t samples, double offset[2])
{
    if (samples == 1) {
        offset[0] = offset[1] = 0.5;
        return;
    }
    /* Each pixel turns the pattern by an amount of its own, so that neighbours do not share it and
     * what error is left looks like fine grain instead of a repeating figure. */
    uint64_t seed = mix((uint64_t)y << 32 | x);
    double turn_x = (double)(seed >> 32) * 0x1p-32;
    double turn_y = (double)(seed & UINT32_MAX) * 0x1p-32;
    offset[0] = fraction(turn_x + sample * R2_STEP_X);
    offset[1] = fraction(turn_y + sample * R2_STEP_Y);
}

struct ray sample_ray(const struct view *view, uint32_t x, uint32_t y, uint32_t sample)
{
    double offset[2];
    sample_position(x, y, sample, view->samples, offset);
    double height = view->height;
    double u = (2 * (x + offset[0]) - view->width) / height;
    double v = (2 * (y + offset[1]) - height) / height;
    const struct camera *camera = &view->camera;
    struct vec3 direction = camera->forward;
    direction = vec_add_scaled(direction, camera->right, u);
    direction = vec_add_scaled(direction, camera->down, v);
    return (struct ray){.origin = camera->eye,
                        .direction = vec_normalize(direction),
                        .t_max = HUGE_VAL,
                        .from = PRIMITIVE_NONE};
}
