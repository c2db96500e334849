/*
 * kernel_embree [--primary] [--image FILE.pfm] CONFIG [SECTION.KEY=VALUE ...]
 *
 * Renders a scene of the farm with Embree, on one thread, and prints what it took: a name and a number per line.
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

/* Bytes that Embree holds: called from one thread. */
struct memory {
    int64_t now, most;
};

static bool on_memory(void *context, ssize_t bytes, bool post)
{
    struct memory *memory = context;
    (void)post;
    memory->now += bytes;
    if (memory->now > memory->most) memory->most = memory->now;
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
    printf("render_s %.6f\nrender_cpu_s %.6f\n", clock_wall() - start, clock_thread_cpu() - cpu);
    printf("primary %llu\nshadow %llu\nreflection %llu\nrefraction %llu\n",
           (unsigned long long)rays[KIND_PRIMARY], (unsigned long long)rays[KIND_SHADOW],
           (unsigned long long)rays[KIND_REFLECTION], (unsigned long long)rays[KIND_REFRACTION]);
}

static void render_primary(const struct model *model, float *rgb)
{
    struct packet_times times;
    double cpu = clock_thread_cpu();
    trace_primary(model, rgb, &times);
    printf("render_cpu_s %.6f\n", clock_thread_cpu() - cpu);
    printf("packet_width %u\nprimary %llu\nhits %llu\nintersect_s %.6f\nrender_s %.6f\n",
           times.width, (unsigned long long)times.rays, (unsigned long long)times.hits,
           times.intersect_s, times.total_s);
}

int main(int argc, char **argv)
{
    struct options options = parse_options(argc, argv);
    struct scene *scene = scene_load(options.config, options.overrides, REACH_ANYWHERE);
    if (!scene) return 2;
    /* As Embree's manual asks: denormal numbers are flushed to zero. */
    _mm_setcsr(_mm_getcsr() | 0x8040);

    struct memory memory = {0};
    RTCDevice device = rtcNewDevice("threads=1,user_threads=1");
    if (!device) fatal("Embree does not start");
    rtcSetDeviceErrorFunction(device, on_error, NULL);
    rtcSetDeviceMemoryMonitorFunction(device, on_memory, &memory);
    struct model *model = allocate(1, sizeof *model);
    double start = clock_wall();
    model_create(model, scene, device);
    double committed = clock_wall();
    rtcCommitScene(model->rtc);
    double built = clock_wall();
    printf("embree %ld\nconvert_s %.6f\nbuild_s %.6f\n",
           (long)rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION), committed - start,
           built - committed);
    uint64_t triangles = scene_triangle_count(scene);
    printf("triangles %llu\nprimitives %llu\nembree_bytes %lld\nembree_peak_bytes %lld\nown_bytes "
           "%llu\n",
           (unsigned long long)triangles, (unsigned long long)scene_primitive_count(scene),
           (long long)memory.now, (long long)memory.most, (unsigned long long)model->own_bytes);

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
