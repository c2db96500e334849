#include "master/adaptive.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/adaptive_state.h"
#include "master/forecast.h"
#include "master/refine.h"

/* The share of the error before it that a pass aims at, at least and at most. There is a minimum, as a pass is planned
 * from what earlier ones have shown, which is not enough to go farther. It is low, as samples are quicker the more of
 * them a pixel gets at a time: with 0.12 and four levels the same error took 0.8 to 1.0 of the CPU time that it took
 * with 0.5 and two, in nine runs of seven scenes. The maximum makes an end to passes that miss the target by a hair. */
#define PASS_AIM_MIN 0.12
#define PASS_AIM_MAX 0.93

/* The target is out of reach where even max_samples of every pixel are expected to leave an estimate above it. (Where
 * they leave a lower one, the upper end of its interval may or may not come below the target: that depends on chance
 * and on how many passes there are.) Then all further samples together are not worth a pass once the squared error is
 * at most LEAST_STOP times what they leave, 5 % of the error; passes aim at LEAST_AIM times it, half of that, so that
 * one that falls somewhat short is the last, too. Otherwise all pixels would get max_samples, for next to nothing: for
 * a target of 1e-4 and 16 to 1024 max_samples, three scenes of 160 x 120 pixels would take 1.2 to 4.4 times as many
 * rays, for errors that are 2 to 4 % smaller. */
#define LEAST_STOP 1.1
#define LEAST_AIM  1.05

size_t adaptive_pixel_bytes(void)
{
    const struct pass *pass = NULL;
    return statistics_pixel_bytes() + pixel_errors_bytes() + pass_cost_pixel_bytes() +
           sizeof *pass->next;
}

struct adaptive *adaptive_create(const struct view *view, struct canvas *canvas, double target)
{
    assert(view->min_samples % 2 == 0 && view->max_samples % 2 == 0);
    struct adaptive *adaptive = allocate_zeroed(1, sizeof *adaptive);
    size_t pixels = canvas_pixels(canvas);
    adaptive->target = target;
    statistics_init(&adaptive->statistics, view, canvas);
    effort_init(&adaptive->effort, &adaptive->statistics.levels);
    adaptive->cost = pass_cost_create(canvas->width, canvas->height);
    adaptive->pass.next = memset(allocate_large(pixels), 1, pixels);
    pixel_errors_init(&adaptive->errors, &adaptive->statistics);
    pass_begin(&adaptive->pass, true, 0, pixels);
    return adaptive;
}

void adaptive_destroy(struct adaptive *adaptive)
{
    if (!adaptive) return;
    pixel_errors_free(&adaptive->errors);
    free(adaptive->pass.next);
    pass_cost_destroy(adaptive->cost);
    statistics_free(&adaptive->statistics);
    free(adaptive);
}

void adaptive_set_pool(struct adaptive *adaptive, struct thread_pool *pool)
{
    adaptive->pool = pool;
}

/* ---- the next pass ---- */

static struct candidates candidates_of(struct adaptive *adaptive)
{
    return (struct candidates){&adaptive->statistics, &adaptive->errors, &adaptive->effort,
                               adaptive->pool};
}

/* The estimate of the picture's error. All pixels of the last pass must be in. */
static struct error_estimate pass_error(struct adaptive *adaptive)
{
    uint64_t pixels = pixel_errors_expect(&adaptive->errors, adaptive->pool)->pixels;
    struct error_breakdown breakdown = pixel_errors_breakdown(&adaptive->errors);
    return error_estimate(&breakdown, pixels, ERROR_LOOK_PASS, adaptive->pass.count);
}

static bool meets_target(const struct adaptive *adaptive, double high)
{
    return adaptive->target > 0 && high <= adaptive->target;
}

/* Settles the last pass: compares what it has left with its promise, and the error with the target. Returns
 * pass_error(). */
static struct error_estimate settle_pass(struct adaptive *adaptive)
{
    struct error_estimate error = pass_error(adaptive);
    promise_settle(&adaptive->promise, pixel_errors_halves(&adaptive->errors));
    adaptive->is_met = meets_target(adaptive, error.high);
    return error;
}

/* Plans every pixel's next level and with them what the pass promises, after settle_pass(). Returns whether any pixel
 * goes up. */
static bool plan_levels(struct adaptive *adaptive, double limit)
{
    assert(adaptive->pass.missing == 0);
    struct candidates candidates = candidates_of(adaptive);
    double squares = pixel_errors_halves(&adaptive->errors);
    struct refined refined = refine_levels(&candidates, limit, adaptive->pass.next);
    if (refined.pixels == 0) return false;
    promise_make(&adaptive->promise, squares, refined.left);
    pass_begin(&adaptive->pass, false, limit, refined.pixels);
    return true;
}

/* The squared error that the next pass aims at; HUGE_VAL: no pass is worth it. */
static double pass_goal(const struct adaptive *adaptive, const struct allocation *allocation,
                        struct error_estimate error)
{
    double squares = allocation_squares(allocation), least = allocation_under(allocation, 0).left;
    double share = fmax(PASS_AIM_MIN, adaptive->target / error.high);
    if (share > PASS_AIM_MAX) share = PASS_AIM_MAX;
    double goal = share * share * squares;
    double most = adaptive->target / error.rmse;
    bool in_reach = least <= most * most * squares;
    if (!(adaptive->target > 0) || in_reach) return goal;
    return squares <= LEAST_STOP * least ? HUGE_VAL : fmax(goal, LEAST_AIM * least);
}

/* The limit for the next pass: the one that takes the error to the pass's aim, or a higher one if there is time for no
 * more. */
static double limit_for(struct adaptive *adaptive, struct error_estimate error, double seconds)
{
    struct candidates candidates = candidates_of(adaptive);
    struct allocation *allocation = refine_allocation(&candidates);
    double goal = pass_goal(adaptive, allocation, error);
    double limit = goal < HUGE_VAL ? allocation_limit(allocation, goal) : HUGE_VAL;
    if (seconds < HUGE_VAL) {
        double effort = seconds / effort_seconds_per_unit(&adaptive->effort);
        limit = fmax(limit, allocation_limit_within(allocation, effort));
    }
    allocation_destroy(allocation);
    return limit;
}

bool adaptive_plan(struct adaptive *adaptive, double seconds)
{
    if (adaptive->statistics.unsampled > 0) {
        adaptive_plan_first(adaptive, seconds);
        return true;
    }
    struct error_estimate error = settle_pass(adaptive);
    return !adaptive->is_met && plan_levels(adaptive, limit_for(adaptive, error, seconds));
}

bool adaptive_replan(struct adaptive *adaptive, double limit)
{
    if (adaptive->statistics.unsampled > 0) return adaptive_replan_first(adaptive, limit);
    if (limit < 0) return false;
    (void)settle_pass(adaptive);
    return !adaptive->is_met && plan_levels(adaptive, limit);
}

void adaptive_predict_work(struct adaptive *adaptive)
{
    if (adaptive->statistics.unsampled > 0) return;
    pass_cost_predict(adaptive->cost, &adaptive->statistics, adaptive->pass.next, adaptive->pool);
}

bool adaptive_is_met(struct adaptive *adaptive)
{
    if (adaptive->is_met) return true;
    return adaptive->pass.missing == 0 && adaptive->statistics.unsampled == 0 &&
           meets_target(adaptive, pass_error(adaptive).high);
}

/* The seconds beyond those so far in which a run with these levels leaves this share of the squares. */
static double seconds_to(struct adaptive *adaptive, double share, uint32_t max_samples)
{
    struct statistics statistics = adaptive->statistics;
    struct effort effort = adaptive->effort;
    levels_extend(&statistics.levels, max_samples);
    effort_set_levels(&effort, &statistics.levels);
    struct candidates candidates = {&statistics, &adaptive->errors, &effort, adaptive->pool};
    struct allocation *allocation = refine_allocation(&candidates);
    double limit = allocation_limit(allocation, share * allocation_squares(allocation));
    allocation_destroy(allocation);
    if (!(limit > 0)) return HUGE_VAL;
    return refine_effort(&candidates, limit) * effort_seconds_per_unit(&effort) -
           effort.on_later.seconds;
}

double adaptive_forecast(struct adaptive *adaptive, double rmse, double power, uint32_t max_samples)
{
    const struct error_totals *totals = pixel_errors_expect(&adaptive->errors, adaptive->pool);
    uint64_t pixels = totals->pixels;
    if (pixels < canvas_pixels(adaptive->statistics.canvas) || !(totals->halves.squares > 0))
        return (double)NAN;
    double exponent = promise_exponent(&adaptive->promise);
    if (adaptive->pass.is_first) exponent = power / FORECAST_EDGE; /* promises assume edges */
    if (!(exponent > 0)) return (double)NAN;
    double squares = pixel_errors_breakdown(&adaptive->errors).sum.squares;
    double share = pow(rmse * rmse * (double)pixels / squares, 1 / exponent);
    return share < 1 ? seconds_to(adaptive, share, max_samples) : 0;
}

/* ---- what is asked of it ---- */

/* Until all pixels of the pass are in, the pool is busy with tiles. */
static struct thread_pool *idle_pool(const struct adaptive *adaptive)
{
    return adaptive->pass.missing ? NULL : adaptive->pool;
}

struct error_breakdown adaptive_errors(struct adaptive *adaptive, uint64_t *pixels,
                                       uint64_t *samples)
{
    const struct error_totals *totals = pixel_errors_totals(&adaptive->errors, idle_pool(adaptive));
    *pixels = totals->pixels;
    *samples = totals->samples;
    return pixel_errors_breakdown(&adaptive->errors);
}

double adaptive_target(const struct adaptive *adaptive)
{
    return adaptive->target;
}

unsigned adaptive_passes(const struct adaptive *adaptive)
{
    return adaptive->pass.count;
}

bool adaptive_is_first(const struct adaptive *adaptive)
{
    return adaptive->pass.is_first;
}

double adaptive_limit(const struct adaptive *adaptive)
{
    return adaptive->pass.limit;
}

bool adaptive_is_complete(const struct adaptive *adaptive)
{
    return adaptive->pass.missing == 0;
}

double adaptive_missing(const struct adaptive *adaptive)
{
    const struct pass *pass = &adaptive->pass;
    return pass->missing ? (double)pass->missing / (double)pass->asked : 0;
}

const uint8_t *adaptive_levels(const struct adaptive *adaptive)
{
    return adaptive->statistics.level;
}

uint32_t adaptive_first_samples(const struct adaptive *adaptive)
{
    return (uint32_t)adaptive->statistics.levels.samples[1];
}

struct tile adaptive_whole(const struct adaptive *adaptive)
{
    const struct canvas *canvas = adaptive->statistics.canvas;
    return (struct tile){.w = canvas->width, .h = canvas->height, .step = 1};
}

uint64_t adaptive_unsampled(const struct adaptive *adaptive)
{
    return adaptive->statistics.unsampled;
}

double adaptive_seconds(const struct adaptive *adaptive)
{
    return adaptive->effort.on_first.seconds + adaptive->effort.on_later.seconds;
}

double adaptive_first_seconds(const struct adaptive *adaptive)
{
    return adaptive->effort.on_first.seconds;
}
