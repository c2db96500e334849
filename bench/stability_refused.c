/* Row 10: meaningless numbers, which the loaders must refuse. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "bench/stability.h"
#include "common/message.h"
#include "master/load.h"

/* Scenes that must be refused, and the line with the error. */
static const struct {
    const char *extension, *text;
    int line;
} refused[] = {
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = 0\n", 3},
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = -1\n", 3},
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = -0\n", 3},
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = nan\n", 3},
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = inf\n", 3},
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = -inf\n", 3},
    {"ini", "[sphere s]\ncenter = 0 0 0\nradius = 1e999\n", 3},
    {"ini", "[sphere s]\ncenter = 0 nan 0\nradius = 1\n", 2},
    {"ini", "[sphere s]\ncenter = 0 1e400 0\nradius = 1\n", 2},
    {"ini", "[disc d]\ncenter = 0 0 0\nnormal = 0 1 0\nradius = 0\n", 4},
    {"ini", "[disc d]\ncenter = 0 0 0\nnormal = 0 0 0\nradius = 1\n", 1},
    {"ini", "[plane p]\npoint = 0 0 0\nnormal = 0 0 0\n", 1},
    {"ini", "[plane p]\npoint = 0 0 0\nnormal = 0 inf 0\n", 3},
    {"nff", "f 1 1 1 1 0 0 0 1\ns 0 0 0 0\n", 2},
    {"nff", "f 1 1 1 1 0 0 0 1\ns 0 0 0 nan\n", 2},
    {"nff", "f 1 1 1 1 0 0 0 1\ns 0 0 0 inf\n", 2},
    {"nff", "f 1 1 1 1 0 0 0 1\ns 0 1e999 0 1\n", 2},
};

/* Whether loading reports exactly one line, which begins with "path:line:". */
static bool is_refused(const char *folder, size_t which)
{
    char message[1024] = "";
    char *path = format_text("%s/scene.%s", folder, refused[which].extension);
    FILE *file = fopen(path, "w");
    if (!file || fputs(refused[which].text, file) < 0 || fclose(file) != 0)
        fatal("cannot write %s", path);
    struct job job;
    message_capture(message, sizeof message);
    bool loaded = load_job(path, NULL, 0, REACH_FOLDER, &job);
    message_capture(NULL, 0);
    if (loaded) job_free(&job);
    char *start = format_text("%s:%d:", path, refused[which].line);
    bool good = !loaded && strncmp(message, start, strlen(start)) == 0;
    unlink(path);
    free(start);
    free(path);
    return good;
}

static void run_10(const struct budget *budget, struct case_result *result)
{
    (void)budget;
    char folder[] = "/tmp/stability-XXXXXX";
    struct tally tally = {.samples = 0};
    if (!mkdtemp(folder)) fatal("cannot make a folder for scenes");
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        if (!is_refused(folder, i)) score_wrong(&tally.ours, i);
        tally.samples++;
    }
    rmdir(folder);
    conclude(result, &tally, NULL, 0);
    strcpy(result->paper, "-");
    result->paper_samples = 0;
}

const struct stability_case refused_cases[] = {
    {10, "r <= 0, NaN, inf", "-", "refused with file and line", .run = run_10},
    {.number = 0},
};
