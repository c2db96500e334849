/*
 * What a renderer (worker/render.h) holds while it works. render.c starts samples and takes them
 * through their trees wave by wave, trace.c looks at the rays of one wave, pixels.c makes pixels of
 * finished samples.
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

/* One sample on its way. All there is of one that is a single ray comes first. */
struct path {
    struct color_sum color;
    uint32_t pixel;  /* of the tile */
    uint32_t sample; /* of the pixel */
    uint64_t traced; /* rays of all kinds, to be shown or not; none towards lights without colour */
    bool bad;        /* counted as not finite */
    bool bounding;   /* all that is shown is traced; the rest goes into the bound */
    bool branched;   /* it has more than its first ray */
    uint64_t rays;   /* traced so far to be shown, without shadow rays */
};

/* The further rays of a sample that has branched; most samples of many pictures never do. */
struct further {
    struct tree tree;
    struct omission omission;
};

/* A point of the wave, and a light on its lit side. */
struct facing {
    uint32_t point, light;
};

/* A task in work. */
struct progress {
    struct task task;
    uint64_t samples; /* of the task */
    uint64_t started;
    struct task_cursor next;   /* to start, in the order of block_place() */
    uint32_t band, band_begin; /* rows of blocks that it is in, and their first pixel */
    uint32_t place;            /* which pixel of the tile that is */
    uint32_t x, y;             /* its place in the whole picture */
    struct task_cursor adds;   /* to be added next */
    struct pixel_sum sum;      /* of that pixel */
    uint32_t halfway;          /* first samples of it after which an error is told, too; 0: none */
};

struct renderer {
    const struct scene *scene;
    const struct bvh *bvh;
    struct radiance radiance;
    uint64_t ray_budget; /* of a sample */
    bool primary_only;   /* nothing reflects or refracts */
    struct media *media;
    uint32_t eye_media; /* the stack that the eye is in */
    struct progress progress;
    /* Of a task in which only some pixels get samples, for as many as the largest so far had; owned. */
    struct refinement *refinements; /* what they get, in the order in which they are rendered */
    uint32_t *numbers;              /* of each pixel of the tile among those that get some */
    uint32_t refinements_room;
    struct render_counts counts;
    renderer_interrupted *interrupted;
    void *context;

    struct path paths[WAVE];
    struct further further[WAVE]; /* of each path */

    /* The current wave: slot i traces branches[i] for path owner[i]. */
    uint32_t count;
    bool fresh;        /* they are the first rays of samples */
    bool dense;        /* the first of these samples' pixel has several: mostly all have */
    uint32_t bounding; /* so many of them only count for the bound */
    uint32_t owner[WAVE];
    struct branch branches[WAVE];
    struct ray rays[WAVE];
    struct hit hits[WAVE];
    struct points points;
    struct sample_lanes samples;

    /* Points that face lights, and the shadow rays to those, light by light. */
    struct faced faced;
    struct facing facing[WAVE];
    uint32_t facing_count;
    struct lit lit;
    struct ray shadow_rays[WAVE];
    struct vec3 transmittance[WAVE];

    struct onward onward;
    uint32_t behind[WAVE];      /* the stacks of media that onward->point's refracted rays are in */
    struct vec3 mirrored[WAVE]; /* share of each point's mirror ray */
};

/* Whether the ray in a slot of the wave only counts for the bound. */
static inline bool is_bounding(const struct renderer *renderer, uint32_t slot)
{
    return renderer->paths[renderer->owner[slot]].bounding;
}

static inline struct vec3 finished_sum(const struct renderer *renderer, const struct color_sum *sum)
{
    return renderer->scene->view.formulas == FORMULAS_PAPER ? sum->plain : color_sum_value(sum);
}

/* The hits of a wave become colour and further rays. */
void trace_wave(struct renderer *renderer);

/* The same where the scene has primary and shadow rays only. */
void trace_primary_wave(struct renderer *renderer);

/* Adds the samples of the first so many paths, which are the task's next ones in their order, to their
 * pixels; hands a pixel over behind its last one. */
void add_samples(struct renderer *renderer, uint32_t count);

#endif
