/*
 * Renders the farm's scenes with Embree, for comparison; it is not a part of the farm. The files
 * bench/kernel_embree*.c make one program, which needs Embree 3 or 4.
 *
 * A scene comes from the farm's own loader, so that geometry, camera, lights and materials are the same numbers,
 * rounded to float. Shading, depth and pruning follow the same rules as worker/; only media are identified
 * merely by the side of a surface.
 */
#ifndef FARM_BENCH_KERNEL_EMBREE_H
#define FARM_BENCH_KERNEL_EMBREE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#define EMBREE_VERSION 4
typedef struct RTCRayQueryContext query_context;
#else
#include <embree3/rtcore.h>
#define EMBREE_VERSION 3
typedef struct RTCIntersectContext query_context;
#endif

#include "common/scene.h"

/* ---- vectors of float ---- */

struct f3 {
    float x, y, z;
};

static inline struct f3 f3(float x, float y, float z)
{
    return (struct f3){x, y, z};
}

static inline struct f3 f3_of(struct vec3 v)
{
    return f3((float)v.x, (float)v.y, (float)v.z);
}

static inline struct f3 f3_add(struct f3 a, struct f3 b)
{
    return f3(a.x + b.x, a.y + b.y, a.z + b.z);
}

static inline struct f3 f3_sub(struct f3 a, struct f3 b)
{
    return f3(a.x - b.x, a.y - b.y, a.z - b.z);
}

static inline struct f3 f3_mul(struct f3 a, struct f3 b)
{
    return f3(a.x * b.x, a.y * b.y, a.z * b.z);
}

static inline struct f3 f3_scale(struct f3 a, float s)
{
    return f3(a.x * s, a.y * s, a.z * s);
}

/* a + b s */
static inline struct f3 f3_add_scaled(struct f3 a, struct f3 b, float s)
{
    return f3(a.x + b.x * s, a.y + b.y * s, a.z + b.z * s);
}

static inline float f3_dot(struct f3 a, struct f3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline float f3_max(struct f3 a)
{
    float m = a.x > a.y ? a.x : a.y;
    return m > a.z ? m : a.z;
}

static inline struct f3 f3_normalize(struct f3 a)
{
    return f3_scale(a, 1 / sqrtf(f3_dot(a, a)));
}

/* ---- the scene ---- */

struct surface_material {
    struct f3 color, ambient, diffuse, transmitted; /* products with the colour */
    float specular, shininess, reflection, ior;
    bool transparent;
};

struct point_light {
    struct f3 position, color;
};

struct solid_cone {
    struct f3 base, axis; /* axis: unit, towards the apex */
    float height, base_radius, apex_radius, slope;
    bool capped;
};

struct solid_box {
    struct f3 min, max;
};

struct flat_disc {
    struct f3 center, normal;
    float radius;
};

struct model;

/* One geometry of the Embree scene: the primitives of one kind, either the transparent or the opaque ones. */
struct part {
    const struct model *model;
    enum primitive_kind kind;
    bool transparent;
    uint32_t count;
    uint32_t *index;    /* primID -> index among the primitives of its kind in the farm's scene */
    uint32_t *material; /* primID -> material */
    uint32_t *normal;   /* patches: three normals per primID */
    void *solids;       /* cones, boxes, discs: what the callbacks read */
    float *spheres;     /* centre and radius: Embree's own buffer */
};

#define PARTS_MAX (2 * PRIMITIVE_KINDS)

struct model {
    const struct scene *scene;
    RTCDevice device;
    RTCScene rtc;
    unsigned part_count;
    struct part parts[PARTS_MAX]; /* by geomID */
    struct surface_material *materials;
    struct f3 *normals;
    struct point_light *lights;
    unsigned light_count;
    uint64_t own_bytes; /* bytes of the arrays above that grow with the scene */
};

/* Fills in all but the committed tree; exits with a message if the scene has something that is not supported. */
void model_create(struct model *model, const struct scene *scene, RTCDevice device);
void model_destroy(struct model *model);

/* The callbacks of cones, boxes and discs. */
void solids_attach(RTCGeometry geometry);

/* ---- rays ---- */

/* The most transparent crossings of one shadow ray. With spatial splits Embree may report a crossing several
 * times. */
#define SEEN_MAX 32

struct shadow_query {
    query_context context; /* first: the callbacks get a pointer to it */
    struct f3 through;
    unsigned seen;
    struct {
        unsigned geometry, primitive;
        float t;
    } crossings[SEEN_MAX];
};

/* Notes a crossing; the light that passes is filtered by its colour. */
void shadow_pass(struct shadow_query *query, const struct part *part, unsigned geometry,
                 unsigned primitive, float t);

enum { KIND_PRIMARY, KIND_SHADOW, KIND_REFLECTION, KIND_REFRACTION, KIND_COUNT };

/* Renders the view of the scene with single rays, one sample in the middle of each pixel; rgb has 3 floats per
 * pixel. */
void trace_picture(const struct model *model, float *rgb, uint64_t rays[KIND_COUNT]);

/* Renders primary rays alone, in coherent packets; rgb as above. Returns the CPU seconds inside Embree. */
double trace_primary(const struct model *model, float *rgb);

/* The direction of the ray through a point of the picture, in pixels from its upper left corner; unit. */
static inline struct f3 primary_direction(const struct view *view, float x, float y)
{
    float height = (float)view->height, width = (float)view->width;
    struct f3 direction = f3_of(view->camera.forward);
    direction = f3_add_scaled(direction, f3_of(view->camera.right), (2 * x - width) / height);
    direction = f3_add_scaled(direction, f3_of(view->camera.down), (2 * y - height) / height);
    return f3_normalize(direction);
}

struct f3 sky_color(const struct view *view, struct f3 direction);

/* ---- the two versions of the interface ---- */

static inline void context_init(query_context *context)
{
#if EMBREE_VERSION == 4
    rtcInitRayQueryContext(context);
#else
    rtcInitIntersectContext(context);
#endif
}

static inline void trace_nearest(const struct model *model, struct RTCRayHit *ray)
{
#if EMBREE_VERSION == 4
    rtcIntersect1(model->rtc, ray, NULL);
#else
    query_context context;
    context_init(&context);
    rtcIntersect1(model->rtc, &context, ray);
#endif
}

static inline void trace_any(const struct model *model, query_context *context, struct RTCRay *ray)
{
#if EMBREE_VERSION == 4
    struct RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = context;
    rtcOccluded1(model->rtc, ray, &arguments);
#else
    rtcOccluded1(model->rtc, context, ray);
#endif
}

#endif
