#include "master/coverage.h"

#include <stdlib.h>

#include "common/message.h"

#define WORD_BITS 64

void coverage_init(struct coverage *coverage, uint32_t width, uint32_t height)
{
    uint64_t pixels = (uint64_t)width * height;
    coverage->width = width;
    coverage->bits = allocate_zeroed(pixels / WORD_BITS + 1, sizeof *coverage->bits);
}

void coverage_free(struct coverage *coverage)
{
    free(coverage->bits);
    *coverage = (struct coverage){0};
}

static bool has(const struct coverage *coverage, uint64_t pixel)
{
    return coverage->bits[pixel / WORD_BITS] >> pixel % WORD_BITS & 1;
}

bool coverage_has(const struct coverage *coverage, uint32_t x, uint32_t y)
{
    return has(coverage, (uint64_t)y * coverage->width + x);
}

static uint64_t pixel_index(const struct coverage *coverage, const struct tile *tile, uint32_t k)
{
    uint32_t x, y;
    tile_pixel(tile, k, &x, &y);
    return (uint64_t)y * coverage->width + x;
}

uint32_t coverage_add(struct coverage *coverage, const struct tile *tile)
{
    uint32_t pixels = tile_pixels(tile), added = 0;
    for (uint32_t k = 0; k < pixels; k++) {
        uint64_t i = pixel_index(coverage, tile, k), bit = UINT64_C(1) << i % WORD_BITS;
        added += !(coverage->bits[i / WORD_BITS] & bit);
        coverage->bits[i / WORD_BITS] |= bit;
    }
    return added;
}

uint32_t coverage_remove(struct coverage *coverage, const struct tile *tile)
{
    uint32_t pixels = tile_pixels(tile), removed = 0;
    for (uint32_t k = 0; k < pixels; k++) {
        uint64_t i = pixel_index(coverage, tile, k), bit = UINT64_C(1) << i % WORD_BITS;
        removed += (coverage->bits[i / WORD_BITS] & bit) != 0;
        coverage->bits[i / WORD_BITS] &= ~bit;
    }
    return removed;
}

uint32_t coverage_count(const struct coverage *coverage, const struct tile *tile)
{
    uint32_t pixels = tile_pixels(tile), count = 0;
    for (uint32_t k = 0; k < pixels; k++)
        count += has(coverage, pixel_index(coverage, tile, k));
    return count;
}
