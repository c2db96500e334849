#include "master/found.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"

void found_init(struct found *found, uint32_t width, uint32_t height)
{
    *found = (struct found){0};
    coverage_init(&found->used, width, height);
    coverage_init(&found->unused, width, height);
    coverage_init(&found->all, width, height);
}

void found_close(struct found *found)
{
    struct coverage all = found->all;
    coverage_free(&found->used);
    coverage_free(&found->unused);
    free(found->tiles);
    *found = (struct found){.all = all};
}

void found_free(struct found *found)
{
    found_close(found);
    coverage_free(&found->all);
}

uint32_t found_add(struct found *found, const struct found_tile *tile)
{
    found->tiles = grow(found->tiles, found->count, sizeof *found->tiles);
    found->tiles[found->count++] = *tile;
    if (tile->tile.pass > 0) return 0;
    coverage_add(&found->all, &tile->tile);
    uint32_t pixels = coverage_add(&found->unused, &tile->tile);
    found->pixels += pixels;
    return pixels;
}

uint32_t found_use(struct found *found, const struct tile *tile)
{
    uint32_t pixels = coverage_count(&found->unused, tile);
    if (pixels < tile_pixels(tile)) return pixels;
    coverage_remove(&found->unused, tile);
    coverage_add(&found->used, tile);
    return pixels;
}

void found_use_all(struct found *found)
{
    for (size_t i = 0; i < found->count; i++) {
        const struct tile *tile = &found->tiles[i].tile;
        if (tile->pass > 0) continue;
        coverage_remove(&found->unused, tile);
        coverage_add(&found->used, tile);
    }
}

/* Rounded up, so that what is not 0 stays so: a sample that was not finite is reported in any case. */
static uint64_t part_of(uint64_t count, double share)
{
    return (uint64_t)ceil((double)count * share);
}

static void scale_errors(struct error_sum *sum, double share)
{
    sum->squares *= share;
    sum->fourths *= share;
}

/* truncation is the maximum over pixels, not a sum, and stays. */
static struct render_counts scaled(const struct render_counts *counts, double share)
{
    struct render_counts part = *counts;
    if (share == 1) return part;
    for (int kind = 0; kind < RAY_KINDS; kind++)
        part.rays[kind] = part_of(part.rays[kind], share);
    uint64_t *whole[] = {&part.primary_hits, &part.nonfinite,       &part.exact_fallbacks,
                         &part.bound_rays,   &part.unmatched_media, &part.open_media};
    for (size_t i = 0; i < sizeof whole / sizeof *whole; i++)
        *whole[i] = part_of(*whole[i], share);
    part.intersect_s *= share;
    part.shade_s *= share;
    scale_errors(&part.sampling, share);
    scale_errors(&part.halfway, share);
    return part;
}

/* Removes the tile's pixels from the coverage, so that each counts only once; returns the share of them that was still
 * in it. */
static double share_of(struct coverage *coverage, const struct tile *tile)
{
    return coverage_remove(coverage, tile) / (double)tile_pixels(tile);
}

struct found_sums found_sum(struct found *found)
{
    struct found_sums sums = {0};
    for (size_t i = found->count; i-- > 0;) {
        const struct found_tile *it = &found->tiles[i];
        double used = it->tile.pass > 0 ? 1 : share_of(&found->used, &it->tile);
        double unused = it->tile.pass > 0 ? 0 : share_of(&found->unused, &it->tile);
        sums.repeated_s += unused * it->busy_s;
        if (!(used > 0)) continue;
        sums.busy_s += used * it->busy_s;
        sums.cpu_s += used * it->cpu_s;
        struct render_counts counts = scaled(&it->counts, used);
        render_counts_add(&sums.counts, &counts);
    }
    return sums;
}
