#include "bench/error_fields.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "common/hash.h"
#include "common/message.h"
#include "master/adaptive.h"
#include "test/halves.h"
#include "worker/sample.h"

enum { EDGE = 96, PIXELS = EDGE * EDGE };

#define GROUND 0.2

/* Of squares of whole pixels, the part `filled` of which has a thing, anywhere in it: of radii between two, and
 * contrasts down to a part of full white. */
struct field {
    uint64_t seed;
    bool needles; /* or discs */
    double cell;
    double filled;
    double radius[2]; /* of a needle: half of its width */
    double half_length;
    double faintest;
};

/* From 0 to 1, the number-th of a place or of a field's own. */
static double drawn(const struct field *field, double column, double row, uint64_t number)
{
    const double place[3] = {column, row, (double)field->seed};
    return (double)(hash64(place, sizeof place, number) >> 11) * 0x1p-53;
}

/* Evenly over the logarithms. */
static double between(double least, double most, double part)
{
    return least * pow(most / least, part);
}

static struct field field_of(uint64_t seed)
{
    struct field field = {.seed = seed};
    double own[7];
    for (uint64_t i = 0; i < 7; i++)
        own[i] = drawn(&field, -1, -1, i);
    field.needles = own[0] < 0.5;
    double radius = between(0.04, 0.32, own[1]) / (field.needles ? 2 : 1);
    field.radius[0] = radius;
    field.radius[1] = own[2] < 0.5 ? radius : 3 * radius;
    field.half_length = field.needles ? between(0.3, 3, own[3]) : 0;
    field.cell = ceil(fmax(between(3, 14, own[4]), 2 * field.half_length + 1));
    field.faintest = own[5] < 0.4 ? 0.1 : 1;
    field.filled = between(0.1, 1, own[6]);
    return field;
}

/* Of a cell; radius 0: none is there. */
struct thing {
    double x, y, along[2], half_length, radius, value;
};

static struct thing thing_at(const struct field *field, double x, double y)
{
    double column = floor(x / field->cell), row = floor(y / field->cell), luck[6];
    for (uint64_t i = 0; i < 6; i++)
        luck[i] = drawn(field, column, row, i);
    if (luck[5] > field->filled) return (struct thing){.radius = 0};
    double radius = between(field->radius[0], field->radius[1], luck[2]);
    double reach = fmin(radius + field->half_length, field->cell / 2),
           free = field->cell - 2 * reach;
    return (struct thing){
        .x = column * field->cell + reach + free * luck[0],
        .y = row * field->cell + reach + free * luck[1],
        .along = {cos(2 * M_PI * luck[3]), sin(2 * M_PI * luck[3])},
        .half_length = field->half_length,
        .radius = radius,
        .value = GROUND + (1 - GROUND) * pow(field->faintest, luck[4]),
    };
}

static double value_of(const struct field *field, const struct thing *thing, double x, double y)
{
    double u = x - thing->x, v = y - thing->y;
    double along = u * thing->along[0] + v * thing->along[1];
    double across = v * thing->along[0] - u * thing->along[1];
    bool within = field->needles ? fabs(along) < thing->half_length && fabs(across) < thing->radius
                                 : hypot(u, v) < thing->radius;
    return within ? thing->value : GROUND;
}

/* A pixel has one thing at most, as cells are of whole pixels. From FINE x FINE places: of a needle of a fiftieth of a
 * pixel's width, which is met by 4 of them across, some percent of what it covers are missed or too much in a pixel,
 * and the error of the pixel is that of four samples and more. */
#define FINE 200
static double true_value(const struct field *field, uint32_t x, uint32_t y)
{
    struct thing thing = thing_at(field, x + 0.5, y + 0.5);
    double far = hypot(x + 0.5 - thing.x, y + 0.5 - thing.y), sum = 0;
    if (far > hypot(thing.radius, thing.half_length) + M_SQRT1_2) return GROUND;
    for (uint32_t i = 0; i < FINE * FINE; i++)
        sum += value_of(field, &thing, x + (i % FINE + 0.5) / FINE, y + (i / FINE + 0.5) / FINE);
    return sum / (FINE * FINE);
}

static void find_truth(const struct field *field, double truth[PIXELS])
{
    for (uint32_t i = 0; i < PIXELS; i++)
        truth[i] = true_value(field, i % EDGE, i / EDGE);
}

static double true_squares(const struct canvas *canvas, const double truth[PIXELS])
{
    double sum = 0;
    for (uint32_t i = 0; i < PIXELS; i++)
        sum += pow((double)canvas->rgb[3 * i] - truth[i], 2);
    return sum;
}

/* The samples that a pixel gets, as the i-th pixel of a part. */
static void sample_pixel(const struct field *field, const struct view *view, uint32_t pixel,
                         struct refinement refinement, uint32_t i, const struct pixel_floats *to)
{
    uint32_t x = pixel % EDGE, y = pixel / EDGE;
    uint32_t begin = level_samples(view, refinement.from), end = level_samples(view, refinement.to);
    struct thing thing = thing_at(field, x + 0.5, y + 0.5);
    struct halves halves = {{0, 0}, 0};
    for (uint32_t s = begin; s < end; s++) {
        double at[2];
        sample_position(view, x, y, s, at);
        halves_add(&halves, s, value_of(field, &thing, x + at[0], y + at[1]));
    }
    halves_tell(&halves, end - begin, i, to);
}

static void render_pass(const struct field *field, const struct view *view,
                        struct adaptive *adaptive)
{
    static struct refinement refinements[PIXELS];
    static float part[PIXELS * REFINED_FLOATS];
    const struct tile whole = {.w = EDGE, .h = EDGE, .step = 1};
    adaptive_refinements(adaptive, &whole, refinements);
    struct pixel_floats to = pixel_floats(part, adaptive_pixels(adaptive, &whole), true);
    uint32_t in = 0;
    for (uint32_t pixel = 0; pixel < PIXELS; pixel++)
        if (refinements[pixel].to > refinements[pixel].from)
            sample_pixel(field, view, pixel, refinements[pixel], in++, &to);
    adaptive_put(adaptive, &whole, part, 1);
}

/* ---- what came of it ---- */

/* Widths of what is hidden, in terms of HIDDEN_LEAST and HIDDEN_MOST, that intervals are tried with. */
static const double widths[] = {0.5, 0.7, 1, 1.4, 2};
enum { WIDTHS = sizeof widths / sizeof *widths, SHARES = 5 };

struct outcome {
    uint32_t runs, late; /* late: that ended above their target */
    uint32_t below[WIDTHS],
        above[WIDTHS]; /* runs with an interval that the error is below, above */
    double samples, ratio,
        squares;           /* per pixel, and true of told error as logarithms: sums over runs */
    double *looks[SHARES]; /* of each share of what is hidden: that logarithm; owned */
    size_t counts[SHARES];
};

/* A run so far: whether an interval of each width did not hold. */
struct misses {
    bool below[WIDTHS], above[WIDTHS];
};

/* The logarithm of the true error in terms of the told one. */
static double look(struct outcome *outcome, const struct error_told *told, unsigned pass,
                   double squares, struct misses *misses)
{
    const struct error_told seen = {.sum = told->sum};
    struct error_estimate by_luck = error_estimate(&seen, PIXELS, ERROR_LOOK_PASS, pass);
    double luck = 2 * log(by_luck.high / by_luck.rmse), ratio = log(squares / told->sum.squares);
    double share = told->hidden / told->sum.squares;
    for (uint32_t k = 0; k < WIDTHS; k++) {
        misses->below[k] |= ratio < -hypot(luck, widths[k] * share * log(HIDDEN_LEAST));
        misses->above[k] |= ratio > hypot(luck, widths[k] * share * log(HIDDEN_MOST));
    }
    uint32_t bin = (uint32_t)fmin(share * SHARES, SHARES - 1);
    outcome->looks[bin] = grow(outcome->looks[bin], outcome->counts[bin], sizeof(double));
    outcome->looks[bin][outcome->counts[bin]++] = ratio / 2;
    return ratio / 2;
}

static void run(struct outcome *outcome, const struct field *field, double target,
                const double truth[PIXELS])
{
    const struct view view = {.width = EDGE,
                              .height = EDGE,
                              .region_w = EDGE,
                              .region_h = EDGE,
                              .min_samples = 4,
                              .max_samples = 4096};
    struct canvas canvas;
    canvas_init(&canvas, EDGE, EDGE);
    struct adaptive *adaptive = adaptive_create(&view, &canvas, target);
    struct misses misses = {0};
    double ratio = 0;
    uint64_t pixels, samples;
    do {
        render_pass(field, &view, adaptive);
        struct error_told told = adaptive_errors(adaptive, &pixels, &samples);
        if (told.sum.squares > 0)
            ratio = look(outcome, &told, adaptive_passes(adaptive), true_squares(&canvas, truth),
                         &misses);
    } while (adaptive_plan(adaptive, HUGE_VAL));
    for (uint32_t k = 0; k < WIDTHS; k++) {
        outcome->below[k] += misses.below[k];
        outcome->above[k] += misses.above[k];
    }
    outcome->runs++;
    outcome->late += sqrt(true_squares(&canvas, truth) / PIXELS) > target;
    outcome->samples += log((double)samples / PIXELS);
    outcome->ratio += ratio;
    outcome->squares += ratio * ratio;
    adaptive_destroy(adaptive);
    canvas_free(&canvas);
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Of sorted logarithms. */
static double quantile(const double *sorted, size_t count, double part)
{
    return exp(sorted[(size_t)((double)(count - 1) * part)]);
}

static void print_looks(struct outcome *outcome)
{
    puts("| hidden of the squared error told | looks | true / told, 1 % | 5 % | median | 95 % | 99 "
         "% |");
    puts("|---|---|---|---|---|---|---|");
    for (uint32_t bin = 0; bin < SHARES; bin++) {
        double *looks = outcome->looks[bin];
        size_t count = outcome->counts[bin];
        if (count == 0) continue;
        qsort(looks, count, sizeof *looks, compare);
        printf("| %.1f to %.1f | %zu | %.2f | %.2f | %.2f | %.2f | %.2f |\n", bin / (double)SHARES,
               (bin + 1) / (double)SHARES, count, quantile(looks, count, 0.01),
               quantile(looks, count, 0.05), quantile(looks, count, 0.5),
               quantile(looks, count, 0.95), quantile(looks, count, 0.99));
        free(looks);
    }
}

static void print_runs(const struct outcome *outcome)
{
    double runs = outcome->runs, mean = outcome->ratio / runs;
    printf("\n%u runs took %.1f samples a pixel (geometric mean) and ended with %.3f times the "
           "error told, +- %.0f "
           "%%; %u of them above the target.\n\n",
           outcome->runs, exp(outcome->samples / runs), exp(mean),
           100 * sqrt(outcome->squares / runs - mean * mean), outcome->late);
    puts("| hidden is at least, at most, of what is told | runs with an error below an interval | "
         "above one |");
    puts("|---|---|---|");
    for (uint32_t k = 0; k < WIDTHS; k++)
        printf("| %.3g, %.3g%s | %u | %u |\n", pow(HIDDEN_LEAST, widths[k]),
               pow(HIDDEN_MOST, widths[k]), widths[k] == 1 ? " (as it is)" : "", outcome->below[k],
               outcome->above[k]);
}

void fields_measure(uint32_t count)
{
    static double truth[PIXELS];
    struct outcome outcome = {0};
    for (uint32_t seed = 0; seed < count; seed++) {
        struct field field = field_of(seed);
        find_truth(&field, truth);
        double target = 0.03;
        for (uint32_t k = 0; k < FIELD_TARGETS; k++, target *= 0.55)
            run(&outcome, &field, target, truth);
    }
    print_looks(&outcome);
    print_runs(&outcome);
}
