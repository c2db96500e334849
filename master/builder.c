#include "master/builder.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/scene_check.h"
#include "common/whole.h"

/* A growing array; the caller knows the size of an element. */
struct list {
    void *items;
    uint64_t count, capacity;
};

struct builder {
    struct list vertices, normals, materials, lights;
    struct list primitives[PRIMITIVE_KINDS];
    struct list duplicates; /* uint32_t: see struct scene */
};

struct builder *builder_create(void)
{
    return allocate_zeroed(1, sizeof(struct builder));
}

static void list_clear(struct list *list)
{
    free(list->items);
    *list = (struct list){0};
}

static void clear(struct builder *builder)
{
    list_clear(&builder->vertices);
    list_clear(&builder->normals);
    list_clear(&builder->duplicates);
    list_clear(&builder->materials);
    list_clear(&builder->lights);
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        list_clear(&builder->primitives[kind]);
}

void builder_destroy(struct builder *builder)
{
    if (!builder) return;
    clear(builder);
    free(builder);
}

static void list_add(struct list *list, const void *item, size_t size)
{
    if (list->count == list->capacity) {
        list->capacity = list->capacity ? list->capacity + list->capacity / 2 : 64;
        list->items = reallocate(list->items, list->capacity, size);
    }
    memcpy((char *)list->items + list->count * size, item, size);
    list->count++;
}

/* ---- tables that others refer to ---- */

const char *builder_add_material(struct builder *builder, const struct material *material,
                                 uint32_t *index)
{
    if (!color_valid(material->color)) return "a colour needs three finite numbers >= 0";
    if (!at_least_zero(material->ambient) || !at_least_zero(material->diffuse) ||
        !at_least_zero(material->specular))
        return "ambient, diffuse and specular have to be finite numbers >= 0";
    if (!shininess_valid(material->shininess))
        return "shininess is out of range, expected a number from 0 to " DIGITS(SHININESS_MAX);
    if (!at_least_zero(material->reflection) || material->reflection > 1)
        return "reflection is out of range, expected a number from 0 to 1";
    if (!at_least_zero(material->transmission) || material->transmission > 1)
        return "transmission is out of range, expected a number from 0 to 1";
    if (!positive(material->ior)) return "ior is out of range, expected a finite number > 0";
    if (builder->materials.count == UINT32_MAX)
        return "too many materials, at most 2^32 - 1 are possible";
    *index = (uint32_t)builder->materials.count;
    list_add(&builder->materials, material, sizeof *material);
    return NULL;
}

const char *builder_add_vertex(struct builder *builder, struct vec3 point, uint32_t *index)
{
    if (!vec_is_finite(point)) return "a corner is not finite, expected three finite numbers";
    if (builder->vertices.count == UINT32_MAX)
        return "too many vertices, at most 2^32 - 1 are possible";
    *index = (uint32_t)builder->vertices.count;
    list_add(&builder->vertices, &point, sizeof point);
    return NULL;
}

const char *builder_add_normal(struct builder *builder, struct vec3 normal, uint32_t *index)
{
    if (!vec_is_finite(normal) || vec_is_zero(normal))
        return "a normal is zero or not finite, expected a direction";
    if (builder->normals.count == UINT32_MAX)
        return "too many normals, at most 2^32 - 1 are possible";
    struct vec3 unit = vec_normalize(normal);
    *index = (uint32_t)builder->normals.count;
    list_add(&builder->normals, &unit, sizeof unit);
    return NULL;
}

const char *builder_add_light(struct builder *builder, const struct light *light)
{
    if (!vec_is_finite(light->position))
        return "the position is not finite, expected three finite numbers";
    if (!color_valid(light->color)) return "a colour needs three finite numbers >= 0";
    if (builder->lights.count == UINT32_MAX)
        return "too many lights, at most 2^32 - 1 are possible";
    list_add(&builder->lights, light, sizeof *light);
    return NULL;
}

/* ---- primitives ---- */

static const char *add_primitive(struct builder *builder, enum primitive_kind kind,
                                 const void *item)
{
    struct list *list = &builder->primitives[kind];
    if (list->count == PRIMITIVE_MAX_COUNT)
        return "too many primitives, at most 2^28 of a kind are possible";
    list_add(list, item, primitive_size(kind));
    return NULL;
}

const char *builder_add_sphere(struct builder *builder, const struct sphere *sphere)
{
    assert(sphere->material < builder->materials.count && sphere->inside_only <= 1);
    if (!vec_is_finite(sphere->center))
        return "the center is not finite, expected three finite numbers";
    if (!positive(sphere->radius))
        return "the radius is out of range, expected a finite number > 0";
    return add_primitive(builder, PRIMITIVE_SPHERE, sphere);
}

static const char *normalize(struct vec3 *normal)
{
    if (!vec_is_finite(*normal) || vec_is_zero(*normal))
        return "the normal is zero or not finite, expected a direction";
    *normal = vec_normalize(*normal);
    return NULL;
}

const char *builder_add_plane(struct builder *builder, const struct plane *plane)
{
    assert(plane->material < builder->materials.count);
    struct plane unit = *plane;
    unit.reserved = 0;
    if (!vec_is_finite(plane->point))
        return "the point is not finite, expected three finite numbers";
    const char *why = normalize(&unit.normal);
    return why ? why : add_primitive(builder, PRIMITIVE_PLANE, &unit);
}

const char *builder_add_disc(struct builder *builder, const struct disc *disc)
{
    assert(disc->material < builder->materials.count);
    struct disc unit = *disc;
    unit.reserved = 0;
    if (!vec_is_finite(disc->center))
        return "the center is not finite, expected three finite numbers";
    if (!positive(disc->radius)) return "the radius is out of range, expected a finite number > 0";
    const char *why = normalize(&unit.normal);
    return why ? why : add_primitive(builder, PRIMITIVE_DISC, &unit);
}

const char *builder_add_box(struct builder *builder, const struct box *box)
{
    assert(box->material < builder->materials.count);
    struct box clean = *box;
    clean.reserved = 0;
    if (!vec_is_finite(box->min) || !vec_is_finite(box->max))
        return "a corner is not finite, expected three finite numbers";
    if (!box_has_volume(box)) return "the box has no volume, expected min < max in every component";
    return add_primitive(builder, PRIMITIVE_BOX, &clean);
}

const char *builder_add_cone(struct builder *builder, const struct cone *cone)
{
    assert(cone->material < builder->materials.count && cone->capped <= 1);
    if (!vec_is_finite(cone->base) || !vec_is_finite(cone->apex))
        return "an end is not finite, expected three finite numbers";
    struct vec3 axis = vec_sub(cone->apex, cone->base);
    if (vec_is_zero(axis)) return "base and apex are the same point, expected two different points";
    if (!vec_is_finite(axis)) return "base and apex are too far apart, expected a finite distance";
    if (!at_least_zero(cone->base_radius) || !at_least_zero(cone->apex_radius))
        return "a radius is out of range, expected finite numbers >= 0";
    if (cone->base_radius == 0 && cone->apex_radius == 0)
        return "both radii are 0, expected at least one > 0";
    return add_primitive(builder, PRIMITIVE_CONE, cone);
}

#define FAR_CORNERS "two corners are too far apart, expected finite distances"

const char *builder_add_triangle(struct builder *builder, const struct triangle *triangle)
{
    assert(indices_valid(triangle->vertex, builder->vertices.count));
    assert(triangle->material < builder->materials.count);
    if (!edges_finite(builder->vertices.items, triangle->vertex)) return FAR_CORNERS;
    return add_primitive(builder, PRIMITIVE_TRIANGLE, triangle);
}

const char *builder_add_patch(struct builder *builder, const struct patch *patch)
{
    assert(indices_valid(patch->vertex, builder->vertices.count));
    assert(indices_valid(patch->normal, builder->normals.count));
    assert(patch->material < builder->materials.count);
    if (!edges_finite(builder->vertices.items, patch->vertex)) return FAR_CORNERS;
    return add_primitive(builder, PRIMITIVE_PATCH, patch);
}

/* ---- questions ---- */

uint32_t builder_vertex_count(const struct builder *builder)
{
    return (uint32_t)builder->vertices.count;
}

struct vec3 builder_vertex(const struct builder *builder, uint32_t index)
{
    assert(index < builder->vertices.count);
    return ((const struct vec3 *)builder->vertices.items)[index];
}

uint32_t builder_light_count(const struct builder *builder)
{
    return (uint32_t)builder->lights.count;
}

uint64_t builder_primitive_count(const struct builder *builder)
{
    uint64_t count = 0;
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        count += builder->primitives[kind].count;
    return count;
}

const void *builder_items(const struct builder *builder, enum primitive_kind kind)
{
    return builder->primitives[kind].items;
}

uint32_t builder_kind_count(const struct builder *builder, enum primitive_kind kind)
{
    return (uint32_t)builder->primitives[kind].count;
}

static struct primitives primitives_of(const struct builder *builder, enum primitive_kind kind)
{
    return (struct primitives){.kind = kind,
                               .items = builder->primitives[kind].items,
                               .count = builder->primitives[kind].count,
                               .vertices = builder->vertices.items,
                               .vertex_count = builder->vertices.count,
                               .materials = builder->materials.items};
}

struct coincidences builder_coincidences(const struct builder *builder, enum primitive_kind kind)
{
    struct primitives primitives = primitives_of(builder, kind);
    return find_coincidences(&primitives);
}

/* ---- the block ---- */

#define UNUSED UINT32_MAX

/* Moves the used items to the front, in their order, and sets in place[] where each one went. */
static void pack(struct list *list, size_t size, uint32_t *place)
{
    char *items = list->items;
    uint32_t kept = 0;
    for (uint64_t i = 0; i < list->count; i++) {
        if (place[i] == UNUSED) continue;
        memmove(items + kept * size, items + i * size, size);
        place[i] = kept++;
    }
    list->count = kept;
}

/* The place in primitives of a kind that holds an index into a table. */
struct reference {
    enum primitive_kind kind;
    size_t offset;
};

/* Drops the items of a table that no reference uses, and updates the indices. */
static void drop_unused(struct builder *builder, struct list *table, size_t size,
                        const struct reference *references, unsigned count)
{
    uint32_t *place = allocate(table->count, sizeof *place);
    memset(place, 0xff, table->count * sizeof *place);
    for (int pass = 0; pass < 2; pass++) {
        for (unsigned r = 0; r < count; r++) {
            const struct list *list = &builder->primitives[references[r].kind];
            size_t step = primitive_size(references[r].kind);
            if (list->count == 0) continue; /* then there are no items to point into */
            char *at = (char *)list->items + references[r].offset;
            for (uint64_t i = 0; i < list->count; i++, at += step) {
                uint32_t *index = (uint32_t *)(void *)at;
                if (pass == 0)
                    place[*index] = 0;
                else
                    *index = place[*index];
            }
        }
        if (pass == 0) pack(table, size, place);
    }
    free(place);
}

/* Unused materials are dropped, as the features of a scene are derived from the materials in the block. */
static void drop_unused_materials(struct builder *builder)
{
    struct reference references[PRIMITIVE_KINDS];
    for (int k = 0; k < PRIMITIVE_KINDS; k++) {
        enum primitive_kind kind = (enum primitive_kind)k;
        references[k] = (struct reference){kind, primitive_material_offset(kind)};
    }
    drop_unused(builder, &builder->materials, sizeof(struct material), references, PRIMITIVE_KINDS);
}

static void drop_unused_corners(struct builder *builder)
{
    struct reference vertices[6], normals[3];
    for (unsigned i = 0; i < 3; i++) {
        size_t step = i * sizeof(uint32_t);
        vertices[i] =
            (struct reference){PRIMITIVE_TRIANGLE, offsetof(struct triangle, vertex) + step};
        vertices[3 + i] =
            (struct reference){PRIMITIVE_PATCH, offsetof(struct patch, vertex) + step};
        normals[i] = (struct reference){PRIMITIVE_PATCH, offsetof(struct patch, normal) + step};
    }
    drop_unused(builder, &builder->vertices, sizeof(struct vec3), vertices, 6);
    drop_unused(builder, &builder->normals, sizeof(struct vec3), normals, 3);
}

static void note_unseen(void *builder, uint32_t id)
{
    list_add(&((struct builder *)builder)->duplicates, &id, sizeof id);
}

/* Drops duplicates, which are never hit, or notes which they are. Not called with the paper's formulas, which may take
 * a ray's start for a hit, so that every surface is hit. */
static void find_unseen(struct builder *builder, bool drop)
{
    for (int k = 0; k < PRIMITIVE_KINDS; k++) {
        struct primitives primitives = primitives_of(builder, (enum primitive_kind)k);
        if (drop)
            builder->primitives[k].count = drop_duplicates(&primitives);
        else
            note_duplicates(&primitives, note_unseen, builder);
    }
}

/* Drops lights that are black, or all lights where no surface shows light. */
static void drop_dark_lights(struct builder *builder)
{
    const struct material *materials = builder->materials.items;
    struct light *lights = builder->lights.items;
    bool shown = false;
    uint64_t kept = 0;
    for (uint64_t i = 0; i < builder->materials.count; i++)
        shown |= material_shows_light(&materials[i]);
    for (uint64_t i = 0; i < builder->lights.count; i++)
        if (shown && !vec_is_zero(lights[i].color)) lights[kept++] = lights[i];
    builder->lights.count = kept;
}

/* Reserves room for a list at *bytes. Sizes of lists are bounded, so this cannot overflow. */
static struct scene_span reserve(const struct list *list, size_t size, uint64_t *bytes)
{
    struct scene_span span = {*bytes, list->count};
    *bytes = round_up_to(*bytes + list->count * size, 8);
    return span;
}

/* The gap behind the items is cleared, so that it always has the same bytes. */
static void move(struct scene *scene, const struct scene_span *span, struct list *list, size_t size)
{
    size_t bytes = list->count * size;
    char *to = (char *)scene + span->offset;
    if (bytes) memcpy(to, list->items, bytes);
    memset(to + bytes, 0, round_up_to(bytes, 8) - bytes);
    list_clear(list);
}

struct scene *builder_finish(struct builder *builder, const struct view *view)
{
    bool sparing = view->variant == VARIANT_AUTO;
    if (view->formulas == FORMULAS_EXACT) find_unseen(builder, sparing);
    drop_unused_materials(builder);
    if (sparing) {
        drop_unused_corners(builder);
        drop_dark_lights(builder);
    }
    struct scene head = {.magic = SCENE_MAGIC, .version = SCENE_VERSION, .view = *view};
    uint64_t bytes = sizeof head;
    head.vertices = reserve(&builder->vertices, sizeof(struct vec3), &bytes);
    head.normals = reserve(&builder->normals, sizeof(struct vec3), &bytes);
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        head.primitives[kind] =
            reserve(&builder->primitives[kind], primitive_size((enum primitive_kind)kind), &bytes);
    head.materials = reserve(&builder->materials, sizeof(struct material), &bytes);
    head.lights = reserve(&builder->lights, sizeof(struct light), &bytes);
    head.duplicates = reserve(&builder->duplicates, sizeof(uint32_t), &bytes);
    head.bytes = bytes;

    struct scene *scene = allocate_large(bytes);
    *scene = head;
    move(scene, &head.vertices, &builder->vertices, sizeof(struct vec3));
    move(scene, &head.normals, &builder->normals, sizeof(struct vec3));
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        move(scene, &head.primitives[kind], &builder->primitives[kind],
             primitive_size((enum primitive_kind)kind));
    move(scene, &head.materials, &builder->materials, sizeof(struct material));
    move(scene, &head.lights, &builder->lights, sizeof(struct light));
    move(scene, &head.duplicates, &builder->duplicates, sizeof(uint32_t));
    return scene;
}
