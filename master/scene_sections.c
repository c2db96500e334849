#include "master/scene_sections.h"

#include <math.h>
#include <string.h>

#include "common/scene_check.h"

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
    {"material", "shininess", VALUE_NUMBER, AT(material, shininess), .min = 0, .max = SHININESS_MAX,
     .fallback = "20", .help = "exponent of the highlight, larger is smaller"},
    {"material", "reflection", VALUE_NUMBER, AT(material, reflection), .min = 0, .max = 1,
     .fallback = "0", .help = "share of light that is mirrored"},
    {"material", "transmission", VALUE_NUMBER, AT(material, transmission), .min = 0, .max = 1,
     .fallback = "0", .help = "share of light that passes through"},
    {"material", "ior", VALUE_NUMBER, AT(material, ior), ANY_ABOVE_0, .fallback = "1.5",
     .help = "index of refraction (water 1.33, glass 1.5; the world outside has 1)"},
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
     .help = "no: flat; yes, or a largest angle in degrees: round edges up to it, of faces "
             "without normals in the file (default: the file's own normals)"},
};

static const struct key include_keys[] = {
    {"include", "file", VALUE_TEXT, AT(include_section, file), REQUIRED,
     .help = "an INI or NFF file"},
    PLACEMENT_KEYS("include", include_section),
};

#define KEYS(table) table, sizeof(table) / sizeof *(table)

static const struct section_kind kinds[SCENE_SECTIONS] = {
    [SECTION_LIGHT] = {"light", KEYS(light_keys)},
    [SECTION_MATERIAL] = {"material", KEYS(material_keys)},
    [SECTION_SPHERE] = {"sphere", KEYS(sphere_keys)},
    [SECTION_PLANE] = {"plane", KEYS(plane_keys)},
    [SECTION_DISC] = {"disc", KEYS(disc_keys)},
    [SECTION_TRIANGLE] = {"triangle", KEYS(triangle_keys)},
    [SECTION_BOX] = {"box", KEYS(box_keys)},
    [SECTION_CYLINDER] = {"cylinder", KEYS(cylinder_keys)},
    [SECTION_CONE] = {"cone", KEYS(cone_keys)},
    [SECTION_MESH] = {"mesh", KEYS(mesh_keys)},
    [SECTION_INCLUDE] = {"include", KEYS(include_keys)},
};

const struct section_kind *scene_section_kind(size_t i)
{
    return i < SCENE_SECTIONS ? &kinds[i] : NULL;
}

enum scene_section scene_section_of(const char *name)
{
    enum scene_section kind = 0;
    while (kind < SCENE_SECTIONS && strcmp(kinds[kind].name, name) != 0)
        kind++;
    return kind;
}
