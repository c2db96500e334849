#include "master/load_objects.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/scene_check.h"
#include "master/faces.h"
#include "master/nearest_name.h"
#include "master/placement.h"
#include "master/sections.h"

/* ---- complaints ---- */

bool refuse_section_key(const struct reading *at, const char *key, const char *why)
{
    struct ini_place place = ini_place_of(at->ini, at->section, key);
    char *title = section_title(at->section);
    user_error(place.file, place.line, "%s: %s", title, why);
    free(title);
    return false;
}

/* The last key that an argument has set, at which errors of the object are reported, as the file alone may be right; ""
 * if there is none. `material` does not count, as it cannot make a shape invalid. */
static const char *key_of_argument(const struct reading *at)
{
    const char *key = "";
    for (size_t i = 0; i < at->section->count; i++) {
        const struct ini_entry *entry = &at->section->entries[i];
        if (entry->file != at->ini->file && strcmp(entry->key, "material") != 0) key = entry->key;
    }
    return key;
}

static bool refuse_values(const struct reading *at, const char *why)
{
    return refuse_section_key(at, key_of_argument(at), why);
}

bool accept_section(const struct reading *at, const char *why)
{
    return !why || refuse_values(at, why);
}

/* The same for what has a place: the message also says what places it. */
static bool accept_object(const struct reading *at, const char *why)
{
    if (!why) return true;
    char *text = why_placed(why, &at->part->placed);
    refuse_values(at, text);
    free(text);
    return false;
}

/* ---- materials ---- */

bool resolve_material(const struct reading *at, const struct object *object, uint32_t *index)
{
    if (!object->material) {
        *index = default_material(at->part->loader);
        return true;
    }
    if (find_material(at->part, object->material, index)) return true;
    if (!*object->material)
        return refuse_section_key(at, "material",
                                  "no material is named, expected the name of a [material]");
    struct nearest_name search = {.name = object->material};
    try_materials(at->part, &search);
    char *hint = nearest_name_hint(&search);
    bool in_file = ini_place_of(at->ini, at->section, "material").line > 0;
    char *text = format_text("there is no [material %s]%s%s", object->material,
                             *hint ? hint : ", expected the name of one",
                             in_file ? comment_hint(object->material) : "");
    refuse_section_key(at, "material", text);
    free(text);
    free(hint);
    return false;
}

/* ---- lights and objects ---- */

bool load_light(const struct reading *at, void *data)
{
    struct light *light = data;
    light->position = placement_point(&at->part->placement, light->position);
    return accept_object(at, builder_add_light(at->part->loader->builder, light));
}

bool load_sphere(const struct reading *at, void *data)
{
    struct sphere_section *s = data;
    const struct placement *placement = &at->part->placement;
    s->sphere.center = placement_point(placement, s->sphere.center);
    s->sphere.radius *= placement->scale;
    return resolve_material(at, &s->object, &s->sphere.material) &&
           accept_object(at, builder_add_sphere(at->part->loader->builder, &s->sphere));
}

bool load_plane(const struct reading *at, void *data)
{
    struct plane_section *s = data;
    const struct placement *placement = &at->part->placement;
    s->plane.point = placement_point(placement, s->plane.point);
    s->plane.normal = placement_direction(placement, s->plane.normal);
    return resolve_material(at, &s->object, &s->plane.material) &&
           accept_object(at, builder_add_plane(at->part->loader->builder, &s->plane));
}

bool load_disc(const struct reading *at, void *data)
{
    struct disc_section *s = data;
    const struct placement *placement = &at->part->placement;
    s->disc.center = placement_point(placement, s->disc.center);
    s->disc.normal = placement_direction(placement, s->disc.normal);
    s->disc.radius *= placement->scale;
    return resolve_material(at, &s->object, &s->disc.material) &&
           accept_object(at, builder_add_disc(at->part->loader->builder, &s->disc));
}

bool load_triangle(const struct reading *at, void *data)
{
    struct triangle_section *s = data;
    struct builder *builder = at->part->loader->builder;
    struct triangle triangle;
    if (!resolve_material(at, &s->object, &triangle.material)) return false;
    if (!corners_have_area(s->corner[0], s->corner[1], s->corner[2]))
        return refuse_values(at, "the corners lie on a line, expected a triangle with an area");
    for (int i = 0; i < 3; i++) {
        struct vec3 corner = placement_point(&at->part->placement, s->corner[i]);
        if (!accept_object(at, builder_add_vertex(builder, corner, &triangle.vertex[i])))
            return false;
    }
    return accept_object(at, builder_add_triangle(builder, &triangle));
}

/* Adds each face as two triangles. Corner i has max.x where bit 0 of i is set, max.y for bit 1, max.z for bit 2. */
static const char *add_turned_box(struct builder *builder, const struct placement *placement,
                                  const struct box *box)
{
    static const unsigned char faces[12][3] = {
        {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
        {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
    };
    uint32_t vertex[8];
    for (int i = 0; i < 8; i++) {
        struct vec3 corner = vec3(i & 1 ? box->max.x : box->min.x, i & 2 ? box->max.y : box->min.y,
                                  i & 4 ? box->max.z : box->min.z);
        const char *why =
            builder_add_vertex(builder, placement_point(placement, corner), &vertex[i]);
        if (why) return why;
    }
    for (int i = 0; i < 12; i++) {
        struct triangle triangle = {{vertex[faces[i][0]], vertex[faces[i][1]], vertex[faces[i][2]]},
                                    box->material};
        const char *why = builder_add_triangle(builder, &triangle);
        if (why) return why;
    }
    return NULL;
}

bool load_box(const struct reading *at, void *data)
{
    struct box_section *s = data;
    struct box *box = &s->box;
    struct builder *builder = at->part->loader->builder;
    const struct placement *placement = &at->part->placement;
    if (!resolve_material(at, &s->object, &box->material)) return false;
    if (!box_has_volume(box))
        return refuse_values(at, "the box has no volume, expected min < max in every component");
    if (!placement_keeps_axes(placement))
        return accept_object(at, add_turned_box(builder, placement, box));
    struct vec3 a = placement_point(placement, box->min), b = placement_point(placement, box->max);
    box->min = vec3(fmin(a.x, b.x), fmin(a.y, b.y), fmin(a.z, b.z));
    box->max = vec3(fmax(a.x, b.x), fmax(a.y, b.y), fmax(a.z, b.z));
    return accept_object(at, builder_add_box(builder, box));
}

static bool add_cone(const struct reading *at, const struct object *object, struct cone *cone)
{
    const struct placement *placement = &at->part->placement;
    cone->base = placement_point(placement, cone->base);
    cone->apex = placement_point(placement, cone->apex);
    cone->base_radius *= placement->scale;
    cone->apex_radius *= placement->scale;
    cone->capped = 1;
    return resolve_material(at, object, &cone->material) &&
           accept_object(at, builder_add_cone(at->part->loader->builder, cone));
}

bool load_cylinder(const struct reading *at, void *data)
{
    struct cylinder_section *s = data;
    struct cone cone = {
        .base = s->base, .apex = s->apex, .base_radius = s->radius, .apex_radius = s->radius};
    return add_cone(at, &s->object, &cone);
}

bool load_cone(const struct reading *at, void *data)
{
    struct cone_section *s = data;
    return add_cone(at, &s->object, &s->cone);
}
