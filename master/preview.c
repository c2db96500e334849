#include "master/preview.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/whole.h"

void preview_free(struct preview *preview)
{
    free(preview->rgb);
    *preview = (struct preview){0};
}

/* Allocates the blocks, all unknown. All probes have the same step, which is the edge of their blocks. */
static void begin(struct preview *preview, uint32_t width, uint32_t height, uint32_t edge)
{
    preview->edge = edge;
    preview->columns = divide_up(width, edge);
    preview->rows = divide_up(height, edge);
    size_t count = (size_t)preview->columns * preview->rows * 3;
    preview->rgb = allocate(count, sizeof *preview->rgb);
    for (size_t i = 0; i < count; i++)
        preview->rgb[i] = NAN;
}

static float *block_of(const struct preview *preview, uint32_t x, uint32_t y)
{
    size_t block = (size_t)(y / preview->edge) * preview->columns + x / preview->edge;
    return preview->rgb + 3 * block;
}

void preview_put(struct preview *preview, uint32_t width, uint32_t height, const struct tile *probe,
                 const float *rgb)
{
    if (preview->edge == 0) begin(preview, width, height, probe->step);
    uint32_t pixels = tile_pixels(probe);
    for (uint32_t k = 0; k < pixels; k++) {
        uint32_t x, y;
        tile_pixel(probe, k, &x, &y);
        memcpy(block_of(preview, x, y), rgb + 3 * (size_t)k, 3 * sizeof *rgb);
    }
}

/* Breadth-first search from the known blocks. */
void preview_complete(struct preview *preview)
{
    static const int steps[4][2] = {{0, -1}, {-1, 0}, {1, 0}, {0, 1}};
    uint32_t count = preview->columns * preview->rows, reached = 0;
    uint32_t *order = allocate(count, sizeof *order);
    for (uint32_t i = 0; i < count; i++)
        if (!isnan(preview->rgb[3 * (size_t)i])) order[reached++] = i;
    for (uint32_t next = 0; next < reached; next++) {
        uint32_t column = order[next] % preview->columns, row = order[next] / preview->columns;
        for (int k = 0; k < 4; k++) {
            /* A coordinate below 0 wraps around to a very large one. */
            uint32_t x = column + (uint32_t)steps[k][0], y = row + (uint32_t)steps[k][1];
            if (x >= preview->columns || y >= preview->rows) continue;
            uint32_t block = y * preview->columns + x;
            float *color = preview->rgb + 3 * (size_t)block;
            if (!isnan(color[0])) continue;
            memcpy(color, preview->rgb + 3 * (size_t)order[next], 3 * sizeof *color);
            order[reached++] = block;
        }
    }
    free(order);
}

/* The two blocks along an axis between whose middles a pixel lies, and the weight of the second. Beyond the
 * outermost middle both are the same block. */
struct between {
    uint32_t first, second;
    float weight;
};

static struct between between_of(uint32_t pixel, uint32_t edge, uint32_t blocks)
{
    uint32_t middle = edge / 2;
    if (pixel < middle) return (struct between){0, 0, 0};
    uint32_t block = (pixel - middle) / edge;
    if (block + 1 >= blocks) return (struct between){blocks - 1, blocks - 1, 0};
    return (struct between){block, block + 1, (float)((pixel - middle) % edge) / (float)edge};
}

void preview_between(const struct preview *preview, uint32_t x, uint32_t y, float color[3])
{
    if (preview->edge == 0) return;
    struct between across = between_of(x, preview->edge, preview->columns);
    struct between down = between_of(y, preview->edge, preview->rows);
    const float *above = preview->rgb + 3 * (size_t)down.first * preview->columns;
    const float *below = preview->rgb + 3 * (size_t)down.second * preview->columns;
    uint32_t left = 3 * across.first, right = 3 * across.second;
    for (uint32_t c = 0; c < 3; c++) {
        float high = above[left + c] + across.weight * (above[right + c] - above[left + c]);
        float low = below[left + c] + across.weight * (below[right + c] - below[left + c]);
        color[c] = high + down.weight * (low - high);
    }
}
