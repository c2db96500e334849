/*
 * What bench/error.sh cannot do itself:
 *
 *   error_tool compare A B               the RMSE of two pictures (PFM, PPM), clamped to 0..1
 *   error_tool scene FOLDER NAME         FOLDER/NAME.ini: a scene of bench/kernel_scenes.h
 *   error_tool export CONFIG OUT [KEY=VALUE ...]
 *                                        the scene for Tachyon (OUT ends with .dat) or POV-Ray, as large as
 *                                        they need it (error_scale.h)
 *   error_tool allocation NAME CONFIG [KEY=VALUE ...]
 *                                        what the best allocation of samples to pixels could gain
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/error_allocation.h"
#include "bench/error_scale.h"
#include "bench/kernel_export.h"
#include "bench/kernel_picture.h"
#include "bench/kernel_scenes.h"
#include "master/load.h"

static int compare(const char *first, const char *second)
{
    struct canvas a, b;
    if (!picture_read(first, &a) || !picture_read(second, &b)) return EXIT_FAILURE;
    printf("%.9g\n", picture_compare(&a, &b).rmse);
    canvas_free(&a);
    canvas_free(&b);
    return EXIT_SUCCESS;
}

static int export(const char *config, const char *out, char **overrides, size_t count)
{
    struct job job;
    if (!load_job(config, overrides, count, REACH_ANYWHERE, &job)) return EXIT_FAILURE;
    struct view view = settings_view(&job.settings);
    struct scene *scene = builder_finish(job.builder, &view);
    scale_for_peers(scene);
    size_t length = strlen(out);
    if (length > 4 && !strcmp(out + length - 4, ".dat"))
        export_tachyon(out, scene);
    else
        export_povray(out, scene);
    free(scene);
    job_free(&job);
    return EXIT_SUCCESS;
}

static int allocation(const char *name, const char *config, char **overrides, size_t count)
{
    struct job job;
    if (!load_job(config, overrides, count, REACH_ANYWHERE, &job)) return EXIT_FAILURE;
    struct view view = settings_view(&job.settings);
    struct scene *scene = builder_finish(job.builder, &view);
    allocation_measure(scene, name, 0);
    free(scene);
    job_free(&job);
    return EXIT_SUCCESS;
}

int main(int argc, char **argv)
{
    if (argc == 4 && !strcmp(argv[1], "compare")) return compare(argv[2], argv[3]);
    if (argc == 4 && !strcmp(argv[1], "scene"))
        return kernel_scene_write(argv[2], argv[3], 1) ? EXIT_SUCCESS : EXIT_FAILURE;
    if (argc >= 4 && !strcmp(argv[1], "export"))
        return export(argv[2], argv[3], argv + 4, (size_t)argc - 4);
    if (argc >= 4 && !strcmp(argv[1], "allocation"))
        return allocation(argv[2], argv[3], argv + 4, (size_t)argc - 4);
    fputs("usage: error_tool compare A B | scene FOLDER NAME | export CONFIG OUT [KEY=VALUE ...] | "
          "allocation NAME CONFIG [KEY=VALUE ...]\n",
          stderr);
    return 2;
}
