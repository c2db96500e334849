/*
 * Loads the scene sections of an INI file. Each is read into its structure by means of its table of keys
 * (scene_sections.h), then added to the scene: lights and objects by load_objects.c, materials by load_materials.c,
 * meshes and included files here.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/message.h"
#include "master/load_objects.h"
#include "master/path.h"
#include "master/placement.h"
#include "master/sections.h"

/* ---- other files ---- */

/* The file that a section names by its key `file`. */
struct named_file {
    char *path; /* with the folder of the file that names it; owned */
    char *root; /* as of struct part; owned */
};

static void named_file_free(struct named_file *named)
{
    free(named->path);
    free(named->root);
}

/* What may be wrong with the name of a file that cannot be opened, as text behind the reason; the caller frees it.
 * path: NULL where no other file is looked for. */
static char *hint_of_file(const struct ini_entry *entry, const char *file, const char *path)
{
    if (entry->line && is_quoted(file)) return copy_text(QUOTES_HINT);
    const char *comment = entry->line ? comment_hint(file) : "";
    char *near = path && !*comment ? nearest_file(path) : NULL;
    char *folder = path_folder(file); /* as it was typed */
    char *hint =
        near ? format_text(", did you mean '%s%s'?", folder, path_name(near)) : copy_text(comment);
    free(folder);
    free(near);
    return hint;
}

/* Text that says why the file cannot be opened, and also if it would lie outside of the root; the caller frees it. */
static char *why_not_open(const struct reading *at, const struct ini_entry *entry, const char *file,
                          const struct named_file *named)
{
    const struct part *part = at->part;
    const char *reason = strerror(errno);
    bool may = !entry->line || part->loader->reach == REACH_ANYWHERE ||
               path_would_be_within(named->path, part->root);
    char *hint = hint_of_file(entry, file, may ? named->path : NULL);
    char *why = may ? format_text("cannot open %s: %s%s", named->path, reason, hint)
                    : format_text("cannot open %s: %s%s; that is outside of the scene's folder %s, "
                                  "too, expected a file in it (farm --allow-outside reads any)",
                                  named->path, reason, hint, part->root);
    free(hint);
    return why;
}

/* Sets *named to the file that a section names, which the caller frees. false after reporting that it cannot be
 * read. */
static bool find_file(const struct reading *at, const char *file, struct named_file *named)
{
    const struct ini_entry *entry = ini_entry(at->section, "file");
    const char *root = at->part->root;
    char *why = NULL;
    named->path = path_in(entry->folder, file);
    /* line is 0: the user has named the file on the command line, which may be anywhere. */
    bool is_root_own = !entry->line && !path_is_within(named->path, root);
    named->root = is_root_own ? root_of(named->path) : copy_text(root);
    if (access(named->path, R_OK) != 0)
        why = why_not_open(at, entry, file, named);
    else if (entry->line && !may_read(at->part->loader, named->path, root))
        why = format_text(LIES_OUTSIDE, named->path, root);
    if (!why) {
        note_source(at->part->loader, named->path);
        return true;
    }
    refuse_section_key(at, "file", why);
    free(why);
    named_file_free(named);
    return false;
}

static bool refuse_mesh_name(const struct reading *at, const char *file)
{
    char *why = *file ? format_text("the name of a mesh has to end with .obj%s%s",
                                    is_quoted(file) ? ", without quotes" : "", comment_hint(file))
                      : copy_text("no file is named, expected an OBJ file");
    refuse_section_key(at, "file", why);
    free(why);
    return false;
}

/* The key of this section that can have made values infinite or zero; that of an outer section if none here can. */
static struct placed placed_by(const struct reading *at, double scale, struct vec3 translate)
{
    bool moves = translate.x != 0 || translate.y != 0 || translate.z != 0;
    const char *key = scale != 1 ? "scale" : moves ? "translate" : NULL;
    if (!key) return at->part->placed;
    return (struct placed){key, ini_place_of(at->ini, at->section, key)};
}

static bool load_mesh(const struct reading *at, void *data)
{
    struct mesh_section *s = data;
    struct placement own = placement_make(s->rotate, s->scale, s->translate);
    struct mesh mesh = {.placement = placement_compose(&at->part->placement, &own),
                        .placed = placed_by(at, s->scale, s->translate),
                        .crease = ini_entry(at->section, "smooth") ? s->crease : CREASE_OF_FILE};
    if (!resolve_material(at, &s->object, &mesh.material)) return false;
    if (!path_has_extension(s->file, ".obj")) return refuse_mesh_name(at, s->file);
    struct named_file named;
    if (!find_file(at, s->file, &named)) return false;
    mesh.path = named.path;
    mesh.root = named.root;
    bool good = load_obj(at->part, &mesh);
    named_file_free(&named);
    return good;
}

/* The number of files is limited besides the depth: where each file includes the next one twice, it grows exponentially
 * with the depth. */
#define INCLUDE_MAX_DEPTH 16
#define INCLUDE_MAX_COUNT 65536

/* false after reporting that the file includes itself, or that there are too many or too deeply nested includes. */
static bool may_include(const struct reading *at, const struct part *inner)
{
    int depth = 0;
    if (++inner->loader->include_count > INCLUDE_MAX_COUNT)
        return refuse_section_key(
            at, "file",
            "too many files are included, at most " DIGITS(INCLUDE_MAX_COUNT) " are possible");
    for (const struct part *part = inner->outer; part; part = part->outer) {
        if (strcmp(part->real_path, inner->real_path) == 0)
            return refuse_section_key(at, "file", "the file includes itself, expected another one");
        if (++depth > INCLUDE_MAX_DEPTH)
            return refuse_section_key(at, "file",
                                      "includes are nested too deeply, at most " DIGITS(
                                          INCLUDE_MAX_DEPTH) " levels are possible");
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
        return refuse_section_key(at, "file",
                                  "an OBJ file is no part to include, expected a [mesh] for it");
    return refuse_section_key(at, "file",
                              "the name of an included file has to end with .ini or .nff");
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
    if (!*s->file)
        return refuse_section_key(at, "file", "no file is named, expected an INI or NFF file");
    if (!find_file(at, s->file, &named)) return false;
    struct part inner = {.loader = at->part->loader,
                         .outer = at->part,
                         .path = named.path,
                         .real_path = path_absolute(named.path),
                         .root = named.root,
                         .placement = placement_compose(&at->part->placement, &own),
                         .placed = placed_by(at, s->scale, s->translate)};
    bool good = load_part(at, &inner);
    part_free(&inner);
    free(named.path);
    return good;
}

/* ---- all sections of a file ---- */

static bool (*const loaders[SCENE_SECTIONS])(const struct reading *at, void *data) = {
    [SECTION_LIGHT] = load_light,       [SECTION_SPHERE] = load_sphere,
    [SECTION_PLANE] = load_plane,       [SECTION_DISC] = load_disc,
    [SECTION_TRIANGLE] = load_triangle, [SECTION_BOX] = load_box,
    [SECTION_CYLINDER] = load_cylinder, [SECTION_CONE] = load_cone,
    [SECTION_MESH] = load_mesh,         [SECTION_INCLUDE] = load_include,
    /* Materials have been loaded before. */
};

static bool refuse_section(const struct ini *ini, const struct ini_section *section)
{
    if (is_settings_section(section->kind)) {
        user_error(ini->file, section->line,
                   "settings such as [%s] belong into the file that is rendered, expected only "
                   "parts of a scene in an included file",
                   section->kind);
        return false;
    }
    char *hint = section_hint(section->kind);
    user_error(ini->file, section->line, "unknown section [%s]%s", section->kind, hint);
    free(hint);
    return false;
}

static bool load_section(const struct reading *at)
{
    enum scene_section kind = scene_section_of(at->section->kind);
    if (kind == SCENE_SECTIONS) return refuse_section(at->ini, at->section);
    if (!loaders[kind]) return true;
    union section_data data;
    memset(&data, 0, sizeof data);
    const struct section_kind *keys = scene_section_kind(kind);
    bool good = read_section(at->ini, at->section, keys->keys, keys->count, &data) &&
                loaders[kind](at, &data);
    keys_free(keys->keys, keys->count, &data);
    return good;
}

/* Appends a loaded section to the loader's list. The sections of an included file precede the one that includes it. So
 * a primitive belongs to the first section whose end is above its index. */
static void note_section(struct loader *loader, const char *file, long line)
{
    loader->sections = grow(loader->sections, loader->section_count, sizeof *loader->sections);
    struct loaded_section *section = &loader->sections[loader->section_count++];
    *section = (struct loaded_section){.file = file, .line = line};
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        section->end[kind] = builder_kind_count(loader->builder, (enum primitive_kind)kind);
}

bool load_scene_sections(struct part *part, const struct ini *ini)
{
    if (!load_materials(part, ini)) return false;
    const char *file = keep_path(part->loader, ini->file);
    for (size_t i = 0; i < ini->count; i++) {
        struct reading at = {part, ini, &ini->sections[i]};
        /* read_settings() reads those of CONFIG. */
        if (!part->outer && is_settings_section(at.section->kind)) continue;
        if (!load_section(&at)) return false;
        note_section(part->loader, file, at.section->line);
    }
    return true;
}
