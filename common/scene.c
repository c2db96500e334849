#include "common/scene.h"

#include <float.h>

#include "common/processor.h"
#include "common/scene_check.h"

static const struct {
    size_t size;
    size_t material_offset;
} primitive_kinds[PRIMITIVE_KINDS] = {
    [PRIMITIVE_TRIANGLE] = {sizeof(struct triangle), offsetof(struct triangle, material)},
    [PRIMITIVE_PATCH] = {sizeof(struct patch), offsetof(struct patch, material)},
    [PRIMITIVE_SPHERE] = {sizeof(struct sphere), offsetof(struct sphere, material)},
    [PRIMITIVE_BOX] = {sizeof(struct box), offsetof(struct box, material)},
    [PRIMITIVE_CONE] = {sizeof(struct cone), offsetof(struct cone, material)},
    [PRIMITIVE_DISC] = {sizeof(struct disc), offsetof(struct disc, material)},
    [PRIMITIVE_PLANE] = {sizeof(struct plane), offsetof(struct plane, material)},
};

/* The block is hashed and sent as it lies in memory, so it must contain no padding, whose content would be
 * undefined. */
_Static_assert(sizeof(struct material) == 80 && sizeof(struct light) == 48, "no padding");
_Static_assert(sizeof(struct triangle) == 16 && sizeof(struct patch) == 28, "no padding");
_Static_assert(sizeof(struct sphere) == 40 && sizeof(struct plane) == 56, "no padding");
_Static_assert(sizeof(struct disc) == 64 && sizeof(struct box) == 56, "no padding");
_Static_assert(sizeof(struct cone) == 72 && sizeof(struct camera) == 96, "no padding");
_Static_assert(sizeof(struct view) == 96 + 3 * 24 + 8 + 14 * 4, "no padding");
_Static_assert(sizeof(struct scene) ==
                   16 + sizeof(struct view) + (5 + PRIMITIVE_KINDS) * sizeof(struct scene_span),
               "no padding");

size_t primitive_size(enum primitive_kind kind)
{
    return primitive_kinds[kind].size;
}

size_t primitive_material_offset(enum primitive_kind kind)
{
    return primitive_kinds[kind].material_offset;
}

uint32_t primitive_material(const struct scene *scene, uint32_t id)
{
    enum primitive_kind kind = primitive_kind(id);
    const char *items = scene_at(scene, &scene->primitives[kind]);
    const char *item = items + primitive_index(id) * primitive_size(kind);
    return *(const uint32_t *)(const void *)(item + primitive_material_offset(kind));
}

uint64_t scene_primitive_count(const struct scene *scene)
{
    uint64_t sum = 0;
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        sum += scene->primitives[kind].count;
    return sum;
}

/* ---- validation ---- */

#define CHECK(condition, text)                                                                     \
    do {                                                                                           \
        if (!(condition)) return text;                                                             \
    } while (0)

static bool span_valid(const struct scene *scene, const struct scene_span *span, size_t size,
                       uint64_t most)
{
    if (span->offset % 8 != 0 || span->offset < sizeof(struct scene)) return false;
    if (span->offset > scene->bytes || span->count > most) return false;
    return span->count <= (scene->bytes - span->offset) / size;
}

/*
 * vec_normalize() divides by a length with a relative error of at most about 3 units of roundoff. The squared
 * length of its result is then wrong by less than 8 DBL_EPSILON, and so is this sum.
 */
static bool is_unit(struct vec3 v)
{
    return fabs(vec_dot(v, v) - 1) <= 16 * DBL_EPSILON;
}

static const char *header_error(const struct scene *scene, size_t bytes)
{
    CHECK(scene->magic == SCENE_MAGIC, "the scene block has another magic number");
    CHECK(scene->version == SCENE_VERSION, "the scene block has another version");
    CHECK(scene->bytes == bytes, "the scene block has another size than its header says");
    const char *text = "a span of the scene block lies outside of it";
    CHECK(span_valid(scene, &scene->vertices, sizeof(struct vec3), UINT32_MAX), text);
    CHECK(span_valid(scene, &scene->normals, sizeof(struct vec3), UINT32_MAX), text);
    CHECK(span_valid(scene, &scene->materials, sizeof(struct material), UINT32_MAX), text);
    CHECK(span_valid(scene, &scene->lights, sizeof(struct light), UINT32_MAX), text);
    CHECK(span_valid(scene, &scene->duplicates, sizeof(uint32_t), UINT32_MAX), text);
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        CHECK(span_valid(scene, &scene->primitives[kind], primitive_kinds[kind].size,
                         PRIMITIVE_MAX_COUNT),
              text);
    return NULL;
}

static const char *picture_error(const struct view *view)
{
    CHECK(view->width >= 1 && view->width <= PICTURE_MAX_EDGE,
          "the picture's width is out of range");
    CHECK(view->height >= 1 && view->height <= PICTURE_MAX_EDGE,
          "the picture's height is out of range");
    CHECK((uint64_t)view->width * view->height <= PICTURE_MAX_PIXELS,
          "the picture has too many pixels");
    CHECK(view->region_w >= 1 && view->region_x < view->width &&
              view->region_w <= view->width - view->region_x,
          "the region lies outside of the picture");
    CHECK(view->region_h >= 1 && view->region_y < view->height &&
              view->region_h <= view->height - view->region_y,
          "the region lies outside of the picture");
    return NULL;
}

static const char *view_error(const struct view *view)
{
    const char *why = picture_error(view);
    CHECK(!why, why);
    const struct camera *camera = &view->camera;
    CHECK(vec_is_finite(camera->eye), "the eye is not finite");
    CHECK(is_unit(camera->forward), "the direction of view has no unit length");
    CHECK(vec_is_finite(camera->right) && !vec_is_zero(camera->right), "the camera is degenerate");
    CHECK(vec_is_finite(camera->down) && !vec_is_zero(camera->down), "the camera is degenerate");
    CHECK(color_valid(view->background_bottom) && color_valid(view->background_top),
          "a background colour is out of range");
    CHECK(is_unit(view->background_up), "the background's up has no unit length");
    CHECK(at_least_zero(view->cutoff), "the cutoff is out of range");
    CHECK(view->max_depth <= RENDER_MAX_DEPTH, "max_depth is out of range");
    CHECK(view->shadows <= 1, "the shadows flag is neither 0 nor 1");
    CHECK(view->min_samples >= 1 && view->max_samples >= view->min_samples &&
              view->max_samples <= SAMPLES_MAX,
          "the number of samples is out of range");
    CHECK(view->reserved == 0, "a reserved field is not 0");
    CHECK(view->formulas <= FORMULAS_PAPER, "the choice of formulas is unknown");
    CHECK(view->processor < PROCESSOR_LEVELS, "the choice of a kernel is unknown");
    CHECK(view->variant <= VARIANT_FULL, "the choice of a variant is unknown");
    return NULL;
}

static bool material_valid(const struct material *m)
{
    return color_valid(m->color) && at_least_zero(m->ambient) && at_least_zero(m->diffuse) &&
           at_least_zero(m->specular) && shininess_valid(m->shininess) &&
           at_least_zero(m->reflection) && m->reflection <= 1 && at_least_zero(m->transmission) &&
           m->transmission <= 1 && positive(m->ior);
}

static const char *table_error(const struct scene *scene)
{
    const struct vec3 *vertices = scene_vertices(scene);
    for (uint64_t i = 0; i < scene->vertices.count; i++)
        CHECK(vec_is_finite(vertices[i]), "a vertex is not finite");
    const struct vec3 *normals = scene_normals(scene);
    for (uint64_t i = 0; i < scene->normals.count; i++)
        CHECK(is_unit(normals[i]), "a normal has no unit length");
    const struct material *materials = scene_materials(scene);
    for (uint64_t i = 0; i < scene->materials.count; i++)
        CHECK(material_valid(&materials[i]), "a material is out of range");
    const struct light *lights = scene_lights(scene);
    for (uint64_t i = 0; i < scene->lights.count; i++)
        CHECK(vec_is_finite(lights[i].position) && color_valid(lights[i].color),
              "a light is out of range");
    return NULL;
}

static const char *polygon_error(const struct scene *scene)
{
    const struct vec3 *vertices = scene_vertices(scene);
    const struct triangle *triangles = scene_triangles(scene);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_TRIANGLE].count; i++) {
        CHECK(indices_valid(triangles[i].vertex, scene->vertices.count) &&
                  triangles[i].material < scene->materials.count,
              "an index of a triangle is out of range");
        CHECK(edges_finite(vertices, triangles[i].vertex),
              "corners of a triangle are too far apart");
    }
    const struct patch *patches = scene_patches(scene);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_PATCH].count; i++) {
        CHECK(indices_valid(patches[i].vertex, scene->vertices.count) &&
                  indices_valid(patches[i].normal, scene->normals.count) &&
                  patches[i].material < scene->materials.count,
              "an index of a patch is out of range");
        CHECK(edges_finite(vertices, patches[i].vertex), "corners of a patch are too far apart");
    }
    return NULL;
}

static bool cone_valid(const struct cone *cone)
{
    struct vec3 axis = vec_sub(cone->apex, cone->base); /* finite only if both ends are */
    return vec_is_finite(axis) && !vec_is_zero(axis) && at_least_zero(cone->base_radius) &&
           at_least_zero(cone->apex_radius) && cone->base_radius + cone->apex_radius > 0 &&
           cone->capped <= 1;
}

static bool box_valid(const struct box *box)
{
    return vec_is_finite(box->min) && vec_is_finite(box->max) && box_has_volume(box);
}

static const char *solid_error(const struct scene *scene)
{
    uint64_t materials = scene->materials.count;
    const struct sphere *spheres = scene_spheres(scene);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_SPHERE].count; i++)
        CHECK(vec_is_finite(spheres[i].center) && positive(spheres[i].radius) &&
                  spheres[i].inside_only <= 1 && spheres[i].material < materials,
              "a sphere is out of range");
    const struct box *boxes = scene_boxes(scene);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_BOX].count; i++)
        CHECK(box_valid(&boxes[i]) && boxes[i].material < materials, "a box is out of range");
    const struct cone *cones = scene_cones(scene);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_CONE].count; i++)
        CHECK(cone_valid(&cones[i]) && cones[i].material < materials, "a cone is out of range");
    const struct disc *discs = scene_discs(scene);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_DISC].count; i++)
        CHECK(vec_is_finite(discs[i].center) && is_unit(discs[i].normal) &&
                  positive(discs[i].radius) && discs[i].material < materials,
              "a disc is out of range");
    const struct plane *planes = scene_planes(scene);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_PLANE].count; i++)
        CHECK(vec_is_finite(planes[i].point) && is_unit(planes[i].normal) &&
                  planes[i].material < materials,
              "a plane is out of range");
    return NULL;
}

static const char *duplicates_error(const struct scene *scene)
{
    const uint32_t *ids = scene_duplicates(scene);
    for (uint64_t i = 0; i < scene->duplicates.count; i++) {
        enum primitive_kind kind = primitive_kind(ids[i]);
        CHECK(kind < PRIMITIVE_KINDS && primitive_index(ids[i]) < scene->primitives[kind].count,
              "the id of a duplicate is out of range");
        CHECK(i == 0 || ids[i - 1] < ids[i], "the ids of duplicates are not in order");
    }
    return NULL;
}

static const char *scene_error(const void *block, size_t bytes)
{
    CHECK(bytes >= sizeof(struct scene), "the scene block is shorter than its header");
    CHECK((uintptr_t)block % 8 == 0, "the scene block is not aligned");
    const struct scene *scene = block;
    const char *why = header_error(scene, bytes);
    if (!why) why = view_error(&scene->view);
    if (!why) why = table_error(scene);
    if (!why) why = polygon_error(scene);
    if (!why) why = solid_error(scene);
    if (!why) why = duplicates_error(scene);
    return why;
}

bool scene_valid(const void *block, size_t bytes, const char **why)
{
    const char *text = scene_error(block, bytes);
    if (text && why) *why = text;
    return !text;
}

/* ---- features ---- */

static const char *const feature_names[FEATURE_COUNT] = {
    "triangles", "patches", "spheres", "boxes",    "cones",      "discs",
    "planes",    "lights",  "shadows", "specular", "reflection", "refraction"};

const char *scene_feature_name(unsigned i)
{
    return feature_names[i];
}

/*
 * Reflection and transmission count even if max_depth is 0: what is left out counts as truncation, and light
 * shines through a transmitting material.
 */
static unsigned material_features(const struct scene *scene)
{
    bool lit = scene->lights.count > 0;
    const struct material *materials = scene_materials(scene);
    unsigned features = 0;
    for (uint64_t i = 0; i < scene->materials.count; i++) {
        if (lit && materials[i].specular > 0) features |= FEATURE_SPECULAR;
        if (materials[i].reflection > 0) features |= FEATURE_REFLECTION;
        if (materials[i].transmission > 0) features |= FEATURE_REFRACTION;
    }
    return features;
}

unsigned scene_features(const struct scene *scene)
{
    static const unsigned of_kind[PRIMITIVE_KINDS] = {
        [PRIMITIVE_TRIANGLE] = FEATURE_TRIANGLES, [PRIMITIVE_PATCH] = FEATURE_PATCHES,
        [PRIMITIVE_SPHERE] = FEATURE_SPHERES,     [PRIMITIVE_BOX] = FEATURE_BOXES,
        [PRIMITIVE_CONE] = FEATURE_CONES,         [PRIMITIVE_DISC] = FEATURE_DISCS,
        [PRIMITIVE_PLANE] = FEATURE_PLANES,
    };
    unsigned features = material_features(scene);
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        if (scene->primitives[kind].count) features |= of_kind[kind];
    if (scene->lights.count) features |= FEATURE_LIGHTS;
    if (scene->lights.count && scene->view.shadows) features |= FEATURE_SHADOWS;
    return features;
}
