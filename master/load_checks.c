/* What settings that are right by themselves have to be together (declared in loader.h). */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/memory.h"
#include "common/message.h"
#include "master/image_file.h"
#include "master/loader.h"
#include "master/text_file.h"

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
    refuse_setting(loader, config, "image",
                   setting_is_set(loader, "image", "width") ? "width" : "height", text);
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

/* An angle from the view of an NFF file may have been rounded to 180. */
static bool half_height_good(double fov)
{
    return fov < 180 && isnormal(view_half_height(fov));
}

static bool camera_good(const struct loader *loader, const char *config)
{
    const struct settings *s = loader->settings;
    struct vec3 view = vec_sub(s->camera.look_at, s->camera.eye), up = s->camera.up;
    if (!half_height_good(s->camera.fov))
        return refuse_setting(loader, config, "camera", "fov",
                              "fov is too close to 0 or 180, expected an angle between them");
    if (!setting_is_set(loader, "camera", "eye") && (!vec_is_finite(view) || vec_is_zero(view))) {
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
                              setting_is_set(loader, "camera", "eye") ? "eye" : "look_at",
                              "eye and look_at are the same point, expected two different ones");
    if (vec_is_zero(up) || !vec_is_finite(up))
        return refuse_setting(loader, config, "camera", "up",
                              "up is zero or not finite, expected a direction");
    if (vec_length(vec_cross(vec_normalize(view), vec_normalize(up))) < PARALLEL)
        return refuse_setting(loader, config, "camera",
                              setting_is_set(loader, "camera", "up") ? "up" : "eye",
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

/*
 * Whether `samples` would be set for nothing: how many a pixel gets is settled by adaptive sampling. An
 * argument may make the picture of a file with `samples` adaptive, as it may override any setting.
 */
static bool samples_are_idle(const struct loader *loader)
{
    const struct settings *s = loader->settings;
    const struct origin *samples = setting_origin(loader, "sampling", "samples");
    const char *end = s->sampling.target_error > 0 ? "target_error" : "time_limit";
    bool overridden = samples->line > 0 && setting_origin(loader, "sampling", end)->line == 0;
    return samples->file && !overridden;
}

/* An adaptive pixel's halves are of equal size. */
static bool sampling_good(const struct loader *loader, const char *config)
{
    const struct settings *s = loader->settings;
    if (!settings_adaptive(s)) return true;
    if (samples_are_idle(loader))
        return refuse_setting(loader, config, "sampling", "samples",
                              "samples is not used beside target_error or time_limit, expected one "
                              "of them (target_error = 0 and time_limit = 0 switch them off)");
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

bool check_settings(const struct loader *loader, const char *config)
{
    return region_good(loader, config) && size_good(loader, config) &&
           camera_good(loader, config) && kernel_good(loader, config) &&
           sampling_good(loader, config) && output_good(loader, config);
}
