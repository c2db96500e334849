/* The pictures of a timeline: what each pixel cost, and which renderer rendered it. */
#include <math.h>
#include <stdbool.h>

#include "common/vec.h"
#include "master/timeline.h"

/* ---- colours ---- */

/* The sRGB transfer function, IEC 61966-2-1; the argument is clamped to 0..1. */
static double srgb_encode(double linear)
{
    if (!(linear > 0)) return 0;
    if (linear >= 1) return 1;
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
}

/* From Oklab (Ottosson 2020, "A perceptual color space for image processing") to linear sRGB. */
static struct vec3 oklab_to_linear(double lightness, double a, double b)
{
    double l = pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
    double m = pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
    double s = pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
    return vec3(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
                -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
                -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s);
}

static bool in_gamut(struct vec3 c)
{
    return fmin(c.x, fmin(c.y, c.z)) >= 0 && fmax(c.x, fmax(c.y, c.z)) <= 1;
}

/* A colour of this lightness (0..1), hue (turns) and chroma, which is reduced if it is not in gamut; encoded for a
 * PNG. */
static void perceived_color(double lightness, double chroma, double hue, float rgb[3])
{
    double turn = 2 * M_PI * hue;
    struct vec3 color = oklab_to_linear(lightness, chroma * cos(turn), chroma * sin(turn));
    for (int step = 0; step < 60 && !in_gamut(color); step++) {
        chroma *= 0.95;
        color = oklab_to_linear(lightness, chroma * cos(turn), chroma * sin(turn));
    }
    rgb[0] = (float)srgb_encode(color.x);
    rgb[1] = (float)srgb_encode(color.y);
    rgb[2] = (float)srgb_encode(color.z);
}

/* From black over violet, red and orange to white, in even steps of lightness. */
void timeline_heat_color(double heat, float rgb[3])
{
    const double violet = 0.78, yellow = 1.30;     /* hues, turns */
    double chroma = 0.24 * sqrt(sin(M_PI * heat)); /* 0 at both ends, up to rounding */
    perceived_color(heat, chroma, violet + (yellow - violet) * heat, rgb);
}

/* ---- the pictures ---- */

/* The range of the colour scale; costs of 0 are unknown, and if all are, the range is 0 to 0. It spans a factor of 2 to
 * 1000, so that noise alone is not shown as structure, and a few expensive pixels leave contrast for the rest. */
static struct heat_range find_range(const float *costs, size_t pixels)
{
    double lowest = HUGE_VAL, highest = 0;
    for (size_t i = 0; i < pixels; i++) {
        if (!(costs[i] > 0)) continue;
        lowest = fmin(lowest, (double)costs[i]);
        highest = fmax(highest, (double)costs[i]);
    }
    return (struct heat_range){fmin(fmax(lowest, highest / 1000), highest / 2), highest};
}

#define SHADES 256

struct heat_range timeline_heatmap(const struct timeline *timeline, uint32_t height,
                                   struct canvas *canvas)
{
    size_t pixels = (size_t)canvas->width * height;
    const float *costs = timeline->costs;
    float shades[SHADES][3];
    struct heat_range range = find_range(costs, pixels);
    double scale = range.highest > 0 ? (SHADES - 1) / log(range.highest / range.lowest) : 0;
    for (int i = 0; i < SHADES; i++)
        timeline_heat_color(i / (SHADES - 1.0), shades[i]);
    for (size_t i = 0; i < pixels; i++) {
        /* At most SHADES - 1, that of the highest cost; less than 0 for costs below the range. */
        double heat = costs[i] > 0 ? scale * log((double)costs[i] / range.lowest) : 0;
        const float *shade = shades[(int)fmax(0, heat + 0.5)];
        for (int c = 0; c < 3; c++)
            canvas->rgb[3 * i + (size_t)c] = shade[c];
    }
    return range;
}

/* Tiles that are narrower than this are not outlined: the outline would be most of them. */
#define OUTLINED 8

void timeline_ranks(const struct timeline *timeline, float (*colors)[3], struct canvas *canvas)
{
    for (size_t i = 0; i < timeline->count; i++) {
        const struct timeline_entry *entry = &timeline->entries[i];
        if (entry->kind != TIMELINE_TILE) continue;
        const struct tile *tile = &entry->tile;
        bool outlined = tile->step == 1 && tile->w >= OUTLINED && tile->h >= OUTLINED;
        uint32_t pixels = tile_pixels(tile), x, y;
        for (uint32_t k = 0; k < pixels; k++) {
            tile_pixel(tile, k, &x, &y);
            float shade = outlined && (x == tile->x || y == tile->y) ? 0.75f : 1;
            for (int c = 0; c < 3; c++)
                canvas_at(canvas, x, y)[c] = shade * colors[entry->renderer][c];
        }
    }
}
