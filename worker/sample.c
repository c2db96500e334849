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

/* Through the point x, y of the picture, not normalised. */
static inline struct vec3 direction_through(const struct view *view, double x, double y)
{
    double height = view->height;
    double u = (2 * x - view->width) / height;
    double v = (2 * y - height) / height;
    const struct camera *camera = &view->camera;
    struct vec3 direction = vec_add_scaled(camera->forward, camera->right, u);
    return vec_add_scaled(direction, camera->down, v);
}

static struct ray eye_ray(const struct view *view, struct vec3 unit)
{
    return (struct ray){
        .origin = view->camera.eye, .direction = unit, .t_max = HUGE_VAL, .from = PRIMITIVE_NONE};
}

struct ray sample_ray(const struct view *view, uint32_t x, uint32_t y, uint32_t sample)
{
    double offset[2];
    sample_position(x, y, sample, view->samples, offset);
    return eye_ray(view, vec_normalize(direction_through(view, x + offset[0], y + offset[1])));
}

void sample_place(const struct view *view, uint32_t x, uint32_t y, uint32_t sample,
                  struct sample_lanes *lanes, uint32_t i)
{
    double offset[2];
    sample_position(x, y, sample, view->samples, offset);
    lanes->x[i] = x + offset[0];
    lanes->y[i] = y + offset[1];
}

static inline void aim_lane(const struct view *view, struct sample_lanes *lanes, uint32_t i)
{
    bool sure = true;
    struct vec3 direction = direction_through(view, lanes->x[i], lanes->y[i]);
    set_lane(&lanes->direction, i, plain_unit(direction, &sure));
    lanes->sure[i] = truth(sure);
}

static FLATTENED void aim_lanes(const struct view *view, struct sample_lanes *lanes, uint32_t count)
{
    OVER_LANES
    for (uint32_t i = 0; i < count; i++)
        aim_lane(view, lanes, i);
}

void sample_rays(const struct view *view, struct sample_lanes *lanes, uint32_t count,
                 struct ray *rays)
{
    aim_lanes(view, lanes, count);
    for (uint32_t i = 0; i < count; i++) {
        struct vec3 unit = lane(&lanes->direction, i);
        if (lanes->sure[i] == 0)
            unit = vec_normalize(direction_through(view, lanes->x[i], lanes->y[i]));
        rays[i] = eye_ray(view, unit);
    }
}
