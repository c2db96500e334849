/*
 * Compares the farm's kernel with other ray tracers: the same scenes at the same size and depth, on one thread
 * each, in turn, several times; prints medians, rates and ratios. See usage().
 */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "bench/kernel_report.h"
#include "bench/kernel_scenes.h"
#include "bench/outside.h"
#include "bench/scenes.h"
#include "common/message.h"

static _Noreturn void usage(const char *why)
{
    fprintf(stderr,
            "kernel: %s\n"
            "usage: kernel [--scenes NAME,NAME] [--programs farm,embree,tachyon,povray]\n"
            "              [--repeat N] [--scale F] [--size WxH] [--steps no]\n"
            "              [--folder DIR] [--farm PROGRAM] [--embree PROGRAM]\n"
            "              [--csv FILE] [--markdown FILE] [--montage FILE.png]\n"
            "  --scenes     all but pipes, which Tachyon takes minutes for\n"
            "  --scale F    multiplies the number of primitives of the generated scenes\n"
            "  --steps no   the picture alone: no rates by kind of ray\n"
            "  --montage    all pictures, half as large: a row for each scene, a column for each "
            "program\n",
            why);
    exit(2);
}

struct options {
    struct bench bench;
    bool programs[PROGRAM_COUNT];
    const char *scenes; /* NULL: all */
    double scale;
    unsigned repeat;
    bool steps;
    const char *csv, *markdown, *montage;
};

static double number_option(const char *text, double least, double most)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text || *end || !(value >= least && value <= most))
        usage("a number is out of range");
    return value;
}

static void choose_programs(struct options *options, const char *list)
{
    size_t known = 0;
    for (unsigned p = 0; p < PROGRAM_COUNT; p++) {
        options->programs[p] = is_listed(list, program_names[p]);
        known += options->programs[p];
    }
    if (known != listed_words(list)) usage("a program is unknown");
}

static void read_option(struct options *options, const char *name, const char *value)
{
    struct bench *bench = &options->bench;
    if (!strcmp(name, "--scenes"))
        options->scenes = value;
    else if (!strcmp(name, "--programs"))
        choose_programs(options, value);
    else if (!strcmp(name, "--repeat"))
        options->repeat = (unsigned)number_option(value, 1, REPEAT_MAX);
    else if (!strcmp(name, "--scale"))
        options->scale = number_option(value, 1e-3, 1e2);
    else if (!strcmp(name, "--steps"))
        options->steps = strcmp(value, "no") != 0;
    else if (!strcmp(name, "--folder"))
        bench->folder = value;
    else if (!strcmp(name, "--farm"))
        bench->farm = value;
    else if (!strcmp(name, "--embree"))
        bench->embree = value;
    else if (!strcmp(name, "--csv"))
        options->csv = value;
    else if (!strcmp(name, "--markdown"))
        options->markdown = value;
    else if (!strcmp(name, "--montage"))
        options->montage = value;
    else if (strcmp(name, "--size") || sscanf(value, "%ux%u", &bench->width, &bench->height) != 2)
        usage("unknown option");
}

static struct options parse_options(int argc, char **argv)
{
    struct options options = {
        .bench = {.farm = "./farm",
                  .embree = "build/bench/kernel_embree",
                  .folder = "build/bench/kernel.out",
                  .width = 640,
                  .height = 480},
        .programs = {true, true, true, true},
        .scale = 1,
        .repeat = 5,
        .steps = true,
    };
    for (int i = 1; i < argc; i += 2) {
        if (i + 1 == argc) usage("an option without its value");
        read_option(&options, argv[i], argv[i + 1]);
    }
    return options;
}

/* ---- scenes ---- */

static const struct {
    const char *name;
    bool has_mesh;
    bool by_default; /* false: only if it is named, as Tachyon takes minutes */
} all_scenes[] = {
    {"balls", false, true},     {"tetra", true, true},   {"mount", true, true},
    {"rings_mesh", true, true}, {"rings", false, true},  {"tree", false, true},
    {"lattice", false, true},   {"million", true, true}, {"planet", true, true},
    {"pipes", true, false},     {"lantern", true, true}, {"garden", true, true},
};
#define SCENE_COUNT (sizeof all_scenes / sizeof *all_scenes)

static void make_folder(const char *path)
{
    if (mkdir(path, 0777) && errno != EEXIST) fatal("%s: %s", path, strerror(errno));
}

/* Whether a line makes a material spawn rays: the farm traces some below the last level, too, for its bound. */
static bool makes_rays(const char *line)
{
    return !strncmp(line, "reflection =", 12) || !strncmp(line, "transmission =", 14);
}

/* Writes the scene as --print-config prints it, without its lights, mirrors and glass. */
static void write_dark(const struct bench *bench, const struct kernel_scene *scene)
{
    char *command = format_text("'%s' --print-config '%s'", bench->farm, scene->config),
         *line = NULL;
    FILE *in = popen(command, "r"), *out = fopen(scene->dark, "w");
    size_t room = 0;
    bool keep = true;
    if (!in || !out) fatal("%s cannot be written: %s", scene->dark, strerror(errno));
    while (getline(&line, &room, in) > 0) {
        if (line[0] == '[') keep = strncmp(line, "[light", 6) != 0;
        if (keep && !makes_rays(line)) fputs(line, out);
    }
    if (pclose(in) || fclose(out)) fatal("%s cannot be made from %s", scene->dark, scene->config);
    free(line);
    free(command);
}

/* Loads a scene with the settings of the picture: those of add_settings() in kernel_run.c. */
static struct scene *load_block(const struct bench *bench, const char *config)
{
    char *width = format_text("image.width=%u", bench->width);
    char *height = format_text("image.height=%u", bench->height);
    char *region = format_text("image.region=0 0 %u %u", bench->width, bench->height);
    const char *settings[] = {width, height, region, "render.max_depth=20", "sampling.samples=1",
                              NULL};
    struct scene *block = scene_load(config, settings, REACH_ANYWHERE);
    if (!block) fatal("%s cannot be loaded", config);
    free(region);
    free(height);
    free(width);
    return block;
}

static void export_for_peers(const struct options *options, const struct kernel_scene *scene)
{
    const struct bench *bench = &options->bench;
    if (!options->programs[PROGRAM_TACHYON] && !options->programs[PROGRAM_POVRAY]) return;
    struct scene *block = load_block(bench, scene->config);
    for (unsigned p = PROGRAM_TACHYON; p <= PROGRAM_POVRAY; p++)
        if (options->programs[p]) export_scene(bench, scene, p, block);
    free(block);
}

static struct kernel_scene prepare_scene(const struct options *options, size_t i)
{
    const struct bench *bench = &options->bench;
    struct kernel_scene scene = {.name = all_scenes[i].name, .has_mesh = all_scenes[i].has_mesh};
    bool generated = kernel_scene_write(bench->folder, scene.name, options->scale);
    scene.config = format_text("%s/%s.ini", generated ? bench->folder : "config", scene.name);
    scene.dark = format_text("%s/%s-dark.ini", bench->folder, scene.name);
    write_dark(bench, &scene);
    export_for_peers(options, &scene);
    return scene;
}

static void free_scene(struct kernel_scene *scene)
{
    free(scene->config);
    free(scene->dark);
}

/* ---- runs ---- */

/* Whether a program is measured in a step: those that are whole programs only render pictures. */
static bool has_step(const struct options *options, enum program program, enum step step)
{
    if (step == STEP_PICTURE) return true;
    return options->steps && (program == PROGRAM_FARM || program == PROGRAM_EMBREE);
}

/* Measures all programs in turn, so that disturbances affect all of them. */
static bool measure_scene(const struct options *options, struct scene_results *results)
{
    bool good = true;
    for (unsigned r = 0; r < options->repeat; r++)
        for (unsigned step = 0; step < STEP_COUNT; step++)
            for (unsigned p = 0; p < PROGRAM_COUNT; p++) {
                struct series *series = &results->series[p][step];
                if (!options->programs[p] || !has_step(options, p, step)) continue;
                if (series->failed) continue;
                series->failed = !run_program(&options->bench, &results->scene, p, step,
                                              &series->runs[series->count]);
                if (series->failed)
                    good = false;
                else
                    series->count++;
            }
    return good;
}

/* Compares each picture with the farm's; the pictures are kept for the montage. False when one cannot be read. */
static bool look_at_pictures(const struct options *options, struct scene_results *results,
                             struct canvas pictures[PROGRAM_COUNT])
{
    bool good = true;
    for (unsigned p = 0; p < PROGRAM_COUNT; p++) {
        results->difference[p] = (struct picture_difference){(double)NAN, (double)NAN};
        if (results->series[p][STEP_PICTURE].count == 0) continue;
        char *path = picture_path(&options->bench, &results->scene, p);
        bool read = picture_read(path, &pictures[p]);
        if (read && pictures[PROGRAM_FARM].rgb)
            results->difference[p] = picture_compare(&pictures[PROGRAM_FARM], &pictures[p]);
        good = good && read;
        free(path);
    }
    return good;
}

static bool programs_found(const struct options *options)
{
    for (unsigned p = 0; p < PROGRAM_COUNT; p++) {
        if (!options->programs[p] || program_found(&options->bench, p)) continue;
        fprintf(stderr, "kernel: %s is not there (make bench-deps)\n", program_names[p]);
        return false;
    }
    return true;
}

static bool is_chosen(const struct options *options, size_t i)
{
    if (!options->scenes) return all_scenes[i].by_default;
    return is_listed(options->scenes, all_scenes[i].name);
}

static void check_scenes(const char *list)
{
    size_t known = 0;
    for (size_t i = 0; i < SCENE_COUNT; i++)
        known += is_listed(list, all_scenes[i].name);
    if (known != listed_words(list)) usage("a scene is unknown");
}

int main(int argc, char **argv)
{
    struct options options = parse_options(argc, argv);
    if (options.scenes) check_scenes(options.scenes);
    if (!programs_found(&options)) return 1;
    struct scene_results *results = allocate_zeroed(SCENE_COUNT, sizeof *results);
    struct canvas pictures[SCENE_COUNT * PROGRAM_COUNT] = {{0}};
    size_t count = 0;
    bool good = true;
    make_folder(options.bench.folder);
    for (size_t i = 0; i < SCENE_COUNT; i++) {
        if (!is_chosen(&options, i)) continue;
        struct scene_results *here = &results[count++];
        here->scene = prepare_scene(&options, i);
        good &= measure_scene(&options, here);
        good &= look_at_pictures(&options, here, &pictures[(count - 1) * PROGRAM_COUNT]);
        report_scene(stdout, here, count == 1);
        fflush(stdout);
    }
    if (count == 0) usage("no scene of this name");
    report_summary(stdout, results, count);
    if (options.csv) report_csv(options.csv, results, count);
    if (options.markdown) report_markdown(options.markdown, results, count);
    const unsigned all = (unsigned)count * PROGRAM_COUNT;
    if (options.montage) good &= picture_montage(options.montage, pictures, all, PROGRAM_COUNT);
    for (size_t i = 0; i < count; i++)
        free_scene(&results[i].scene);
    for (unsigned i = 0; i < all; i++)
        canvas_free(&pictures[i]);
    free(results);
    return good ? 0 : 1;
}
