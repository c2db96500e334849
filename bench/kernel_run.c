#include "bench/kernel_run.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "bench/command.h"
#include "bench/kernel_export.h"
#include "bench/outside.h"
#include "bench/report_values.h"
#include "common/message.h"

const char *const program_names[PROGRAM_COUNT] = {"farm", "embree", "tachyon", "povray"};
const char *const step_names[STEP_COUNT] = {"picture", "direct", "primary", "shadowless"};
const char *const metric_names[METRIC_COUNT] = {
    "render_s", "render_wall_s", "intersect_s", "build_s", "process_s", "process_wall_s", "primary",
    "shadow",   "reflection",    "refraction",  "bytes",   "triangles", "primitives"};

/* The number after the first `key` in the text, or after the first one that follows `after`; NAN: there is none. */
static double number_after(const char *text, const char *after, const char *key)
{
    const char *at = after ? strstr(text, after) : text;
    at = at ? strstr(at, key) : NULL;
    if (!at) return (double)NAN;
    char *end;
    double value = strtod(at + strlen(key), &end);
    return end == at + strlen(key) ? (double)NAN : value;
}

/* ---- the farm ---- */

char *picture_path(const struct bench *bench, const struct kernel_scene *scene,
                   enum program program)
{
    bool floats = program == PROGRAM_FARM || program == PROGRAM_EMBREE;
    return format_text("%s/%s-%s.%s", bench->folder, scene->name, program_names[program],
                       floats ? "pfm" : "ppm");
}

/* Only STEP_PICTURE's picture is kept. */
static char *output_path(const struct bench *bench, const struct kernel_scene *scene,
                         enum program program, enum step step)
{
    if (step == STEP_PICTURE) return picture_path(bench, scene, program);
    return format_text("%s/step-%s.pfm", bench->folder, program_names[program]);
}

/* Adds a word that ends with the path, which is freed. */
static void add_path(struct command *command, const char *before, char *path)
{
    command_add(command, "%s%s", before, path);
    free(path);
}

/* Adds the settings, which are the same for the farm and for Embree's program, as that loads its scenes by the
 * farm's loader. */
static void add_settings(struct command *command, const struct bench *bench, enum step step)
{
    command_add(command, "image.width=%u", bench->width);
    command_add(command, "image.height=%u", bench->height);
    command_add(command, "image.region=0 0 %u %u", bench->width, bench->height);
    command_add(command, "render.max_depth=%d", step == STEP_PICTURE ? 20 : 0);
    command_add(command, "sampling.samples=1");
    if (step == STEP_PRIMARY || step == STEP_SHADOWLESS) command_add(command, "render.shadows=no");
}

static struct command farm_command(const struct bench *bench, const struct kernel_scene *scene,
                                   enum step step)
{
    struct command command = {0};
    command_add(&command, "%s", bench->farm);
    command_add(&command, "--allow-outside"); /* the sample scenes' meshes */
    command_add(&command, "%s", step == STEP_PRIMARY ? scene->dark : scene->config);
    add_settings(&command, bench, step);
    add_path(&command, "output.image=", output_path(bench, scene, PROGRAM_FARM, step));
    command_add(&command, "output.report=%s/report.json", bench->folder);
    command_add(&command, "output.journal="); /* all tiles are this run's own */
    return command;
}

static void read_farm(const struct bench *bench, struct measurement *out)
{
    char *path = format_text("%s/report.json", bench->folder), *text = report_text(path);
    out->at[RENDER_S] = number_after(text, "\"workers\"", "\"cpu_s\":");
    out->at[RENDER_WALL_S] = number_after(text, "\"time\"", "\"render_s\":");
    /* intersect_s is in wall seconds, for part of which the thread may not have had a core: it is scaled to CPU
     * seconds by the ratio for the tiles. The CPU seconds include the pre-pass, so that the result is rather too
     * large. */
    double inside = number_after(text, "\"workers\"", "\"intersect_s\":");
    double busy = number_after(text, "\"workers\"", "\"busy_s\":");
    out->at[INTERSECT_S] = out->at[RENDER_S] * inside / busy;
    out->at[BUILD_S] = number_after(text, "\"time\"", "\"build_s\":");
    out->at[RAYS_PRIMARY] = number_after(text, "\"rays\"", "\"primary\":");
    out->at[RAYS_SHADOW] = number_after(text, "\"rays\"", "\"shadow\":");
    out->at[RAYS_REFLECTION] = number_after(text, "\"rays\"", "\"reflection\":");
    out->at[RAYS_REFRACTION] = number_after(text, "\"rays\"", "\"refraction\":");
    out->at[BYTES] = number_after(text, "\"scene\"", "\"bytes\":") +
                     number_after(text, "\"scene\"", "\"bvh_bytes\":");
    out->at[TRIANGLES] = number_after(text, "\"scene\"", "\"triangles\":");
    out->at[PRIMITIVES] = number_after(text, "\"scene\"", "\"primitives\":");
    free(text);
    free(path);
}

/* ---- Embree ---- */

static struct command embree_command(const struct bench *bench, const struct kernel_scene *scene,
                                     enum step step)
{
    struct command command = {0};
    command_add(&command, "%s", bench->embree);
    if (step == STEP_PRIMARY) command_add(&command, "--primary");
    command_add(&command, "--image");
    add_path(&command, "", output_path(bench, scene, PROGRAM_EMBREE, step));
    command_add(&command, "%s", step == STEP_PRIMARY ? scene->dark : scene->config);
    add_settings(&command, bench, step);
    return command;
}

/* The program prints metrics by their names. */
static void read_embree(const char *text, struct measurement *out)
{
    for (unsigned m = 0; m < METRIC_COUNT; m++) {
        char *key = format_text("\n%s ", metric_names[m]);
        double value = number_after(text, NULL, key);
        if (!isnan(value)) out->at[m] = value;
        free(key);
    }
}

/* ---- Tachyon and POV-Ray ---- */

/* The exported scene, which is the same for all repeats and written once. */
static char *peer_scene(const struct bench *bench, const struct kernel_scene *scene,
                        enum program program)
{
    return format_text("%s/%s.%s", bench->folder, scene->name,
                       program == PROGRAM_TACHYON ? "dat" : "pov");
}

static struct command tachyon_command(const struct bench *bench, const struct kernel_scene *scene)
{
    struct command command = {0};
    static const char *const words[] = {"tachyon",      "+V",      "-numthreads", "1", "-fullshade",
                                        "-shade_phong", "-format", "PPM48",       "-o"};
    for (unsigned i = 0; i < sizeof words / sizeof *words; i++)
        command_add(&command, "%s", words[i]);
    add_path(&command, "", picture_path(bench, scene, PROGRAM_TACHYON));
    add_path(&command, "", peer_scene(bench, scene, PROGRAM_TACHYON));
    return command;
}

/* Tachyon reports wall seconds: they are scaled to CPU seconds by the ratio for the whole process, which has one
 * thread. */
static void read_tachyon(const char *text, struct measurement *out)
{
    out->at[RENDER_WALL_S] = number_after(text, NULL, "Ray Tracing Time:");
    out->at[BUILD_S] = number_after(text, NULL, "Preprocessing Time:");
    out->at[RENDER_S] =
        out->at[RENDER_WALL_S] * fmin(1, out->at[PROCESS_S] / out->at[PROCESS_WALL_S]);
}

static struct command povray_command(const struct bench *bench, const struct kernel_scene *scene)
{
    struct command command = {0};
    static const char *const words[] = {"povray", "+WT1", "-D",    "-V",
                                        "-A",     "+Q9",  "+FP16", "File_Gamma=1"};
    for (unsigned i = 0; i < sizeof words / sizeof *words; i++)
        command_add(&command, "%s", words[i]);
    command_add(&command, "+W%u", bench->width);
    command_add(&command, "+H%u", bench->height);
    add_path(&command, "+I", peer_scene(bench, scene, PROGRAM_POVRAY));
    add_path(&command, "+O", picture_path(bench, scene, PROGRAM_POVRAY));
    return command;
}

static void read_povray(const char *text, struct measurement *out)
{
    out->at[RENDER_S] = number_after(text, "Trace Time", "thread(s) with");
    out->at[RENDER_WALL_S] = number_after(text, "Trace Time", "seconds (");
}

/* ---- any of them ---- */

bool program_found(const struct bench *bench, enum program program)
{
    static const char *const installed[PROGRAM_COUNT] = {NULL, NULL, "tachyon", "povray"};
    if (program == PROGRAM_FARM) return access(bench->farm, X_OK) == 0;
    if (program == PROGRAM_EMBREE) return access(bench->embree, X_OK) == 0;
    return run_shell("command -v %s >/dev/null", installed[program]) == 0;
}

void export_scene(const struct bench *bench, const struct kernel_scene *scene, enum program program,
                  const struct scene *block)
{
    char *path = peer_scene(bench, scene, program);
    if (program == PROGRAM_TACHYON)
        export_tachyon(path, block);
    else
        export_povray(path, block);
    free(path);
}

static struct command command_of(const struct bench *bench, const struct kernel_scene *scene,
                                 enum program program, enum step step)
{
    switch (program) {
    case PROGRAM_FARM:
        return farm_command(bench, scene, step);
    case PROGRAM_TACHYON:
        return tachyon_command(bench, scene);
    case PROGRAM_POVRAY:
        return povray_command(bench, scene);
    case PROGRAM_EMBREE:
    case PROGRAM_COUNT:
        break;
    }
    return embree_command(bench, scene, step);
}

bool run_program(const struct bench *bench, const struct kernel_scene *scene, enum program program,
                 enum step step, struct measurement *out)
{
    for (unsigned i = 0; i < METRIC_COUNT; i++)
        out->at[i] = (double)NAN;
    struct command command = command_of(bench, scene, program, step);
    char *log = format_text("%s/%s-%s-%s.log", bench->folder, scene->name, program_names[program],
                            step_names[step]);
    struct usage usage;
    bool good = command_run(&command, log, &usage);
    out->at[PROCESS_WALL_S] = usage.wall_s;
    out->at[PROCESS_S] = usage.cpu_s;
    if (good) {
        char *text = report_text(log);
        if (program == PROGRAM_FARM) read_farm(bench, out);
        if (program == PROGRAM_EMBREE) read_embree(text, out);
        if (program == PROGRAM_TACHYON) read_tachyon(text, out);
        if (program == PROGRAM_POVRAY) read_povray(text, out);
        free(text);
        good = isfinite(out->at[RENDER_S]);
        if (!good) fprintf(stderr, "kernel: no time in %s\n", log);
    }
    free(log);
    return good;
}
