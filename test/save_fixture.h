/* A picture of three tiles, and what runs that render it save. */
#ifndef FARM_TEST_SAVE_FIXTURE_H
#define FARM_TEST_SAVE_FIXTURE_H

#include "master/save.h"
#include "test/scratch.h"

#define PATH "a.journal"

/* Three tiles side by side. */
enum { EDGE = 16, TILES = 3, WIDTH = TILES * EDGE, PIXELS = WIDTH * EDGE };

static struct scene *scene;

static const struct view view = {.width = WIDTH,
                                 .height = EDGE,
                                 .region_w = WIDTH,
                                 .region_h = EDGE,
                                 .min_samples = 4,
                                 .max_samples = 4096};

/* Group set-up and tear-down. */
static inline int scene_open(void **state)
{
    if (scratch_open(state) != 0) return 1;
    write_text("scene.ini", "[light]\nposition = 1 2 3\n[sphere a]\ncenter = 0 0 0\nradius = 1\n");
    scene = scratch_scene(*state, "scene.ini", NULL);
    return 0;
}

static inline int scene_close(void **state)
{
    free(scene);
    return scratch_close(state);
}

static inline struct tile tile_at(uint32_t x, uint32_t w, uint32_t pass)
{
    return (struct tile){.x = x, .w = w, .h = EDGE, .step = 1, .pass = pass};
}

/* A result that took 2 s of wall time and 1 s of CPU time. */
static inline struct result_header result_of(uint32_t pixels)
{
    return (struct result_header){
        .pixels = pixels, .busy_s = 2, .cpu_s = 1, .counts = {.rays = {10 * pixels}}};
}

/* Renders what the pass asks for in w columns from x on, and saves it unless save is NULL. */
static inline void render_part(struct save *save, struct adaptive *adaptive, uint32_t x, uint32_t w)
{
    static float part[REFINED_FLOATS * PIXELS];
    struct tile tile = tile_at(x, w, adaptive_passes(adaptive) - 1);
    uint32_t pixels = adaptive_pixels(adaptive, &tile);
    for (uint32_t i = 0; i < 3 * pixels; i++) {
        part[i] = (float)((x + i) % 5);
        part[3 * pixels + i] = (float)(i % 7) / 7;
    }
    for (uint32_t i = 6 * pixels; i < REFINED_FLOATS * pixels; i++)
        part[i] = 3;
    struct result_header header = result_of(pixels);
    save_part(save, &tile, &header, part);
    adaptive_put(adaptive, &tile, part, header.cpu_s);
}

#endif
