#include "master/refine.h"

#include <math.h>
#include <stdlib.h>

#include "common/extremes.h"
#include "common/message.h"
#include "common/whole.h"
#include "master/bands.h"

/* A pixel goes up this many levels at most in one pass: too little is known of it for more. */
#define LEVELS_PER_PASS 4

/* ---- what a pixel is worth ---- */

/* Rays of all samples that the pixel has. */
static double cost_of(const struct candidates *it, size_t pixel)
{
    return statistics_rays(it->statistics, pixel) * statistics_samples(it->statistics, pixel);
}

static double gain_of(const struct candidates *it, size_t pixel)
{
    return pixel_errors_with_hidden(it->errors, pixel) / cost_of(it, pixel);
}

/* Effort of going to the next level; 0 if there is none. */
static double effort_of(const struct candidates *it, size_t pixel)
{
    uint32_t level = it->statistics->level[pixel];
    if (level == it->statistics->levels.last) return 0;
    return statistics_rays(it->statistics, pixel) * effort_between(it->effort, level, level + 1);
}

/* Whether its neighbourhood alone, which predicts this error, would give the pixel more samples. */
static bool is_warned(const struct candidates *it, size_t pixel, float predicted_rms, double limit)
{
    double gain = (double)predicted_rms * (double)predicted_rms / cost_of(it, pixel);
    return allocation_doublings(gain, limit, 1) > 0;
}

/* ---- what all are worth ---- */

/* Parts of a picture are allocated in parallel: each has about PART_PIXELS pixels, a hundredth of a second of work.
 * There are at most PARTS_MOST parts, as an allocation takes half a megabyte. The parts do not depend on the pool, as
 * the rounding of sums depends on them. */
#define PART_PIXELS (1u << 20)
#define PARTS_MOST  64

struct allocating {
    const struct candidates *candidates;
    bool halves_show; /* whether the halves show any error */
    double error;     /* mean squared error of a pixel */
    uint32_t bands;   /* bands per part */
    struct allocation **parts;
};

static void allocate_pixel(const struct allocating *it, struct allocation *allocation, size_t i)
{
    const struct candidates *candidates = it->candidates;
    const struct pixel_errors *errors = candidates->errors;
    double square = it->halves_show ? pixel_errors_own(errors, i) + pixel_errors_hidden(errors, i)
                                    : pixel_errors_expected(errors, i);
    allocation_add(allocation, gain_of(candidates, i), square, effort_of(candidates, i),
                   statistics_levels_above(candidates->statistics, i));
}

static void allocate_part(void *context, uint32_t part)
{
    const struct allocating *it = context;
    const struct canvas *canvas = it->candidates->statistics->canvas;
    struct allocation *allocation = it->parts[part] = allocation_create(it->error);
    uint32_t last = smaller((part + 1) * it->bands, band_count(canvas));
    size_t end = band_first_pixel(canvas, last);
    for (size_t i = band_first_pixel(canvas, part * it->bands); i < end; i++)
        allocate_pixel(it, allocation, i);
}

/* The error to be lowered is that estimated from the halves, plus what is hidden. If all halves show an error of 0, it
 * is the expected error, as contrasts may still hide something. */
struct allocation *refine_allocation(const struct candidates *candidates)
{
    const struct canvas *canvas = candidates->statistics->canvas;
    size_t pixels = canvas_pixels(canvas);
    uint32_t bands = band_count(canvas);
    uint32_t parts = (uint32_t)smaller_number(ceil((double)pixels / PART_PIXELS), PARTS_MOST);
    double squares = pixel_errors_halves(candidates->errors);
    double sum = squares > 0 ? squares : pixel_errors_expected_sum(candidates->errors);
    struct allocation *made[PARTS_MOST] = {NULL};
    struct allocating it = {.candidates = candidates,
                            .halves_show = squares > 0,
                            .error = sum / (double)pixels,
                            .bands = divide_up(bands, parts),
                            .parts = made};
    parts = divide_up(bands, it.bands);
    thread_pool_for(candidates->pool, parts, allocate_part, &it);
    for (uint32_t part = 1; part < parts; part++) {
        allocation_join(made[0], made[part]);
        allocation_destroy(made[part]);
    }
    return made[0];
}

double refine_effort(const struct candidates *candidates, double limit)
{
    const struct statistics *statistics = candidates->statistics;
    size_t pixels = canvas_pixels(statistics->canvas);
    double sum = 0;
    for (size_t i = 0; i < pixels; i++) {
        unsigned most = statistics_levels_above(statistics, i);
        unsigned up = allocation_doublings(gain_of(candidates, i), limit, most);
        sum += statistics_rays(statistics, i) *
               effort_between(candidates->effort, 1, statistics->level[i] + up);
    }
    return sum;
}

/* ---- under a limit ---- */

struct stepping {
    const struct candidates *candidates;
    double limit;
    uint8_t *next;
    struct refined *bands;
};

/* Sets the next levels of a band's pixels. */
static void step_band(void *context, uint32_t band)
{
    const struct stepping *it = context;
    const struct candidates *candidates = it->candidates;
    const struct statistics *statistics = candidates->statistics;
    size_t end = band_first_pixel(statistics->canvas, band + 1);
    struct refined refined = {0, 0};
    for (size_t i = band_first_pixel(statistics->canvas, band); i < end; i++) {
        uint32_t level = statistics->level[i];
        unsigned most = smaller(statistics_levels_above(statistics, i), LEVELS_PER_PASS);
        unsigned up = allocation_doublings(gain_of(candidates, i), it->limit, most);
        it->next[i] = (uint8_t)(level + up);
        refined.pixels += up > 0;
        refined.left += pixel_errors_own(candidates->errors, i) *
                        levels_left(&statistics->levels, level, level + up);
    }
    it->bands[band] = refined;
}

/* Records a band's pixels that are left where they are, or would be by their neighbourhood. */
static void leave_band(void *context, uint32_t band)
{
    const struct stepping *it = context;
    const struct candidates *candidates = it->candidates;
    const struct statistics *statistics = candidates->statistics;
    struct hidden *hidden = candidates->errors->hidden;
    size_t end = band_first_pixel(statistics->canvas, band + 1);
    for (size_t i = band_first_pixel(statistics->canvas, band); i < end; i++) {
        if (!hidden_is_open(hidden, i)) continue;
        float predicted_rms = pixel_errors_predicted_rms(candidates->errors, i);
        if (!is_warned(candidates, i, predicted_rms, it->limit))
            hidden_leave(hidden, i, predicted_rms);
        else if (it->next[i] == statistics->level[i])
            hidden_leave_warned(hidden, i);
    }
}

struct refined refine_levels(const struct candidates *candidates, double limit, uint8_t *next)
{
    uint32_t bands = band_count(candidates->statistics->canvas);
    struct stepping it = {candidates, limit, next, allocate(bands, sizeof *it.bands)};
    struct refined all = {0, 0};
    thread_pool_for(candidates->pool, bands, step_band, &it);
    for (uint32_t k = 0; k < bands; k++) {
        all.pixels += it.bands[k].pixels;
        all.left += it.bands[k].left;
    }
    free(it.bands);
    if (all.pixels == 0) return all;
    thread_pool_for(candidates->pool, bands, leave_band, &it);
    pixel_errors_left(candidates->errors);
    return all;
}
