/*
 * Reads Wavefront OBJ meshes: v, vn, f, usemtl and mtllib. Attributes that have no meaning here are skipped, lines,
 * points, curves and curved surfaces with one warning, unknown statements with another. As files can be large, they are
 * parsed in place, and no memory is allocated for single lines.
 */
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/message.h"
#include "master/faces.h"
#include "master/load_mtl.h"
#include "master/loader.h"
#include "master/name_table.h"
#include "master/nearest_name.h"
#include "master/path.h"
#include "master/placement.h"
#include "master/scan.h"
#include "master/text_file.h"
#include "master/triangulate.h"
#include "master/vertex_normals.h"

#define NONE UINT32_MAX

/* Unknown names of materials that are warned of one by one; of further ones only the number is reported. */
#define TOLD_NAMES 5

struct obj_corner {
    uint32_t vertex; /* in the builder */
    uint32_t normal; /* in the builder; NONE: it has none */
};

struct obj {
    const struct part *part;
    const struct mesh *mesh;
    struct builder *builder;
    struct scan scan;

    /* Index in the builder of this file's first vertex, and number of its vertices so far. */
    uint32_t first_vertex, vertex_count;
    uint32_t *normals; /* index in the builder of each normal of this file; NONE: not used */
    uint32_t normal_count;

    uint32_t material;                /* set by the last usemtl */
    struct name_table used;           /* index of the material for each name of usemtl */
    struct name_table libraries_seen; /* paths that were read, and names that are missing */
    struct material_library *library;
    uint32_t unknown_names;
    bool library_missing;
    bool told_not_finite, told_drawn, told_unknown; /* warnings that have been given */

    struct obj_corner *corners; /* of the present face */
    struct vec3 *points;
    size_t corner_count, corner_room;
    struct triangulation triangulation;

    struct triangle *plain; /* triangles with a corner that has no normal */
    size_t plain_count;
    struct faces faces;
};

static bool refuse(const struct obj *obj, const char *text)
{
    user_error(obj->mesh->path, obj->scan.line, "%s",
               obj->scan.too_large ? NUMBER_TOO_LARGE : text);
    return false;
}

static bool accept(const struct obj *obj, const char *why)
{
    return !why || refuse(obj, why);
}

/* The same for what has a place: the message also says what places it. */
static bool accept_placed(const struct obj *obj, const char *why)
{
    if (!why) return true;
    char *text = why_placed(why, &obj->mesh->placed);
    refuse(obj, text);
    free(text);
    return false;
}

/* ---- vertices and normals ---- */

static bool read_vertex(struct obj *obj)
{
    struct vec3 point;
    double ignored;
    if (!scan_vector(&obj->scan, &point)) return refuse(obj, "'v' needs three finite numbers");
    /* A weight or a colour may follow, which is ignored. */
    for (int i = 0; i < 4 && !scan_at_end(&obj->scan); i++)
        if (!scan_number(&obj->scan, &ignored))
            return refuse(obj, "'v' needs three to seven finite numbers");
    if (!scan_at_end(&obj->scan)) return refuse(obj, "'v' needs three to seven finite numbers");
    uint32_t index;
    obj->vertex_count++;
    return accept_placed(
        obj,
        builder_add_vertex(obj->builder, placement_point(&obj->mesh->placement, point), &index));
}

/* Reads three numbers that are not all finite. */
static bool skip_normal(struct obj *obj)
{
    bool finite = true;
    double ignored;
    for (int i = 0; i < 3; i++) {
        bool skipped = scan_not_finite(&obj->scan);
        if (!skipped && !scan_number(&obj->scan, &ignored)) return false;
        finite &= !skipped;
    }
    if (finite || !scan_at_end(&obj->scan)) return false;
    if (!obj->told_not_finite)
        user_warning(obj->mesh->path, obj->scan.line,
                     "normals that are not finite count as none, the first one here");
    obj->told_not_finite = true;
    return true;
}

/* Zero normals, and those that are not finite, which some programs write for faces without an area, count as none, as
 * do all normals of a mesh that is to be flat. */
static bool read_normal(struct obj *obj)
{
    struct vec3 normal;
    struct scan start = obj->scan;
    if (!scan_vector(&obj->scan, &normal) || !scan_at_end(&obj->scan)) {
        obj->scan = start;
        if (!skip_normal(obj)) return refuse(obj, "'vn' needs three finite numbers");
        normal = vec3(0, 0, 0);
    }
    if (obj->normal_count == UINT32_MAX)
        return refuse(obj, "too many normals, at most 2^32 - 1 are possible");
    obj->normals = grow(obj->normals, obj->normal_count, sizeof *obj->normals);
    uint32_t *index = &obj->normals[obj->normal_count++];
    *index = NONE;
    if (vec_is_zero(normal) || obj->mesh->crease == 0) return true;
    return accept_placed(obj, builder_add_normal(obj->builder,
                                                 placement_direction(&obj->mesh->placement, normal),
                                                 index));
}

/* ---- faces ---- */

/*
 * Reads an index and converts it to one that counts from 0. In the file it counts from 1, or if negative backwards from
 * the latest item, which is -1. false if it is no whole number or refers to nothing that has been defined.
 */
static bool read_index(struct scan *scan, uint32_t count, uint32_t *index)
{
    const char *at = scan->at;
    bool back = *at == '-';
    if (back) at++;
    uint64_t number = 0;
    const char *digits = at;
    for (; (unsigned char)(*at - '0') < 10; at++)
        if (number <= UINT32_MAX) number = number * 10 + (uint64_t)(*at - '0');
    if (at == digits || number < 1 || number > count) return false;
    scan->at = at;
    *index = (uint32_t)(back ? count - number : number - 1);
    return true;
}

/* Skips the texture's index, which has no effect but must be a whole number or empty. */
static bool skip_texture_index(struct scan *scan)
{
    bool back = *scan->at == '-';
    if (back) scan->at++;
    const char *digits = scan->at;
    while ((unsigned char)(*scan->at - '0') < 10)
        scan->at++;
    return !back || scan->at > digits;
}

static bool at_end_of_corner(const struct scan *scan)
{
    return strchr(" \t\r\n#\\", *scan->at);
}

/* Reads a corner: v, v/t, v//n or v/t/n; also v/, v// or v/t/, as some programs write the slashes of missing
 * indices. */
static bool read_corner(struct obj *obj, struct obj_corner *corner)
{
    struct scan *scan = &obj->scan;
    uint32_t vertex, normal;
    if (!read_index(scan, obj->vertex_count, &vertex)) return false;
    *corner = (struct obj_corner){obj->first_vertex + vertex, NONE};
    if (*scan->at != '/') return true;
    scan->at++;
    if (!skip_texture_index(scan)) return false;
    if (*scan->at != '/') return true;
    scan->at++;
    if (at_end_of_corner(scan)) return true;
    if (!read_index(scan, obj->normal_count, &normal)) return false;
    corner->normal = obj->normals[normal];
    return true;
}

static void make_corner_room(struct obj *obj)
{
    if (obj->corner_count < obj->corner_room) return;
    obj->corner_room = obj->corner_room ? 2 * obj->corner_room : 16;
    obj->corners = reallocate(obj->corners, obj->corner_room, sizeof *obj->corners);
    obj->points = reallocate(obj->points, obj->corner_room, sizeof *obj->points);
}

/* Whether text is an index beyond the `count` defined items. */
static bool is_beyond(const char *text, uint32_t count)
{
    if (*text == '-') text++;
    size_t digits = strspn(text, "0123456789");
    return digits && (text[digits] == '\0' || text[digits] == '/') &&
           strtoull(text, NULL, 10) > count;
}

static bool refuse_index(const struct obj *obj, const char *word, bool normal)
{
    uint32_t count = normal ? obj->normal_count : obj->vertex_count;
    user_error(obj->mesh->path, obj->scan.line,
               "'%s' names a %s that is not there, only %u %s defined so far", word,
               normal ? "normal" : "vertex", count, count == 1 ? "is" : "are");
    return false;
}

static bool refuse_corner(struct obj *obj)
{
    char word[256];
    scan_word(&obj->scan, word, sizeof word);
    const char *slash = strchr(word, '/'), *last = strrchr(word, '/');
    if (is_beyond(word, obj->vertex_count)) return refuse_index(obj, word, false);
    if (last != slash && is_beyond(last + 1, obj->normal_count))
        return refuse_index(obj, word, true);
    user_error(obj->mesh->path, obj->scan.line,
               "'%s' is no corner of a face, expected indices of defined vertices such as "
               "1, 1/2, 1//3 or 1/2/3",
               word);
    return false;
}

static bool read_corners(struct obj *obj)
{
    obj->corner_count = 0;
    while (!scan_at_end(&obj->scan)) {
        if (obj->corner_count == POLYGON_MAX_CORNERS)
            return refuse(obj, "the face has too many corners, at most " DIGITS(
                                   POLYGON_MAX_CORNERS) " are possible");
        make_corner_room(obj);
        const char *start = obj->scan.at;
        if (!read_corner(obj, &obj->corners[obj->corner_count]) || !at_end_of_corner(&obj->scan)) {
            obj->scan.at = start;
            return refuse_corner(obj);
        }
        obj->corner_count++;
    }
    return obj->corner_count >= 3 || refuse(obj, "'f' needs at least three corners");
}

static const char *add_plain(struct obj *obj, const struct triangle *triangle)
{
    if (obj->plain_count == PRIMITIVE_MAX_COUNT) return "too many faces, at most 2^28 are possible";
    obj->plain = grow(obj->plain, obj->plain_count, sizeof *obj->plain);
    obj->plain[obj->plain_count++] = *triangle;
    return NULL;
}

static const char *add_triangle(struct obj *obj, const uint32_t index[3])
{
    const struct obj_corner *a = &obj->corners[index[0]], *b = &obj->corners[index[1]],
                            *c = &obj->corners[index[2]];
    struct triangle triangle = {{a->vertex, b->vertex, c->vertex}, obj->material};
    if (a->normal == NONE || b->normal == NONE || c->normal == NONE)
        return add_plain(obj, &triangle);
    struct patch patch = {
        {a->vertex, b->vertex, c->vertex}, {a->normal, b->normal, c->normal}, obj->material};
    return builder_add_patch(obj->builder, &patch);
}

static bool read_triangle(struct obj *obj)
{
    static const uint32_t all[3] = {0, 1, 2};
    struct vec3 point[3];
    for (int i = 0; i < 3; i++)
        point[i] = builder_vertex(obj->builder, obj->corners[i].vertex);
    faces_note_triangle(&obj->faces, point, obj->scan.line);
    return accept_placed(obj, add_triangle(obj, all));
}

static bool read_face(struct obj *obj)
{
    if (!read_corners(obj)) return false;
    if (obj->corner_count == 3) return read_triangle(obj);
    for (size_t i = 0; i < obj->corner_count; i++)
        obj->points[i] = builder_vertex(obj->builder, obj->corners[i].vertex);
    struct triangulation *triangles = &obj->triangulation;
    if (!accept(obj, triangulate(obj->points, obj->corner_count, triangles))) return false;
    faces_note_polygon(&obj->faces, obj->points, triangles, obj->mesh->path, obj->scan.line);
    for (size_t i = 0; i < triangles->count; i++)
        if (!accept_placed(obj, add_triangle(obj, triangles->triangles[i]))) return false;
    return true;
}

/* ---- materials ---- */

static bool is_known(const struct name_table *names, const char *name)
{
    uint32_t ignored;
    return name_table_find(names, name, &ignored);
}

/* Reads an MTL file unless it has been read before. false after reporting an error. */
static bool read_library_once(struct obj *obj, const char *path, bool is_regular)
{
    if (!is_regular) {
        user_error(obj->mesh->path, obj->scan.line,
                   "'%s' is no regular file, expected a file of materials", path);
        return false;
    }
    if (!may_read(obj->part->loader, path, obj->mesh->root)) {
        user_error(obj->mesh->path, obj->scan.line, LIES_OUTSIDE, path, obj->mesh->root);
        return false;
    }
    if (faccessat(AT_FDCWD, path, R_OK, AT_EACCESS) != 0) {
        user_error(obj->mesh->path, obj->scan.line, "cannot open %s: %s", path, strerror(errno));
        return false;
    }
    /* The resolved path, so that another path to the same file is recognised. */
    char *file = path_absolute(path);
    bool known = is_known(&obj->libraries_seen, file);
    if (!known) name_table_set(&obj->libraries_seen, file, 0);
    free(file);
    if (known) return true;
    name_table_free(&obj->used); /* the file may redefine names that usemtl has looked up */
    note_source(obj->part->loader, path);
    return material_library_read(obj->library, path);
}

/* false if there is no such file; *good is false after an error in it. */
static bool try_library(struct obj *obj, const char *name, bool *good)
{
    char *folder = path_folder(obj->mesh->path), *path = path_in(folder, name);
    struct stat status;
    bool there = stat(path, &status) == 0;
    if (there) *good = read_library_once(obj, path, S_ISREG(status.st_mode));
    free(folder);
    free(path);
    return there;
}

static void warn_of_missing_library(struct obj *obj, const char *name)
{
    name_table_set(&obj->libraries_seen, name, 0);
    user_warning(obj->mesh->path, obj->scan.line, "the material file '%s' is missing", name);
    obj->library_missing = true;
}

/* Reads mtllib. As file names with blanks are common, the whole rest of the line is tried as a name first, then each of
 * its words up to a comment. */
static bool read_library(struct obj *obj)
{
    char line[4096];
    bool good = true;
    if (!scan_rest(&obj->scan, line, sizeof line))
        return refuse(obj, "'mtllib' needs the name of a file");
    if (try_library(obj, line, &good)) return good;
    char *rest = line;
    for (char *word; good && (word = strtok_r(rest, " \t", &rest));) {
        if (try_library(obj, word, &good)) continue;
        if (*word == '#' && word != line) return true; /* the first word is always a name */
        if (!is_known(&obj->libraries_seen, word)) warn_of_missing_library(obj, word);
    }
    return good;
}

/* Warns that no material has this name, which one the faces get instead, and suggests what may have been meant. */
static void warn_of_unknown_name(const struct obj *obj, const char *name)
{
    const struct loader *loader = obj->part->loader;
    bool grey = loader->has_default_material && obj->mesh->material == loader->default_material;
    struct nearest_name search = {.name = name};
    try_materials(obj->part, &search);
    material_library_try(obj->library, &search);
    char *hint = nearest_name_hint(&search);
    user_warning(obj->mesh->path, obj->scan.line, "no material is called '%s', %s is used%s", name,
                 grey ? "grey" : "the mesh's own", hint);
    free(hint);
}

/* Sets *index to the material of this name, or to the mesh's own if there is none. [material] sections of INI files
 * have precedence over MTL files. */
static bool look_up(struct obj *obj, const char *name, uint32_t *index)
{
    if (find_material(obj->part, name, index)) return true;
    const struct material *found = material_library_find(obj->library, name);
    if (found) {
        struct material material = *found;
        return amend_material(obj->part->loader, name, &material) &&
               accept(obj, builder_add_material(obj->builder, &material, index));
    }
    *index = obj->mesh->material;
    /* A missing library has been warned of already. */
    if (*name && !obj->library_missing && obj->unknown_names++ < TOLD_NAMES)
        warn_of_unknown_name(obj, name);
    return true;
}

/* Some programs write no name for faces without a material. */
static bool use_material(struct obj *obj)
{
    char name[MATERIAL_NAME_SIZE];
    scan_rest(&obj->scan, name, sizeof name);
    if (name_table_find(&obj->used, name, &obj->material)) return true;
    if (!look_up(obj, name, &obj->material)) return false;
    name_table_set(&obj->used, name, obj->material);
    return true;
}

/* false after reporting a material of which arguments set keys but which no MTL file defines. */
static bool amended_found(const struct obj *obj)
{
    const struct ini *amended = &obj->part->loader->amended;
    for (size_t i = 0; i < amended->count; i++) {
        const struct ini_section *section = &amended->sections[i];
        if (material_library_find(obj->library, section->name)) continue;
        struct nearest_name search = {.name = section->name};
        material_library_try(obj->library, &search);
        char *hint = nearest_name_hint(&search);
        user_error(section->entries[0].file, 0, "%s has no material '%s'%s", obj->mesh->path,
                   section->name, hint);
        free(hint);
        return false;
    }
    return true;
}

/* ---- the file ---- */

/* Attributes and what belongs to curves, and what would be drawn; each list ends with NULL. */
static const char *const harmless[] = {
    "vt",       "vp",       "o",    "g",     "s",      "mg",         "bevel",
    "c_interp", "d_interp", "lod",  "ctech", "stech",  "shadow_obj", "trace_obj",
    "cstype",   "deg",      "bmat", "step",  "parm",   "trim",       "hole",
    "scrv",     "sp",       "end",  "con",   "usemap", "maplib",     NULL};
static const char *const drawn[] = {"l", "p", "curv", "curv2", "surf", NULL};

static bool is_among(const char *const *words, const char *word)
{
    while (*words && strcmp(*words, word) != 0)
        words++;
    return *words;
}

static void warn_of_left_out(struct obj *obj, const char *word)
{
    bool is_drawn = is_among(drawn, word);
    bool *told = is_drawn ? &obj->told_drawn : &obj->told_unknown;
    if (*told) return;
    *told = true;
    if (is_drawn)
        user_warning(obj->mesh->path, obj->scan.line,
                     "'%s' is left out: lines, points, curves and curved surfaces are not rendered",
                     word);
    else
        user_warning(obj->mesh->path, obj->scan.line,
                     "unknown statement '%s' is left out, as are others after it", word);
}

static bool pass_over(struct obj *obj)
{
    char word[32], ignored[2];
    scan_word(&obj->scan, word, sizeof word);
    if (!is_among(harmless, word)) warn_of_left_out(obj, word);
    while (scan_word(&obj->scan, ignored, sizeof ignored)) {
    }
    return true;
}

/* The frequent ones first. */
static const struct {
    const char *word;
    bool (*read)(struct obj *obj);
} statements[] = {
    {"v", read_vertex},       {"vn", read_normal},      {"f", read_face},
    {"usemtl", use_material}, {"mtllib", read_library},
};

static bool read_statement(struct obj *obj)
{
    for (size_t i = 0; i < sizeof statements / sizeof *statements; i++)
        if (scan_take(&obj->scan, statements[i].word)) return statements[i].read(obj);
    return pass_over(obj);
}

static bool read_all(struct obj *obj)
{
    while (scan_next_line(&obj->scan))
        if (!read_statement(obj)) return false;
    if (obj->unknown_names > TOLD_NAMES)
        user_warning(obj->mesh->path, 0, "%u more names of materials are not known",
                     obj->unknown_names - TOLD_NAMES);
    if (obj->faces.count == 0) {
        user_error(obj->mesh->path, 0, "has no faces, expected a mesh with at least one 'f'");
        return false;
    }
    faces_warn_of_flat(&obj->faces, obj->mesh->path);
    double crease = fmax(obj->mesh->crease, 0);
    return amended_found(obj) && accept_placed(obj, add_smooth_triangles(obj->builder, obj->plain,
                                                                         obj->plain_count, crease));
}

bool load_obj(const struct part *part, const struct mesh *mesh)
{
    struct text_file file;
    if (!text_file_read(mesh->path, SCENE_MAX_BYTES, &file)) return false;
    struct obj obj = {.part = part,
                      .mesh = mesh,
                      .builder = part->loader->builder,
                      .material = mesh->material,
                      .library = material_library_create(),
                      .scan = scan_start(file.text, mesh->path, true)};
    obj.first_vertex = builder_vertex_count(obj.builder);
    bool good = read_all(&obj);
    material_library_destroy(obj.library);
    triangulation_free(&obj.triangulation);
    free(obj.normals);
    name_table_free(&obj.used);
    name_table_free(&obj.libraries_seen);
    free(obj.corners);
    free(obj.points);
    free(obj.plain);
    text_file_free(&file);
    return good;
}
