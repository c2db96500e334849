/*
 * kernel_embree [--primary] [--image FILE.pfm] CONFIG [SECTION.KEY=VALUE ...]
 *
 * Renders a scene of the farm with Embree, on one thread, and prints what it took: a name of metric_names
 * (kernel_run.h) and a number per line, below the version.
 * Without --primary it renders the whole picture with single rays; with it, primary rays alone in coherent
 * packets.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <xmmintrin.h>

#include "bench/kernel_embree.h"
#include "bench/scenes.h"
#include "common/clock.h"
#include "common/message.h"
#include "master/image_file.h"

struct options {
    bool primary; /* primary rays alone; false: the whole picture */
    const char *image, *config;
    const char *const *overrides;
};

static _Noreturn void usage(void)
{
    fputs("usage: kernel_embree [--primary] [--image FILE.pfm] CONFIG [SECTION.KEY=VALUE "
          "...]\n",
          stderr);
    exit(2);
}

static struct options parse_options(int argc, char **argv)
{
    struct options options = {0};
    int i = 1;
    for (; i + 1 < argc && argv[i][0] == '-'; i++) {
        if (!strcmp(argv[i], "--primary"))
            options.primary = true;
        else if (!strcmp(argv[i], "--image"))
            options.image = argv[++i];
        else
            usage();
    }
    if (i >= argc) usage();
    options.config = argv[i++];
    options.overrides = (const char *const *)&argv[i];
    return options;
}

/* Counts the bytes that Embree holds: called from one thread. */
static bool on_memory(void *context, ssize_t bytes, bool post)
{
    (void)post;
    *(int64_t *)context += bytes;
    return true;
}

static void on_error(void *context, enum RTCError code, const char *text)
{
    (void)context;
    fatal("Embree: error %d: %s", code, text);
}

static void render_picture(const struct model *model, float *rgb)
{
    uint64_t rays[KIND_COUNT] = {0};
    double start = clock_wall(), cpu = clock_thread_cpu();
    trace_picture(model, rgb, rays);
    printf("render_s %.6f\nrender_wall_s %.6f\n", clock_thread_cpu() - cpu, clock_wall() - start);
    printf("primary %llu\nshadow %llu\nreflection %llu\nrefraction %llu\n",
           (unsigned long long)rays[KIND_PRIMARY], (unsigned long long)rays[KIND_SHADOW],
           (unsigned long long)rays[KIND_REFLECTION], (unsigned long long)rays[KIND_REFRACTION]);
}

static void render_primary(const struct model *model, float *rgb)
{
    double start = clock_wall(), cpu = clock_thread_cpu();
    double intersect_s = trace_primary(model, rgb);
    printf("render_s %.6f\nrender_wall_s %.6f\n", clock_thread_cpu() - cpu, clock_wall() - start);
    printf("primary %llu\nintersect_s %.6f\n",
           (unsigned long long)model->scene->view.width * model->scene->view.height, intersect_s);
}

int main(int argc, char **argv)
{
    struct options options = parse_options(argc, argv);
    struct scene *scene = scene_load(options.config, options.overrides, REACH_ANYWHERE);
    if (!scene) return 2;
    /* As Embree's manual asks: denormal numbers are flushed to zero. */
    _mm_setcsr(_mm_getcsr() | 0x8040);

    int64_t bytes = 0;
    RTCDevice device = rtcNewDevice("threads=1,user_threads=1");
    if (!device) fatal("Embree does not start");
    rtcSetDeviceErrorFunction(device, on_error, NULL);
    rtcSetDeviceMemoryMonitorFunction(device, on_memory, &bytes);
    struct model *model = allocate(1, sizeof *model);
    model_create(model, scene, device);
    double start = clock_wall();
    rtcCommitScene(model->rtc);
    double build_s = clock_wall() - start;
    printf("embree %ld\nbuild_s %.6f\n",
           (long)rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION), build_s);
    printf("triangles %llu\nprimitives %llu\nbytes %lld\n",
           (unsigned long long)scene_triangle_count(scene),
           (unsigned long long)scene_primitive_count(scene),
           (long long)bytes + (long long)model->own_bytes);

    struct canvas picture;
    canvas_init(&picture, scene->view.width, scene->view.height);
    if (options.primary)
        render_primary(model, picture.rgb);
    else
        render_picture(model, picture.rgb);
    bool good = !options.image || image_write(options.image, &picture, NULL);
    canvas_free(&picture);
    model_destroy(model);
    free(model);
    rtcReleaseDevice(device);
    free(scene);
    return good ? 0 : 1;
}
