#include "master/contrast.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* there - here; false: it is not finite. */
static bool difference_to(const struct canvas *canvas, size_t here, size_t there, double by[3])
{
    double square = 0;
    for (size_t c = 0; c < 3; c++) {
        by[c] = (double)canvas->rgb[3 * there + c] - (double)canvas->rgb[3 * here + c];
        square += by[c] * by[c];
    }
    return square < HUGE_VAL;
}

static double product(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

struct contrast contrast_of(const struct canvas *canvas, uint32_t x, uint32_t y)
{
    size_t width = canvas->width, here = (size_t)y * width + x;
    double by[8][3];
    unsigned count = 0, far = 0;
    uint32_t left = x > 0 ? x - 1 : x, right = x + 1 < width ? x + 1 : x;
    uint32_t above = y > 0 ? y - 1 : y, below = y + 1 < canvas->height ? y + 1 : y;
    for (uint32_t v = above; v <= below; v++) {
        for (uint32_t u = left; u <= right; u++) {
            size_t there = (size_t)v * width + u;
            if (there == here || !difference_to(canvas, here, there, by[count])) continue;
            if (product(by[count], by[count]) > product(by[far], by[far])) far = count;
            count++;
        }
    }
    if (count == 0) return (struct contrast){0, 0};
    double across = 0;
    for (unsigned k = 0; k < count; k++)
        across = fmax(across, -product(by[far], by[k]));
    return (struct contrast){product(by[far], by[far]) / 3, across / 3};
}
