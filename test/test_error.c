#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "master/forecast.h"
#include "test/near.h"
#include "test/random.h"
#include "test/unit.h"

static uint64_t seed = 88172645463325252u;

static double uniform(void)
{
    return random_between(&seed, 0x1p-54, 1);
}

/* A random number of the standard normal distribution (G. Box & M. Muller, 1958). */
static double normal(void)
{
    return sqrt(-2 * log(uniform())) * cos(2 * M_PI * uniform());
}

static void test_nothing_is_no_error(void **state)
{
    const struct error_breakdown none = {.sum = {0, 0}};
    struct error_estimate estimate = error_estimate(&none, 0, ERROR_LOOK_PASS, 1);
    assert_true(estimate.rmse == 0 && estimate.low == 0 && estimate.high == 0);
    estimate = error_estimate(&none, 100, ERROR_LOOK_PASS, 1);
    assert_true(estimate.rmse == 0 && estimate.low == 0 && estimate.high == 0);
}

static void test_interval_widens_with_every_look(void **state)
{
    const struct error_breakdown breakdown = {
        .sum = {.squares = 1000 * 0.01, .fourths = 3000 * 0.0001}};
    struct error_estimate before = error_estimate(&breakdown, 1000, ERROR_LOOK_PASS, 1);
    assert_near(before.rmse, 0.1, 1e-12);
    for (unsigned look = 2; look < 200; look++) {
        struct error_estimate now = error_estimate(&breakdown, 1000, ERROR_LOOK_PASS, look);
        assert_true(now.rmse == before.rmse && now.low < before.low && now.high > before.high);
        before = now;
    }
    assert_true(before.high < 0.2);
}

/* The hidden error widens the interval by its share of the error, as much at the hundredth look as at the first one.
 * The carried error widens it at its lower end only. */
static void test_hidden_widens_the_interval(void **state)
{
    for (unsigned look = 1; look <= 100; look += 99) {
        const struct error_breakdown all = {.sum = {.squares = 10, .fourths = 0}, .hidden = 10};
        struct error_estimate estimate = error_estimate(&all, 1000, ERROR_LOOK_PASS, look);
        assert_near(estimate.high, 0.2, 1e-12);
        assert_near(estimate.low, 0.025, 1e-12);
        const struct error_breakdown half = {.sum = {.squares = 10, .fourths = 0.3},
                                             .hidden = 5,
                                             .carried = 2.5},
                                     none = {.sum = half.sum};
        struct error_estimate by_luck = error_estimate(&none, 1000, ERROR_LOOK_PASS, look);
        estimate = error_estimate(&half, 1000, ERROR_LOOK_PASS, look);
        double luck = log(by_luck.high / 0.1);
        assert_near(log(estimate.high / 0.1), hypot(luck, log(2) / 2), 1e-12);
        assert_near(log(0.1 / estimate.low), hypot(luck, log(4) * 0.75), 1e-12);
    }
}

/* With an odd number of samples both ends are as far away as the estimate may be off, beside luck. */
static void test_odd_samples_widen_the_interval(void **state)
{
    assert_true(error_odd(1) == 0 && error_odd(2) == 0 && error_odd(100) == 0);
    assert_near(error_odd(3), log(2), 1e-12);
    assert_true(error_odd(5) < error_odd(3) && error_odd(7) < error_odd(5) && error_odd(7) > 0);
    struct error_breakdown breakdown = {.sum = {.squares = 10, .fourths = 0.3}};
    struct error_estimate even = error_estimate(&breakdown, 1000, ERROR_LOOK_PASS, 1);
    breakdown.odd = 0.1;
    struct error_estimate odd = error_estimate(&breakdown, 1000, ERROR_LOOK_PASS, 1);
    assert_true(odd.rmse == even.rmse);
    assert_near(odd.low, even.low * exp(-0.05), 1e-12);
    assert_near(odd.high, even.high * exp(0.05), 1e-12);
}

/* The probability that the interval misses the error, if the logarithm of the estimate is normally distributed. */
static double miss_of(enum error_look kind, unsigned number)
{
    const struct error_breakdown breakdown = {.sum = {.squares = 10, .fourths = 0.3}};
    struct error_estimate estimate = error_estimate(&breakdown, 1000, kind, number);
    assert_near(estimate.low * estimate.high, estimate.rmse * estimate.rmse, 1e-12);
    double spread = M_SQRT2 * sqrt(breakdown.sum.fourths) / breakdown.sum.squares;
    return erfc(2 * log(estimate.high / estimate.rmse) / spread * M_SQRT1_2);
}

/* However often a run is looked at, both kinds of looks together miss with the stated probability, of which looks after
 * passes have the larger part. */
static void test_all_looks_together(void **state)
{
    enum { LOOKS = 1000 };
    double sum = 0;
    for (unsigned number = 1; number <= LOOKS; number++) {
        double pass = miss_of(ERROR_LOOK_PASS, number),
               between = miss_of(ERROR_LOOK_BETWEEN, number);
        assert_true(pass > between);
        sum += pass + between;
    }
    assert_near(sum / (1 - ERROR_CONFIDENCE), 1, 1.0 / LOOKS);
}

/*
 * Pixels with errors of very different sizes, looked at ten times while their number grows: the
 * share of runs in which an interval misses the error that those pixels have.
 */
static void test_intervals_hold(void **state)
{
    enum { RUNS = 2000, LOOKS = 10, PIXELS = 200 };
    unsigned missed = 0;
    for (unsigned run = 0; run < RUNS; run++) {
        struct error_breakdown breakdown = {.sum = {0, 0}};
        double truth = 0;
        bool held = true;
        for (unsigned look = 1; look <= LOOKS; look++) {
            for (unsigned i = 0; i < PIXELS; i++) {
                double size = uniform() < 0.2 ? 1 : 0.1;
                double a = size * normal(), b = size * normal();
                truth += (a + b) * (a + b) / 4;
                double square = (a - b) * (a - b) / 4;
                error_sum_add(&breakdown.sum, &(struct error_sum){square, square * square});
            }
            double rmse = sqrt(truth / (look * PIXELS));
            for (enum error_look kind = ERROR_LOOK_PASS; kind <= ERROR_LOOK_BETWEEN; kind++) {
                struct error_estimate estimate =
                    error_estimate(&breakdown, look * PIXELS, kind, look);
                held &= estimate.low <= rmse && rmse <= estimate.high;
            }
        }
        missed += !held;
    }
    assert_true(missed <= RUNS * (1 - ERROR_CONFIDENCE));
}

static void test_forecast_to_a_goal(void **state)
{
    struct error_point now = {.seconds = 4, .rmse = 0.01, .log_spread = 0.01};
    struct error_forecast forecast = error_forecast_to(&now, 0.005, 8);
    double low, high;
    assert_true(forecast.known);
    assert_near(forecast.slope, log(2) / log(3), 1e-12);
    assert_near(forecast_seconds(&forecast, 0.005, &low, &high), 12, 1e-9);
    /* A fifth of 8 s more, and of where they begin 1 % of the error. */
    assert_true(10.3 < low && low < 11 && 13.5 < high && high < 14.5);
    assert_false(error_forecast_to(&now, 0.005, HUGE_VAL).known);
    assert_true(error_forecast_to(&now, 0.005, HUGE_VAL).beyond);
    assert_false(error_forecast_to(&now, 0.005, (double)NAN).known);
    assert_false(error_forecast_to(&now, 0.005, (double)NAN).beyond);
    assert_false(forecast.beyond);
    assert_false(error_forecast_to(&now, 0.02, 1).known);
}

/* By how much the error is known to be off, the slope is off, too, the less the longer the run goes on. */
static void test_forecast_of_an_uncertain_error(void **state)
{
    struct error_point now = {.seconds = 4, .rmse = 0.01};
    double known = error_forecast_to(&now, 0.005, 32).slope_spread;
    now.log_spread = 0.5;
    double spread = error_forecast_to(&now, 0.005, 32).slope_spread;
    assert_near(spread, hypot(known, 0.5 / log(36.0 / 4)), 1e-12);
}

/* If next to nothing is still to come, the uncertainty is that of times from run to run; if much is, it does not
 * change. */
static void test_forecast_scatters(void **state)
{
    struct error_point now = {.seconds = 4, .rmse = 0.01, .log_spread = 0.01};
    double low, high, before_low, before_high;
    struct error_forecast forecast = error_forecast_to(&now, 0.005, 1e-6);
    assert_true(forecast.slope > FORECAST_STEEPEST);
    forecast_set_scatter(&forecast, 0.3);
    assert_near(forecast_seconds(&forecast, 0.005, &low, &high), 4 + 1e-6, 1e-9);
    assert_near(low, 4, 1e-6);
    assert_near(high, 4 + 4 * FORECAST_SCATTER + 0.3, 1e-5);
    forecast = error_forecast_to(&now, 0.005, 8);
    forecast_seconds(&forecast, 0.005, &before_low, &before_high);
    forecast_set_scatter(&forecast, 0.3);
    forecast_seconds(&forecast, 0.005, &low, &high);
    assert_true(low == before_low && high == before_high);
    /* A second more, whose uncertainty is that from run to run, to both sides. */
    now.log_spread = 1e-9;
    forecast = error_forecast_to(&now, 0.005, 1);
    forecast_set_scatter(&forecast, 0.5);
    assert_near(forecast_seconds(&forecast, 0.005, &low, &high), 5, 1e-9);
    assert_near(low, 5 - forecast.scatter, 1e-9);
    assert_near(high, 5 + forecast.scatter, 1e-9);
}

/* A number so large that numbers which are no powers of two are as good as any. */
#define MANY (1u << 20)

/* Half of MANY samples and all of them, in terms of 16, of a picture whose squared error is flat n^-1 +
 * edge n^-3/2 + smooth n^-FORECAST_SMOOTH. */
static double error_of(const double parts[3], double n)
{
    return sqrt(parts[0] / n + parts[1] * pow(n, -1.5) + parts[2] * pow(n, -FORECAST_SMOOTH));
}

static struct error_forecast forecast_at(const double parts[3], double spread, double goal_at)
{
    const struct error_point points[2] = {{1, error_of(parts, 8), spread},
                                          {2, error_of(parts, 16), spread}};
    return error_forecast(points, MANY, error_of(parts, goal_at));
}

static void test_forecast_of_even_samples(void **state)
{
    /* Edges alone, then with what is smooth, which counts the less the more samples there are; and what
     * no sample resolves: all go on as they do, if that is known well. */
    const double parts[4][3] = {{0, 1, 0}, {0, 1, 9}, {0, 0, 1}, {1, 0, 0}};
    for (int i = 0; i < 4; i++) {
        double low, high, goal = error_of(parts[i], 63.9);
        struct error_forecast forecast = forecast_at(parts[i], 1e-4, 63.9);
        assert_true(forecast.known);
        double took = 2 * 64.0 / 16;
        assert_true(forecast.samples == 4.0 * MANY);
        assert_near(forecast_seconds(&forecast, goal, &low, &high) / took, 1, 5e-3);
        assert_true(0.8 * took < low && low < 0.95 * took);
        assert_true(1.05 * took < high && high < 1.25 * took);
        /* The less is known of the errors, the wider, unless its slope is an unusual one. */
        if (i == 0)
            assert_true(forecast_at(parts[i], 0.05, 64).slope_spread > forecast.slope_spread);
    }
}

/* Seconds grow a little more slowly than the number of samples; the difference decreases with that number. */
static void test_seconds_of_samples(void **state)
{
    const double edge[3] = {0, 1, 0};
    const struct error_point points[2] = {{1, error_of(edge, 8), 1e-6},
                                          {2, error_of(edge, 16), 1e-6}};
    const struct {
        uint32_t samples;
        double times; /* as long */
    } cases[] = {{16, 4 * (1 + FORECAST_ROOT / 8) / (1 + FORECAST_ROOT / 4)},
                 {64, 4 * (1 + FORECAST_ROOT / 16) / (1 + FORECAST_ROOT / 8)},
                 {MANY, 4}};
    for (int i = 0; i < 3; i++) {
        double low, high, goal = error_of(edge, 63.99);
        struct error_forecast forecast = error_forecast(points, cases[i].samples, goal);
        assert_true(forecast.samples == 4 * cases[i].samples);
        assert_near(forecast_seconds(&forecast, goal, &low, &high) / 2 / cases[i].times, 1, 2e-3);
    }
}

/* Powers of two have less error than the numbers beside them: they are what reaches a goal soon after it,
 * and where a run had another number, its error tells of that. */
static void test_powers_of_two_are_better(void **state)
{
    const double edge[3] = {0, 1, 0}, worse = exp(FORECAST_UNEVEN);
    const struct error_point even[2] = {{1, error_of(edge, 8), 1e-6},
                                        {2, error_of(edge, 16), 1e-6}};
    assert_true(error_forecast(even, 16, error_of(edge, 31)).samples == 32);
    assert_true(error_forecast(even, 16, error_of(edge, 29)).samples == 32);
    assert_true(error_forecast(even, 16, error_of(edge, 20)).samples == 24);
    assert_true(error_forecast(even, 16, error_of(edge, 33)).samples == 40);
    const struct error_point odd[2] = {{1, error_of(edge, 8), 1e-6},
                                       {2, error_of(edge, 18) * worse, 1e-6}};
    assert_true(error_forecast(odd, 18, error_of(edge, 31)).samples == 32);
    /* 20 would be hardly better than these 18. */
    struct error_forecast next = error_forecast(odd, 18, error_of(edge, 19.9) * worse);
    assert_true(next.samples == 20);
}

static void test_power_of_samples(void **state)
{
    const double parts[3][3] = {{0, 1, 0}, {0, 1, 9}, {1, 0, 0}};
    for (int i = 0; i < 3; i++) {
        const struct error_point points[2] = {{1, error_of(parts[i], 8), 1e-6},
                                              {1, error_of(parts[i], 16), 1e-6}};
        double now = points[1].rmse, goal = error_of(parts[i], 64);
        assert_near(error_power(points, 16, goal), 2 * log(now / goal) / log(4), 1e-4);
        assert_near(error_power(points, 16, 2 * now), FORECAST_EDGE, 0); /* it is there */
    }
    const struct error_point grown[2] = {{1, 0.1, 0.01}, {1, 0.2, 0.01}};
    assert_near(error_power(grown, 16, 0.05), FORECAST_EDGE, 0);
    /* What both numbers lack as they are no powers of two is no part of how the error goes down. */
    const double worse = exp(FORECAST_UNEVEN);
    const struct error_point odd[2] = {{1, error_of(parts[0], 12) * worse, 1e-6},
                                       {1, error_of(parts[0], 24) * worse, 1e-6}};
    assert_near(error_power(odd, 24, error_of(parts[0], 64)), FORECAST_EDGE, 1e-4);
}

static void test_point(void **state)
{
    struct error_breakdown breakdown = {.sum = {.squares = 10, .fourths = 0.3}};
    struct error_point point;
    assert_true(error_point(&breakdown, 1000, 2, &point));
    assert_true(point.seconds == 2);
    assert_near(point.rmse, 0.1, 1e-15);
    assert_near(point.log_spread, sqrt(0.3) / 10 / 2, 1e-15); /* half of that of the square */
    assert_false(error_point(&breakdown, 0, 2, &point) || error_point(&breakdown, 1000, 0, &point));
    breakdown.hidden = 5;
    assert_true(error_point(&breakdown, 1000, 2, &point));
    assert_near(point.log_spread, hypot(sqrt(0.3) / 10, 0.6 * 0.5) / 2, 1e-15);
}

/* The intervals of forecasts contain the scatter that comes from the errors of both points. */
static void test_forecasts_scatter_as_told(void **state)
{
    enum { RUNS = 4000 };
    const double parts[3][3] = {{0, 1, 0}, {0, 1, 9}, {1, 0, 0}}, spreads[2] = {0.01, 0.005};
    for (int i = 0; i < 3; i++) {
        double goal = error_of(parts[i], 40), sum = 0, squares = 0, low, high;
        const struct error_point exact[2] = {{1, error_of(parts[i], 8), spreads[0]},
                                             {2, error_of(parts[i], 16), spreads[1]}};
        struct error_forecast told = error_forecast(exact, MANY, goal);
        double seconds = forecast_seconds(&told, goal, &low, &high), times = log(seconds / 2);
        for (int run = 0; run < RUNS; run++) {
            const struct error_point points[2] = {
                {1, exact[0].rmse * exp(spreads[0] * normal()), spreads[0]},
                {2, exact[1].rmse * exp(spreads[1] * normal()), spreads[1]}};
            struct error_forecast forecast = error_forecast(points, MANY, goal);
            double off = log(forecast_seconds(&forecast, goal, &low, &high) / seconds);
            sum += off;
            squares += off * off;
        }
        double deviation = sqrt(squares / RUNS - pow(sum / RUNS, 2));
        double foresight = FORECAST_SPREAD * (1 - 2 / seconds) * told.slope / times;
        double of_errors = sqrt(pow(told.slope_spread, 2) - pow(foresight, 2));
        assert_near(of_errors / told.slope * times / deviation, 1, 0.06);
    }
}

/* An unknown slope is assumed to be the usual one; the better it is known, the less the usual one counts. */
static void test_slopes_are_usual_until_known(void **state)
{
    const double slopes[2] = {0.6, 0.9};
    for (int i = 0; i < 2; i++) {
        double usual = exp2(FORECAST_SLOPE), seen = exp2(slopes[i]), low, high, seconds[4];
        for (int k = 0; k < 4; k++) {
            double spread = pow(10, k - 3);
            const struct error_point points[2] = {{1, seen, spread}, {2, 1, spread}};
            struct error_forecast forecast = error_forecast(points, 4, 0.25);
            seconds[k] = forecast_seconds(&forecast, 0.25, &low, &high);
            assert_true(k == 0 || (seconds[k - 1] > seconds[k]) == (slopes[i] < FORECAST_SLOPE));
        }
        /* Moved by the same, both errors end where the usual slope goes through. */
        double middle = sqrt(seen / usual);
        const struct error_point points[2] = {{1, usual * middle, 1e-6}, {2, middle, 1e-6}};
        struct error_forecast forecast = error_forecast(points, 4, 0.25);
        assert_near(seconds[3] / forecast_seconds(&forecast, 0.25, &low, &high), 1, 1e-2);
    }
}

/* Where only one of both errors is uncertain, it is that one which is moved to the usual slope. */
static void test_the_uncertain_error_is_moved(void **state)
{
    const double seen = exp2(0.6), usual = exp2(FORECAST_SLOPE);
    for (int uncertain = 0; uncertain < 2; uncertain++) {
        struct error_point points[2] = {{1, seen, 1e-6}, {2, 1, 1e-6}};
        points[uncertain].log_spread = 1e3;
        double moved = error_forecast(points, 4, 0.25).samples;
        points[0].rmse = uncertain ? seen : usual;
        points[1].rmse = uncertain ? seen / usual : 1;
        points[uncertain].log_spread = 1e-6;
        assert_true(error_forecast(points, 4, 0.25).samples == moved);
    }
}

/* If both errors may be equal, the time has no upper bound, but a lower one. */
static void test_forecast_without_an_end(void **state)
{
    const struct error_point points[2] = {{1, 0.0097, 0.01}, {2, 0.01, 0.01}};
    struct error_forecast forecast = error_forecast(points, 4, 0.005);
    double low, high;
    assert_true(forecast.known);
    double seconds = forecast_seconds(&forecast, 0.005, &low, &high);
    assert_true(seconds < HUGE_VAL);
    assert_true(high == HUGE_VAL && low > 50 &&
                low < seconds); /* as where both are off to the steep side */
}

static void test_no_forecast(void **state)
{
    struct error_point points[2] = {{1, 0.1, 0.01}, {2, 0.2, 0.01}};
    assert_false(error_forecast(points, 4, 0.05).known); /* the error grows */
    points[1].rmse = 0.05;
    assert_false(error_forecast(points, 4, 0.06).known); /* the goal is reached already */
    assert_true(error_forecast(points, 4, 0.04).known);
    /* Half of the samples had missed what has most of the error. */
    const struct error_point missed[2] = {{1, 0.0008, 0.5}, {2, 0.053, 0.5}};
    assert_false(error_forecast(missed, 7, 0.02).known);
    /* A picture of one pixel, whose error is so uncertain that it may be below the goal already. */
    const struct error_point uncertain[2] = {{1, 0.04, 0.8}, {2, 0.05, 0.8}};
    assert_false(error_forecast(uncertain, 4, 0.025).known);
    const struct error_breakdown none = {.sum = {0, 0}}, lost = {.sum = {HUGE_VAL, HUGE_VAL}};
    struct error_point point;
    assert_false(error_point(&none, 10, 1, &point));
    assert_false(error_point(&lost, 10, 1, &point));
}

static void test_goals_are_round(void **state)
{
    assert_near(forecast_goal(0.0021), 0.001, 1e-15);
    assert_near(forecast_goal(0.0019), 0.0007, 1e-15);
    assert_near(forecast_goal(0.0039), 0.0015, 1e-15);
    assert_near(forecast_goal(0.0061), 0.003, 1e-15);
    assert_true(forecast_goal(0.0006) == 0.0003 && forecast_goal(0.6) == 0.3);
    assert_true(forecast_goal(1.4) == 0.7 && forecast_goal(0.03) == 0.015);
    assert_near(forecast_goal(0.05), 0.02, 1e-15);
    assert_near(forecast_goal(0.11), 0.05, 1e-15);
    assert_near(forecast_goal(0.4), 0.2, 1e-15); /* half of it, where that is round */
    assert_near(forecast_goal(1), 0.5, 1e-15);
    assert_true(forecast_goal(4.1) == 2 && forecast_goal(30) == 15 && forecast_goal(1400) == 700);
}

static void test_csv(void **state)
{
    char *text;
    size_t bytes;
    FILE *out = open_memstream(&text, &bytes);
    struct error_row row = {1.5, 4, {0.25, 0.125, 0.5}, 0.3, 0.75};
    error_names_csv(out);
    error_row_csv(out, &row);
    row.true_rmse = (double)NAN;
    error_row_csv(out, &row);
    row.estimate.high = HUGE_VAL; /* no number that readers of the file know */
    error_row_csv(out, &row);
    fclose(out);
    assert_string_equal(
        text, "elapsed_s,samples_per_pixel,estimated_rmse,estimated_low,estimated_high,true_rmse,"
              "sampled_share\n"
              "1.5,4,0.25,0.125,0.5,0.3,0.75\n1.5,4,0.25,0.125,0.5,,0.75\n"
              "1.5,4,0.25,0.125,,,0.75\n");
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nothing_is_no_error),
        cmocka_unit_test(test_interval_widens_with_every_look),
        cmocka_unit_test(test_hidden_widens_the_interval),
        cmocka_unit_test(test_odd_samples_widen_the_interval),
        cmocka_unit_test(test_all_looks_together),
        cmocka_unit_test(test_intervals_hold),
        cmocka_unit_test(test_forecast_to_a_goal),
        cmocka_unit_test(test_forecast_of_an_uncertain_error),
        cmocka_unit_test(test_forecast_scatters),
        cmocka_unit_test(test_forecast_of_even_samples),
        cmocka_unit_test(test_seconds_of_samples),
        cmocka_unit_test(test_powers_of_two_are_better),
        cmocka_unit_test(test_power_of_samples),
        cmocka_unit_test(test_point),
        cmocka_unit_test(test_forecasts_scatter_as_told),
        cmocka_unit_test(test_slopes_are_usual_until_known),
        cmocka_unit_test(test_the_uncertain_error_is_moved),
        cmocka_unit_test(test_forecast_without_an_end),
        cmocka_unit_test(test_no_forecast),
        cmocka_unit_test(test_goals_are_round),
        cmocka_unit_test(test_csv),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
