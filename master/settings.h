/*
 * The settings of a run: the sections [image], [camera], [background], [render], [sampling], [farm] and
 * [output] of an INI file, and SECTION.KEY=VALUE on the command line.
 */
#ifndef FARM_MASTER_SETTINGS_H
#define FARM_MASTER_SETTINGS_H

#include <stdbool.h>
#include <stdint.h>

#include "common/processor.h"
#include "common/scene.h"
#include "master/key.h"
#include "master/schedule.h"

struct settings {
    struct {
        uint32_t width, height; /* pixels */
        uint32_t region[4];     /* x y w h, pixels; w = 0: the whole picture */
    } image;
    struct {
        struct vec3 eye, look_at, up;
        double fov; /* vertical, edge to edge, degrees, 0 < fov < 180 */
    } camera;
    struct {
        struct vec3 bottom, top; /* linear RGB */
    } background;
    struct {
        uint32_t max_depth;
        double cutoff;
        bool shadows;
        enum formulas formulas;
        bool strict; /* a sample that is not finite ends the run with status 1 */
    } render;
    struct {
        uint32_t samples;                  /* per pixel, unless sampling is adaptive */
        uint32_t min_samples, max_samples; /* if it is adaptive */
        double target_error;               /* RMSE; 0: none */
        double time_limit;                 /* seconds; 0: none */
        char *reference;                   /* path, owned; "": none */
    } sampling;
    struct {
        enum schedule schedule;
        uint32_t tile; /* edge in pixels; 0: auto */
        bool master_renders;
        double patience; /* seconds for which a process may give no sign of life */
        enum processor_level kernel;
        enum variant variant;
    } farm;
    struct {
        /* Paths, owned; NULL: named after the config; report and journal "": none. */
        char *image, *report, *journal;
        double preview; /* seconds between previews while rendering; 0: none */
        char *error, *trace, *heatmap, *ranks; /* paths, owned; "": none */
    } output;
};

/* All settings, in the order in which they are printed; offsets refer to struct settings. */
#define SETTINGS_KEYS 35
extern const struct key settings_keys[SETTINGS_KEYS];

/* Whether sampling is adaptive: it is if a target error or a time limit is set. */
static inline bool settings_adaptive(const struct settings *settings)
{
    return settings->sampling.target_error > 0 || settings->sampling.time_limit > 0;
}

/*
 * Whether a key belongs in a list of a run's settings: color is another name of bottom and top, samples is refused
 * beside adaptive sampling, and there may be no region.
 */
bool settings_lists(const struct settings *settings, const struct key *key);

/* Sets every key to its fallback. Strings are owned: settings_free() frees them. */
void settings_init(struct settings *settings);
void settings_free(struct settings *settings);

#endif
