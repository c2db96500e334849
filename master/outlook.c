#include "master/outlook.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The class of the octave of 1. */
#define MIDDLE 40

/* The weight of one octave in the estimate for another one is divided by 2 to the power of this for each octave of
 * distance: by far the most comes from the nearest one of which anything is known. */
#define FADING 3

/* The octave (binary exponent) of 1 is 0, that of 2 and 3 is 1. That of 0 and of subnormal numbers is one below all
 * others. Read from the bits, as speed matters: see half_octave_below() in master/queue_predict.c. */
static int octave_of(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (int)(bits >> (DBL_MANT_DIG - 1)) - (DBL_MAX_EXP - 1);
}

static struct outlook_class *class_of(struct outlook *outlook, double work, uint64_t pixels)
{
    int octave = work > 0 ? MIDDLE + octave_of(work / (double)pixels) : 0;
    octave = octave < 0 ? 0 : octave >= OUTLOOK_CLASSES ? OUTLOOK_CLASSES - 1 : octave;
    return &outlook->classes[octave];
}

void outlook_add(struct outlook *outlook, double work, uint64_t pixels)
{
    class_of(outlook, work, pixels)->left += work;
}

void outlook_remove(struct outlook *outlook, double work, uint64_t pixels)
{
    class_of(outlook, work, pixels)->left -= work;
}

void outlook_finish(struct outlook *outlook, double work, uint64_t pixels, double seconds)
{
    struct outlook_class *class = class_of(outlook, work, pixels);
    class->done += work;
    class->seconds += seconds;
}

void outlook_skip(struct outlook *outlook, double work, uint64_t pixels)
{
    class_of(outlook, work, pixels)->skipped += work;
}

/* Seconds per work of this octave, by all finished tiles; 1 while there are none. */
static double seconds_per_work(const struct outlook *outlook, int octave)
{
    double seconds = 0, done = 0;
    for (int i = 0; i < OUTLOOK_CLASSES; i++) {
        double weight = ldexp(1, -FADING * abs(i - octave));
        seconds += weight * outlook->classes[i].seconds;
        done += weight * outlook->classes[i].done;
    }
    return seconds > 0 && done > 0 ? seconds / done : 1;
}

struct outlook_share outlook_share(const struct outlook *outlook)
{
    double left = 0, skipped = 0, done = 0;
    for (int i = 0; i < OUTLOOK_CLASSES; i++) {
        const struct outlook_class *class = &outlook->classes[i];
        if (!(class->left > 0 || class->skipped > 0 || class->done > 0)) continue;
        double ratio = seconds_per_work(outlook, i);
        left += fmax(class->left, 0) * ratio; /* differences of sums may fall below 0 */
        skipped += class->skipped * ratio;
        done += class->seconds;
    }
    double all = left + skipped + done;
    if (!(all > 0)) return (struct outlook_share){0, 0, 0};
    return (struct outlook_share){(skipped + done) / all, skipped / all, left + done};
}
