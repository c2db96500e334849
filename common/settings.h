/*
 * The settings of a run: what the sections [image], [camera], [background], [render], [sampling],
 * [farm] and [output] of an INI file, and SECTION.KEY=VALUE on the command line, can say.
 */
#ifndef FARM_COMMON_SETTINGS_H
#define FARM_COMMON_SETTINGS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "common/key.h"
#include "common/processor.h"
#include "common/scene.h"
#include "common/schedule.h"

struct settings {
    struct {
        uint32_t width, height; /* pixels */
        uint32_t region[4];     /* x y w h; w = 0: the whole picture */
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
        uint32_t samples; /* per pixel */
    } sampling;
    struct {
        enum schedule schedule;
        uint32_t tile; /* edge in pixels; 0: auto */
        bool master_renders;
        enum processor_level kernel;
        enum variant variant;
    } farm;
    struct {
        /* Paths, owned; NULL: named after the config; report and journal "": none. */
        char *image, *report, *journal;
        char *trace, *heatmap, *ranks; /* paths, owned; "": none */
    } output;
};

/* What can be set, in the order in which it is printed; offsets are into struct settings. */
#define SETTINGS_KEYS 27
extern const struct key settings_keys[SETTINGS_KEYS];

void settings_init(struct settings *settings);
void settings_free(struct settings *settings);

#endif
