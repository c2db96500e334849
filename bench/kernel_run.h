/* Runs one program on one scene: how it is started, and what it reports about itself. */
#ifndef FARM_BENCH_KERNEL_RUN_H
#define FARM_BENCH_KERNEL_RUN_H

#include <stdbool.h>
#include <stdint.h>

#include "common/scene.h"

enum program { PROGRAM_FARM, PROGRAM_EMBREE, PROGRAM_TACHYON, PROGRAM_POVRAY, PROGRAM_COUNT };

extern const char *const program_names[PROGRAM_COUNT];

/* What is rendered of the picture: from the steps follows what a ray of each kind costs. */
enum step {
    STEP_PICTURE,    /* everything */
    STEP_DIRECT,     /* primary rays and shadows */
    STEP_PRIMARY,    /* primary rays alone, without lights; with Embree in packets */
    STEP_SHADOWLESS, /* primary rays with lights but no shadows */
    STEP_COUNT
};

extern const char *const step_names[STEP_COUNT];

/* What one run took: seconds, counts, bytes. NAN: not reported. */
enum metric {
    RENDER_S,      /* CPU seconds of the rendering thread */
    RENDER_WALL_S, /* the same in wall seconds */
    INTERSECT_S,   /* CPU seconds within the kernel alone; only where rays are traced in batches */
    BUILD_S,       /* wall */
    PROCESS_S,     /* CPU seconds of the whole process, with loading and writing */
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
    const char *folder;        /* folder of scenes, pictures and logs */
    uint32_t width, height;
};

struct kernel_scene {
    const char *name;
    char *config;  /* INI file */
    char *dark;    /* the same without lights, mirrors and glass */
    bool has_mesh; /* most of it is triangles */
};

/* The path of the picture of STEP_PICTURE; the caller frees it. */
char *picture_path(const struct bench *bench, const struct kernel_scene *scene,
                   enum program program);

/* Runs a program; false, after saying why: it failed, or did not report what it should. */
bool run_program(const struct bench *bench, const struct kernel_scene *scene, enum program program,
                 enum step step, struct measurement *out);

/* Writes the scene for Tachyon or POV-Ray, with the view of this block. */
void export_scene(const struct bench *bench, const struct kernel_scene *scene, enum program program,
                  const struct scene *block);

/* Whether the program can be started at all. */
bool program_found(const struct bench *bench, enum program program);

#endif
