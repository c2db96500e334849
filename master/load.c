/*
 * CONFIG and overrides into a job. A scene file given as CONFIG is treated as an INI file of one
 * section that names it.
 */
#include "master/load.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/memory.h"
#include "common/message.h"
#include "common/number.h"
#include "master/framing.h"
#include "master/image_file.h"
#include "master/loader.h"
#include "master/nearest_name.h"
#include "master/scene_sections.h"
#include "master/sections.h"
#include "master/text_file.h"

/* ---- the loader's memory ---- */

size_t setting_index(const char *section, const char *name)
{
    size_t i = 0;
    while (strcmp(settings_keys[i].section, section) != 0 ||
           strcmp(settings_keys[i].name, name) != 0)
        if (++i == SETTINGS_KEYS) fatal("no setting is called %s.%s", section, name);
    return i;
}

const struct origin *setting_origin(const struct loader *loader, const char *section,
                                    const char *name)
{
    return &loader->origins[setting_index(section, name)];
}

static bool is_set(const struct loader *loader, const char *section, const char *name)
{
    return setting_origin(loader, section, name)->file != NULL;
}

const char *keep_path(struct loader *loader, const char *path)
{
    loader->paths = grow(loader->paths, loader->path_count, sizeof *loader->paths);
    return loader->paths[loader->path_count++] = copy_text(path);
}

bool may_read(const struct loader *loader, const char *path, const char *root)
{
    return loader->reach == REACH_ANYWHERE || path_is_within(path, root);
}

char *root_of(const char *path)
{
    char *folder = path_folder(path);
    char *root = path_absolute(*folder ? folder : ".");
    free(folder);
    return root;
}

void loader_free(struct loader *loader)
{
    for (size_t i = 0; i < loader->path_count; i++)
        free(loader->paths[i]);
    free(loader->paths);
}

/* ---- settings ---- */

bool is_settings_section(const char *kind)
{
    for (size_t i = 0; i < SETTINGS_KEYS; i++)
        if (strcmp(settings_keys[i].section, kind) == 0) return true;
    return false;
}

/* The keys of a section stand together in the table. */
static const struct key *settings_of(const char *kind, size_t *count)
{
    size_t first = 0;
    while (strcmp(settings_keys[first].section, kind) != 0)
        first++;
    size_t end = first;
    while (end < SETTINGS_KEYS && strcmp(settings_keys[end].section, kind) == 0)
        end++;
    *count = end - first;
    return &settings_keys[first];
}

static bool set_setting(struct loader *loader, const struct ini_section *section,
                        const struct ini_entry *entry)
{
    size_t count;
    const struct key *keys = settings_of(section->kind, &count);
    const struct key *key = find_key(keys, count, entry->key);
    if (!key) {
        refuse_key(section, entry, keys, count);
        return false;
    }
    struct ini_entry local = *entry;
    bool is_path = key->type == VALUE_TEXT && *entry->value;
    if (is_path) local.value = path_in(entry->folder, entry->value);
    bool good = read_entry(section, &local, key, loader->settings);
    if (is_path) free(local.value);
    if (!good) return false;
    loader->origins[key - settings_keys] = (struct origin){entry->file, entry->line};
    if (strcmp(section->kind, "background") == 0) loader->background_set = true;
    return true;
}

static bool read_settings_section(struct loader *loader, const struct ini *ini,
                                  const struct ini_section *section)
{
    if (*section->name) {
        user_error(ini->file, section->line, "[%s] takes no name, expected [%s]", section->kind,
                   section->kind);
        return false;
    }
    for (size_t i = 0; i < section->count; i++)
        if (!set_setting(loader, section, &section->entries[i])) return false;
    if (strcmp(section->kind, "background") != 0 || !ini_entry(section, "color")) return true;
    if (!ini_entry(section, "bottom") && !ini_entry(section, "top")) return true;
    struct ini_place place = place_of(ini, section, "color");
    user_error(place.file, place.line,
               "[background] has a color as well as bottom or top, expected one or the other");
    return false;
}

static bool read_settings(struct loader *loader, const struct ini *ini)
{
    bool seen[SETTINGS_KEYS] = {false};
    for (size_t i = 0; i < ini->count; i++) {
        const struct ini_section *section = &ini->sections[i];
        if (!is_settings_section(section->kind)) continue;
        size_t count;
        size_t which = (size_t)(settings_of(section->kind, &count) - settings_keys);
        if (seen[which]) {
            user_error(ini->file, section->line, "a second [%s], expected one", section->kind);
            return false;
        }
        seen[which] = true;
        if (!read_settings_section(loader, ini, section)) return false;
    }
    return true;
}

/* ---- overrides ---- */

/* "material glass.ior=1.3" taken apart; the pieces point into one copy. */
struct override {
    const char *argument;
    char *copy;
    char *kind, *name, *key, *value;
};

static char *trim(char *text)
{
    text += strspn(text, " \t");
    size_t length = strlen(text);
    while (length && strchr(" \t", text[length - 1]))
        text[--length] = '\0';
    return text;
}

static bool take_apart(const char *argument, struct override *override)
{
    *override = (struct override){.argument = argument, .copy = copy_text(argument)};
    char *equals = strchr(override->copy, '=');
    if (equals) *equals = '\0';
    char *dot = equals ? strrchr(override->copy, '.') : NULL;
    if (dot) {
        *dot = '\0';
        override->value = trim(equals + 1);
        override->key = trim(dot + 1);
        override->kind = trim(override->copy);
        size_t length = strcspn(override->kind, " \t");
        override->name = trim(override->kind + length);
        override->kind[length] = '\0';
        if (*override->key && *override->kind) return true;
    }
    user_error(argument, 0, "is no setting, expected SECTION.KEY=VALUE");
    free(override->copy);
    return false;
}

static bool refuse_override_section(const struct override *override)
{
    struct nearest_name search = {.name = override->kind};
    for (size_t i = 0; i < SETTINGS_KEYS; i++)
        nearest_name_try(&search, settings_keys[i].section);
    for (size_t i = 0; scene_section_kind(i); i++)
        nearest_name_try(&search, scene_section_kind(i)->name);
    char *hint = search.best ? nearest_name_hint(&search)
                             : copy_text(", expected one that 'farm --help' lists");
    user_error(override->argument, 0, "unknown section '%s'%s", override->kind, hint);
    free(hint);
    return false;
}

/* The one section that an override names. */
static struct ini_section *overridden_section(const struct ini *ini,
                                              const struct override *override)
{
    struct nearest_name search = {.name = override->name};
    struct ini_section *found = NULL;
    size_t matches = 0;
    for (size_t i = 0; i < ini->count; i++) {
        struct ini_section *section = &ini->sections[i];
        if (strcmp(section->kind, override->kind) != 0) continue;
        nearest_name_try(&search, section->name);
        if (strcmp(section->name, override->name) != 0) continue;
        found = section;
        matches++;
    }
    if (matches == 1) return found;
    if (matches > 1) {
        user_error(override->argument, 0,
                   "there are %zu sections [%s], expected one that has a name", matches,
                   override->kind);
        return NULL;
    }
    char *hint = nearest_name_hint(&search);
    user_error(override->argument, 0, "%s has no section [%s%s%s]%s", ini->file, override->kind,
               *override->name ? " " : "", override->name, hint);
    free(hint);
    return NULL;
}

static bool apply(struct loader *loader, struct ini *ini, const struct override *override)
{
    struct ini_entry entry = {
        .key = override->key, .value = override->value, .file = override->argument, .folder = ""};
    if (is_settings_section(override->kind) && !*override->name) {
        struct ini_section section = {.kind = override->kind, .name = override->name};
        return set_setting(loader, &section, &entry);
    }
    if (!is_scene_section(override->kind)) return refuse_override_section(override);
    struct ini_section *section = overridden_section(ini, override);
    if (!section) return false;
    ini_set(section, override->key, override->value, &entry);
    return true;
}

static bool apply_overrides(struct loader *loader, struct ini *ini, char *const *overrides,
                            size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct override override;
        if (!take_apart(overrides[i], &override)) return false;
        bool good = apply(loader, ini, &override);
        free(override.copy);
        if (!good) return false;
    }
    return true;
}

/* ---- checks of what belongs together ---- */

/* Complains where the setting was made; config where it was not made at all. */
static bool refuse_setting(const struct loader *loader, const char *config, const char *section,
                           const char *name, const char *text)
{
    const struct origin *origin = setting_origin(loader, section, name);
    user_error(origin->file ? origin->file : config, origin->line, "%s", text);
    return false;
}

/* Of a picture in memory: three floats. */
#define PIXEL_BYTES (3 * sizeof(float))

static bool size_good(const struct loader *loader, const char *config)
{
    const struct settings *s = loader->settings;
    const uint32_t *region = s->image.region;
    uint64_t pixels = (uint64_t)s->image.width * s->image.height;
    uint64_t bytes = (region[2] ? (uint64_t)region[2] * region[3] : pixels) * PIXEL_BYTES;
    char *text = NULL;
    if (pixels > PICTURE_MAX_PIXELS)
        text = format_text("the picture has %llu pixels, expected width x height <= 2^28",
                           (unsigned long long)pixels);
    else if (!memory_holds(bytes))
        text = format_text("the picture takes %llu bytes, expected at most the %zu of memory",
                           (unsigned long long)bytes, memory_limit());
    if (!text) return true;
    refuse_setting(loader, config, "image", is_set(loader, "image", "width") ? "width" : "height",
                   text);
    free(text);
    return false;
}

static bool region_good(const struct loader *loader, const char *config)
{
    const struct settings *s = loader->settings;
    const uint32_t *region = s->image.region;
    if (!region[2]) return true;
    if (region[0] >= s->image.width || region[2] > s->image.width - region[0] ||
        region[1] >= s->image.height || region[3] > s->image.height - region[1]) {
        char *text = format_text("region = %u %u %u %u reaches out of the picture, expected a part "
                                 "of %u x %u pixels",
                                 region[0], region[1], region[2], region[3], s->image.width,
                                 s->image.height);
        refuse_setting(loader, config, "image", "region", text);
        free(text);
        return false;
    }
    return true;
}

/*
 * Below this sine of the angle between view and up, rounding (a few units of DBL_EPSILON in a cross
 * product of unit vectors) would decide more than a thousandth of the picture's direction.
 */
#define PARALLEL (4096 * DBL_EPSILON)

/* Of the picture, at a distance of 1 from the eye. */
static double half_height_of(double fov)
{
    return tan(fov * (M_PI / 360));
}

/* An angle from the view of an NFF file may have been rounded to 180. */
static bool half_height_good(double fov)
{
    return fov < 180 && isnormal(half_height_of(fov));
}

static bool camera_good(const struct loader *loader, const char *config)
{
    const struct settings *s = loader->settings;
    struct vec3 view = vec_sub(s->camera.look_at, s->camera.eye), up = s->camera.up;
    if (!half_height_good(s->camera.fov))
        return refuse_setting(loader, config, "camera", "fov",
                              "fov is too close to 0 or 180, expected an angle between them");
    if (!is_set(loader, "camera", "eye") && (!vec_is_finite(view) || vec_is_zero(view))) {
        user_error(config, 0,
                   "the scene is too large or too small for an eye to be placed, expected "
                   "camera.eye and camera.look_at");
        return false;
    }
    if (!vec_is_finite(s->camera.eye) || !vec_is_finite(view))
        return refuse_setting(loader, config, "camera", "eye",
                              "eye and look_at are too far apart, expected a finite distance");
    if (vec_is_zero(view))
        return refuse_setting(loader, config, "camera",
                              is_set(loader, "camera", "eye") ? "eye" : "look_at",
                              "eye and look_at are the same point, expected two different ones");
    if (vec_is_zero(up) || !vec_is_finite(up))
        return refuse_setting(loader, config, "camera", "up",
                              "up is zero or not finite, expected a direction");
    if (vec_length(vec_cross(vec_normalize(view), vec_normalize(up))) < PARALLEL)
        return refuse_setting(loader, config, "camera",
                              is_set(loader, "camera", "up") ? "up" : "eye",
                              "up lies along the direction of view, expected another direction");
    return true;
}

static bool kernel_good(const struct loader *loader, const char *config)
{
    enum processor_level level = loader->settings->farm.kernel;
    if (processor_has(level)) return true;
    char *text = format_text("kernel = %s is not for this processor, expected auto or portable",
                             processor_level_name(level));
    bool good = refuse_setting(loader, config, "farm", "kernel", text);
    free(text);
    return good;
}

/* An adaptive pixel's halves are of equal size. */
static bool sampling_good(const struct loader *loader, const char *config)
{
    const struct settings *s = loader->settings;
    if (!settings_adaptive(s)) return true;
    uint32_t min = s->sampling.min_samples, max = s->sampling.max_samples;
    if (min % 2)
        return refuse_setting(loader, config, "sampling", "min_samples",
                              "min_samples is odd, expected an even number");
    if (max % 2)
        return refuse_setting(loader, config, "sampling", "max_samples",
                              "max_samples is odd, expected an even number");
    if (max <= min)
        return refuse_setting(loader, config, "sampling", "max_samples",
                              "max_samples is not above min_samples, expected more");
    if (s->farm.schedule != SCHEDULE_DYNAMIC)
        return refuse_setting(loader, config, "farm", "schedule",
                              "target_error and time_limit need schedule = dynamic");
    return true;
}

/* A picture or trace that is asked for has a name of its kind, and no other output has it. */
static bool extra_good(const struct loader *loader, const char *config, const char *key,
                       const char *path, bool is_picture)
{
    if (!*path || path_is_device(path)) return true;
    if (is_picture ? !image_extension_known(path) : !path_has_extension(path, ".json")) {
        char *text = format_text("%s has an unknown extension, expected %s", key,
                                 is_picture ? ".png, .hdr or .pfm" : ".json");
        bool good = refuse_setting(loader, config, "output", key, text);
        free(text);
        return good;
    }
    const struct settings *settings = loader->settings;
    const char *const all[] = {settings->output.image, settings->output.report,
                               settings->output.trace, settings->output.heatmap,
                               settings->output.ranks};
    unsigned same = 0;
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        same += strcmp(all[i], path) == 0;
    if (same <= 1) return true;
    char *text =
        format_text("%s is also the name of another output, expected a file of its own", key);
    bool good = refuse_setting(loader, config, "output", key, text);
    free(text);
    return good;
}

static bool output_good(const struct loader *loader, const char *config)
{
    const char *image = loader->settings->output.image;
    if (!*image)
        return refuse_setting(loader, config, "output", "image",
                              "image is empty, expected the name of a file");
    if (!image_extension_known(image))
        return refuse_setting(loader, config, "output", "image",
                              "image has an unknown extension, expected .png, .hdr or .pfm");
    /* So no output can fall on the picture, the scene or any part of it. */
    const char *report = loader->settings->output.report;
    if (*report && !path_has_extension(report, ".json") && !path_is_device(report))
        return refuse_setting(loader, config, "output", "report",
                              "the name of a report has to end with .json");
    const char *journal = loader->settings->output.journal;
    if (*journal && !path_has_extension(journal, ".journal"))
        return refuse_setting(loader, config, "output", "journal",
                              "the name of a journal has to end with .journal");
    const struct settings *settings = loader->settings;
    return extra_good(loader, config, "trace", settings->output.trace, false) &&
           extra_good(loader, config, "heatmap", settings->output.heatmap, true) &&
           extra_good(loader, config, "ranks", settings->output.ranks, true);
}

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

/* CONFIG as a document; a scene file becomes a section that names it. */
static bool read_config(const char *path, struct ini *ini)
{
    bool is_obj = path_has_extension(path, ".obj");
    if (path_has_extension(path, ".ini")) return ini_load(path, ini);
    if (!is_obj && !path_has_extension(path, ".nff")) {
        user_error(path, 0, "has an unknown extension, expected .ini, .nff or .obj");
        return false;
    }
    if (access(path, R_OK) != 0) {
        user_error(path, 0, "cannot be opened: %s", strerror(errno));
        return false;
    }
    ini_create(path, ini);
    struct ini_section *section = ini_add_section(ini, is_obj ? "mesh" : "include", "scene", 0);
    struct ini_entry origin = {.file = ini->file, .folder = ""};
    ini_set(section, "file", path, &origin);
    if (is_obj) ini_set(section, "smooth", "yes", &origin);
    return true;
}

/* The lights of an OBJ file, as sections so that they are printed like others. */
static bool add_lights(struct loader *loader, struct ini *ini)
{
    static const char *const names[2] = {"key", "fill"};
    struct light lights[2];
    shoulder_lights(loader->settings, lights);
    struct ini_entry origin = {.file = ini->file, .folder = ""};
    for (int i = 0; i < 2; i++) {
        struct ini_section *section = ini_add_section(ini, "light", names[i], 0);
        char *position = format_vector(lights[i].position), *color = format_vector(lights[i].color);
        ini_set(section, "position", position, &origin);
        ini_set(section, "color", color, &origin);
        free(position);
        free(color);
        if (builder_add_light(loader->builder, &lights[i])) return false;
    }
    return true;
}

static bool load_scene(struct loader *loader, const struct ini *ini)
{
    /* A document that stands for a scene file is no file that could be included again. */
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

static bool load_document(struct loader *loader, struct ini *ini, char *const *overrides,
                          size_t count)
{
    const char *config = ini->file;
    struct settings *settings = loader->settings;
    if (!read_settings(loader, ini) || !apply_overrides(loader, ini, overrides, count) ||
        !load_scene(loader, ini))
        return false;
    frame_scene(loader->builder, settings, is_set(loader, "camera", "eye"),
                is_set(loader, "camera", "look_at"));
    name_outputs(settings, config);
    if (!region_good(loader, config) || !size_good(loader, config) ||
        !camera_good(loader, config) || !kernel_good(loader, config) ||
        !sampling_good(loader, config) || !output_good(loader, config))
        return false;
    if (path_has_extension(config, ".obj")) {
        if (add_lights(loader, ini)) return true;
        user_error(config, 0, "there is no room for lights around it, expected a smaller scene");
        return false;
    }
    if (!builder_light_count(loader->builder))
        user_warning(config, 0, "the scene has no light, expected at least one [light]");
    if (builder_is_empty(loader->builder))
        user_warning(config, 0, "the scene has no objects, the picture shows the background");
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
    struct loader loader = {.builder = job->builder, .settings = &job->settings, .reach = reach};
    bool good = load_document(&loader, job->document, overrides, count);
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

/* ---- the view ---- */

static struct camera camera_of(const struct settings *settings)
{
    struct camera camera = {.eye = settings->camera.eye};
    double half_height = half_height_of(settings->camera.fov);
    camera.forward = vec_normalize(vec_sub(settings->camera.look_at, settings->camera.eye));
    struct vec3 up = vec_normalize(settings->camera.up);
    struct vec3 right = vec_normalize(vec_cross(camera.forward, up));
    camera.right = vec_scale(right, half_height);
    camera.down = vec_scale(vec_normalize(vec_cross(camera.forward, right)), half_height);
    return camera;
}

struct view settings_view(const struct settings *settings)
{
    const uint32_t *region = settings->image.region;
    struct view view = {
        .camera = camera_of(settings),
        .background_bottom = settings->background.bottom,
        .background_top = settings->background.top,
        .background_up = vec_normalize(settings->camera.up),
        .cutoff = settings->render.cutoff,
        .width = settings->image.width,
        .height = settings->image.height,
        .region_x = region[0],
        .region_y = region[1],
        .region_w = region[2] ? region[2] : settings->image.width,
        .region_h = region[2] ? region[3] : settings->image.height,
        .max_depth = settings->render.max_depth,
        .shadows = settings->render.shadows,
        .min_samples = settings_adaptive(settings) ? settings->sampling.min_samples
                                                   : settings->sampling.samples,
        .max_samples = settings_adaptive(settings) ? settings->sampling.max_samples
                                                   : settings->sampling.samples,
        .formulas = settings->render.formulas,
        .processor = settings->farm.kernel,
        .variant = settings->farm.variant,
    };
    return view;
}
