/* The cases of the catalogue about rays among many objects, light and whole pictures. */
#ifndef FARM_BENCH_PICTURES_H
#define FARM_BENCH_PICTURES_H

#include "bench/stability.h"
#include "common/protocol.h"

typedef void run_case(const struct budget *budget, struct case_result *result);

run_case run_scaling, run_decimal_scaling, run_translation; /* 30-32, pictures_moved.c */
run_case run_light_places, run_mutual_visibility;           /* 33-34, pictures_rays.c */
run_case run_tree, run_tree_axes, run_tree_sizes;           /* 35-37, pictures_tree.c */
run_case run_equal_centroids, run_bad_rays;                 /* 38-39, pictures_tree.c */
run_case run_phong, run_phong_ends, run_light_sums;         /* 45-47, pictures_light.c */
run_case run_equal_media, run_snell, run_grazing;           /* 48-50, pictures_light.c */
run_case run_mirrors, run_mirror_balls;                     /* 51-52, pictures_bounce.c */
run_case run_cutoff, run_glass_cluster, run_media;          /* 53-55, pictures_bounce.c */
run_case run_processes, run_builds, run_any_scene;          /* 56-58, pictures_farm.c */
run_case run_reference;                                     /* 59, pictures_reference.c */

/* ---- scenes from files ---- */

/* Loads the scene of an .ini, .nff or .obj file; overrides as on the command line, ended by NULL. Returns NULL
 * when it cannot be loaded, with a message on stderr. Freed by free(). */
struct scene *picture_load(const char *path, const char *const *overrides);

/* The scene files of config/, config/extreme/ and the folder that SCENES names, or, for a quick
 * run, the small ones among them; sorted, ended by NULL. Freed by picture_files_free(). */
char **picture_files(bool quick);
void picture_files_free(char **files);

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
