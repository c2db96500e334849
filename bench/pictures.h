/* What the cases about rays among many objects, light and whole pictures share. */
#ifndef FARM_BENCH_PICTURES_H
#define FARM_BENCH_PICTURES_H

#include "bench/stability.h"
#include "common/protocol.h"

/* ---- scenes from files ---- */

/* scene_load() of a scene with all its files in its folder, for the kernel of stage_kernel(). Ends the program when it
 * cannot be loaded. */
struct scene *picture_load(const char *path, const char *const *overrides);

/* The scene files of config/, config/extreme/ and the folder that SCENES names, or, for a quick
 * run, the small ones among them; sorted, ended by NULL. Freed by picture_files_free(). */
char **picture_files(bool quick);
void picture_files_free(char **files);

/* Ends the program when one of these files cannot be loaded: at once, and not when its row comes. */
void picture_files_check(bool quick);

/* A copy of the scene with all lengths multiplied; freed by free(). */
struct scene *picture_scaled(const struct scene *scene, double factor);

/* A copy of the scene, moved by `by` and rounded; freed by free(). */
struct scene *picture_moved(const struct scene *scene, struct vec3 by);

/* ---- pictures ---- */

struct picture {
    uint32_t width, height;
    float *rgb; /* owned */
    struct render_counts counts;
};

/* Renders the whole picture, with a new tree or with an existing one. */
struct picture picture_render(const struct scene *scene);
struct picture picture_render_with(const struct scene *scene, const struct bvh *bvh);
void picture_free(struct picture *picture);

/* The number of pixels that differ in any bit. */
uint64_t picture_differences(const struct picture *a, const struct picture *b);

/* ---- random objects ---- */

/* Adds so many spheres, triangles, boxes, discs and capped cones of size 0.2 to 4, in a cube of edge 20 around
 * the origin. */
void picture_mixture(struct builder *builder, struct random *random, int count);

/* Sets verdict, samples and wrong. */
void picture_verdict(struct case_result *result, uint64_t samples, uint64_t wrong);

#endif
