#include "bench/error_fields.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench/median.h"
#include "common/hash.h"
#include "common/message.h"
#include "master/adaptive.h"
#include "test/halves.h"
#include "test/sample_fixture.h"

enum { EDGE = 96, PIXELS = EDGE * EDGE, TARGETS = 6 };

#define GROUND 0.2

/*
 * A field is divided into square cells of whole pixels. The part `filled` of the cells has a thing at a random
 * place in it, with a radius between two values, and a contrast down to a part of full white.
 */
struct field {
    uint64_t seed;
    bool needles; /* false: discs; long needles are hairs */
    double cell;
    double filled;
    double radius[2]; /* for a needle: half of its width */
    double half_length;
    double faintest;
};

/* The number-th random number, 0 to 1, of a place or of the field itself. */
static double drawn(const struct field *field, double column, double row, uint64_t number)
{
    const double place[3] = {column, row, (double)field->seed};
    return (double)(hash64(place, sizeof place, number) >> 11) * 0x1p-53;
}

/* Uniform in the logarithm. */
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
    field.half_length = field.needles ? between(0.3, 16, own[3]) : 0;
    field.cell = ceil(fmax(between(3, 14, own[4]), 2 * field.half_length + 1));
    field.faintest = own[5] < 0.4 ? 0.1 : 1;
    field.filled = between(0.1, 1, own[6]);
    return field;
}

/* The thing in a cell; radius 0: there is none. */
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
    double reach = radius + field->half_length, free = field->cell - 2 * reach;
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

/* The value of a pixel, which has one thing at most, as cells consist of whole pixels. It is sampled at FINE x
 * FINE places: 8 of them lie across the thinnest needle, so that its coverage of a pixel may be off by some
 * percent. */
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

/* A field that is sampled with its own random numbers: those of pixels that are `right` further to the right. */
struct picture {
    const struct field *field;
    struct view view;
    uint32_t right;
    const double *truth;
    struct canvas canvas;
    struct adaptive *adaptive;
};

/* Takes the samples of a pixel in a pass; it is the i-th pixel of the part. */
static void sample_pixel(const struct picture *picture, uint32_t pixel,
                         struct refinement refinement, uint32_t i, const struct pixel_floats *to)
{
    const struct view *view = &picture->view;
    uint32_t x = pixel % EDGE, y = pixel / EDGE;
    uint32_t begin = level_samples(view, refinement.from), end = level_samples(view, refinement.to);
    struct thing thing = thing_at(picture->field, x + 0.5, y + 0.5);
    struct halves halves = {{0, 0}, 0};
    for (uint32_t s = begin; s < end; s++) {
        double at[2];
        sample_position(view, picture->right + x, y, s, at);
        halves_add(&halves, s, value_of(picture->field, &thing, x + at[0], y + at[1]));
    }
    halves_tell(&halves, end - begin, i, to);
}

static void render_pass(const struct picture *picture)
{
    static struct refinement refinements[PIXELS];
    static float part[PIXELS * REFINED_FLOATS];
    struct adaptive *adaptive = picture->adaptive;
    const struct tile whole = {.w = EDGE, .h = EDGE, .step = 1};
    adaptive_refinements(adaptive, &whole, refinements);
    struct pixel_floats to = pixel_floats(part, adaptive_pixels(adaptive, &whole), true);
    uint32_t in = 0;
    for (uint32_t pixel = 0; pixel < PIXELS; pixel++)
        if (refinements[pixel].to > refinements[pixel].from)
            sample_pixel(picture, pixel, refinements[pixel], in++, &to);
    adaptive_put(adaptive, &whole, part, 1);
}

/* The true RMSE. */
static double true_error(const struct picture *picture)
{
    double sum = 0;
    for (uint32_t i = 0; i < PIXELS; i++)
        sum += pow((double)picture->canvas.rgb[3 * i] - picture->truth[i], 2);
    return sqrt(sum / PIXELS);
}

/* ---- results ---- */

/* The widths of the bounds on what is hidden that are tried, relative to those of HIDDEN_LEAST and HIDDEN_MOST
 * (in logarithms). */
static const double widths[] = {0.5, 0.7, 1, 1.4, 2};
enum { WIDTHS = sizeof widths / sizeof *widths, AS_IT_IS = 2, SHARES = 5 };

/* Whether any interval of a run, for each width, did not contain the error. */
struct misses {
    bool below[WIDTHS], above[WIDTHS]; /* the error was below it, above it */
};

/* Logarithms of true / estimated error. */
struct ratios {
    double *ratios; /* owned */
    size_t count;
};

static void ratios_add(struct ratios *ratios, double ratio)
{
    ratios->ratios = grow(ratios->ratios, ratios->count, sizeof *ratios->ratios);
    ratios->ratios[ratios->count++] = ratio;
}

struct outcome {
    uint32_t runs, unseen; /* unseen: no sample hit anything, and no error was estimated */
    uint32_t late;         /* runs of the others that ended above the target */
    uint32_t fields;       /* fields with a run that has an interval that did not hold */
    uint32_t below[WIDTHS], above[WIDTHS]; /* runs with such intervals */
    double samples;                        /* logarithms of samples per pixel, summed over runs */
    struct ratios
        /* At all looks, by the part of the estimated squared error that is hidden. */
        looks[SHARES];
    struct ratios ends; /* at the ends of runs */
};

/* Tests an interval with another width of the bounds on what is hidden than error_estimate() uses. */
static void look_with(double width, const struct error_breakdown *breakdown, unsigned pass,
                      double ratio, bool *below, bool *above)
{
    const struct error_breakdown seen = {.sum = breakdown->sum};
    struct error_estimate by_luck = error_estimate(&seen, PIXELS, ERROR_LOOK_PASS, pass);
    double luck = 2 * log(by_luck.high / by_luck.rmse);
    double hidden = breakdown->hidden / breakdown->sum.squares,
           carried = breakdown->carried / breakdown->sum.squares;
    *below |= 2 * ratio < -hypot(luck, width * (hidden + carried) * log(HIDDEN_LEAST));
    *above |= 2 * ratio > hypot(luck, width * hidden * log(HIDDEN_MOST));
}

/* Tests the intervals of a look; returns log(true / estimated error). The estimated error is above 0. */
static double look(struct outcome *outcome, const struct error_breakdown *breakdown, unsigned pass,
                   double error, struct misses *misses)
{
    struct error_estimate estimate = error_estimate(breakdown, PIXELS, ERROR_LOOK_PASS, pass);
    double ratio = log(error / estimate.rmse);
    for (uint32_t k = 0; k < WIDTHS; k++)
        if (k != AS_IT_IS)
            look_with(widths[k], breakdown, pass, ratio, &misses->below[k], &misses->above[k]);
    misses->below[AS_IT_IS] |= error < estimate.low;
    misses->above[AS_IT_IS] |= error > estimate.high;
    uint32_t share =
        (uint32_t)fmin(SHARES * breakdown->hidden / breakdown->sum.squares, SHARES - 1);
    ratios_add(&outcome->looks[share], ratio);
    return ratio;
}

/* Adds a run, which took `samples` per pixel; returns whether all its intervals held. */
static bool add_run(struct outcome *outcome, const struct misses *misses, double samples,
                    double ratio)
{
    for (uint32_t k = 0; k < WIDTHS; k++) {
        outcome->below[k] += misses->below[k];
        outcome->above[k] += misses->above[k];
    }
    outcome->samples += log(samples);
    ratios_add(&outcome->ends, ratio);
    return !(misses->below[AS_IT_IS] || misses->above[AS_IT_IS]);
}

/* Runs all passes; returns whether all intervals held. */
static bool run(struct outcome *outcome, const struct picture *picture)
{
    struct misses misses = {0};
    double ratio = 0;
    uint64_t pixels, samples;
    bool seen;
    do {
        render_pass(picture);
        struct error_breakdown breakdown = adaptive_errors(picture->adaptive, &pixels, &samples);
        seen = breakdown.sum.squares > 0;
        if (seen)
            ratio = look(outcome, &breakdown, adaptive_passes(picture->adaptive),
                         true_error(picture), &misses);
    } while (adaptive_plan(picture->adaptive, HUGE_VAL));
    outcome->runs++;
    outcome->late += seen && true_error(picture) > adaptive_target(picture->adaptive);
    outcome->unseen += !seen;
    return !seen || add_run(outcome, &misses, (double)samples / PIXELS, ratio);
}

static void measure_field(struct outcome *outcome, uint64_t seed)
{
    static double means[PIXELS];
    struct field field = field_of(seed);
    struct picture picture = {
        .field = &field,
        .view = {.width = EDGE,
                 .height = EDGE,
                 .region_w = EDGE,
                 .region_h = EDGE,
                 .min_samples = 4,
                 .max_samples = 4096},
        .truth = means,
    };
    bool held = true;
    find_truth(&field, means);
    for (uint32_t k = 0; k < TARGETS; k++) {
        canvas_init(&picture.canvas, EDGE, EDGE);
        picture.right = k * EDGE;
        picture.adaptive = adaptive_create(&picture.view, &picture.canvas, 0.03 * pow(0.55, k));
        held &= run(outcome, &picture);
        adaptive_destroy(picture.adaptive);
        canvas_free(&picture.canvas);
    }
    outcome->fields += !held;
}

/* Prints a row of quantiles; sorts and frees the ratios. */
static void print_ratios(const char *name, struct ratios *it)
{
    const double parts[] = {0.01, 0.05, 0.5, 0.95, 0.99};
    if (it->count == 0) return;
    sort_values(it->ratios, it->count);
    printf("| %s | %zu |", name, it->count);
    for (uint32_t k = 0; k < sizeof parts / sizeof *parts; k++)
        printf(" %.2f |", exp(it->ratios[(size_t)((double)(it->count - 1) * parts[k])]));
    putchar('\n');
    free(it->ratios);
}

static void print_looks(struct outcome *outcome)
{
    puts("| hidden of the square told | looks | true / told error, 1 % | 5 % | median | 95 % | 99 "
         "% |");
    puts("|---|---|---|---|---|---|---|");
    for (uint32_t share = 0; share < SHARES; share++) {
        char name[32];
        snprintf(name, sizeof name, "%.1f to %.1f", share / (double)SHARES,
                 (share + 1) / (double)SHARES);
        print_ratios(name, &outcome->looks[share]);
    }
    print_ratios("at the end, any", &outcome->ends);
}

static void print_runs(const struct outcome *outcome)
{
    uint32_t seen = outcome->runs - outcome->unseen;
    printf("\n%u runs, of which %u met nothing, which tells no error.\n", outcome->runs,
           outcome->unseen);
    printf("The others took %.1f samples a pixel (geometric mean); %u of them ended above the "
           "target.\n",
           exp(outcome->samples / seen), outcome->late);
    printf("%u fields had an interval that did not hold.\n\n", outcome->fields);
    puts("The same runs judged by intervals with other bounds of what is hidden, in terms of the "
         "square told:\n");
    puts("| at least | at most | runs with an error below an interval | above one |");
    puts("|---|---|---|---|");
    for (uint32_t k = 0; k < WIDTHS; k++)
        printf("| %.3g | %.3g%s | %u | %u |\n", pow(HIDDEN_LEAST, widths[k]),
               pow(HIDDEN_MOST, widths[k]), k == AS_IT_IS ? " (as it is)" : "", outcome->below[k],
               outcome->above[k]);
}

void fields_measure(uint32_t count)
{
    struct outcome outcome = {0};
    for (uint32_t seed = 0; seed < count; seed++)
        measure_field(&outcome, seed);
    print_looks(&outcome);
    print_runs(&outcome);
}
