/*
 * How bright a ray can be at most before it is traced: from that follow the order in which the rays
 * of a sample's tree are traced, and what those that are left out can have changed.
 *
 * The scene's surfaces are put into a few groups, each with a box around it. What lights and
 * ambient make of a group's surfaces (`shown`), and the share of reflected and refracted rays that
 * they pass on (`passed`), are bounded per component of colour; so a ray is at most as bright as
 * its piece of background, and as shown + passed R of those groups whose boxes it meets. R is the
 * most that any ray can bring: the fixed point of
 *
 *   R = max(background, max over groups (shown + passed R))
 *
 * which is finite where surfaces lose light. Where some lose none (reflection + transmission = 1)
 * and add light of their own, each level of the tree can add as much again, and a ray that total
 * reflection keeps inside need never get out: then R is the sum over RADIANCE_LEVELS levels, or
 * max_depth of them if that is more. Surfaces that pass on more than they get have no bound.
 */
#ifndef FARM_WORKER_RADIANCE_H
#define FARM_WORKER_RADIANCE_H

#include "common/scene.h"
#include "worker/shape.h"

/* Enough to tell a few objects from each other; all of them are looked at for a ray. */
#define RADIANCE_GROUPS 16

/* So deep a tree is meant by "any depth" where surfaces lose nothing. */
#define RADIANCE_LEVELS 1000

typedef double group_row[RADIANCE_GROUPS];

struct radiance {
    const struct scene *scene;
    uint32_t groups;
    /* Of the groups' boxes, rounded outward; and as above. Unused rows are met by no ray. */
    group_row min[3], max[3], shown[3], passed[3];
    uint32_t only[RADIANCE_GROUPS]; /* the primitive of a group of one; else PRIMITIVE_NONE */
    bool single;                    /* there are groups of one */
    bool light_grows;               /* on its way through surfaces: what is lit has no bound */
    /* R of a ray with n levels below it, up to `deepest`: base + (n + 1) each. base may be infinite. */
    double base[3], each[3], deepest;
    /* The same with n levels below it, 0 .. max_depth, where it is far less; NULL: base. */
    struct vec3 *levels;
};

/* radiance_free() frees what is in it. */
void radiance_init(struct radiance *radiance, const struct scene *scene);
void radiance_free(struct radiance *radiance);

/*
 * The largest component that a ray of some depth and weight can add to a sample, in a picture of
 * max_depth levels (shown; depth <= max_depth) or of any number of them; may be infinite. An upper
 * bound, rounding included.
 */
double radiance_of(const struct radiance *radiance, const struct ray *ray, struct vec3 weight,
                   uint32_t depth, bool shown);

/* The same without looking at the boxes: mostly larger, and quickly told. */
double radiance_roughly(const struct radiance *radiance, struct vec3 weight, uint32_t depth,
                        bool shown);

/* The largest component of R of a primary ray. */
double radiance_most(const struct radiance *radiance);

/* Whether surfaces can pass on more light than falls on them: transmission * colour > 1. */
bool radiance_light_grows(const struct scene *scene);

/* The lights that can matter as they are seen from anywhere in a box. */
struct beams {
    uint32_t count;
    bool paired;      /* share and cosine are there: it counts how far apart the lights are */
    bool light_grows; /* radiance_light_grows() */
    struct vec3 sum;  /* of colours, rounded up */
    struct vec3 strongest;
    struct vec3 diffuse; /* the most that they make of a white surface, whatever its normal */
    struct vec3 *share;  /* of the strongest one, per component */
    double *cosine;      /* [count][count]: of the least angle between two of them */
};

/* The box may be infinite. beams_free() frees what is in it. */
void beams_init(struct beams *beams, const struct scene *scene, const struct bounds *box,
                bool light_grows);
void beams_free(struct beams *beams);

/*
 * The most that these lights and ambient can make of a material's surface anywhere in their box,
 * per component, whatever its normal, and without shadows.
 */
struct vec3 radiance_shown(const struct beams *beams, const struct material *material);

#endif
