/*
 * The scene sections of an INI file. Each kind of section has a structure that it is read into, a
 * table of keys, and a function that puts it into the scene.
 */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/message.h"
#include "master/loader.h"
#include "master/nearest_name.h"
#include "master/placement.h"
#include "master/scene_sections.h"
#include "master/sections.h"
#include "master/text_file.h"

/* ---- what sections hold ---- */

/* Objects begin with the name of their material, so that one function resolves it. */
struct object {
    char *material; /* NULL: the default */
};

struct sphere_section {
    struct object object;
    struct sphere sphere;
};

struct plane_section {
    struct object object;
    struct plane plane;
};

struct disc_section {
    struct object object;
    struct disc disc;
};

struct triangle_section {
    struct object object;
    struct vec3 corner[3];
};

struct box_section {
    struct object object;
    struct box box;
};

struct cylinder_section {
    struct object object;
    struct vec3 base, apex;
    double radius;
};

struct cone_section {
    struct object object;
    struct cone cone;
};

struct mesh_section {
    struct object object;
    char *file;
    struct vec3 translate, rotate;
    double scale, crease;
};

struct include_section {
    char *file;
    struct vec3 translate, rotate;
    double scale;
};

#define AT(type, member) .offset = offsetof(struct type, member)
#define ANY_ABOVE_0      .min = 0, .max = HUGE_VAL, .flags = KEY_ABOVE_MIN
#define FROM_0           .min = 0, .max = HUGE_VAL
#define REQUIRED         .required = true

static const struct key light_keys[] = {
    {"light", "position", VALUE_VECTOR, AT(light, position), REQUIRED, .help = "where it is"},
    {"light", "color", VALUE_COLOR, AT(light, color), .fallback = "1 1 1",
     .help = "its strength, the same at any distance"},
};

static const struct key material_keys[] = {
    {"material", "color", VALUE_COLOR, AT(material, color), .fallback = "0.8 0.8 0.8",
     .help = "of the surface"},
    {"material", "ambient", VALUE_NUMBER, AT(material, ambient), FROM_0, .fallback = "0.1",
     .help = "share of light that comes from everywhere"},
    {"material", "diffuse", VALUE_NUMBER, AT(material, diffuse), FROM_0, .fallback = "0.7",
     .help = "share of light that is scattered"},
    {"material", "specular", VALUE_NUMBER, AT(material, specular), FROM_0, .fallback = "0.2",
     .help = "strength of the highlight"},
    {"material", "shininess", VALUE_NUMBER, AT(material, shininess), FROM_0, .fallback = "20",
     .help = "exponent of the highlight: larger is smaller"},
    {"material", "reflection", VALUE_NUMBER, AT(material, reflection), .min = 0, .max = 1,
     .fallback = "0", .help = "share of light that is mirrored"},
    {"material", "transmission", VALUE_NUMBER, AT(material, transmission), .min = 0, .max = 1,
     .fallback = "0", .help = "share of light that passes through"},
    {"material", "ior", VALUE_NUMBER, AT(material, ior), ANY_ABOVE_0, .fallback = "1.5",
     .help = "index of refraction; the world outside has 1"},
};

#define MATERIAL_KEY(kind)                                                                         \
    {                                                                                              \
        kind, "material", VALUE_TEXT, .offset = 0, .help = "name of a [material] (default: grey)"  \
    }

static const struct key sphere_keys[] = {
    {"sphere", "center", VALUE_VECTOR, AT(sphere_section, sphere.center), REQUIRED},
    {"sphere", "radius", VALUE_NUMBER, AT(sphere_section, sphere.radius), REQUIRED, ANY_ABOVE_0},
    MATERIAL_KEY("sphere"),
};

static const struct key plane_keys[] = {
    {"plane", "point", VALUE_VECTOR, AT(plane_section, plane.point), REQUIRED,
     .help = "any point of it"},
    {"plane", "normal", VALUE_VECTOR, AT(plane_section, plane.normal), REQUIRED},
    MATERIAL_KEY("plane"),
};

static const struct key disc_keys[] = {
    {"disc", "center", VALUE_VECTOR, AT(disc_section, disc.center), REQUIRED},
    {"disc", "normal", VALUE_VECTOR, AT(disc_section, disc.normal), REQUIRED},
    {"disc", "radius", VALUE_NUMBER, AT(disc_section, disc.radius), REQUIRED, ANY_ABOVE_0},
    MATERIAL_KEY("disc"),
};

static const struct key triangle_keys[] = {
    {"triangle", "a", VALUE_VECTOR, AT(triangle_section, corner[0]), REQUIRED,
     .help = "corners, counter-clockwise seen from the front"},
    {"triangle", "b", VALUE_VECTOR, AT(triangle_section, corner[1]), REQUIRED},
    {"triangle", "c", VALUE_VECTOR, AT(triangle_section, corner[2]), REQUIRED},
    MATERIAL_KEY("triangle"),
};

static const struct key box_keys[] = {
    {"box", "min", VALUE_VECTOR, AT(box_section, box.min), REQUIRED, .help = "lowest corner"},
    {"box", "max", VALUE_VECTOR, AT(box_section, box.max), REQUIRED, .help = "highest corner"},
    MATERIAL_KEY("box"),
};

static const struct key cylinder_keys[] = {
    {"cylinder", "base", VALUE_VECTOR, AT(cylinder_section, base), REQUIRED,
     .help = "middle of one end"},
    {"cylinder", "apex", VALUE_VECTOR, AT(cylinder_section, apex), REQUIRED,
     .help = "middle of the other"},
    {"cylinder", "radius", VALUE_NUMBER, AT(cylinder_section, radius), REQUIRED, ANY_ABOVE_0},
    MATERIAL_KEY("cylinder"),
};

static const struct key cone_keys[] = {
    {"cone", "base", VALUE_VECTOR, AT(cone_section, cone.base), REQUIRED,
     .help = "middle of one end"},
    {"cone", "apex", VALUE_VECTOR, AT(cone_section, cone.apex), REQUIRED,
     .help = "middle of the other"},
    {"cone", "base_radius", VALUE_NUMBER, AT(cone_section, cone.base_radius), REQUIRED, FROM_0},
    {"cone", "apex_radius", VALUE_NUMBER, AT(cone_section, cone.apex_radius), FROM_0,
     .fallback = "0"},
    MATERIAL_KEY("cone"),
};

#define PLACEMENT_KEYS(kind, type)                                                                 \
    {kind,                                                                                         \
     "translate",                                                                                  \
     VALUE_VECTOR,                                                                                 \
     AT(type, translate),                                                                          \
     .fallback = "0 0 0",                                                                          \
     .help = "shift, after turning and scaling"},                                                  \
        {kind,                                                                                     \
         "rotate",                                                                                 \
         VALUE_VECTOR,                                                                             \
         AT(type, rotate),                                                                         \
         .fallback = "0 0 0",                                                                      \
         .help = "degrees about x, then y, then z"},                                               \
    {                                                                                              \
        kind, "scale", VALUE_NUMBER, AT(type, scale), ANY_ABOVE_0,                                 \
            .fallback = "1", .help = "size, the same in all directions"                            \
    }

static const struct key mesh_keys[] = {
    {"mesh", "file", VALUE_TEXT, AT(mesh_section, file), REQUIRED, .help = "an OBJ file"},
    MATERIAL_KEY("mesh"),
    PLACEMENT_KEYS("mesh", mesh_section),
    {"mesh", "smooth", VALUE_CREASE, AT(mesh_section, crease), .min = 0, .max = 180,
     .help = "no: flat; yes, or a largest angle in degrees: round edges up to it (default: the "
             "file's own normals)"},
};

static const struct key include_keys[] = {
    {"include", "file", VALUE_TEXT, AT(include_section, file), REQUIRED,
     .help = "an INI or NFF file"},
    PLACEMENT_KEYS("include", include_section),
};

/* ---- help for all of them ---- */

/* A section on its way into the scene. */
struct reading {
    struct part *part;
    const struct ini *ini;
    const struct ini_section *section;
};

static bool refuse(const struct reading *at, const char *key, const char *why)
{
    struct ini_place place = place_of(at->ini, at->section, key);
    char *title = section_title(at->section);
    user_error(place.file, place.line, "%s: %s", title, why);
    free(title);
    return false;
}

/* Tells of a builder's complaint, if it is one. */
static bool accept(const struct reading *at, const char *why)
{
    return !why || refuse(at, "", why);
}

uint32_t default_material(struct loader *loader)
{
    if (loader->has_default_material) return loader->default_material;
    struct material material = {0};
    keys_set_fallbacks(material_keys, sizeof material_keys / sizeof *material_keys, &material);
    if (builder_add_material(loader->builder, &material, &loader->default_material))
        fatal("too many materials");
    loader->has_default_material = true;
    return loader->default_material;
}

static int compare_name(const void *name, const void *material)
{
    return strcmp(name, ((const struct named_material *)material)->name);
}

bool find_material(const struct part *part, const char *name, uint32_t *index)
{
    for (; part; part = part->outer) {
        if (!part->material_count) continue;
        const struct named_material *found = bsearch(name, part->materials, part->material_count,
                                                     sizeof *part->materials, compare_name);
        if (!found) continue;
        *index = found->index;
        return true;
    }
    return false;
}

static bool resolve_material(const struct reading *at, const struct object *object, uint32_t *index)
{
    if (!object->material) {
        *index = default_material(at->part->loader);
        return true;
    }
    if (find_material(at->part, object->material, index)) return true;
    struct nearest_name search = {.name = object->material};
    for (const struct part *part = at->part; part; part = part->outer)
        for (size_t i = 0; i < part->material_count; i++)
            nearest_name_try(&search, part->materials[i].name);
    char *hint = search.best ? nearest_name_hint(&search) : copy_text(", expected the name of one");
    char *text = format_text("there is no [material %s]%s", object->material, hint);
    refuse(at, "material", text);
    free(text);
    free(hint);
    return false;
}

void warn_of_gain(const struct material *material, const char *file, long line)
{
    /* A little more than 1 is rounding of the numbers as they were written. */
    if (material->reflection + material->transmission > 1.0000001)
        user_warning(file, line,
                     "reflection and transmission together are more than 1: the surface "
                     "gives off more light than it gets");
    if (vec_max(material->color) > 1)
        user_warning(file, line, "a component of the color is more than 1: full white is 1 1 1");
}

/* ---- lights and objects ---- */

static bool load_light(const struct reading *at, void *data)
{
    struct light *light = data;
    light->position = place_point(&at->part->placement, light->position);
    return accept(at, builder_add_light(at->part->loader->builder, light));
}

static bool load_sphere(const struct reading *at, void *data)
{
    struct sphere_section *s = data;
    const struct placement *placement = &at->part->placement;
    s->sphere.center = place_point(placement, s->sphere.center);
    s->sphere.radius *= placement->scale;
    return resolve_material(at, &s->object, &s->sphere.material) &&
           accept(at, builder_add_sphere(at->part->loader->builder, &s->sphere));
}

static bool load_plane(const struct reading *at, void *data)
{
    struct plane_section *s = data;
    const struct placement *placement = &at->part->placement;
    s->plane.point = place_point(placement, s->plane.point);
    s->plane.normal = place_direction(placement, s->plane.normal);
    return resolve_material(at, &s->object, &s->plane.material) &&
           accept(at, builder_add_plane(at->part->loader->builder, &s->plane));
}

static bool load_disc(const struct reading *at, void *data)
{
    struct disc_section *s = data;
    const struct placement *placement = &at->part->placement;
    s->disc.center = place_point(placement, s->disc.center);
    s->disc.normal = place_direction(placement, s->disc.normal);
    s->disc.radius *= placement->scale;
    return resolve_material(at, &s->object, &s->disc.material) &&
           accept(at, builder_add_disc(at->part->loader->builder, &s->disc));
}

static bool load_triangle(const struct reading *at, void *data)
{
    struct triangle_section *s = data;
    struct builder *builder = at->part->loader->builder;
    struct triangle triangle;
    if (!resolve_material(at, &s->object, &triangle.material)) return false;
    struct vec3 ab = vec_sub(s->corner[1], s->corner[0]), ac = vec_sub(s->corner[2], s->corner[0]);
    if (vec_is_zero(ab) || vec_is_zero(ac) ||
        vec_is_zero(vec_cross(vec_normalize(ab), vec_normalize(ac))))
        return refuse(at, "", "the corners lie on a line, expected a triangle with an area");
    for (int i = 0; i < 3; i++) {
        struct vec3 corner = place_point(&at->part->placement, s->corner[i]);
        if (!accept(at, builder_add_vertex(builder, corner, &triangle.vertex[i]))) return false;
    }
    return accept(at, builder_add_triangle(builder, &triangle));
}

/* The faces as two triangles each; corner i has max.x where bit 0 is set, max.y bit 1, max.z bit 2.
 */
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
        const char *why = builder_add_vertex(builder, place_point(placement, corner), &vertex[i]);
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

static bool load_box(const struct reading *at, void *data)
{
    struct box_section *s = data;
    struct box *box = &s->box;
    struct builder *builder = at->part->loader->builder;
    const struct placement *placement = &at->part->placement;
    if (!resolve_material(at, &s->object, &box->material)) return false;
    if (!(box->min.x < box->max.x && box->min.y < box->max.y && box->min.z < box->max.z))
        return refuse(at, "", "the box has no volume, expected min < max in every component");
    if (!placement_keeps_axes(placement))
        return accept(at, add_turned_box(builder, placement, box));
    struct vec3 a = place_point(placement, box->min), b = place_point(placement, box->max);
    box->min = vec3(fmin(a.x, b.x), fmin(a.y, b.y), fmin(a.z, b.z));
    box->max = vec3(fmax(a.x, b.x), fmax(a.y, b.y), fmax(a.z, b.z));
    return accept(at, builder_add_box(builder, box));
}

static bool add_cone(const struct reading *at, const struct object *object, struct cone *cone)
{
    const struct placement *placement = &at->part->placement;
    cone->base = place_point(placement, cone->base);
    cone->apex = place_point(placement, cone->apex);
    cone->base_radius *= placement->scale;
    cone->apex_radius *= placement->scale;
    cone->capped = 1;
    return resolve_material(at, object, &cone->material) &&
           accept(at, builder_add_cone(at->part->loader->builder, cone));
}

static bool load_cylinder(const struct reading *at, void *data)
{
    struct cylinder_section *s = data;
    struct cone cone = {
        .base = s->base, .apex = s->apex, .base_radius = s->radius, .apex_radius = s->radius};
    return add_cone(at, &s->object, &cone);
}

static bool load_cone(const struct reading *at, void *data)
{
    struct cone_section *s = data;
    return add_cone(at, &s->object, &s->cone);
}

/* ---- other files ---- */

/* The file that a section names by its key `file`. */
struct named_file {
    char *path; /* from where it was written; owned */
    char *root; /* as of a part; owned */
};

static void named_file_free(struct named_file *named)
{
    free(named->path);
    free(named->root);
}

/* false, after saying so at that line, when no file can be read there. */
static bool find_file(const struct reading *at, const char *file, struct named_file *named)
{
    const struct ini_entry *entry = ini_entry(at->section, "file");
    const char *root = at->part->root;
    char *why = NULL;
    named->path = path_in(entry->folder, file);
    /* What stands on the command line, which has no lines, is the user's own wish. */
    named->root = entry->line ? copy_text(root) : root_of(named->path);
    if (access(named->path, R_OK) != 0)
        why = format_text("cannot open %s: %s", named->path, strerror(errno));
    else if (entry->line && !may_read(at->part->loader, named->path, root))
        why = format_text(LIES_OUTSIDE, named->path, root);
    if (!why) return true;
    refuse(at, "file", why);
    free(why);
    named_file_free(named);
    return false;
}

static bool load_mesh(const struct reading *at, void *data)
{
    struct mesh_section *s = data;
    struct placement own = placement_make(s->rotate, s->scale, s->translate);
    struct mesh mesh = {.placement = placement_compose(&at->part->placement, &own),
                        .crease = ini_entry(at->section, "smooth") ? s->crease : CREASE_OF_FILE};
    if (!resolve_material(at, &s->object, &mesh.material)) return false;
    if (!path_has_extension(s->file, ".obj"))
        return refuse(at, "file", "the name of a mesh has to end with .obj, without quotes");
    struct named_file named;
    if (!find_file(at, s->file, &named)) return false;
    mesh.path = named.path;
    mesh.root = named.root;
    bool good = load_obj(at->part, &mesh);
    named_file_free(&named);
    return good;
}

/* Whether the file may be included here: no file includes itself, and there is a limit. */
static bool may_include(const struct reading *at, const struct part *inner)
{
    int depth = 0;
    if (++inner->loader->include_count > INCLUDE_MAX_COUNT)
        return refuse(at, "file", "too many files are included, at most 65536 are possible");
    for (const struct part *part = inner->outer; part; part = part->outer) {
        if (strcmp(part->real_path, inner->real_path) == 0)
            return refuse(at, "file", "the file includes itself, expected another one");
        if (++depth > INCLUDE_MAX_DEPTH)
            return refuse(at, "file",
                          "includes are nested too deeply, at most 16 levels are possible");
    }
    return true;
}

static bool load_included_ini(struct part *part)
{
    struct ini ini;
    if (!ini_load(part->path, &ini)) return false;
    bool good = load_scene_sections(part, &ini);
    ini_free(&ini);
    return good;
}

static bool load_part(const struct reading *at, struct part *inner)
{
    if (!may_include(at, inner)) return false;
    if (path_has_extension(inner->path, ".nff")) return load_nff(inner);
    if (path_has_extension(inner->path, ".ini")) return load_included_ini(inner);
    if (path_has_extension(inner->path, ".obj"))
        return refuse(at, "file", "an OBJ file is no part to include, expected a [mesh] for it");
    return refuse(at, "file", "the name of an included file has to end with .ini or .nff");
}

void part_free(struct part *part)
{
    for (size_t i = 0; i < part->material_count; i++)
        free(part->materials[i].name);
    free(part->materials);
    free(part->real_path);
    free(part->root);
}

static bool load_include(const struct reading *at, void *data)
{
    struct include_section *s = data;
    struct placement own = placement_make(s->rotate, s->scale, s->translate);
    struct named_file named;
    if (!find_file(at, s->file, &named)) return false;
    struct part inner = {.loader = at->part->loader,
                         .outer = at->part,
                         .path = named.path,
                         .real_path = path_absolute(named.path),
                         .root = named.root,
                         .placement = placement_compose(&at->part->placement, &own)};
    bool good = load_part(at, &inner);
    part_free(&inner);
    free(named.path);
    return good;
}

/* ---- all sections of a file ---- */

#define KEYS(table) table, sizeof(table) / sizeof *(table)

/* Large enough for what any section is read into. */
union section_data {
    struct light light;
    struct material material;
    struct sphere_section sphere;
    struct plane_section plane;
    struct disc_section disc;
    struct triangle_section triangle;
    struct box_section box;
    struct cylinder_section cylinder;
    struct cone_section cone;
    struct mesh_section mesh;
    struct include_section include;
};

static const struct {
    struct section_kind kind;
    bool (*load)(const struct reading *at, void *data); /* NULL: materials, loaded before */
} kinds[] = {
    {{"light", KEYS(light_keys)}, load_light},
    {{"material", KEYS(material_keys)}, NULL},
    {{"sphere", KEYS(sphere_keys)}, load_sphere},
    {{"plane", KEYS(plane_keys)}, load_plane},
    {{"disc", KEYS(disc_keys)}, load_disc},
    {{"triangle", KEYS(triangle_keys)}, load_triangle},
    {{"box", KEYS(box_keys)}, load_box},
    {{"cylinder", KEYS(cylinder_keys)}, load_cylinder},
    {{"cone", KEYS(cone_keys)}, load_cone},
    {{"mesh", KEYS(mesh_keys)}, load_mesh},
    {{"include", KEYS(include_keys)}, load_include},
};
#define KIND_COUNT (sizeof kinds / sizeof *kinds)

const struct section_kind *scene_section_kind(size_t i)
{
    return i < KIND_COUNT ? &kinds[i].kind : NULL;
}

static size_t kind_index(const char *kind)
{
    size_t i = 0;
    while (i < KIND_COUNT && strcmp(kinds[i].kind.name, kind) != 0)
        i++;
    return i;
}

bool is_scene_section(const char *kind)
{
    return kind_index(kind) < KIND_COUNT;
}

static bool load_material(const struct reading *at, uint32_t *index)
{
    struct material material = {0};
    if (!*at->section->name)
        return refuse(at, "", "a material needs a name, expected [material NAME]");
    if (!read_section(at->ini, at->section, KEYS(material_keys), &material)) return false;
    warn_of_gain(&material, at->ini->file, at->section->line);
    return accept(at, builder_add_material(at->part->loader->builder, &material, index));
}

static int compare_materials(const void *a, const void *b)
{
    return strcmp(((const struct named_material *)a)->name,
                  ((const struct named_material *)b)->name);
}

/* All materials first, so that they may stand after their use. */
static bool load_materials(struct part *part, const struct ini *ini)
{
    part->materials = allocate(ini->count, sizeof *part->materials);
    for (size_t i = 0; i < ini->count; i++) {
        struct reading at = {part, ini, &ini->sections[i]};
        struct named_material *material = &part->materials[part->material_count];
        if (strcmp(at.section->kind, "material") != 0) continue;
        if (!load_material(&at, &material->index)) return false;
        material->name = copy_text(at.section->name);
        part->material_count++;
    }
    qsort(part->materials, part->material_count, sizeof *part->materials, compare_materials);
    return true;
}

static bool refuse_section(const struct ini *ini, const struct ini_section *section)
{
    struct nearest_name search = {.name = section->kind};
    for (size_t i = 0; i < SETTINGS_KEYS; i++) {
        if (strcmp(section->kind, settings_keys[i].section) == 0) {
            user_error(ini->file, section->line,
                       "settings such as [%s] belong into the file that is rendered, expected only "
                       "parts of a scene in an included file",
                       section->kind);
            return false;
        }
    }
    for (size_t i = 0; i < KIND_COUNT; i++)
        nearest_name_try(&search, kinds[i].kind.name);
    for (size_t i = 0; i < SETTINGS_KEYS; i++)
        nearest_name_try(&search, settings_keys[i].section);
    char *hint = search.best ? nearest_name_hint(&search)
                             : copy_text(", expected one that 'farm --help' lists");
    user_error(ini->file, section->line, "unknown section [%s]%s", section->kind, hint);
    free(hint);
    return false;
}

static bool load_section(const struct reading *at)
{
    size_t kind = kind_index(at->section->kind);
    if (kind == KIND_COUNT) return refuse_section(at->ini, at->section);
    if (!kinds[kind].load) return true;
    union section_data data;
    memset(&data, 0, sizeof data);
    const struct key *keys = kinds[kind].kind.keys;
    size_t count = kinds[kind].kind.count;
    bool good =
        read_section(at->ini, at->section, keys, count, &data) && kinds[kind].load(at, &data);
    keys_free(keys, count, &data);
    return good;
}

bool load_scene_sections(struct part *part, const struct ini *ini)
{
    if (!load_materials(part, ini)) return false;
    for (size_t i = 0; i < ini->count; i++) {
        struct reading at = {part, ini, &ini->sections[i]};
        /* The settings of CONFIG itself are dealt with elsewhere. */
        if (!part->outer && is_settings_section(at.section->kind)) continue;
        if (!load_section(&at)) return false;
    }
    return true;
}
