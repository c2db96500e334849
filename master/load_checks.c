/* Checks settings against each other, each of which has been found valid by itself (declared in loader.h). */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "common/memory.h"
#include "common/message.h"
#include "common/tile.h"
#include "master/adaptive.h"
#include "master/image_file.h"
#include "master/loader.h"
#include "master/path.h"
#include "master/sections.h"

/* Reports an error at the place where the setting was made; in CONFIG where it has its default. Always returns
 * false. */
static MESSAGE_FORMAT(4, 5) bool refuse_setting(const struct loader *loader, const char *section,
                                                const char *name, const char *format, ...)
{
    const struct origin *origin = setting_origin(loader, section, name);
    va_list arguments;
    va_start(arguments, format);
    char *text = format_arguments(format, arguments);
    va_end(arguments);
    user_error(origin->file ? origin->file : loader->config, origin->line, "%s", text);
    free(text);
    return false;
}

/* Bytes that rank 0 keeps for each pixel during the whole run: the canvas, those of a preview and of a reference, the
 * statistics of adaptive sampling, and the costs of a heat map. */
static uint64_t pixel_bytes(const struct settings *s)
{
    bool preview = s->output.preview > 0, reference = *s->sampling.reference != '\0';
    uint64_t canvases = 1u + preview + reference, canvas_bytes = 3 * sizeof(float);
    uint64_t costs = *s->output.heatmap ? sizeof(float) : 0;
    return canvases * canvas_bytes + (settings_adaptive(s) ? adaptive_pixel_bytes() : 0) + costs;
}

static bool is_argument(const struct loader *loader, const char *section, const char *key)
{
    const struct origin *origin = setting_origin(loader, section, key);
    return origin->file && origin->line == 0;
}

/* Of keys of a section that contradict each other the one to name: an argument rather than a line of CONFIG, which was
 * right before it. NULL ends the list. */
static const char *culprit(const struct loader *loader, const char *section,
                           const char *const *keys)
{
    const char *set = keys[0];
    for (size_t i = 0; keys[i]; i++) {
        if (is_argument(loader, section, keys[i])) return keys[i];
        if (!setting_is_set(loader, section, set)) set = keys[i];
    }
    return set;
}

static bool size_good(const struct loader *loader)
{
    const struct settings *s = loader->settings;
    const uint32_t *region = s->image.region;
    uint64_t pixels = (uint64_t)s->image.width * s->image.height;
    uint64_t bytes = (region[2] ? (uint64_t)region[2] * region[3] : pixels) * pixel_bytes(s);
    const char *edge = culprit(loader, "image", (const char *[]){"width", "height", NULL});
    if (pixels > PICTURE_MAX_PIXELS)
        return refuse_setting(loader, "image", edge,
                              "the picture has %llu pixels, expected width x height <= 2^28",
                              (unsigned long long)pixels);
    if (!memory_holds(bytes))
        return refuse_setting(loader, "image", edge,
                              "the picture takes %.1f MB of memory, expected at most the %.1f MB "
                              "that this process may have",
                              1e-6 * (double)bytes, 1e-6 * (double)memory_limit());
    return true;
}

static bool region_good(const struct loader *loader)
{
    const struct settings *s = loader->settings;
    const uint32_t *region = s->image.region;
    if (!region[2]) return true;
    if (region[0] >= s->image.width || region[2] > s->image.width - region[0] ||
        region[1] >= s->image.height || region[3] > s->image.height - region[1])
        return refuse_setting(
            loader, "image", "region",
            "the region reaches out of the picture, expected a part of %u x %u pixels",
            s->image.width, s->image.height);
    return true;
}

/* The rows of a band that are sent together form one tile, so they must not exceed its size. */
static bool rows_good(const struct loader *loader)
{
    const struct settings *s = loader->settings;
    const uint32_t *region = s->image.region;
    uint32_t width = region[2] ? region[2] : s->image.width;
    uint32_t height = region[2] ? region[3] : s->image.height;
    uint32_t rows = s->farm.tile < height ? s->farm.tile : height;
    if (!schedule_is_static(s->farm.schedule) || rows * width <= TILE_MAX_PIXELS) return true;
    return refuse_setting(loader, "farm", "tile",
                          "tile = %u rows of %u pixels are too many at a time, expected at most %u",
                          s->farm.tile, width, TILE_MAX_PIXELS / width);
}

/*
 * The least sine of the angle between the direction of view and up. Below it, the rounding error of the cross product
 * of the two unit vectors, a few DBL_EPSILON, would be more than a thousandth of its length.
 */
#define PARALLEL (4096 * DBL_EPSILON)

/* An angle from the view of an NFF file may have been rounded to 180. */
static bool half_height_good(double fov)
{
    return fov < 180 && isnormal(view_half_height(fov));
}

/* Only if the user has set eye can the two be the same point. The text names look_at's default where it is in
 * effect. */
static bool refuse_same_point(const struct loader *loader)
{
    bool both = setting_is_set(loader, "camera", "look_at");
    return refuse_setting(
        loader, "camera", culprit(loader, "camera", (const char *[]){"eye", "look_at", NULL}),
        both ? "eye and look_at are the same point, expected two different ones"
             : "eye and look_at, the middle of the scene unless it is set, are the same point, "
               "expected two different ones");
}

static bool refuse_up(const struct loader *loader)
{
    bool is_set = setting_is_set(loader, "camera", "up");
    return refuse_setting(
        loader, "camera", culprit(loader, "camera", (const char *[]){"up", "eye", "look_at", NULL}),
        is_set ? "up lies along the direction of view, expected another direction"
               : "up, 0 1 0 unless it is set, lies along the direction of view, expected another "
                 "direction, such as up = 0 0 -1");
}

static bool camera_good(const struct loader *loader)
{
    const struct settings *s = loader->settings;
    struct vec3 view = vec_sub(s->camera.look_at, s->camera.eye), up = s->camera.up;
    if (!half_height_good(s->camera.fov))
        return refuse_setting(loader, "camera", "fov",
                              "fov is too close to 0 or 180, expected an angle between them");
    if (!setting_is_set(loader, "camera", "eye") && (!vec_is_finite(view) || vec_is_zero(view))) {
        user_error(loader->config, 0,
                   "the scene is too large or too small for an eye to be placed, expected "
                   "camera.eye and camera.look_at");
        return false;
    }
    if (!vec_is_finite(s->camera.eye) || !vec_is_finite(view))
        return refuse_setting(loader, "camera",
                              culprit(loader, "camera", (const char *[]){"eye", "look_at", NULL}),
                              "eye and look_at are too far apart, expected a finite distance");
    if (vec_is_zero(view)) return refuse_same_point(loader);
    if (vec_is_zero(up) || !vec_is_finite(up))
        return refuse_setting(loader, "camera", "up",
                              "up is zero or not finite, expected a direction");
    if (vec_length(vec_cross(vec_normalize(view), vec_normalize(up))) < PARALLEL)
        return refuse_up(loader);
    return true;
}

static bool kernel_good(const struct loader *loader)
{
    enum processor_level level = loader->settings->farm.kernel;
    if (processor_has(level)) return true;
    char *choices = processor_choices(processor_has);
    refuse_setting(loader, "farm", "kernel", "kernel = %s is %s, expected %s",
                   processor_level_names[level], processor_lacks(level), choices);
    free(choices);
    return false;
}

/*
 * Whether `samples` is set without effect, as adaptive sampling decides how many samples a pixel gets. It is accepted
 * in a file if it is an argument that makes sampling adaptive, as arguments may override any setting.
 */
static bool samples_are_idle(const struct loader *loader)
{
    const struct settings *s = loader->settings;
    const struct origin *samples = setting_origin(loader, "sampling", "samples");
    const char *end = s->sampling.target_error > 0 ? "target_error" : "time_limit";
    bool overridden = samples->line > 0 && setting_origin(loader, "sampling", end)->line == 0;
    return samples->file && !overridden;
}

/* No warning where target_error or time_limit is set to 0, which switches off adaptive sampling of a file that also
 * sets its limits. */
static void warn_of_idle_limits(const struct loader *loader)
{
    static const char *const limits[] = {"min_samples", "max_samples"};
    if (setting_is_set(loader, "sampling", "target_error") ||
        setting_is_set(loader, "sampling", "time_limit"))
        return;
    for (size_t i = 0; i < sizeof limits / sizeof *limits; i++) {
        const struct origin *origin = setting_origin(loader, "sampling", limits[i]);
        if (origin->file)
            user_warning(origin->file, origin->line,
                         "%s of [sampling] is not used without target_error or time_limit",
                         limits[i]);
    }
}

/* The user may have meant per cent. */
static void warn_of_large_target(const struct loader *loader)
{
    double target = loader->settings->sampling.target_error;
    if (target < 1) return;
    const struct origin *origin = setting_origin(loader, "sampling", "target_error");
    user_warning(origin->file, origin->line,
                 "target_error = %g is an RMSE where 1 is white: hardly any picture has so much",
                 target);
}

/* Checks the numbers of samples: adaptive sampling needs even ones, as it compares two halves of equal size. */
static bool limits_good(const struct loader *loader)
{
    uint32_t min = loader->settings->sampling.min_samples;
    uint32_t max = loader->settings->sampling.max_samples;
    if (min % 2)
        return refuse_setting(loader, "sampling", "min_samples",
                              "min_samples is odd, expected an even number");
    if (max % 2)
        return refuse_setting(loader, "sampling", "max_samples",
                              "max_samples is odd, expected an even number");
    if (max > min) return true;
    if (setting_is_set(loader, "sampling", "max_samples"))
        return refuse_setting(loader, "sampling", "max_samples",
                              "max_samples is not above min_samples, expected more");
    return refuse_setting(loader, "sampling", "min_samples",
                          "min_samples is not below max_samples, expected "
                          "fewer");
}

static bool sampling_good(const struct loader *loader)
{
    const struct settings *s = loader->settings;
    if (!settings_adaptive(s)) {
        if (!limits_good(loader)) return false;
        warn_of_idle_limits(loader);
        return true;
    }
    if (samples_are_idle(loader))
        return refuse_setting(loader, "sampling", "samples",
                              "samples is not used beside target_error or time_limit, expected "
                              "min_samples and max_samples, or samples alone (target_error = 0 and "
                              "time_limit = 0)");
    warn_of_large_target(loader);
    if (!limits_good(loader)) return false;
    if (s->farm.schedule != SCHEDULE_DYNAMIC)
        return refuse_setting(loader, "farm", "schedule",
                              "target_error and time_limit need schedule = dynamic");
    return true;
}

/* A setting that names a file. extension: that its name must have; NULL: any of a picture's formats. */
struct checked_file {
    const char *section, *key, *path, *extension;
};

static bool kind_good(const struct checked_file *file)
{
    if (!file->extension) return image_extension_known(file->path);
    return path_has_extension(file->path, file->extension) || path_is_written_in_place(file->path);
}

/* stat() of the folder of a file, which need not exist itself. */
static bool stat_folder(const char *path, struct stat *status)
{
    char *folder = path_directory(path);
    bool found = stat(folder, status) == 0;
    free(folder);
    return found;
}

/* Whether two paths, of which at least one does not exist, name the same place. */
static bool same_place(const char *a, const char *b)
{
    struct stat first, second;
    if (strcmp(path_name(a), path_name(b)) != 0) return false;
    if (!stat_folder(a, &first) || !stat_folder(b, &second)) return strcmp(a, b) == 0;
    return first.st_dev == second.st_dev && first.st_ino == second.st_ino;
}

static bool same_file(const char *a, const char *b)
{
    struct stat first, second;
    if (path_is_written_in_place(a) && path_is_written_in_place(b)) return false;
    if (stat(a, &first) == 0 && stat(b, &second) == 0)
        return first.st_dev == second.st_dev && first.st_ino == second.st_ino;
    char *behind_a = path_behind_links(a), *behind_b = path_behind_links(b);
    bool same = behind_a && behind_b && same_place(behind_a, behind_b);
    free(behind_a);
    free(behind_b);
    return same;
}

/* Reports two settings that name the same file, at `file` unless only `other` is an argument. Returns false. */
static bool refuse_same(const struct loader *loader, const struct checked_file *file,
                        const struct checked_file *other)
{
    bool swap = is_argument(loader, other->section, other->key) &&
                !is_argument(loader, file->section, file->key);
    const struct checked_file *newer = swap ? other : file, *older = swap ? file : other;
    return refuse_setting(loader, newer->section, newer->key,
                          "%s is also the name of the %s, expected a file of its own", newer->key,
                          older->key);
}

/* false after reporting that an output is, perhaps by a link, a file that the scene is read from. */
static bool spares_sources(const struct loader *loader, const struct checked_file *file)
{
    struct stat status;
    if (stat(file->path, &status) != 0) return true;
    for (size_t i = 0; i < loader->source_count; i++) {
        const struct source *source = &loader->sources[i];
        if (source->device == status.st_dev && source->inode == status.st_ino)
            return refuse_setting(loader, file->section, file->key,
                                  "%s = %s leads to %s, which the scene is read from, expected a "
                                  "file of its own",
                                  file->key, file->path, source->path);
    }
    return true;
}

static const char *hint_of_name(const char *name)
{
    return is_quoted(name) ? QUOTES_HINT : comment_hint(name);
}

/* Checks the i-th name, also against those before it. */
static bool name_good(const struct loader *loader, const struct checked_file *files, size_t i)
{
    const struct checked_file *file = &files[i];
    if (!*file->path) return true;
    if (!kind_good(file)) {
        const struct origin *origin = setting_origin(loader, file->section, file->key);
        return refuse_setting(loader, file->section, file->key,
                              "%s has an unknown extension, expected %s%s", file->key,
                              file->extension ? file->extension : ".png, .hdr or .pfm",
                              origin->line ? hint_of_name(path_name(file->path)) : "");
    }
    for (size_t k = 0; k < i; k++)
        if (same_file(files[k].path, file->path)) return refuse_same(loader, file, &files[k]);
    return spares_sources(loader, file);
}

/* No two outputs may be the same file, and none may be the reference or a file that the scene is read from. */
static bool output_good(const struct loader *loader)
{
    const struct settings *s = loader->settings;
    const struct checked_file files[] = {
        {"sampling", "reference", s->sampling.reference, ""},
        {"output", "image", s->output.image, NULL},
        {"output", "report", s->output.report, ".json"},
        {"output", "journal", s->output.journal, ".journal"},
        {"output", "error", s->output.error, ".csv"},
        {"output", "trace", s->output.trace, ".json"},
        {"output", "heatmap", s->output.heatmap, NULL},
        {"output", "ranks", s->output.ranks, NULL},
    };
    if (!*s->output.image)
        return refuse_setting(loader, "output", "image",
                              "image is empty, expected the name of a file");
    for (size_t i = 1; i < sizeof files / sizeof *files; i++)
        if (!name_good(loader, files, i)) return false;
    return true;
}

bool check_settings(const struct loader *loader)
{
    return region_good(loader) && size_good(loader) && rows_good(loader) && camera_good(loader) &&
           kernel_good(loader) && sampling_good(loader) && output_good(loader);
}
