#include "master/allocation.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"

/*
 * A histogram of the pixels' gains, in bins of an eighth of an octave. For each bin and each number of levels that
 * pixels can still go up there are sums of squares and effort. Octaves are relative to that of the typical error, so
 * that pictures of any brightness are planned alike. Gains beyond either end, which no picture has, count with the last
 * bin there.
 */
enum { BIN_BITS = 3, BINS_PER_OCTAVE = 1 << BIN_BITS, OCTAVE_MIN = -120, OCTAVES = 220 };
enum { BINS = OCTAVES * BINS_PER_OCTAVE };

struct allocation {
    int octave_min;
    double squares[BINS][LEVEL_MAX + 1];
    double efforts[BINS][LEVEL_MAX + 1];
    bool used[BINS];
    double all_squares;
};

struct allocation *allocation_create(double error)
{
    struct allocation *allocation = allocate_zeroed(1, sizeof *allocation);
    int exponent = 1;
    if (error > 0 && error < HUGE_VAL) frexp(error, &exponent);
    allocation->octave_min = OCTAVE_MIN + exponent - 1;
    return allocation;
}

void allocation_destroy(struct allocation *allocation)
{
    free(allocation);
}

/* The bin's upper end: gains in the bin are at most this, and above its lower end. So under a limit that is the end of
 * a bin, all pixels of higher bins are doubled at least once. */
static double bin_end(const struct allocation *allocation, int bin)
{
    int octave = bin / BINS_PER_OCTAVE, part = bin % BINS_PER_OCTAVE + 1;
    return ldexp(1 + (double)part / BINS_PER_OCTAVE, octave + allocation->octave_min);
}

/* The bin is made of a double's exponent and the first three bits of its mantissa. */
static int bin_of(const struct allocation *allocation, double gain)
{
    int64_t bits; /* those of the gains of one bin follow each other; gain > 0 */
    memcpy(&bits, &gain, sizeof bits);
    if (!(gain > 0)) return 0;
    int64_t bin = ((bits - 1) >> (DBL_MANT_DIG - 1 - BIN_BITS)) -
                  (int64_t)(allocation->octave_min + DBL_MAX_EXP - 1) * BINS_PER_OCTAVE;
    return bin < 0 ? 0 : bin >= BINS ? BINS - 1 : (int)bin;
}

void allocation_add(struct allocation *allocation, double gain, double square, double effort,
                    unsigned most)
{
    int bin = bin_of(allocation, gain);
    allocation->squares[bin][most] += square;
    allocation->efforts[bin][most] += effort;
    allocation->used[bin] = true;
    allocation->all_squares += square;
}

void allocation_join(struct allocation *allocation, const struct allocation *other)
{
    assert(allocation->octave_min == other->octave_min);
    for (int bin = 0; bin < BINS; bin++) {
        if (!other->used[bin]) continue;
        allocation->used[bin] = true;
        for (unsigned most = 0; most <= LEVEL_MAX; most++) {
            allocation->squares[bin][most] += other->squares[bin][most];
            allocation->efforts[bin][most] += other->efforts[bin][most];
        }
    }
    allocation->all_squares += other->all_squares;
}

double allocation_squares(const struct allocation *allocation)
{
    return allocation->all_squares;
}

/* Twice as many samples leave 2^-3/2 of a pixel's squared error (allocation.h) and, at twice the cost, half as much of
 * its gain, 2^-5/2. */
#define ERROR_OF_DOUBLE 0.35355339059327379
#define GAIN_OF_DOUBLE  (ERROR_OF_DOUBLE / 2)

unsigned allocation_doublings(double gain, double limit, unsigned most)
{
    unsigned count = 0;
    while (count < most && gain > limit) {
        gain *= GAIN_OF_DOUBLE;
        count++;
    }
    return count;
}

struct allocation_outcome allocation_under(const struct allocation *allocation, double limit)
{
    struct allocation_outcome sum = {0, 0};
    double efforts[LEVEL_MAX + 1]; /* of k doublings in one pass, in terms of the first doubling */
    for (unsigned k = 0; k <= LEVEL_MAX; k++)
        efforts[k] = pow(exp2(k) - 1, EFFORT_POWER);
    for (int bin = 0; bin < BINS; bin++) {
        if (!allocation->used[bin]) continue;
        unsigned most = allocation_doublings(bin_end(allocation, bin), limit, LEVEL_MAX);
        double factor = 1;
        for (unsigned k = 0; k <= LEVEL_MAX; k++) {
            sum.left += factor * allocation->squares[bin][k];
            sum.effort += efforts[k < most ? k : most] * allocation->efforts[bin][k];
            if (k < most) factor *= ERROR_OF_DOUBLE;
        }
    }
    return sum;
}

/* The last bin whose end, as the limit, has an outcome for which is_so() holds, as it does for all bins before it; -1:
 * none has. */
static int last_bin(const struct allocation *allocation,
                    bool (*is_so)(struct allocation_outcome outcome, double than), double than)
{
    int low = -1, high = BINS - 1;
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (is_so(allocation_under(allocation, bin_end(allocation, middle)), than))
            low = middle;
        else
            high = middle;
    }
    return low;
}

static bool leaves_at_most(struct allocation_outcome outcome, double goal)
{
    return outcome.left <= goal;
}

static bool takes_more(struct allocation_outcome outcome, double effort)
{
    return outcome.effort > effort;
}

double allocation_limit(const struct allocation *allocation, double goal)
{
    int bin = last_bin(allocation, leaves_at_most, goal);
    return bin < 0 ? 0 : bin_end(allocation, bin);
}

double allocation_limit_within(const struct allocation *allocation, double effort)
{
    int bin = last_bin(allocation, takes_more, effort);
    double next = bin_end(allocation, bin + 1);
    if (allocation_under(allocation, next).effort > 0) return next;
    return bin < 0 ? 0 : bin_end(allocation, bin);
}
