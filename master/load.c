/*
 * Loads CONFIG and the overrides into a job. A scene file (.nff or .obj) that is given as CONFIG is treated as an INI
 * file with a section that names it, and sections for the lights of an OBJ file.
 */
#include "master/load.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/message.h"
#include "master/framing.h"
#include "master/loader.h"
#include "master/path.h"

/* ---- the loader's memory ---- */

const char *keep_path(struct loader *loader, const char *path)
{
    loader->paths = grow(loader->paths, loader->path_count, sizeof *loader->paths);
    return loader->paths[loader->path_count++] = copy_text(path);
}

void note_source(struct loader *loader, const char *path)
{
    struct stat status;
    if (stat(path, &status) != 0) return; /* reading it will fail, which is reported there */
    loader->sources = grow(loader->sources, loader->source_count, sizeof *loader->sources);
    loader->sources[loader->source_count++] =
        (struct source){keep_path(loader, path), status.st_dev, status.st_ino};
}

bool may_read(const struct loader *loader, const char *path, const char *root)
{
    return loader->reach == REACH_ANYWHERE || path_is_within(path, root);
}

char *root_of(const char *path)
{
    char *folder = path_directory(path), *root = path_absolute(folder);
    free(folder);
    return root;
}

char *why_placed(const char *why, const struct placed *placed)
{
    const struct ini_place *at = &placed->place;
    if (!placed->key) return copy_text(why);
    if (at->line == 0) return format_text("%s (after %s of %s)", why, placed->key, at->file);
    return format_text("%s (after %s of %s:%ld)", why, placed->key, at->file, at->line);
}

void loader_free(struct loader *loader)
{
    for (size_t i = 0; i < loader->path_count; i++)
        free(loader->paths[i]);
    free(loader->paths);
    free(loader->sections);
    free(loader->sources);
}

/* ---- the names of outputs ---- */

/* The picture's name with another extension. */
static char *name_beside(const char *image, const char *extension)
{
    const char *dot = strrchr(image, '.');
    int length = dot && !strchr(dot, '/') ? (int)(dot - image) : (int)strlen(image);
    return format_text("%.*s%s", length, image, extension);
}

/* The picture in the current folder, report and journal beside the picture, wherever that is. */
static void name_outputs(struct settings *settings, const char *config)
{
    if (!settings->output.image) {
        char *stem = path_stem(config);
        settings->output.image = format_text("%s.png", stem);
        free(stem);
    }
    if (!settings->output.report)
        settings->output.report = name_beside(settings->output.image, ".json");
    if (!settings->output.journal)
        settings->output.journal = name_beside(settings->output.image, ".journal");
}

/* ---- the job ---- */

static bool refuse_config(const char *path)
{
    struct stat status;
    char *ini = format_text("%s.ini", path);
    int missing = stat(path, &status) == 0 ? 0 : errno;
    if (!missing && S_ISDIR(status.st_mode))
        user_error(path, 0, "is a folder, expected a scene: .ini, .nff or .obj");
    else if (access(ini, R_OK) == 0)
        user_error(path, 0, "is no scene, did you mean '%s'?", ini);
    else if (missing)
        user_error(path, 0, "cannot be opened: %s; expected a scene: .ini, .nff or .obj",
                   strerror(missing));
    else
        user_error(path, 0, "has an unknown extension, expected .ini, .nff or .obj");
    free(ini);
    return false;
}

static bool refuse_unreadable(const char *path)
{
    const char *reason = strerror(errno);
    char *near = nearest_file(path);
    if (near)
        user_error(path, 0, "cannot be opened: %s, did you mean '%s'?", reason, near);
    else
        user_error(path, 0, "cannot be opened: %s", reason);
    free(near);
    return false;
}

/* A file without any section is refused: it has been truncated or never written. */
static bool read_ini(const char *path, struct ini *ini)
{
    if (!ini_load(path, ini)) return false;
    if (ini->count) return true;
    user_error(path, 0, "has no sections, expected a scene with at least one");
    ini_free(ini);
    return false;
}

/* The document of an OBJ file has a section for the mesh, then this many for lights, then one for each material of its
 * MTL files of which arguments set keys. */
#define SHOULDER_LIGHTS 2

/* Adds the section that names the file; for an OBJ file also those of its lights, still empty, so that arguments can
 * set their keys. Their positions depend on the camera. */
static void add_scene_file(struct ini *ini, const char *path, bool is_obj)
{
    struct ini_section *section = ini_add_section(ini, is_obj ? "mesh" : "include", "scene", 0);
    struct ini_entry origin = {.file = ini->file, .folder = ""};
    ini_set(section, "file", path, &origin);
    if (!is_obj) return;
    ini_set(section, "smooth", "yes", &origin);
    ini_add_section(ini, "light", "key", 0);
    ini_add_section(ini, "light", "fill", 0);
}

/* Reads CONFIG into a document; false after reporting an error. */
static bool read_config(const char *path, struct ini *ini)
{
    bool is_obj = path_has_extension(path, ".obj");
    bool is_ini = path_has_extension(path, ".ini");
    if (!is_ini && !is_obj && !path_has_extension(path, ".nff")) return refuse_config(path);
    if (access(path, R_OK) != 0) return refuse_unreadable(path);
    if (is_ini) return read_ini(path, ini);
    ini_create(path, ini);
    add_scene_file(ini, path, is_obj);
    return true;
}

static bool load_scene(struct loader *loader, const struct ini *ini)
{
    /* A document that was made for a scene file is no file that could include itself. */
    bool is_file = path_has_extension(ini->file, ".ini");
    struct part part = {.loader = loader,
                        .path = ini->file,
                        .real_path = is_file ? path_absolute(ini->file) : copy_text(""),
                        .root = root_of(ini->file),
                        .placement = placement_identity};
    bool good = load_scene_sections(&part, ini);
    part_free(&part);
    return good;
}

/* Sets an entry of the section, unless an argument has set it. */
static void set_vector(const struct ini *ini, struct ini_section *section, const char *key,
                       struct vec3 value)
{
    struct ini_entry origin = {.file = ini->file, .folder = ""};
    char *text = format_vector(value);
    if (!ini_entry(section, key)) ini_set(section, key, text, &origin);
    free(text);
}

/* Places the lights of an OBJ file. They are sections so that they are printed and overridden like others. */
static bool load_shoulder_lights(struct loader *loader, const struct ini *sections)
{
    struct light lights[SHOULDER_LIGHTS];
    shoulder_lights(loader->settings, lights);
    for (size_t i = 0; i < SHOULDER_LIGHTS; i++) {
        struct ini_section *section = &sections->sections[i];
        if (!ini_entry(section, "position") && !vec_is_finite(lights[i].position)) {
            user_error(sections->file, 0,
                       "there is no room for lights around it, expected a smaller scene");
            return false;
        }
        set_vector(sections, section, "position", lights[i].position);
        set_vector(sections, section, "color", lights[i].color);
    }
    return load_scene(loader, sections);
}

static void warn_of_little(const struct loader *loader)
{
    const char *config = loader->config;
    bool nff = path_has_extension(config, ".nff"); /* whose surfaces have no ambient light */
    if (builder_primitive_count(loader->builder) == 0)
        user_warning(config, 0, "the scene has no objects, the picture shows the background");
    else if (builder_light_count(loader->builder) == 0)
        user_warning(config, 0,
                     "the scene has no light: surfaces show no more than %swhat they mirror or let "
                     "through, until %s lights them",
                     nff ? "" : "their ambient light and ", nff ? "an 'l'" : "a [light]");
}

/* The section that a primitive comes from. */
static const struct loaded_section *section_of(const struct loader *loader,
                                               enum primitive_kind kind, uint32_t index)
{
    size_t low = 0, high = loader->section_count - 1;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (loader->sections[middle].end[kind] > index)
            high = middle;
        else
            low = middle + 1;
    }
    return &loader->sections[low];
}

/* Text that names the section of the earlier primitive, for a warning at that of its double; the caller frees it. */
static char *name_of_earlier(const struct loaded_section *section,
                             const struct loaded_section *earlier)
{
    if (section == earlier) return copy_text("another one here");
    if (earlier->line == 0) return copy_text("that of an argument");
    if (strcmp(section->file, earlier->file) == 0)
        return format_text("that of line %ld", earlier->line);
    return format_text("that of %s:%ld", earlier->file, earlier->line);
}

/* One warning for all transparent doubles, which builder_coincidences() counts: each splits the rays that reach it once
 * more, and nothing but the time shows it. */
static void warn_of_coincidences(const struct loader *loader)
{
    struct coincidences first = {0};
    enum primitive_kind first_kind = PRIMITIVE_KINDS;
    uint64_t count = 0;
    for (int k = 0; k < PRIMITIVE_KINDS; k++) {
        enum primitive_kind kind = (enum primitive_kind)k;
        struct coincidences found = builder_coincidences(loader->builder, kind);
        if (count == 0) {
            first = found;
            first_kind = kind;
        }
        count += found.count;
    }
    if (count == 0) return;
    const struct loaded_section *section = section_of(loader, first_kind, first.first);
    char *earlier = name_of_earlier(section, section_of(loader, first_kind, first.earlier));
    user_warning(
        section->file, section->line,
        "transparent surfaces coincide with earlier ones, and each splits all rays once "
        "more, which may take very long: %llu in all; the first is here and coincides with %s",
        (unsigned long long)count, earlier);
    free(earlier);
}

/* A view of `count` sections of a document, which still owns them. */
static struct ini sections_from(const struct ini *ini, size_t first, size_t count)
{
    struct ini sections = *ini;
    sections.sections += first;
    sections.count = count;
    return sections;
}

static bool load_document(struct loader *loader, struct ini *ini, char *const *overrides,
                          size_t count)
{
    struct settings *settings = loader->settings;
    if (!read_settings(loader, ini) || !apply_overrides(loader, ini, overrides, count))
        return false;
    /* The lights of an OBJ file are placed last: they depend on the camera, which depends on all else. */
    bool is_obj = path_has_extension(loader->config, ".obj");
    size_t first = is_obj ? 1 : ini->count;
    struct ini scene = sections_from(ini, 0, first);
    struct ini lights = sections_from(ini, first, is_obj ? SHOULDER_LIGHTS : 0);
    first += lights.count;
    loader->amended = sections_from(ini, first, ini->count - first);
    if (!load_scene(loader, &scene)) return false;
    warn_of_coincidences(loader);
    frame_scene(loader->builder, settings, setting_is_set(loader, "camera", "eye"),
                setting_is_set(loader, "camera", "look_at"));
    name_outputs(settings, loader->config);
    if (!check_settings(loader)) return false;
    if (lights.count) return load_shoulder_lights(loader, &lights);
    warn_of_little(loader);
    return true;
}

bool load_job(const char *path, char *const *overrides, size_t count, enum reach reach,
              struct job *job)
{
    struct ini ini;
    if (!read_config(path, &ini)) return false;
    *job = (struct job){.builder = builder_create(), .document = allocate(1, sizeof ini)};
    *job->document = ini;
    settings_init(&job->settings);
    struct loader loader = {
        .config = path, .builder = job->builder, .settings = &job->settings, .reach = reach};
    note_source(&loader, path);
    bool good = load_document(&loader, job->document, overrides, count);
    job->named =
        (struct named_settings){.image = setting_is_set(&loader, "output", "image"),
                                .report = setting_is_set(&loader, "output", "report"),
                                .journal = setting_is_set(&loader, "output", "journal"),
                                .max_samples = setting_is_set(&loader, "sampling", "max_samples")};
    loader_free(&loader);
    if (!good) job_free(job);
    return good;
}

void job_free(struct job *job)
{
    settings_free(&job->settings);
    builder_destroy(job->builder);
    if (job->document) ini_free(job->document);
    free(job->document);
    *job = (struct job){0};
}
