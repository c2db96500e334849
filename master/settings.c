#include "master/settings.h"

#include <math.h>
#include <string.h>

_Static_assert(sizeof(enum schedule) == sizeof(uint32_t), "a VALUE_CHOICE is stored in it");

_Static_assert(sizeof(enum formulas) == sizeof(uint32_t), "a VALUE_CHOICE is stored in it");

_Static_assert(sizeof(enum processor_level) == sizeof(uint32_t), "a VALUE_CHOICE is stored in it");
_Static_assert(sizeof(enum variant) == sizeof(uint32_t), "a VALUE_CHOICE is stored in it");

static const char *const formulas[] = {"exact", "paper", NULL};
static const char *const variants[] = {"auto", "full", NULL};

#define AT(member)       .offset = offsetof(struct settings, member)
#define RANGE(low, high) .min = (low), .max = (high)

/* In the order in which they are printed. */
const struct key settings_keys[] = {
    {"image", "width", VALUE_UNSIGNED, AT(image.width), RANGE(1, PICTURE_MAX_EDGE),
     .fallback = "640", .help = "pixels from left to right"},
    {"image", "height", VALUE_UNSIGNED, AT(image.height), RANGE(1, PICTURE_MAX_EDGE),
     .fallback = "480", .help = "pixels from top to bottom"},
    {"image", "region", VALUE_REGION, AT(image.region),
     .help = "x y w h: the part that is rendered, pixels (default: all)"},
    {"camera", "eye", VALUE_VECTOR, AT(camera.eye),
     .help = "where the eye is (default: so that the scene fills the picture)"},
    {"camera", "look_at", VALUE_VECTOR, AT(camera.look_at),
     .help = "the point in the middle of the picture (default: so that the scene is in the middle; "
             "with an eye, the centre of the box around the scene)"},
    {"camera", "up", VALUE_VECTOR, AT(camera.up), .fallback = "0 1 0",
     .help = "the direction that is up in the picture"},
    {"camera", "fov", VALUE_NUMBER, AT(camera.fov), RANGE(0, 180),
     .flags = KEY_ABOVE_MIN | KEY_BELOW_MAX, .fallback = "45",
     .help = "vertical angle from edge to edge, degrees"},
    {"background", "color", VALUE_COLORS, AT(background.bottom),
     .help = "one colour; in place of bottom and top"},
    {"background", "bottom", VALUE_COLOR, AT(background.bottom), .fallback = "0.04 0.04 0.05",
     .help = "colour straight down"},
    {"background", "top", VALUE_COLOR, AT(background.top), .fallback = "0.2 0.26 0.36",
     .help = "colour straight up; between them it changes linearly"},
    {"render", "max_depth", VALUE_UNSIGNED, AT(render.max_depth), RANGE(0, RENDER_MAX_DEPTH),
     .fallback = "20", .help = "levels of reflection and refraction that are followed"},
    {"render", "cutoff", VALUE_NUMBER, AT(render.cutoff), RANGE(0, HUGE_VAL),
     .fallback = "0.001953125", .help = "largest error of a pixel that pruning may cause"},
    {"render", "shadows", VALUE_BOOLEAN, AT(render.shadows), .fallback = "yes",
     .help = "whether objects shade each other"},
    {"render", "formulas", VALUE_CHOICE, AT(render.formulas), .fallback = "exact",
     .choices = formulas, .help = "the robust formulas, or the naive ones of the paper"},
    {"render", "strict", VALUE_BOOLEAN, AT(render.strict), .fallback = "no",
     .help = "whether a sample that is not finite ends the run with status 1"},
    {"sampling", "samples", VALUE_UNSIGNED, AT(sampling.samples), RANGE(1, SAMPLES_MAX),
     .fallback = "1", .help = "rays per pixel, unless target_error or time_limit is set"},
    {"sampling", "min_samples", VALUE_UNSIGNED, AT(sampling.min_samples), RANGE(2, SAMPLES_MAX),
     .fallback = "4", .help = "fewest samples of a pixel in adaptive sampling, an even number"},
    {"sampling", "max_samples", VALUE_UNSIGNED, AT(sampling.max_samples), RANGE(4, SAMPLES_MAX),
     .fallback = "4096",
     .help = "most samples of a pixel in adaptive sampling, even, more than min_samples"},
    {"sampling", "target_error", VALUE_NUMBER, AT(sampling.target_error), RANGE(0, HUGE_VAL),
     .fallback = "0", .help = "RMSE of the picture at which to stop, white is 1; 0: none"},
    {"sampling", "time_limit", VALUE_NUMBER, AT(sampling.time_limit), RANGE(0, HUGE_VAL),
     .fallback = "0", .help = "seconds after which to stop with what is there; 0: none"},
    {"sampling", "reference", VALUE_TEXT, AT(sampling.reference), .fallback = "",
     .help = "picture to measure the error against, .pfm; empty: none"},
    {"farm", "schedule", VALUE_CHOICE, AT(farm.schedule), .fallback = "dynamic",
     .choices = schedule_names, .help = "how the picture is shared out"},
    {"farm", "tile", VALUE_AUTO, AT(farm.tile), RANGE(1, 1024), .fallback = "auto",
     .help = "edge of a tile (dynamic, tiles), or rows sent at a time, pixels"},
    {"farm", "master_renders", VALUE_BOOLEAN, AT(farm.master_renders), .fallback = "yes",
     .help = "whether rank 0 renders as well"},
    {"farm", "patience", VALUE_NUMBER, AT(farm.patience), RANGE(1, 1e6), .fallback = "60",
     .help = "seconds that a process may give no sign before the others go on without it"},
    {"farm", "kernel", VALUE_CHOICE, AT(farm.kernel), .fallback = "auto",
     .choices = processor_level_names, .help = "instructions that the kernel uses"},
    {"farm", "variant", VALUE_CHOICE, AT(farm.variant), .fallback = "auto", .choices = variants,
     .help = "auto leaves out what the scene does not need, full nothing; same picture"},
    {"output", "image", VALUE_TEXT, AT(output.image),
     .help = "picture file: .png, .hdr or .pfm (default: CONFIG's name, .png)"},
    {"output", "report", VALUE_TEXT, AT(output.report),
     .help = "report file, JSON; empty: none (default: the picture's name, .json)"},
    {"output", "preview", VALUE_NUMBER, AT(output.preview), RANGE(0, HUGE_VAL), .fallback = "0",
     .help = "seconds from picture to picture while it is rendered; 0: none"},
    {"output", "error", VALUE_TEXT, AT(output.error), .fallback = "",
     .help = "rows of error against time, .csv; empty: none"},
    {"output", "journal", VALUE_TEXT, AT(output.journal),
     .help = "finished tiles until the picture is written, .journal; empty: none (default: the "
             "picture's name, .journal)"},
    {"output", "trace", VALUE_TEXT, AT(output.trace), .fallback = "",
     .help = "who did what when, Chrome trace for Perfetto, .json; empty: none"},
    {"output", "heatmap", VALUE_TEXT, AT(output.heatmap), .fallback = "",
     .help = "picture of the cost of each pixel; empty: none"},
    {"output", "ranks", VALUE_TEXT, AT(output.ranks), .fallback = "",
     .help = "picture of which rank rendered what; empty: none"},
};

_Static_assert(sizeof settings_keys / sizeof *settings_keys == SETTINGS_KEYS,
               "settings.h tells the number of keys");

bool settings_lists(const struct settings *settings, const struct key *key)
{
    const void *value = (const char *)settings + key->offset;
    if (key->type == VALUE_COLORS) return false;
    if (value == &settings->sampling.samples) return !settings_adaptive(settings);
    return key->type != VALUE_REGION || settings->image.region[2] > 0;
}

void settings_init(struct settings *settings)
{
    memset(settings, 0, sizeof *settings);
    keys_set_fallbacks(settings_keys, SETTINGS_KEYS, settings);
}

void settings_free(struct settings *settings)
{
    keys_free(settings_keys, SETTINGS_KEYS, settings);
}
