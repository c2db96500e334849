/* Rows 56-58: the program as a whole. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "bench/outside.h"
#include "bench/pictures.h"
#include "common/message.h"

/* ---- 56 ---- */

struct trial {
    unsigned ranks; /* 0: without mpiexec */
    const char *how;
};

/* 0: the same picture as the reference, which the first trial makes. */
static bool trial_differs(const struct trial *trial, const char *folder, bool quick, bool first)
{
    char launch[256] = "";
    if (trial->ranks)
        snprintf(launch, sizeof launch, "%s -n %u", from_environment("MPIEXEC", "mpiexec"),
                 trial->ranks);
    if (run_shell("timeout 120 %s '%s' test/data/everything.ini output.report= "
                  "output.image=%s/%s.pfm image.width=%d image.height=%d farm.kernel=%s %s "
                  ">/dev/null 2>&1",
                  launch, from_environment("FARM", "./farm"), folder, first ? "first" : "next",
                  quick ? 48 : 194, quick ? 32 : 122, processor_level_names[stage_kernel()],
                  trial->how) != 0)
        return true;
    return !first && run_shell("cmp -s %s/first.pfm %s/next.pfm", folder, folder) != 0;
}

static void run_processes(const struct budget *budget, struct case_result *result)
{
    const struct trial trials[] = {
        {0, ""},
        {2, "farm.tile=7"},
        {3, "farm.schedule=cyclic"},
        {0, "farm.tile=1"},
        {1, "farm.tile=64"},
        {2, "farm.schedule=strips"},
        {3, "farm.tile=16 farm.master_renders=no"},
        {4, "farm.schedule=strips farm.master_renders=no"},
        {5, "farm.schedule=cyclic farm.tile=33"},
        {8, "farm.tile=auto"},
    };
    char folder[] = "/tmp/farm-pictures-XXXXXX";
    uint64_t count = budget->quick ? 3 : sizeof trials / sizeof *trials, wrong = 0;
    if (!mkdtemp(folder)) fatal("cannot make a folder for pictures: %s", strerror(errno));
    for (uint64_t i = 0; i < count; i++) {
        if (!trial_differs(&trials[i], folder, budget->quick, i == 0)) continue;
        wrong++;
        if (!result->note[0])
            snprintf(result->note, sizeof result->note, "-n %u %s", trials[i].ranks, trials[i].how);
    }
    run_shell("rm -r %s", folder);
    if (!wrong)
        snprintf(result->note, sizeof result->note,
                 "runs that are killed and go on: make bench-faults");
    snprintf(result->paper, sizeof result->paper, "the same");
    snprintf(result->ours, sizeof result->ours, "%llu of %llu runs differ",
             (unsigned long long)wrong, (unsigned long long)count);
    picture_verdict(result, count, wrong);
}

/* ---- 57 ---- */

static void run_builds(const struct budget *budget, struct case_result *result)
{
    result->verdict = VERDICT_MARKED;
    if (budget->quick) {
        snprintf(result->note, sizeof result->note, "builds take minutes: at full size only");
        return;
    }
    FILE *script = popen("sh bench/builds.sh", "r");
    if (!script) fatal("cannot run bench/builds.sh");
    char line[256];
    unsigned same = 0, wrong = 0, missing = 0;
    while (fgets(line, sizeof line, script)) {
        line[strcspn(line, "\n")] = '\0';
        bool differs = strncmp(line, "differs ", 8) == 0, lacks = strncmp(line, "missing ", 8) == 0;
        same += strncmp(line, "same ", 5) == 0;
        wrong += differs;
        missing += lacks;
        /* The first build that differs; only if there is none, what is missing. */
        if ((differs && wrong == 1) || (lacks && wrong == 0 && missing == 1))
            snprintf(result->note, sizeof result->note, "%s", line);
    }
    bool complete = pclose(script) == 0;
    snprintf(result->paper, sizeof result->paper, "the same builds");
    snprintf(result->ours, sizeof result->ours, "%u of %u builds differ", wrong, same + wrong);
    picture_verdict(result, same + wrong, wrong + !(complete || wrong));
    if (missing && complete && wrong == 0) result->verdict = VERDICT_MARKED;
}

/* ---- 58 ---- */

static const char *const quick_size[] = {"image.width=32", "image.height=24", "sampling.samples=1",
                                         "render.max_depth=20", NULL};
static const char *const full_size[] = {"image.width=320", "image.height=240", "sampling.samples=4",
                                        NULL};

/* Non-finite samples of a scene, as the renderer counts them and as the picture shows them. */
static uint64_t bad_samples(const struct scene *scene, bool *agree)
{
    struct picture picture = picture_render(scene);
    uint64_t seen = 0;
    for (size_t i = 0; i < (size_t)picture.width * picture.height * 3; i++)
        seen += isfinite(picture.rgb[i]) ? 0 : 1;
    uint64_t counted = picture.counts.nonfinite;
    *agree = (seen == 0) == (counted == 0);
    picture_free(&picture);
    return counted;
}

/* Whether a NaN or an overflow that gets into a scene behind the loader's back is counted. */
static bool injected_found(const char *path, const char *const *size)
{
    struct scene *scene = picture_load(path, size);
    bool agree, found = true;
    struct view *view = &scene->view;
    double eye = view->camera.eye.x;
    view->camera.eye.x = (double)NAN;
    found = found && bad_samples(scene, &agree) > 0;
    view->camera.eye.x = eye;
    view->background_top.y = HUGE_VAL;
    found = found && bad_samples(scene, &agree) > 0 && agree;
    view->background_top.y = 0;
    struct light *lights = (struct light *)((char *)scene + scene->lights.offset);
    lights[0].color.z = (double)NAN;
    found = found && bad_samples(scene, &agree) > 0 && agree;
    free(scene);
    return found;
}

static void run_any_scene(const struct budget *budget, struct case_result *result)
{
    const char *const *size = budget->quick ? quick_size : full_size;
    uint64_t scenes = 0, bad = 0, paper = 0;
    char **files = picture_files(budget->quick);
    for (char **file = files; *file; file++) {
        struct scene *scene = picture_load(*file, size);
        bool agree;
        uint64_t count = bad_samples(scene, &agree);
        count += !agree;
        bad += count;
        if (count) snprintf(result->note, sizeof result->note, "%s", *file);
        scene->view.formulas = FORMULAS_PAPER;
        paper += bad_samples(scene, &agree);
        scenes++;
        free(scene);
    }
    picture_files_free(files);
    bool found = injected_found("test/data/everything.ini", size);
    snprintf(result->paper, sizeof result->paper, "%llu non-finite", (unsigned long long)paper);
    snprintf(result->ours, sizeof result->ours, "%llu non-finite in %llu scenes, injected %s",
             (unsigned long long)bad, (unsigned long long)scenes, found ? "found" : "MISSED");
    picture_verdict(result, scenes, bad + !found);
}

const struct stability_case farm_cases[] = {
    {56, "ranks, tile sizes, schedules", "self", "pictures identical", .run = run_processes},
    {57, "builds: FMA, -O0 / -O3, gcc / clang", "self", "pictures identical", .run = run_builds},
    {58, "any scene", "-", "0 non-finite; injected NaN found", .run = run_any_scene, .files = true},
    {.number = 0},
};
