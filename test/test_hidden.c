/* Tests the estimate of the hidden error with pixels whose samples are drawn one by one, against what they really
 * missed. */
#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "master/hidden.h"
#include "test/near.h"
#include "test/random.h"
#include "test/unit.h"

#define EDGE   64
#define PIXELS (EDGE * EDGE)

/* A picture of black pixels, each with an object of this share of its area, or none (0). */
struct field {
    struct canvas canvas;
    float difference[3 * PIXELS], spread[PIXELS];
    uint8_t level[PIXELS];
    struct statistics statistics; /* of these arrays */
    double share[PIXELS];
    uint64_t state;
};

/* Sums over the first samples of a pixel, and their number. */
struct drawn {
    double sum[2], count; /* of its halves */
};

static struct drawn drawn[PIXELS];

static void draw(struct field *field, size_t i, double samples)
{
    for (; drawn[i].count < samples; drawn[i].count++)
        drawn[i].sum[(size_t)drawn[i].count % 2] +=
            random_between(&field->state, 0, 1) < field->share[i];
}

/* Sets a pixel's mean, halves and spread, as a renderer sends them, from all samples up to this level. */
static void tell(struct field *field, size_t i, uint8_t level)
{
    double samples = field->statistics.levels.samples[level], half = samples / 2;
    draw(field, i, samples);
    double a = drawn[i].sum[0] / half, b = drawn[i].sum[1] / half;
    for (size_t c = 0; c < 3; c++) {
        field->canvas.rgb[3 * i + c] = (float)((a + b) / 2);
        field->difference[3 * i + c] = (float)(a - b);
    }
    field->spread[i] = (float)sqrt((a * (1 - a) + b * (1 - b)) / 2);
    field->level[i] = level;
}

static struct field *field_of(uint32_t edge, uint64_t seed)
{
    struct view view = {.min_samples = 4, .max_samples = 4096};
    struct field *field = allocate_zeroed(1, sizeof *field);
    canvas_init(&field->canvas, edge, edge);
    field->statistics = (struct statistics){.canvas = &field->canvas,
                                            .difference = field->difference,
                                            .spread = field->spread,
                                            .level = field->level};
    levels_init(&field->statistics.levels, &view);
    field->state = seed;
    for (size_t i = 0; i < PIXELS; i++)
        drawn[i] = (struct drawn){{0, 0}, 0};
    return field;
}

static void field_free(struct field *field)
{
    canvas_free(&field->canvas);
    free(field);
}

static void refine(struct field *field, struct hidden *hidden, size_t i, uint8_t level)
{
    struct pixel_statistics before = statistics_of_pixel(&field->statistics, i);
    tell(field, i, level);
    hidden_settle(hidden, &field->statistics, i, &before);
}

static struct hidden_sum sum_of(const struct field *field, const struct hidden *hidden)
{
    struct hidden_sum sum = {.carried = {0, 0}};
    uint32_t pixels = field->canvas.width * field->canvas.height;
    for (size_t i = 0; i < pixels; i++)
        hidden_add(hidden, &field->statistics, i, &sum);
    return sum;
}

static double true_error(const struct field *field)
{
    double sum = 0;
    for (size_t i = 0; i < PIXELS; i++)
        sum += pow((double)field->canvas.rgb[3 * i] - field->share[i], 2);
    return sum;
}

static struct error_sum told_by_halves(const struct field *field)
{
    struct error_sum sum = {0, 0};
    for (size_t i = 0; i < PIXELS; i++) {
        double error = own_error(field->difference + 3 * i);
        error_sum_add(&sum, &(struct error_sum){error, error * error});
    }
    return sum;
}

/* Puts objects into every fifth pixel of every fifth row, so that they are no neighbours. */
static void scatter(struct field *field, double least, double most)
{
    for (size_t y = 2; y < EDGE; y += 5)
        for (size_t x = 2; x < EDGE; x += 5)
            field->share[y * EDGE + x] =
                least * pow(most / least, random_between(&field->state, 0, 1));
}

/* All pixels get level 1 and are left there. Those that hit something then get level 5, and some of the others level
 * 3. */
static void run(struct field *field, struct hidden *hidden, size_t others)
{
    for (size_t i = 0; i < PIXELS; i++) {
        tell(field, i, 1);
        hidden_leave(hidden, i, 0);
    }
    for (size_t i = 0; i < PIXELS; i++)
        if (field->spread[i] > 0 || field->difference[3 * i] != 0) refine(field, hidden, i, 5);
    for (size_t i = 0; i < others; i++)
        if (field->level[i] == 1) refine(field, hidden, i, 3);
}

/* The mean of the estimate over many pictures is the true error, whether none or a third of the other pixels have got
 * more samples since. Without the hidden part it would be at most seven tenths of it. The estimated variance is right
 * to within a factor of 4. */
static void check_mean(double least, double most, size_t others)
{
    double told = 0, halves = 0, truth = 0, off = 0, variance = 0;
    const int pictures = 200;
    for (int k = 0; k < pictures; k++) {
        struct field *field = field_of(EDGE, 1 + (uint64_t)k);
        struct hidden *hidden = hidden_create(PIXELS);
        scatter(field, least, most);
        run(field, hidden, others);
        struct hidden_sum sum = sum_of(field, hidden);
        struct error_sum by_halves = told_by_halves(field);
        struct error_breakdown errors = hidden_errors(hidden, &sum, by_halves);
        halves += by_halves.squares;
        told += errors.sum.squares;
        truth += true_error(field);
        off += pow(errors.sum.squares - true_error(field), 2);
        variance += errors.sum.fourths;
        hidden_destroy(hidden);
        field_free(field);
    }
    if (!(fabs(told / truth - 1) < 0.15))
        fail_msg("%g to %g, %zu others: %g told of %g", least, most, others, told, truth);
    assert_true(halves < 0.7 * truth);
    if (!(off < 4 * variance && variance < 4 * off))
        fail_msg("%g to %g, %zu others: variance %g, %g told", least, most, others, off, variance);
}

static void test_mean(void **state)
{
    const double shares[][2] = {{0.05, 0.05}, {0.02, 0.3}, {0.01, 0.1}};
    for (int i = 0; i < 3; i++) {
        check_mean(shares[i][0], shares[i][1], 0);
        check_mean(shares[i][0], shares[i][1], PIXELS / 3);
    }
}

/* An error that was found still counts when its pixel, which has hit something, leaves another level. */
static void test_found_stays(void **state)
{
    struct field *field = field_of(EDGE, 1);
    struct hidden *hidden = hidden_create(PIXELS);
    const size_t at = 10 * EDGE + 10;
    for (size_t i = 0; i < PIXELS; i++) {
        tell(field, i, 1); /* nothing there */
        hidden_leave(hidden, i, 0);
    }
    field->share[at] = 0.5;
    refine(field, hidden, at, 4);
    double found = sum_of(field, hidden).carried.squares;
    assert_true(found > 0);
    assert_true(hidden_is_open(hidden, at));
    hidden_leave(hidden, at, 0);
    refine(field, hidden, at, 8);
    struct hidden_sum sum = sum_of(field, hidden);
    /* Of sixteen times as many samples the first ones are a sixteenth. */
    assert_true(fabs(sum.carried.squares * 256 / found - 1) < 0.5);
    assert_true(sum.levels[4].expected > 0);
    assert_int_equal(sum.levels[1].pixels, PIXELS - 1);
    assert_false(hidden_is_open(hidden, at)); /* later ones tell what they leave */
    hidden_destroy(hidden);
    field_free(field);
}

/* The error of a picture in which all pixels are black. */
static struct error_breakdown errors_of(const struct field *field, const struct hidden *hidden)
{
    struct hidden_sum sum = sum_of(field, hidden);
    return hidden_errors(hidden, &sum, (struct error_sum){0, 0});
}

/* Pixels that are left although they are warned have missed as much each as the others of their level. One that gets
 * more samples is looked at anew. */
static void test_warned(void **state)
{
    struct field *field = field_of(EDGE, 1);
    struct hidden *hidden = hidden_create(PIXELS);
    scatter(field, 0.1, 0.1);
    run(field, hidden, 0);
    struct hidden_sum sum = sum_of(field, hidden);
    double before = errors_of(field, hidden).hidden, there = (double)sum.levels[1].pixels;
    size_t warned = 0, last = 0;
    assert_true(before > 0);
    for (size_t i = 0; i < PIXELS / 2; i++) {
        if (field->level[i] != 1) continue;
        hidden_leave_warned(hidden, i);
        last = i;
        warned++;
    }
    sum = sum_of(field, hidden);
    assert_true(sum.levels[1].warned == warned && (double)(sum.levels[1].pixels + warned) == there);
    assert_true(errors_of(field, hidden).hidden > before);
    hidden_share(hidden, &sum);
    assert_true(hidden_of(hidden, last, 1) > 0);
    assert_false(hidden_is_open(hidden, last));
    refine(field, hidden, last, 3);
    assert_true(hidden_is_open(hidden, last) && sum_of(field, hidden).levels[3].warned == 0);
    hidden_destroy(hidden);
    field_free(field);
}

/* What later samples have found, worked out by hand for three different channels. Pixels that no plan has left are open
 * and add nothing. */
static void test_found_by_hand(void **state)
{
    struct field *field = field_of(EDGE, 1);
    struct hidden *hidden = hidden_create(PIXELS);
    const size_t at = 2;
    const struct pixel_statistics before = {{0, 0.03f, 0.06f}, {0.02f, 0.04f, 0}, 0, 1};
    const float mean[3] = {0.3f, 0.6f, 0.9f}, difference[3] = {0.25f, 0.5f, 0.125f};
    const double *samples = field->statistics.levels.samples;
    double later = samples[3] - samples[1], shown = 0;
    assert_true(hidden_is_open(hidden, at) && sum_of(field, hidden).levels[0].pixels == 0);
    for (size_t c = 0; c < 3; c++) {
        double first = (double)before.mean[c], half = (double)before.difference[c];
        double found = (samples[3] * (double)mean[c] - samples[1] * first) / later;
        double split = (samples[3] * (double)difference[c] - samples[1] * half) / later;
        field->canvas.rgb[3 * at + c] = mean[c];
        field->difference[3 * at + c] = difference[c];
        shown += pow(found - first, 2) / 3 - pow(split, 2) / 12;
    }
    field->level[at] = 3;
    hidden_leave(hidden, at, 0.1f);
    hidden_settle(hidden, &field->statistics, at, &before);
    struct hidden_sum sum = sum_of(field, hidden);
    double carried = pow(samples[1] / samples[3], 2) * shown;
    assert_near(sum.carried.squares, carried, 1e-9);
    assert_near(sum.carried.fourths, carried * carried, 1e-9);
    /* If less error is predicted than its halves show, the pixel has met something instead. */
    hidden_leave(hidden, at + 1, 0);
    field->level[at + 1] = 3;
    hidden_settle(hidden, &field->statistics, at + 1, &before);
    sum = sum_of(field, hidden);
    assert_near(sum.levels[1].shortfall, samples[1] / later * own_error(before.difference), 1e-9);
    assert_near(sum.carried.squares, carried, 1e-9);
    hidden_destroy(hidden);
    field_free(field);
}

/* Whether a pixel whose halves agree is taken to have met something, which is why it is no longer open. spread: how
 * much its samples' variance exceeds the squared error of one sample that its neighbourhood predicts. */
static bool has_met(uint8_t level, double spread)
{
    struct field *field = field_of(EDGE, 1);
    struct hidden *hidden = hidden_create(PIXELS);
    const size_t at = 10 * EDGE + 10;
    const double of_one = 0.01;
    tell(field, at, level);
    field->spread[at] = (float)sqrt(spread * of_one);
    hidden_leave(hidden, at, (float)sqrt(of_one / field->statistics.levels.power[level]));
    refine(field, hidden, at, (uint8_t)(level + 1));
    bool met = !hidden_is_open(hidden, at);
    hidden_destroy(hidden);
    field_free(field);
    return met;
}

/* How large a spread is a surprise does not depend on the number of samples. */
static void test_spread_of_many_samples(void **state)
{
    for (uint8_t level = 1; level < 10; level++) {
        assert_false(has_met(level, 5));
        assert_true(has_met(level, 12));
    }
}

/* By chance the first samples may seem to have missed less than nothing; the whole error is never below 0. */
static void test_never_below_0(void **state)
{
    struct hidden *hidden = hidden_create(1);
    const struct hidden_sum sum = {.carried = {-5, 25}};
    struct error_breakdown errors = hidden_errors(hidden, &sum, (struct error_sum){1, 1});
    assert_true(errors.sum.squares == 0 && errors.carried == -5 && errors.sum.fourths == 26);
    hidden_destroy(hidden);
}

/* Of sums, all is added up but the shortfall, of which the largest one counts, whichever sum it is in. */
static void test_sums_are_joined(void **state)
{
    struct hidden_sum a = {.carried = {1, 2}}, b = {.carried = {10, 20}};
    a.levels[1] = a.levels[LEVEL_MAX] = (struct level_sum){1, 2, 3, 4, 5};
    b.levels[1] = b.levels[LEVEL_MAX] = (struct level_sum){10, 20, 30, 40, 2};
    hidden_join(&a, &b);
    hidden_join(&b, &a);
    for (unsigned level = 1; level <= LEVEL_MAX; level += LEVEL_MAX - 1) {
        const struct level_sum *sum = &b.levels[level];
        assert_true(sum->pixels == 21 && sum->warned == 42 && sum->expected == 63);
        assert_true(sum->variance == 84 && sum->shortfall == 5 && a.levels[level].shortfall == 5);
    }
    assert_true(b.carried.squares == 21 && b.carried.fourths == 42);
}

/* A neighbour of which any channel is not finite does not hide how much a pixel stands out from the others. */
static void test_strange_neighbour(void **state)
{
    struct field *field = field_of(EDGE, 1);
    struct hidden *hidden = hidden_create(PIXELS);
    scatter(field, 0.1, 0.1);
    run(field, hidden, 0);
    double before = sum_of(field, hidden).levels[1].expected;
    for (size_t i = 0; i + 1 < PIXELS; i++)
        if (field->share[i + 1] > 0) field->canvas.rgb[3 * i + i % 3] = NAN;
    double after = sum_of(field, hidden).levels[1].expected;
    assert_true(before > 0 && fabs(after / before - 1) < 1e-6);
    hidden_destroy(hidden);
    field_free(field);
}

/* Sets a pixel's mean, and the variance of its samples, whose halves agree. */
static void tell_even(struct field *field, size_t i, uint8_t level, double mean, double variance)
{
    for (size_t c = 0; c < 3; c++) {
        field->canvas.rgb[3 * i + c] = (float)mean;
        field->difference[3 * i + c] = 0;
    }
    field->spread[i] = (float)sqrt(variance);
    field->level[i] = level;
}

/* Equal samples, whose sums are rounded, have met nothing, however little their neighbourhood predicts: what later ones
 * meet was missed. */
static void test_rounded(void **state)
{
    struct field *field = field_of(EDGE, 1);
    struct hidden *hidden = hidden_create(PIXELS);
    tell_even(field, 0, 1, 0.2, 1e-18);
    hidden_leave(hidden, 0, 0);
    struct pixel_statistics before = statistics_of_pixel(&field->statistics, 0);
    tell_even(field, 0, 3, 0.25, 0.03);
    hidden_settle(hidden, &field->statistics, 0, &before);
    struct hidden_sum sum = sum_of(field, hidden);
    assert_true(hidden_is_open(hidden, 0) && sum.levels[1].expected == 0);
    assert_true(sum.carried.squares > 0);
    hidden_destroy(hidden);
    field_free(field);
}

/*
 * A bar through each pixel makes its samples vary, later ones as much as the first, but sets its mean apart
 * by next to nothing. It is no speck of immense contrast, of which each that was hit stands for many that were missed.
 */
static void test_pattern(void **state)
{
    struct field *field = field_of(EDGE, 1);
    struct hidden *hidden = hidden_create(PIXELS);
    const double apart = 1e-4, variance = 0.25;
    for (size_t i = 0; i < PIXELS; i++) {
        tell_even(field, i, 1, 0.5, variance);
        hidden_leave(hidden, i, 0);
    }
    for (size_t i = 0; i < PIXELS; i++) {
        struct pixel_statistics before = statistics_of_pixel(&field->statistics, i);
        tell_even(field, i, 4, 0.5 + (i % 2 ? apart : 0), variance);
        hidden_settle(hidden, &field->statistics, i, &before);
        assert_false(hidden_is_open(hidden, i)); /* it has met the bar */
    }
    double expected = sum_of(field, hidden).levels[1].expected;
    assert_true(expected > 0 && expected < 3 * PIXELS * apart * apart);
    hidden_destroy(hidden);
    field_free(field);
}

/* The error that is inferred from an object in the pixel at x, y, when this channel of those beside it whose bit is set
 * (of the block of 3 x 3, row by row) was found to be bright, and, with bit 9, that of all that are farther away. */
static double inferred_at(uint32_t x, uint32_t y, size_t channel, unsigned which, float bright)
{
    struct field *field = field_of(EDGE, 1);
    struct hidden *hidden = hidden_create(PIXELS);
    field->share[y * EDGE + x] = 0.6;
    run(field, hidden, 0);
    for (uint32_t v = 0; v < EDGE; v++)
        for (uint32_t u = 0; u < EDGE; u++) {
            bool is_near = u + 1 >= x && u <= x + 1 && v + 1 >= y && v <= y + 1;
            unsigned bit = is_near ? 3 * (v + 1 - y) + u + 1 - x : 9;
            if (bit != 4 && which >> bit & 1)
                field->canvas.rgb[3 * (v * EDGE + u) + channel] = bright;
        }
    double expected = sum_of(field, hidden).levels[1].expected;
    hidden_destroy(hidden);
    field_free(field);
    return expected;
}

/* An object is what differs from the mean of the pixels around it, all of which count alike, and no others. */
static void test_surroundings(void **state)
{
    static const struct {
        uint32_t x, y;
        size_t channel;
        unsigned around;
    } places[] = {
        {30, 40, 0, 0x1ef}, {0, 0, 1, 0x1a0}, {EDGE - 1, EDGE - 1, 2, 0x00b}, {1, 1, 0, 0x1ef}};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        uint32_t x = places[i].x, y = places[i].y;
        size_t channel = places[i].channel;
        unsigned around = places[i].around;
        double none = inferred_at(x, y, channel, 0, 0);
        double all = inferred_at(x, y, channel, around, 0.125f);
        assert_true(none > 0 &&
                    all > none); /* the less it stands out, the less likely it was hit */
        assert_true(inferred_at(x, y, channel, around | 1u << 9, 0.125f) == all);
        float sum = 0.125f * (float)__builtin_popcount(around);
        for (unsigned bit = 0; bit < 9; bit++)
            if (around >> bit & 1) assert_true(inferred_at(x, y, channel, 1u << bit, sum) == all);
    }
}

/* A picture of one pixel, and colours that are not finite. */
static void test_strange(void **state)
{
    struct field *field = field_of(1, 1);
    struct hidden *hidden = hidden_create(1);
    field->share[0] = 0.5;
    tell(field, 0, 1);
    hidden_leave(hidden, 0, 0);
    refine(field, hidden, 0, 5);
    struct hidden_sum sum = sum_of(field, hidden);
    assert_true(sum.levels[1].expected == 0 && isfinite(sum.levels[1].variance));
    hidden_destroy(hidden);
    field_free(field);
    const float colors[] = {NAN, INFINITY, -INFINITY, 3e38f};
    for (int k = 0; k < 4; k++) {
        field = field_of(EDGE, 1);
        hidden = hidden_create(PIXELS);
        scatter(field, 0.3, 0.3);
        run(field, hidden, PIXELS / 2); /* some is found, too */
        assert_true(sum_of(field, hidden).carried.squares > 0);
        for (size_t i = 0; i < PIXELS; i += 3)
            field->canvas.rgb[3 * i] = field->difference[3 * i + 1] = field->spread[i] = colors[k];
        sum = sum_of(field, hidden);
        struct error_breakdown errors = hidden_errors(hidden, &sum, (struct error_sum){1, 1});
        assert_true(isfinite(errors.sum.squares) && errors.sum.squares >= errors.hidden);
        assert_true(isfinite(errors.sum.fourths) && errors.sum.fourths >= 0);
        assert_true(errors.hidden >= 0);
        hidden_destroy(hidden);
        field_free(field);
    }
}

/* The error that pixels are inferred to have missed which are left with 4 samples, after others have got `most`. */
static double inferred(uint32_t most)
{
    const struct view view = {.min_samples = 4, .max_samples = most};
    struct field *field = field_of(EDGE, 1);
    struct hidden *hidden = hidden_create(PIXELS);
    levels_init(&field->statistics.levels, &view);
    scatter(field, 0.1, 0.3);
    for (size_t i = 0; i < PIXELS; i++) {
        tell(field, i, 1);
        hidden_leave(hidden, i, 0);
    }
    for (size_t i = 0; i < PIXELS; i++)
        if (field->spread[i] > 0) refine(field, hidden, i, 2);
    struct hidden_sum sum = sum_of(field, hidden);
    double error = hidden_errors(hidden, &sum, (struct error_sum){0, 0}).hidden;
    hidden_destroy(hidden);
    field_free(field);
    return error;
}

/* Fewer later samples than first ones tell nothing. */
static void test_few_later_samples(void **state)
{
    assert_true(inferred(8) > 0);
    assert_true(inferred(6) == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mean),
        cmocka_unit_test(test_found_stays),
        cmocka_unit_test(test_warned),
        cmocka_unit_test(test_found_by_hand),
        cmocka_unit_test(test_few_later_samples),
        cmocka_unit_test(test_spread_of_many_samples),
        cmocka_unit_test(test_never_below_0),
        cmocka_unit_test(test_sums_are_joined),
        cmocka_unit_test(test_strange_neighbour),
        cmocka_unit_test(test_rounded),
        cmocka_unit_test(test_pattern),
        cmocka_unit_test(test_surroundings),
        cmocka_unit_test(test_strange),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
