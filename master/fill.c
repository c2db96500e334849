#include "master/fill.h"

#include <stdbool.h>
#include <string.h>

#include "master/lattice.h"

static float *at(const struct canvas *canvas, uint32_t x, uint32_t y)
{
    return canvas->rgb + 3 * ((size_t)y * canvas->width + x);
}

/* Of a pixel that a lattice has and the next coarser one has not: to the nearest that it has. */
static const int straight[4][2] = {{0, -1}, {-1, 0}, {1, 0}, {0, 1}};
static const int diagonal[4][2] = {{-1, -1}, {1, -1}, {-1, 1}, {1, 1}};

/* The mean of those that lie in the picture: the one above or to the left always does, for the pixel in the
 * corner is on every lattice. What lies beyond the first row or column is far beyond the last one. */
static void take_mean(struct canvas *canvas, uint32_t x, uint32_t y, uint32_t spacing,
                      const int steps[4][2])
{
    float sum[3] = {0, 0, 0}, count = 0, *color = at(canvas, x, y);
    for (int i = 0; i < 4; i++) {
        uint32_t u = x + spacing * (uint32_t)steps[i][0], v = y + spacing * (uint32_t)steps[i][1];
        if (u >= canvas->width || v >= canvas->height) continue;
        const float *near = at(canvas, u, v);
        for (int c = 0; c < 3; c++)
            sum[c] += near[c];
        count++;
    }
    for (int c = 0; c < 3; c++)
        color[c] = sum[c] / count;
}

/* The colour of the pixel's block; false: it is not known. */
static bool take_block(struct canvas *canvas, uint32_t x, uint32_t y, const struct preview *preview)
{
    const float *color = preview_color(preview, x, y);
    if (!color) return false;
    memcpy(at(canvas, x, y), color, 3 * sizeof *color);
    return true;
}

/* What this lattice has and the next coarser one has not. Where blocks are no larger than the way to the next known
 * pixels, they tell more than these. */
static void fill_lattice(struct canvas *canvas, const uint8_t *known, const struct preview *preview,
                         uint32_t lattice)
{
    uint32_t spacing = lattice_rows(lattice);
    bool odd = lattice % 2, has_blocks = preview->edge > 0 && preview->edge <= spacing;
    for (uint32_t y = odd ? spacing : 0; y < canvas->height; y += odd ? 2 * spacing : spacing) {
        uint32_t first = odd || y / spacing % 2 == 0 ? spacing : 0;
        for (uint32_t x = first; x < canvas->width; x += 2 * spacing) {
            if (known[(size_t)y * canvas->width + x]) continue;
            if (!has_blocks || !take_block(canvas, x, y, preview))
                take_mean(canvas, x, y, spacing, odd ? diagonal : straight);
        }
    }
}

void fill_unknown(struct canvas *canvas, const uint8_t *known, struct preview *preview)
{
    preview_complete(preview);
    for (uint32_t y = 0; y < canvas->height; y += LATTICE_SPACING)
        for (uint32_t x = 0; x < canvas->width; x += LATTICE_SPACING)
            if (!known[(size_t)y * canvas->width + x]) take_block(canvas, x, y, preview);
    for (uint32_t lattice = LATTICE_COARSEST; lattice-- > 0;)
        fill_lattice(canvas, known, preview, lattice);
}
