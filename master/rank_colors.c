#include "master/rank_colors.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/vec.h"

/* The colours to choose from have so many values of each component. */
#define STEPS 16

/* Limits in CIELAB. Darker colours are hard to tell from each other and from the outlines of tiles, and lighter ones
 * and such of less chroma from the greys of the legend. Blue itself has a lightness of 32.3. */
#define LIGHTNESS_LEAST 32
#define LIGHTNESS_MOST  95
#define CHROMA_LEAST    20

/* What a difference of hue or chroma counts, relative to lightness: in CIELAB those of vivid colours are larger than
 * they look. With a half, the least difference by CIEDE2000 between two of 44 colours is 9.5, with 1 it is 6. */
#define CHROMA_WEIGHT 0.5

struct candidate {
    float rgb[3];
    struct vec3 place; /* lightness, a and b of CIELAB, weighted */
    double apart;      /* square of the distance to the nearest colour that is taken */
};

/* From sRGB to linear components, IEC 61966-2-1. */
static double srgb_decode(double encoded)
{
    return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4);
}

/* The function f of CIE 15:2004. */
static double cielab_root(double share)
{
    return share > 216.0 / 24389 ? cbrt(share) : (24389.0 / 27 * share + 16) / 116;
}

/* CIE 15:2004, with the white of sRGB. */
static struct vec3 cielab(const float rgb[3])
{
    double r = srgb_decode((double)rgb[0]), g = srgb_decode((double)rgb[1]),
           b = srgb_decode((double)rgb[2]);
    double x = cielab_root((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505);
    double y = cielab_root(0.2126 * r + 0.7152 * g + 0.0722 * b);
    double z = cielab_root((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.089);
    return vec3(116 * y - 16, 500 * (x - y), 200 * (y - z));
}

static double squared_distance(struct vec3 a, struct vec3 b)
{
    struct vec3 apart = vec_sub(a, b);
    return vec_dot(apart, apart);
}

/* false: no rank is to have that colour. */
static bool make_candidate(int r, int g, int b, struct candidate *it)
{
    const float most = STEPS - 1;
    *it = (struct candidate){.rgb = {(float)r / most, (float)g / most, (float)b / most}};
    struct vec3 color = cielab(it->rgb);
    it->place = vec3(color.x, CHROMA_WEIGHT * color.y, CHROMA_WEIGHT * color.z);
    /* The first colour is the one most unlike black, which are pixels that nobody has rendered. */
    it->apart = squared_distance(it->place, vec3(0, 0, 0));
    return color.x >= LIGHTNESS_LEAST && color.x <= LIGHTNESS_MOST &&
           hypot(color.y, color.z) >= CHROMA_LEAST;
}

/* Owned by the caller. */
static struct candidate *list_candidates(size_t *count)
{
    struct candidate *list = allocate((size_t)STEPS * STEPS * STEPS, sizeof *list);
    *count = 0;
    for (int r = 0; r < STEPS; r++)
        for (int g = 0; g < STEPS; g++)
            for (int b = 0; b < STEPS; b++)
                *count += make_candidate(r, g, b, &list[*count]);
    return list;
}

/* Takes the candidate that is farthest from all that are taken; of several, the first one. */
static const struct candidate *take_farthest(struct candidate *list, size_t count)
{
    struct candidate *farthest = list;
    for (size_t i = 1; i < count; i++)
        if (list[i].apart > farthest->apart) farthest = &list[i];
    for (size_t i = 0; i < count; i++)
        list[i].apart = fmin(list[i].apart, squared_distance(list[i].place, farthest->place));
    return farthest;
}

void rank_colors(uint32_t count, float (*rgb)[3])
{
    size_t colors;
    struct candidate *list = list_candidates(&colors);
    for (uint32_t i = 0; i < count; i++) {
        const float *color = i < colors ? take_farthest(list, colors)->rgb : rgb[i - colors];
        memcpy(rgb[i], color, sizeof rgb[i]);
    }
    free(list);
}
