/*
 * A tool for what bench/error.sh cannot do itself:
 *
 *   error_tool compare A B               the RMSE of two pictures (PFM, PPM), clamped to 0..1
 *   error_tool scene FOLDER NAME         FOLDER/NAME.ini: a scene of bench/kernel_scenes.h
 *   error_tool export CONFIG OUT [KEY=VALUE ...]
 *                                        the scene for Tachyon (OUT ends with .dat) or POV-Ray, as large as
 *                                        they need it (error_scale.h)
 *   error_tool allocation NAME CONFIG [KEY=VALUE ...]
 *                                        the gain of the best allocation of samples to pixels
 *   error_tool lattice CONFIG PIXELS SAMPLES A B [KEY=VALUE ...]
 *                                        the errors of two pictures (PFM) of the scene, against a reference of
 *                                        SAMPLES samples of about PIXELS of their pixels: RMSE of A, its
 *                                        standard deviation, the same of B, RMSE of the reference
 *   error_tool fields COUNT              how well errors are estimated for things that few samples hit (error_fields.h)
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/error_allocation.h"
#include "bench/error_fields.h"
#include "bench/error_lattice.h"
#include "bench/error_scale.h"
#include "bench/kernel_export.h"
#include "bench/kernel_picture.h"
#include "bench/kernel_scenes.h"
#include "bench/scenes.h"
#include "common/message.h"
#include "master/number.h"

static int compare(const char *first, const char *second)
{
    struct canvas a = {0}, b = {0};
    bool good = picture_read(first, &a) && picture_read(second, &b);
    if (good && (a.width != b.width || a.height != b.height)) {
        fprintf(stderr, "%s is %u x %u, %s is %u x %u: they cannot be compared\n", first, a.width,
                a.height, second, b.width, b.height);
        good = false;
    }
    if (good) printf("%.9g\n", picture_compare(&a, &b).rmse);
    canvas_free(&a);
    canvas_free(&b);
    return good ? EXIT_SUCCESS : EXIT_FAILURE;
}

static int export(const char *config, const char *out, const char *const *overrides)
{
    struct scene *scene = scene_load(config, overrides, REACH_ANYWHERE);
    if (!scene) return EXIT_FAILURE;
    scale_for_peers(scene);
    size_t length = strlen(out);
    if (length > 4 && !strcmp(out + length - 4, ".dat"))
        export_tachyon(out, scene);
    else
        export_povray(out, scene);
    free(scene);
    return EXIT_SUCCESS;
}

static int allocation(const char *name, const char *config, const char *const *overrides)
{
    struct scene *scene = scene_load(config, overrides, REACH_ANYWHERE);
    if (!scene) return EXIT_FAILURE;
    allocation_measure(scene, name);
    free(scene);
    return EXIT_SUCCESS;
}

/* Parses a positive whole number that `steps` divides; ends the program if it is none. */
static uint32_t whole_count(const char *text, uint32_t steps)
{
    uint32_t count;
    if (!number_parse_unsigned(text, &count) || count == 0 || count % steps != 0)
        fatal("expected %s number above 0, not %s", steps == 2 ? "an even" : "a whole", text);
    return count;
}

static int lattice(char **arguments, const char *const *overrides)
{
    uint32_t pixels = whole_count(arguments[1], 1), samples = whole_count(arguments[2], 2);
    struct scene *scene = scene_load(arguments[0], overrides, REACH_ANYWHERE);
    if (!scene) return EXIT_FAILURE;
    struct canvas pictures[2] = {0};
    bool good =
        picture_read(arguments[3], &pictures[0]) && picture_read(arguments[4], &pictures[1]);
    for (uint32_t i = 0; i < 2 && good; i++)
        good =
            pictures[i].width == scene->view.region_w && pictures[i].height == scene->view.region_h;
    if (good) {
        struct lattice_error errors[2];
        lattice_compare(scene, pixels, samples, pictures, 2, errors);
        printf("%.9g %.3g %.9g %.3g %.3g\n", errors[0].rmse, errors[0].deviation, errors[1].rmse,
               errors[1].deviation, errors[0].reference);
    }
    canvas_free(&pictures[0]);
    canvas_free(&pictures[1]);
    free(scene);
    return good ? EXIT_SUCCESS : EXIT_FAILURE;
}

static int fields(const char *count)
{
    fields_measure(whole_count(count, 1));
    return EXIT_SUCCESS;
}

int main(int argc, char **argv)
{
    const char *const *words = (const char *const *)argv;
    if (argc == 4 && !strcmp(argv[1], "compare")) return compare(argv[2], argv[3]);
    if (argc == 4 && !strcmp(argv[1], "scene"))
        return kernel_scene_write(argv[2], argv[3], 1) ? EXIT_SUCCESS : EXIT_FAILURE;
    if (argc >= 4 && !strcmp(argv[1], "export")) return export(argv[2], argv[3], words + 4);
    if (argc >= 4 && !strcmp(argv[1], "allocation")) return allocation(argv[2], argv[3], words + 4);
    if (argc >= 7 && !strcmp(argv[1], "lattice")) return lattice(argv + 2, words + 7);
    if (argc == 3 && !strcmp(argv[1], "fields")) return fields(argv[2]);
    fputs("usage: error_tool compare A B | scene FOLDER NAME | export CONFIG OUT [KEY=VALUE ...] | "
          "allocation NAME CONFIG [KEY=VALUE ...] | lattice CONFIG PIXELS SAMPLES A B [KEY=VALUE "
          "...] | fields COUNT\n",
          stderr);
    return 2;
}
