/* One program rendering one scene: what it is started with, and what it says about itself. */
#ifndef FARM_BENCH_KERNEL_RUN_H
#define FARM_BENCH_KERNEL_RUN_H

#include <stdbool.h>
#include <stdint.h>

#include "common/scene.h"

enum program { PROGRAM_FARM, PROGRAM_EMBREE, PROGRAM_TACHYON, PROGRAM_POVRAY, PROGRAM_COUNT };

extern const char *const program_names[PROGRAM_COUNT];

/* What of the picture is rendered: the steps tell what a ray of each kind costs. */
enum step {
    STEP_PICTURE,    /* everything */
    STEP_DIRECT,     /* primary rays and shadows */
    STEP_PRIMARY,    /* primary rays alone, many of them, without lights; over Embree in packets */
    STEP_SHADOWLESS, /* primary rays with lights but no shadows */
    STEP_COUNT
};

/* What one run took: seconds, counts, bytes. NAN: not told. */
enum metric {
    RENDER_S,      /* CPU of the rendering thread */
    RENDER_WALL_S, /* the same by the wall clock */
    INTERSECT_S,   /* within the kernel alone, CPU; only where rays come in batches */
    BUILD_S,       /* wall */
    PROCESS_S,     /* CPU of the whole process, with loading and writing */
    PROCESS_WALL_S,
    RAYS_PRIMARY,
    RAYS_SHADOW,
    RAYS_REFLECTION,
    RAYS_REFRACTION,
    BYTES, /* of geometry and tree */
    TRIANGLES,
    PRIMITIVES,
    METRIC_COUNT
};

extern const char *const metric_names[METRIC_COUNT];

struct measurement {
    double at[METRIC_COUNT];
};

/* What stays the same for all runs. */
struct bench {
    const char *farm, *embree; /* programs */
    const char *folder;        /* where scenes, pictures and logs go */
    uint32_t width, height;
    unsigned samples; /* of STEP_PRIMARY */
};

struct kernel_scene {
    const char *name;
    char *config;  /* INI file */
    char *dark;    /* the same without lights, mirrors and glass */
    bool has_mesh; /* most of it is triangles */
};

/* The picture that STEP_PICTURE leaves; the caller frees it. */
char *picture_path(const struct bench *bench, const struct kernel_scene *scene,
                   enum program program);

/* false, after saying why: it ended badly, or did not say what it should. */
bool run_program(const struct bench *bench, const struct kernel_scene *scene, enum program program,
                 enum step step, struct measurement *out);

/* Writes the scene for Tachyon or POV-Ray, in this block's view. */

void export_scene(const struct bench *bench, const struct kernel_scene *scene, enum program program,
                  const struct scene *block);

/* Whether the program can be started at all. */
bool program_found(const struct bench *bench, enum program program);

#endif
