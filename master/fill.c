#include "master/fill.h"

#include <math.h>
#include <stdbool.h>

#include "master/lattice.h"

/* Steps from a pixel that belongs to a lattice but not to the next coarser one, to its nearest neighbours in the
 * latter. */
static const int straight[4][2] = {{0, -1}, {-1, 0}, {1, 0}, {0, 1}};
static const int diagonal[4][2] = {{-1, -1}, {1, -1}, {-1, 1}, {1, 1}};

/* A picture of which some pixels are known. */
struct picture {
    const struct canvas *canvas;
    const uint8_t *known; /* per pixel */
    const struct preview *preview;
};

static bool is_known(const struct picture *picture, uint32_t x, uint32_t y)
{
    return picture->known[(size_t)y * picture->canvas->width + x];
}

/* Where a neighbour of a pixel is. A coordinate below 0 wraps around to a very large one. */
struct neighbour {
    uint32_t x, y;
};

/* Puts those of the four neighbours that lie in the picture into `found`, and returns their number. The one above or to
 * the left always does, as the pixel in the corner is on every lattice. */
static int neighbours_of(const struct canvas *canvas, uint32_t lattice, uint32_t x, uint32_t y,
                         struct neighbour found[4])
{
    uint32_t spacing = lattice_row_step(lattice);
    const int(*steps)[2] = lattice % 2 ? diagonal : straight;
    int count = 0;
    for (int i = 0; i < 4; i++) {
        uint32_t u = x + spacing * (uint32_t)steps[i][0], v = y + spacing * (uint32_t)steps[i][1];
        if (u < canvas->width && v < canvas->height) found[count++] = (struct neighbour){u, v};
    }
    return count;
}

static void mean_of(const struct canvas *canvas, const struct neighbour *around, int count,
                    float mean[3])
{
    float sum[3] = {0, 0, 0};
    for (int i = 0; i < count; i++) {
        const float *near = canvas_at(canvas, around[i].x, around[i].y);
        for (int c = 0; c < 3; c++)
            sum[c] += near[c];
    }
    for (int c = 0; c < 3; c++)
        mean[c] = sum[c] / (float)count;
}

static int count_known(const struct picture *picture, const struct neighbour *around, int count)
{
    int sum = 0;
    for (int i = 0; i < count; i++)
        sum += is_known(picture, around[i].x, around[i].y);
    return sum;
}

/* Whether the preview, with blocks of this edge, is a better estimate of a pixel than its neighbours at this
 * distance. That is so if the blocks are no larger than the distance; or if their centres are no farther away than
 * the neighbours, and most of the neighbours are guessed themselves. */
static bool blocks_tell_more(uint32_t edge, uint32_t spacing, int neighbours, int known)
{
    if (edge == 0 || edge > 2 * spacing) return false;
    return edge <= spacing || 2 * known < neighbours;
}

/* The colour for a pixel of this lattice that does not belong to the next coarser one. */
static void guess(const struct picture *picture, uint32_t lattice, uint32_t x, uint32_t y,
                  float color[3])
{
    const struct preview *preview = picture->preview;
    struct neighbour around[4];
    int count = neighbours_of(picture->canvas, lattice, x, y, around);
    int there = count_known(picture, around, count);
    if (blocks_tell_more(preview->edge, lattice_row_step(lattice), count, there))
        preview_between(preview, x, y, color);
    else
        mean_of(picture->canvas, around, count, color);
}

static void fill_lattice(const struct picture *picture, uint32_t lattice)
{
    const struct canvas *canvas = picture->canvas;
    uint32_t row_step = lattice_step(lattice), step = lattice_between_step(lattice);
    for (uint32_t y = lattice_between_first_row(lattice); y < canvas->height; y += row_step)
        for (uint32_t x = lattice_between_first(lattice, y); x < canvas->width; x += step)
            if (!is_known(picture, x, y)) guess(picture, lattice, x, y, canvas_at(canvas, x, y));
}

void fill_unknown(struct canvas *canvas, const uint8_t *known, struct preview *preview)
{
    const struct picture picture = {canvas, known, preview};
    preview_complete(preview);
    for (uint32_t y = 0; y < canvas->height; y += LATTICE_SPACING)
        for (uint32_t x = 0; x < canvas->width; x += LATTICE_SPACING)
            if (!is_known(&picture, x, y)) preview_between(preview, x, y, canvas_at(canvas, x, y));
    for (uint32_t lattice = LATTICE_COARSEST; lattice-- > 0;)
        fill_lattice(&picture, lattice);
}

/* ---- the error of filled pixels ---- */

/* The squared error of filled pixels, as a share of that of guesses for the pixels of the finest complete lattice:
 * filled pixels are closer to known ones than those are to the next coarser lattice. The share was 0.36 to 0.58 in
 * ten pictures of three scenes, of which 7 to 61 % had samples. */
#define GUESSED_SHARE 0.5

static double squared_miss(const float a[3], const float b[3])
{
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        double miss = (double)a[c] - (double)b[c];
        sum += miss * miss;
    }
    return sum / 3;
}

static bool is_whole(const struct picture *picture, uint32_t lattice)
{
    const struct canvas *canvas = picture->canvas;
    uint32_t step = lattice_step(lattice);
    for (uint32_t y = 0; y < canvas->height; y += lattice_row_step(lattice))
        for (uint32_t x = lattice_first(lattice, y); x < canvas->width; x += step)
            if (!is_known(picture, x, y)) return false;
    return true;
}

/* Whether the adjacent pixel is known: the one to the right, or in the last column the one to the left. */
static bool is_accompanied(const struct picture *picture, uint32_t x, uint32_t y)
{
    uint32_t width = picture->canvas->width;
    return width > 1 && is_known(picture, x + 1 < width ? x + 1 : x - 1, y);
}

/* The mean squared error of guesses for pixels of a complete lattice that do not belong to the next coarser one,
 * where there are unknown pixels beside them; NaN: there are none. */
static double miss_of(const struct picture *picture, uint32_t lattice)
{
    const struct canvas *canvas = picture->canvas;
    double sum = 0, count = 0;
    uint32_t row_step = lattice_step(lattice), step = lattice_between_step(lattice);
    for (uint32_t y = lattice_between_first_row(lattice); y < canvas->height; y += row_step)
        for (uint32_t x = lattice_between_first(lattice, y); x < canvas->width; x += step) {
            float color[3];
            if (is_accompanied(picture, x, y)) continue;
            guess(picture, lattice, x, y, color);
            sum += squared_miss(color, canvas_at(canvas, x, y));
            count++;
        }
    return sum / count;
}

double fill_error(const struct canvas *canvas, const uint8_t *known, const struct preview *preview)
{
    const struct picture picture = {canvas, known, preview};
    double miss = (double)NAN;
    for (uint32_t lattice = 0; lattice < LATTICE_COARSEST && isnan(miss); lattice++)
        if (is_whole(&picture, lattice)) miss = miss_of(&picture, lattice);
    return GUESSED_SHARE * miss;
}
