/*
 * The scene block: everything that a renderer needs to know, in one contiguous, read-only piece of memory
 * with offsets in place of pointers. Rank 0 builds it (master/builder.h). It is broadcast, placed once per
 * node in shared memory, and hashed, all without conversion.
 *
 *   struct scene | vertices | normals | triangles | patches | spheres | ... | lights
 *
 * Lengths are in scene units, colours are linear RGB with 1 as full white; angles have been converted to
 * vectors.
 */
#ifndef FARM_COMMON_SCENE_H
#define FARM_COMMON_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/vec.h"

#define SCENE_MAGIC   0x4d524146u /* "FARM" in memory on a little-endian machine */
#define SCENE_VERSION 1u

/* Limits of a view. The canvas of the largest picture takes 3 GiB. */
#define PICTURE_MAX_EDGE   65535
#define PICTURE_MAX_PIXELS (UINT64_C(1) << 28)
#define RENDER_MAX_DEPTH   1000000u
#define SAMPLES_MAX        65536u

/* The paper's equation (8) and its reflection and refraction terms. */
struct material {
    struct vec3 color;   /* Cs; each component >= 0 */
    double ambient;      /* ke >= 0 */
    double diffuse;      /* kd >= 0 */
    double specular;     /* ks >= 0 */
    double shininess;    /* n >= 0 */
    double reflection;   /* kr, 0..1 */
    double transmission; /* kt, 0..1; transmitted light is also filtered by the surface colour */
    double ior;          /* index of refraction > 0; that of the world outside is 1 */
};

/* Whether the material's colour depends on lights. */
static inline bool material_shows_light(const struct material *material)
{
    return material->diffuse > 0 || material->specular > 0;
}

struct light {
    struct vec3 position;
    struct vec3 color; /* strength s, each component >= 0; no falloff with distance */
};

/* A flat triangle as vertex indices, counter-clockwise seen from its front. */
struct triangle {
    uint32_t vertex[3];
    uint32_t material;
};

/* A triangle with vertex normals that are interpolated, as vertex and normal indices. */
struct patch {
    uint32_t vertex[3];
    uint32_t normal[3];
    uint32_t material;
};

struct sphere {
    struct vec3 center;
    double radius; /* > 0 */
    uint32_t material;
    uint32_t inside_only; /* 1: visible only from within (NFF: negative radius) */
};

/* All points p with (p - point).normal = 0. It is unbounded and so not in the BVH. */
struct plane {
    struct vec3 point;
    struct vec3 normal; /* unit length */
    uint32_t material;
    uint32_t reserved;
};

struct disc {
    struct vec3 center;
    struct vec3 normal; /* unit length */
    double radius;      /* > 0 */
    uint32_t material;
    uint32_t reserved;
};

/* An axis-aligned solid, min < max in every component. The kernel also accepts boxes without thickness. */
struct box {
    struct vec3 min, max;
    uint32_t material;
    uint32_t reserved;
};

/* A cylinder (equal radii), a cone (one radius 0) or a frustum between two points. */
struct cone {
    struct vec3 base, apex; /* different points */
    double base_radius;     /* >= 0 */
    double apex_radius;     /* >= 0; not both 0 */
    uint32_t material;
    uint32_t capped; /* 1: a solid with end caps; 0: an open surface (NFF) */
};

/* The camera, in a form that gives a ray by additions and multiplications alone. */
struct camera {
    struct vec3 eye;
    struct vec3 forward; /* unit length; towards the middle of the picture */
    /* Per half height of the picture: the middle of the right edge of a square picture lies in direction
     * forward + right, that of the lower edge in direction forward + down. */
    struct vec3 right;
    struct vec3 down;
};

/* Which formulas the kernel uses. */
enum formulas {
    FORMULAS_EXACT, /* the robust ones, which hold on stiff and extreme scenes */
    FORMULAS_PAPER  /* the paper's naive ones, kept for comparison */
};

/* What is omitted from the scene and the renderer because it cannot change the picture. */
enum variant {
    VARIANT_AUTO, /* all that this scene does not need */
    VARIANT_FULL  /* nothing, for comparison */
};

/* What is rendered, and how: all settings that change the picture, and two (processor, variant) that do not. */
struct view {
    struct camera camera;
    struct vec3 background_bottom; /* colour seen straight down (against the camera's up) */
    struct vec3 background_top;    /* colour seen straight up */
    struct vec3 background_up;     /* unit */
    double cutoff;                 /* >= 0: largest error of a pixel that pruning may cause */
    uint32_t width, height;        /* the whole picture, pixels */
    uint32_t region_x, region_y;   /* the rendered region: pixels x .. x + w - 1, y .. y + h - 1 */
    uint32_t region_w, region_h;
    uint32_t max_depth;   /* levels of reflection and refraction followed; 0: none */
    uint32_t shadows;     /* 0 or 1 */
    uint32_t min_samples; /* per pixel, >= 1: common/refinement.h */
    uint32_t max_samples; /* >= min_samples; equal without adaptive sampling */
    uint32_t formulas;    /* enum formulas */
    uint32_t processor;   /* enum processor_level: which build of the kernel is used */
    uint32_t variant;     /* enum variant */
    uint32_t reserved;    /* 0 */
};

struct scene_span {
    uint64_t offset; /* bytes from the start of the block, a multiple of 8 */
    uint64_t count;  /* elements */
};

/* The kinds of primitive, in the order of their ids. Of hits at equal distance the lowest id wins. */
enum primitive_kind {
    PRIMITIVE_TRIANGLE,
    PRIMITIVE_PATCH,
    PRIMITIVE_SPHERE,
    PRIMITIVE_BOX,
    PRIMITIVE_CONE,
    PRIMITIVE_DISC,
    PRIMITIVE_PLANE,
    PRIMITIVE_KINDS
};

struct scene {
    uint32_t magic;
    uint32_t version;
    uint64_t bytes; /* of the whole block */
    struct view view;
    struct scene_span vertices; /* struct vec3 */
    struct scene_span normals;  /* struct vec3, unit length */
    struct scene_span primitives[PRIMITIVE_KINDS];
    struct scene_span materials;
    struct scene_span lights;
    struct scene_span duplicates; /* uint32_t: ids of primitives that are never hit, ascending */
};

/* The id of a primitive: its kind in the bits from PRIMITIVE_INDEX_BITS up, its index in its kind's span
 * below. */
#define PRIMITIVE_INDEX_BITS 28
#define PRIMITIVE_MAX_COUNT  (UINT32_C(1) << PRIMITIVE_INDEX_BITS)
#define PRIMITIVE_NONE       UINT32_MAX

static inline uint32_t primitive_id(enum primitive_kind kind, uint32_t index)
{
    return (uint32_t)kind << PRIMITIVE_INDEX_BITS | index;
}

static inline enum primitive_kind primitive_kind(uint32_t id)
{
    return (enum primitive_kind)(id >> PRIMITIVE_INDEX_BITS);
}

static inline uint32_t primitive_index(uint32_t id)
{
    return id & (PRIMITIVE_MAX_COUNT - 1);
}

/* Whether the primitives of a kind are triangles: so are patches, which have normals besides. */
static inline bool kind_is_triangle(enum primitive_kind kind)
{
    return kind <= PRIMITIVE_PATCH;
}

static inline bool is_triangle(uint32_t id)
{
    return kind_is_triangle(primitive_kind(id));
}

static inline const void *scene_at(const struct scene *scene, const struct scene_span *span)
{
    return (const char *)scene + span->offset;
}

static inline const struct vec3 *scene_vertices(const struct scene *scene)
{
    return scene_at(scene, &scene->vertices);
}

static inline const struct vec3 *scene_normals(const struct scene *scene)
{
    return scene_at(scene, &scene->normals);
}

static inline const struct material *scene_materials(const struct scene *scene)
{
    return scene_at(scene, &scene->materials);
}

static inline const struct light *scene_lights(const struct scene *scene)
{
    return scene_at(scene, &scene->lights);
}

static inline const uint32_t *scene_duplicates(const struct scene *scene)
{
    return scene_at(scene, &scene->duplicates);
}

#define SCENE_ACCESSOR(plural, singular, kind)                                                     \
    static inline const struct singular *scene_##plural(const struct scene *scene)                 \
    {                                                                                              \
        return scene_at(scene, &scene->primitives[kind]);                                          \
    }
SCENE_ACCESSOR(triangles, triangle, PRIMITIVE_TRIANGLE)
SCENE_ACCESSOR(patches, patch, PRIMITIVE_PATCH)
SCENE_ACCESSOR(spheres, sphere, PRIMITIVE_SPHERE)
SCENE_ACCESSOR(boxes, box, PRIMITIVE_BOX)
SCENE_ACCESSOR(cones, cone, PRIMITIVE_CONE)
SCENE_ACCESSOR(discs, disc, PRIMITIVE_DISC)
SCENE_ACCESSOR(planes, plane, PRIMITIVE_PLANE)
#undef SCENE_ACCESSOR

/* The three vertex indices of a triangle or patch. */
static inline const uint32_t *corner_indices(const struct scene *scene, uint32_t id)
{
    uint32_t index = primitive_index(id);
    if (primitive_kind(id) == PRIMITIVE_PATCH) return scene_patches(scene)[index].vertex;
    return scene_triangles(scene)[index].vertex;
}

/* Whether the primitive bounds a volume by itself. */
static inline bool primitive_is_solid(const struct scene *scene, uint32_t primitive)
{
    uint32_t index = primitive_index(primitive);
    switch (primitive_kind(primitive)) {
    case PRIMITIVE_SPHERE:
        return !scene_spheres(scene)[index].inside_only;
    case PRIMITIVE_BOX:
        return true;
    case PRIMITIVE_CONE:
        return scene_cones(scene)[index].capped;
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_DISC:
    case PRIMITIVE_PLANE:
    case PRIMITIVE_KINDS:
        break;
    }
    return false;
}

/* Bytes of one element of a kind's span. */
size_t primitive_size(enum primitive_kind kind);

/* The index of the primitive's material. */
uint32_t primitive_material(const struct scene *scene, uint32_t id);

/* Whether the primitive is transparent. */
static inline bool transmits(const struct scene *scene, uint32_t id)
{
    return scene_materials(scene)[primitive_material(scene, id)].transmission > 0;
}

/* The number of primitives of all kinds. */
uint64_t scene_primitive_count(const struct scene *scene);

/* The number of triangles and patches, which are the first two kinds. */
static inline uint64_t scene_triangle_count(const struct scene *scene)
{
    return (uint64_t)scene->primitives[PRIMITIVE_TRIANGLE].count +
           scene->primitives[PRIMITIVE_PATCH].count;
}

/*
 * Whether the bytes at block are a scene that can be used without further checks: every span lies in the
 * block, every index in its span, every number in its range. Prints nothing; on failure *why becomes a
 * constant text (why may be NULL).
 */
bool scene_valid(const void *block, size_t bytes, const char **why);

/* Features that a scene uses, as bits. */
enum scene_feature {
    FEATURE_TRIANGLES = 1 << 0,
    FEATURE_PATCHES = 1 << 1,
    FEATURE_SPHERES = 1 << 2,
    FEATURE_BOXES = 1 << 3,
    FEATURE_CONES = 1 << 4,
    FEATURE_DISCS = 1 << 5,
    FEATURE_PLANES = 1 << 6,
    FEATURE_LIGHTS = 1 << 7,
    FEATURE_SHADOWS = 1 << 8,
    FEATURE_SPECULAR = 1 << 9,
    FEATURE_REFLECTION = 1 << 10,
    FEATURE_REFRACTION = 1 << 11,
    FEATURE_COUNT = 12
};

/* The features that some primitive, material, light or setting of the scene requires, as bits. */
unsigned scene_features(const struct scene *scene);

/* The name of bit number i of enum scene_feature, 0 .. FEATURE_COUNT - 1. */
const char *scene_feature_name(unsigned i);

#endif
