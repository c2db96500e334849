/* Reads MTL files (load_mtl.h): the statements that have a meaning here; others are skipped. */
#include "master/load_mtl.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "common/message.h"
#include "common/scene_check.h"
#include "master/loader.h"
#include "master/name_table.h"
#include "master/scan.h"
#include "master/text_file.h"

struct mtl_material {
    struct material material;
    double mirror; /* max(Ks): the reflection if illum says so */
    double illum;  /* illumination model; -1: not given */
    bool has_d;    /* d is given, which has precedence over Tr, whatever their order */
    long line;     /* of newmtl */
    long color_line;
    long no_ior_line; /* where Ni is set to 0; 0: nowhere */
};

struct material_library {
    struct name_table names; /* index in items of the latest definition of each name */
    struct mtl_material *items;
    uint32_t count;
};

/* The last illumination model that the format has. */
#define ILLUM_MAX 10

/* All keys that are read, and what their values have to be. */
static const struct {
    const char *word, *needs;
} keys[] = {
    {"newmtl", "a name"},
    {"Kd", "a colour: three numbers >= 0, or one for all three"},
    {"Ks", "a colour: three numbers >= 0, or one for all three"},
    {"Ns", "a number from 0 to " DIGITS(SHININESS_MAX)},
    {"Ni", "an index of refraction, a number >= 0"},
    {"d", "a number from 0 to 1"},
    {"Tr", "a number from 0 to 1"},
    {"illum", "a whole number from 0 to " DIGITS(ILLUM_MAX)},
};
#define KEYS (sizeof keys / sizeof *keys)

/* The index of refraction of a material that gives none: light is not bent, as in thin sheets, which are often modelled
 * so. */
#define NO_IOR 1

/* A file being read into a library. */
struct mtl {
    struct material_library *library;
    struct scan scan;
    /* Which warnings have been given: each is given once per file. */
    bool told_curve, told_halo, told_texture, told_emission, told_case, told_no_ior;
    bool told_gain, told_bright, told_twice;
    uint32_t first; /* the file's first item */
};

struct material_library *material_library_create(void)
{
    return allocate_zeroed(1, sizeof(struct material_library));
}

void material_library_destroy(struct material_library *library)
{
    name_table_free(&library->names);
    free(library->items);
    free(library);
}

const struct material *material_library_find(const struct material_library *library,
                                             const char *name)
{
    uint32_t index;
    return name_table_find(&library->names, name, &index) ? &library->items[index].material : NULL;
}

void material_library_try(const struct material_library *library, struct nearest_name *search)
{
    /* In the order of the file, as the hint may list them. A name that is defined several times is passed once. */
    const char **names = allocate_zeroed(library->count, sizeof *names);
    for (size_t i = 0; i < library->names.room; i++) {
        const struct name_entry *entry = &library->names.entries[i];
        if (entry->name) names[entry->value] = entry->name;
    }
    for (uint32_t i = 0; i < library->count; i++)
        if (names[i]) nearest_name_try(search, names[i]);
    free(names);
}

/* A name that an earlier file defines, too, is no mistake: a later library may override it. */
static void warn_of_second(struct mtl *mtl, const char *name)
{
    uint32_t earlier = 0;
    if (mtl->told_twice || !name_table_find(&mtl->library->names, name, &earlier)) return;
    if (earlier < mtl->first) return;
    user_warning(mtl->scan.path, mtl->scan.line,
                 "material '%s' is defined in line %ld, too; the last one counts", name,
                 mtl->library->items[earlier].line);
    mtl->told_twice = true;
}

static bool add_material(struct mtl *mtl)
{
    char name[MATERIAL_NAME_SIZE];
    struct material_library *library = mtl->library;
    scan_rest(&mtl->scan, name, sizeof name);
    if (library->count == UINT32_MAX) {
        user_error(mtl->scan.path, mtl->scan.line, "too many materials, expected less than 2^32");
        return false;
    }
    warn_of_second(mtl, name);
    library->items = grow(library->items, library->count, sizeof *library->items);
    name_table_set(&library->names, name, library->count);
    library->items[library->count++] = (struct mtl_material){.illum = -1,
                                                             .line = mtl->scan.line,
                                                             .material = {.color = {0.8, 0.8, 0.8},
                                                                          .ambient = 0.1,
                                                                          .diffuse = 1,
                                                                          .shininess = 20,
                                                                          .ior = NO_IOR}};
    return true;
}

/* Reads a colour: three numbers, or one number for all three components. false: invalid or negative. */
static bool read_numbers(struct scan *scan, struct vec3 *color)
{
    struct vec3 c;
    if (!scan_number(scan, &c.x)) return false;
    c.y = c.z = c.x;
    if (!scan_at_end(scan) && !(scan_number(scan, &c.y) && scan_number(scan, &c.z))) return false;
    *color = c;
    return c.x >= 0 && c.y >= 0 && c.z >= 0;
}

/* Reads a colour. One that is given as a spectral curve or in CIE XYZ is skipped with a warning and leaves *color
 * unchanged. */
static bool read_color(struct mtl *mtl, struct vec3 *color)
{
    bool curve = scan_take(&mtl->scan, "spectral");
    if (!curve && !scan_take(&mtl->scan, "xyz")) return read_numbers(&mtl->scan, color);
    if (!mtl->told_curve)
        user_warning(mtl->scan.path, mtl->scan.line,
                     "colours given as '%s' are left out, only red, green and blue are known",
                     curve ? "spectral" : "xyz");
    mtl->told_curve = true;
    return true;
}

static bool read_share(struct scan *scan, double *value)
{
    return scan_number(scan, value) && *value >= 0 && *value <= 1;
}

static bool read_opacity(struct mtl *mtl, struct mtl_material *m)
{
    double opacity;
    bool halo = scan_take(&mtl->scan, "-halo");
    if (!read_share(&mtl->scan, &opacity)) return false;
    if (halo && !mtl->told_halo) {
        user_warning(mtl->scan.path, mtl->scan.line,
                     "'-halo' is left out, 'd' is the same all over");
        mtl->told_halo = true;
    }
    m->material.transmission = 1 - opacity;
    m->has_d = true;
    return true;
}

static bool read_transparency(struct mtl *mtl, struct mtl_material *m)
{
    double share;
    if (!read_share(&mtl->scan, &share)) return false;
    if (!m->has_d) m->material.transmission = share;
    return true;
}

/* Reads Ni. Some programs write 0 if no index of refraction was set, so 0 counts as not given. */
static bool read_ior(struct scan *scan, struct mtl_material *m)
{
    double ior;
    if (!scan_number(scan, &ior) || !(ior >= 0)) return false;
    m->material.ior = ior > 0 ? ior : NO_IOR;
    m->no_ior_line = ior > 0 ? 0 : scan->line;
    return true;
}

static bool read_model(struct scan *scan, double *model)
{
    return scan_number(scan, model) && *model >= 0 && *model <= ILLUM_MAX &&
           *model == floor(*model);
}

/* Whether the statement names a texture: map_Kd, map_Bump and others, in upper or lower case, some without map_. */
static bool is_texture(const char *word)
{
    static const char *const others[] = {"bump", "disp", "decal", "norm", "refl"};
    bool found = strncasecmp(word, "map_", 4) == 0;
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        found |= strcasecmp(word, others[i]) == 0;
    return found;
}

/* Warns of Ke unless it is zero, as many programs write a zero Ke for every material. */
static void warn_of_emission(struct mtl *mtl)
{
    struct vec3 color;
    struct scan ahead = mtl->scan;
    if (mtl->told_emission || !read_numbers(&ahead, &color) || vec_is_zero(color)) return;
    user_warning(mtl->scan.path, mtl->scan.line,
                 "'Ke' is left out: surfaces give off no light of their own, lights alone do");
    mtl->told_emission = true;
}

/* Skips a statement without a meaning here. Those whose effect is missed in the picture are warned of: keys in the
 * wrong case, textures and emitted light. */
static void pass_over(struct mtl *mtl, const char *word)
{
    for (size_t i = 0; i < KEYS && !mtl->told_case; i++) {
        const char *key = keys[i].word;
        mtl->told_case = strcasecmp(word, key) == 0 && strcmp(word, key) != 0;
        if (mtl->told_case)
            user_warning(mtl->scan.path, mtl->scan.line, "'%s' is left out, did you mean '%s'?",
                         word, key);
    }
    if (strcmp(word, "Ke") == 0) warn_of_emission(mtl);
    if (mtl->told_texture || !is_texture(word)) return;
    user_warning(mtl->scan.path, mtl->scan.line,
                 "'%s' is left out: textures are not read, the color is used alone", word);
    mtl->told_texture = true;
}

static bool read_value(struct mtl *mtl, struct mtl_material *m, const char *word)
{
    struct scan *scan = &mtl->scan;
    struct material *material = &m->material;
    if (strcmp(word, "Kd") == 0) {
        m->color_line = scan->line;
        return read_color(mtl, &material->color);
    }
    if (strcmp(word, "Ns") == 0)
        return scan_number(scan, &material->shininess) && shininess_valid(material->shininess);
    if (strcmp(word, "Ni") == 0) return read_ior(scan, m);
    if (strcmp(word, "d") == 0) return read_opacity(mtl, m);
    if (strcmp(word, "Tr") == 0) return read_transparency(mtl, m);
    if (strcmp(word, "illum") == 0) return read_model(scan, &m->illum);
    if (strcmp(word, "Ks") != 0) return pass_over(mtl, word), true;
    struct vec3 color = vec3(0, 0, 0);
    if (!read_color(mtl, &color)) return false;
    m->mirror = vec_max(color);
    return true;
}

/* Warns of an Ni of 0 in a material that transmits light; in others it makes no difference. */
static void warn_of_no_ior(struct mtl *mtl, const struct mtl_material *m)
{
    if (mtl->told_no_ior || !m->no_ior_line || !(m->material.transmission > 0)) return;
    user_warning(mtl->scan.path, m->no_ior_line,
                 "'Ni' is 0 and counts as not given: light that is let through is not bent");
    mtl->told_no_ior = true;
}

/*
 * Completes the file's materials. Illumination models 0 and 1 have no highlight; from 3 on, the
 * reflection is as strong as the highlight. Ambient and diffuse light are scaled by 1 - transmission: a material that
 * hides next to nothing of what is behind it shows next to nothing of its own colour.
 */
static void finish(struct mtl *mtl)
{
    struct material_library *library = mtl->library;
    const char *path = mtl->scan.path, *others = ", as may others after it";
    for (size_t i = mtl->first; i < library->count; i++) {
        struct mtl_material *m = &library->items[i];
        if (m->illum < 0 || m->illum >= 2) m->material.specular = m->mirror;
        if (m->illum >= 3) m->material.reflection = fmin(m->mirror, 1);
        m->material.ambient *= 1 - m->material.transmission;
        m->material.diffuse *= 1 - m->material.transmission;
        if (!mtl->told_gain) mtl->told_gain = warn_of_gain(&m->material, path, m->line, others);
        if (!mtl->told_bright)
            mtl->told_bright = warn_of_bright_color(&m->material, path, m->color_line, others);
        warn_of_no_ior(mtl, m);
    }
}

/* word: one of the keys */
static bool refuse_value(const struct mtl *mtl, const char *word)
{
    size_t i = 0;
    while (i + 1 < KEYS && strcmp(word, keys[i].word) != 0)
        i++;
    if (mtl->scan.too_large)
        user_error(mtl->scan.path, mtl->scan.line, "'%s': " NUMBER_TOO_LARGE, word);
    else
        user_error(mtl->scan.path, mtl->scan.line, "'%s' needs %s", word, keys[i].needs);
    return false;
}

static bool read_lines(struct mtl *mtl)
{
    struct material_library *library = mtl->library;
    while (scan_next_line(&mtl->scan)) {
        char word[32];
        scan_word(&mtl->scan, word, sizeof word);
        if (strcmp(word, "newmtl") == 0) {
            if (!add_material(mtl)) return false;
        } else if (library->count == mtl->first) {
            pass_over(mtl, word);
        } else if (!read_value(mtl, &library->items[library->count - 1], word)) {
            return refuse_value(mtl, word);
        }
        mtl->scan.at += strcspn(mtl->scan.at, "\n");
    }
    finish(mtl);
    return true;
}

bool material_library_read(struct material_library *library, const char *path)
{
    struct text_file file;
    if (!text_file_read(path, SCENE_MAX_BYTES, &file)) return false;
    struct mtl mtl = {
        .library = library, .scan = scan_start(file.text, path, false), .first = library->count};
    bool good = read_lines(&mtl);
    text_file_free(&file);
    return good;
}
