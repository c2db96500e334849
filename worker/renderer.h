/*
 * The state of a renderer (worker/render.h). render.c starts samples and takes them through their trees wave
 * by wave, trace.c processes the rays of one wave, pixels.c computes the pixels from finished samples.
 *
 * Functions of render.c and trace.c that take `primary_only` are compiled twice. It is true for a scene in which
 * nothing reflects or refracts: every sample is then a single ray of weight 1, and there are no trees and no media.
 */
#ifndef FARM_WORKER_RENDERER_H
#define FARM_WORKER_RENDERER_H

#include "worker/color_sum.h"
#include "worker/medium.h"
#include "worker/omission.h"
#include "worker/points.h"
#include "worker/render.h"
#include "worker/sample.h"
#include "worker/task.h"
#include "worker/tree.h"

/* A sample in work. The fields that a sample of a single ray needs come first. */
struct sample_state {
    struct color_sum color;
    uint32_t pixel;  /* pixel of the tile */
    uint32_t sample; /* number within the pixel */
    /* Rays of all kinds, for the picture or its bound, except towards lights without colour. */
    uint64_t cost_rays;
    bool bad;      /* was counted as nonfinite */
    bool bounding; /* all its rays for the picture are traced; those left only serve the bound */
    bool branched; /* it has secondary rays */
    uint64_t picture_rays; /* rays traced for the picture, without shadow rays */
};

/* The pending rays of a sample that has branched; in many pictures most samples never do. */
struct pending_rays {
    struct tree tree;
    struct omission omission;
};

/* A point of the wave and a light on its lit side. */
struct shadow_test {
    uint32_t point, light;
};

/* The progress of a task. */
struct progress {
    struct task task;
    uint64_t samples; /* of the task */
    uint64_t started;
    struct task_cursor next; /* the next sample to start, in the order of block_place() */
    /* The current band (row of blocks), and the number of its first pixel. */
    uint32_t band, band_begin;
    uint32_t place;          /* the pixel of `next`: its number in the tile */
    uint32_t x, y;           /* the same pixel's position in the whole picture */
    struct task_cursor adds; /* the next sample to be added to its pixel */
    struct pixel_sum sum;    /* sums over the samples of that pixel so far */
    /* Number of a pixel's first samples after which its error is recorded as well; 0: none. */
    uint32_t halfway;
};

struct renderer {
    const struct scene *scene;
    const struct bvh *bvh;
    struct radiance radiance;
    uint64_t ray_budget; /* of each sample */
    bool primary_only;   /* nothing reflects or refracts */
    struct media *media;
    uint32_t eye_media;  /* the stack that the eye is in */
    bool eye_on_surface; /* it depends on the direction of the ray */
    struct progress progress;
    /* For tasks in which only some pixels get samples; room for the largest one so far; owned. */
    struct refinement *refinements; /* in the order in which pixels are rendered */
    uint32_t *numbers;              /* the number of each pixel among those that get samples */
    uint32_t refinements_room;
    struct render_counts counts;
    renderer_interrupted *interrupted;
    void *context;

    struct sample_state states[WAVE];
    struct pending_rays pending[WAVE]; /* of each sample */

    /* The current wave. Slot i traces branches[i] for sample owner[i]. */
    uint32_t count;
    bool fresh;        /* these are the first rays of samples */
    uint32_t bounding; /* the number of them that only serve the bound */
    uint32_t owner[WAVE];
    struct branch branches[WAVE];
    struct ray rays[WAVE];
    struct hit hits[WAVE];
    struct points points;
    struct sample_lanes samples;

    /* Points that face lights, and the shadow rays towards these, light by light. */
    struct faced faced;
    struct shadow_test shadow_tests[WAVE];
    uint32_t shadow_count;
    struct lit lit;
    struct ray shadow_rays[WAVE];
    struct vec3 transmittance[WAVE];

    struct secondary_rays secondary;
    uint32_t behind[WAVE]; /* for each secondary->point: the stack of media behind the surface */
    struct vec3 mirrored[WAVE]; /* weight of each point's mirror ray */
    bool uncrossed[WAVE];       /* whether the ray has not crossed the surface of the point */
};

/* Whether the ray in a slot of the wave only serves the bound. */
static inline bool is_bounding(const struct renderer *renderer, uint32_t slot)
{
    return renderer->states[renderer->owner[slot]].bounding;
}

static inline struct vec3 finished_sum(const struct renderer *renderer, const struct color_sum *sum)
{
    return renderer->scene->view.formulas == FORMULAS_PAPER ? sum->plain : color_sum_value(sum);
}

/* Traces the rays of a wave: adds colours to the samples and spawns further rays. */
void trace_wave(struct renderer *renderer);

/* The same for scenes with primary and shadow rays only. */
void trace_primary_wave(struct renderer *renderer);

/*
 * Adds the first `count` of the samples in work, which are the task's next ones in order, to their pixels.
 * Stores a pixel after its last sample.
 */
void add_samples(struct renderer *renderer, uint32_t count);

#endif
