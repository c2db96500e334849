/* Computes the pixels of a task from its samples, in order. */
#include "worker/exact.h"
#include "worker/inlined.h"
#include "worker/renderer.h"

static void put_color(float *rgb, struct vec3 color)
{
    rgb[0] = (float)color.x;
    rgb[1] = (float)color.y;
    rgb[2] = (float)color.z;
}

static struct vec3 divided(struct vec3 v, double by)
{
    return vec3(v.x / by, v.y / by, v.z / by);
}

/* Samples of one colour are computed in different ways, so that they differ by a few units of rounding. That is no
 * error of sampling: more samples would not lower it. 64 units are 7e-15 of a colour, and floats keep 6e-8 of it. */
#define SAME_COLOR (64 * UNIT_ROUNDOFF)

static double beyond_rounding(double a, double b)
{
    double difference = a - b;
    return fabs(difference) <= SAME_COLOR * fmax(fabs(a), fabs(b)) ? 0 : difference;
}

/* The mean of half A minus the mean of half B, neither of which is empty; 0 in components that are equal but for
 * rounding. */
static struct vec3 halves_difference(const struct renderer *renderer, double evens, double odds)
{
    const struct pixel_sum *sum = &renderer->progress.sum;
    struct vec3 even = divided(finished_sum(renderer, &sum->half[0]), evens);
    struct vec3 odd = divided(finished_sum(renderer, &sum->half[1]), odds);
    return vec3(beyond_rounding(even.x, odd.x), beyond_rounding(even.y, odd.y),
                beyond_rounding(even.z, odd.z));
}

/*
 * The share of (A - B)^2 that is the squared error of a pixel with a samples in A and b in B. The pixel is p
 * A + q B, with p = a / n and q = b / n. If a = b, both halves have errors of equal size, and (A - B)^2 / 4
 * is on average the squared error of the pixel. Otherwise the squared errors of the halves are taken
 * proportional to a^-3/2 and b^-3/2, as at edges (master/error.h). (A - B)^2 is then on average their sum,
 * and the pixel's squared error is p^2 a^-3/2 + q^2 b^-3/2 = (a^1/2 + b^1/2) / n^2.
 */
static double share_of_square(double a, double b)
{
    if (a == b) return 0.25;
    return (sqrt(a) + sqrt(b)) / ((a + b) * (a + b) * (1 / (a * sqrt(a)) + 1 / (b * sqrt(b))));
}

static void add_error(struct error_sum *sum, struct vec3 difference, double evens, double odds)
{
    double share = share_of_square(evens, odds);
    double square = vec_dot(difference, difference) / 3 * share;
    if (!(square < HUGE_VAL)) return; /* counted as nonfinite */
    sum->squares += square;
    sum->fourths += square * square;
}

/*
 * Root mean square deviation of the pixel's samples from the means of their halves; even and odd are the
 * halves' sums. If the samples are equal, rounding may leave a negative rest.
 */
static double spread_of(double squares, struct vec3 even, double evens, struct vec3 odd,
                        double odds)
{
    squares -= vec_dot(even, even) / evens;
    squares -= vec_dot(odd, odd) / odds;
    return squares > 0 ? sqrt(squares / (3 * (evens + odds))) : 0;
}

/* What is stored of a pixel. */
struct pixel_result {
    struct vec3 mean, difference;
    double spread, rays;
};

static INLINED void put_pixel(struct renderer *renderer, uint32_t pixel,
                              const struct pixel_result *result)
{
    const struct task *task = &renderer->progress.task;
    /* Only pixels that get samples are in the output. */
    uint32_t place = task->refinements ? renderer->numbers[pixel] : pixel;
    put_color(task->to.mean + 3 * (size_t)place, result->mean);
    if (task->to.difference) put_color(task->to.difference + 3 * (size_t)place, result->difference);
    if (task->to.spread) task->to.spread[place] = (float)result->spread;
    if (task->to.rays) task->to.rays[place] = (float)result->rays;
}

/*
 * The mean of upper bounds, rounded up for the sum and the quotient. The mean of several passes lies between
 * the passes' means, and so does its bound.
 */
static INLINED void note_truncation(struct renderer *renderer, double sum, double samples)
{
    if (sum != 0) sum = sum / samples * (1 + (samples + 2) * UNIT_ROUNDOFF);
    renderer->counts.truncation = max_number(renderer->counts.truncation, sum);
}

/* A pixel with several samples, of which consecutive ones belong to different halves. */
static void finish_pixel(struct renderer *renderer, uint32_t pixel, uint32_t begin, uint32_t end)
{
    struct progress *progress = &renderer->progress;
    struct vec3 even = finished_sum(renderer, &progress->sum.half[0]);
    struct vec3 odd = finished_sum(renderer, &progress->sum.half[1]);
    uint32_t even_samples = (end + 1) / 2 - (begin + 1) / 2;
    double samples = end - begin, evens = even_samples, odds = samples - evens;
    struct pixel_result result = {.mean = divided(vec_add(even, odd), samples),
                                  .difference = halves_difference(renderer, evens, odds),
                                  .spread =
                                      spread_of(progress->sum.squares, even, evens, odd, odds),
                                  .rays = (double)progress->sum.rays / samples};
    put_pixel(renderer, pixel, &result);
    add_error(&renderer->counts.sampling, result.difference, evens, odds);
    note_truncation(renderer, progress->sum.truncation, samples);
    progress->sum = (struct pixel_sum){0};
}

/* A pixel with a single sample: no halves; the sum with 0 is all that is left of the summation. */
static INLINED void finish_only(struct renderer *renderer, uint32_t pixel, struct vec3 color,
                                double truncation, uint64_t rays)
{
    const struct vec3 none = {0, 0, 0};
    struct pixel_result result = {
        .mean = vec_add(color, none), .difference = none, .spread = 0, .rays = (double)rays};
    put_pixel(renderer, pixel, &result);
    note_truncation(renderer, truncation, 1);
}

static INLINED void add_sample(struct renderer *renderer, uint32_t pixel, struct vec3 color,
                               double truncation, uint64_t rays)
{
    struct progress *progress = &renderer->progress;
    struct task_cursor *adds = &progress->adds;
    uint32_t begin = adds->begin, end = adds->end, so_far = adds->sample + 1 - begin;
    if (end - begin == 1) {
        finish_only(renderer, pixel, color, truncation, rays);
        cursor_advance(adds, &progress->task, &renderer->scene->view);
        return;
    }
    color_sum_add(&progress->sum.half[adds->sample & 1], color);
    progress->sum.squares += vec_dot(color, color);
    progress->sum.truncation += truncation;
    progress->sum.rays += rays;
    if (so_far == progress->halfway && begin == 0) {
        uint32_t half = so_far / 2;
        add_error(&renderer->counts.halfway, halves_difference(renderer, half, half), half, half);
    }
    if (cursor_advance(adds, &progress->task, &renderer->scene->view))
        finish_pixel(renderer, pixel, begin, end);
}

void add_samples(struct renderer *renderer, uint32_t count)
{
    for (uint32_t p = 0; p < count; p++) {
        const struct sample_state *state = &renderer->states[p];
        double truncation = state->branched ? omission_bound(&renderer->pending[p].omission) : 0;
        add_sample(renderer, state->pixel, finished_sum(renderer, &state->color), truncation,
                   state->cost_rays);
    }
}
