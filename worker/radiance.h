/*
 * Upper bounds on the radiance that a ray can bring, before it is traced. They determine the order in which
 * the rays of a sample's tree are traced, and bound the effect of those that are left out.
 *
 * The scene's surfaces are divided into a few groups, each with a box around it. Two quantities are bounded
 * for each group, per component of colour: `direct`, what lights and ambient make of its surfaces, and
 * `passed`, the share of reflected and refracted rays that they pass on. The brightness of a ray is then at
 * most the largest of the background in its direction and direct + passed R of the groups whose boxes it
 * meets. R bounds what any ray can bring; it is the fixed point of
 *
 *   R = max(background, max over groups (direct + passed R))
 *
 * and finite where all surfaces lose light. Where some lose none (reflection + transmission = 1) and add
 * light of their own, each level of the tree can add as much again, and total reflection may keep a ray
 * inside forever. R is then the sum over RADIANCE_LEVELS levels, or over max_depth of them if that is more.
 * For surfaces that pass on more than they get there is no bound.
 */
#ifndef FARM_WORKER_RADIANCE_H
#define FARM_WORKER_RADIANCE_H

#include "common/scene.h"
#include "worker/bounds.h"
#include "worker/ray.h"

/* Enough to separate a few objects; all groups are tested for a ray. */
#define RADIANCE_GROUPS 16

/* The depth that stands for "any depth" where surfaces lose no light. */
#define RADIANCE_LEVELS 1000

typedef double group_row[RADIANCE_GROUPS];

struct radiance {
    const struct scene *scene;
    uint32_t groups;
    /* Boxes of the groups, rounded outward; direct and passed as above. No ray meets the box of an unused
     * group. */
    group_row min[3], max[3], direct[3], passed[3];
    uint32_t only[RADIANCE_GROUPS]; /* the primitive of a group of one; else PRIMITIVE_NONE */
    bool single;                    /* some groups have only one primitive */
    bool light_grows;               /* as radiance_light_grows(): then lit surfaces have no bound */
    /* R of a ray with n levels below it, n <= deepest: base + (n + 1) each. base may be infinite. */
    double base[3], each[3], deepest;
    /* R with n levels below, n = 0 .. max_depth, if that is much smaller; NULL: use base and each. */
    struct vec3 *levels;
};

/* The caller releases it with radiance_free(). */
void radiance_init(struct radiance *radiance, const struct scene *scene);
void radiance_free(struct radiance *radiance);

/*
 * An upper bound, rounding included, on the largest component that a ray of this depth and weight can add to
 * a sample; may be infinite. in_picture: in a picture of max_depth levels (depth <= max_depth), else in one of any
 * depth.
 */
double radiance_bound(const struct radiance *radiance, const struct ray *ray, struct vec3 weight,
                      uint32_t depth, bool in_picture);

/* The same without testing the boxes: mostly larger, but fast. */
double radiance_coarse_bound(const struct radiance *radiance, struct vec3 weight, uint32_t depth,
                             bool in_picture);

/* The largest component of R of a primary ray. */
double radiance_primary_bound(const struct radiance *radiance);

/* Whether light can grow on its way through surfaces: transmission * colour > 1. */
bool radiance_light_grows(const struct scene *scene);

/* The lights with a colour, as seen from anywhere in a box. */
struct box_lights {
    uint32_t count;
    /* share and cosine are given: the angles between lights are taken into account. */
    bool paired;
    bool light_grows; /* radiance_light_grows() */
    struct vec3 sum;  /* sum of the colours, rounded up */
    struct vec3 strongest;
    struct vec3 diffuse; /* bound on their diffuse light on a white surface of any normal */
    struct vec3 *share;  /* of each light: share of the strongest one, per component */
    double *cosine;      /* [count][count]: cosine of the least angle between two of them */
};

/* The box may be infinite. The caller releases *box_lights with box_lights_free(). */
void box_lights_init(struct box_lights *box_lights, const struct scene *scene,
                     const struct bounds *box, bool light_grows);
void box_lights_free(struct box_lights *box_lights);

/*
 * An upper bound, per component, on what these lights and ambient can make of a surface of the material
 * anywhere in their box, for any normal and without shadows.
 */
struct vec3 box_lights_bound(const struct box_lights *box_lights, const struct material *material);

#endif
