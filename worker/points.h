/*
 * The points of a wave: where its rays have hit something, and what light does there. What surface_at() and
 * the functions of shade.h do for one hit is done here for all hits of a wave, in lanes, with the same bits.
 */
#ifndef FARM_WORKER_POINTS_H
#define FARM_WORKER_POINTS_H

#include "worker/shade.h"
#include "worker/wave.h"

struct points {
    uint32_t count;
    uint32_t slot[WAVE]; /* index of the ray in the wave */
    const struct material *material[WAVE];
    struct rows3 point, view, geometric, normal; /* as in struct shading_point */
    lane_row entering;                           /* 1 or 0 */
    uint32_t formulas;                           /* enum formulas */

    /* Used by points_find(). */
    struct rows3 origin;  /* of the ray */
    struct rows3 a, b, c; /* what defines the surface, by kind */
    lane_row t;           /* t, u, v: as in struct hit */
    union {
        lane_row u, t_error; /* t_error: of a rough hit, hit_t_error() */
    };
    lane_row v;
    lane_row radius;  /* of a sphere */
    lane_row at_apex; /* of a cone: 1: the cap at the apex; 0: the other */
    lane_row sure;    /* 1 or 0 */
};

/*
 * Computes the points of the rays that have hit something, from the hits of nearest_rough() or nearest();
 * count <= WAVE. exact_fallbacks: as for nearest().
 */
void points_find(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                 const struct hit *hits, uint32_t count, struct points *points,
                 uint64_t *exact_fallbacks);

/* One of the points, as the functions of shade.h take it. */
struct shading_point points_get(const struct points *points, size_t i);

/* light_faces() for all points; end: shadow_end(). */
struct faced {
    lane_row faces; /* 1 or 0 */
    lane_row end;
    struct rows3 to_light;
};
void points_face(const struct points *points, const struct light *light, struct faced *faced);

/* shade_light() for points that see a light. */
struct lit {
    uint32_t count;
    uint32_t point[WAVE];
    struct rows3 to_light, strength;
    struct rows3 color; /* the result */

    /* Used by points_light(): values of the points and of their materials. */
    struct rows3 view, normal, surface;
    lane_row diffuse, specular, shininess, sure;
};
void points_light(const struct points *points, struct lit *lit);

/* Directions of secondary rays: reflect() and refract() for some of the points. */
struct secondary_rays {
    uint32_t count;
    uint32_t point[WAVE];
    struct rows3 direction; /* the result */
    lane_row from, to;      /* indices of refraction */
    lane_row passes;        /* 1, or 0: total reflection */

    /* Used by the two functions below: values of the points. */
    struct rows3 view, normal, geometric;
    lane_row sure;
};
void points_reflect(const struct points *points, struct secondary_rays *secondary);
void points_refract(const struct points *points, struct secondary_rays *secondary);

#endif
