/* Traces primary rays in Embree's coherent packets. */
#include <stdlib.h>

#include "bench/kernel_embree.h"
#include "common/clock.h"
#include "common/message.h"
#include "common/whole.h"

#define WIDE  16
/* Packets between two readings of the clock: 100 kB, within the second-level cache. */
#define CHUNK 256

/* Pixels are rendered in squares of this edge, one after the other, and in Z-order within a square: so 16
 * consecutive rays are as close to each other as possible. */
#define SQUARE 16

struct packets {
    const struct model *model;
    const struct view *view;
    unsigned width;
    uint64_t next, end; /* rays: one through the middle of each pixel */
    union {
        struct RTCRayHit16 wide[CHUNK];
        struct RTCRayHit8 narrow[CHUNK];
    } at;
    uint32_t pixels[CHUNK * WIDE];
};

/* Bits 0, 2, 4 and 6. */
static uint32_t even_bits(uint32_t k)
{
    return (k & 1) | (k >> 1 & 2) | (k >> 2 & 4) | (k >> 3 & 8);
}

static uint32_t pixel_of(const struct view *view, uint64_t k)
{
    uint32_t squares = view->width / SQUARE, inside = (uint32_t)(k % (SQUARE * SQUARE));
    uint32_t square = (uint32_t)(k / (SQUARE * SQUARE));
    uint32_t x = square % squares * SQUARE + even_bits(inside);
    uint32_t y = square / squares * SQUARE + even_bits(inside >> 1);
    return y * view->width + x;
}

/* Writes one ray into a packet of width N, which is a structure of arrays. */
#define SET_RAY(packet, i, eye, d)                                                                 \
    do {                                                                                           \
        (packet)->ray.org_x[i] = (eye).x, (packet)->ray.org_y[i] = (eye).y;                        \
        (packet)->ray.org_z[i] = (eye).z, (packet)->ray.tnear[i] = 0;                              \
        (packet)->ray.dir_x[i] = (d).x, (packet)->ray.dir_y[i] = (d).y;                            \
        (packet)->ray.dir_z[i] = (d).z, (packet)->ray.time[i] = 0;                                 \
        (packet)->ray.tfar[i] = INFINITY, (packet)->ray.mask[i] = UINT32_MAX;                      \
        (packet)->ray.flags[i] = 0, (packet)->hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;             \
    } while (0)

/* Fills in the next rays, CHUNK packets at most; returns how many rays. */
static unsigned fill_packets(struct packets *packets)
{
    struct f3 eye = f3_of(packets->view->camera.eye);
    unsigned count = 0, room = CHUNK * packets->width;
    for (; count < room && packets->next < packets->end; count++, packets->next++) {
        const struct view *view = packets->view;
        uint32_t pixel = pixel_of(view, packets->next);
        struct f3 d = primary_direction(view, (float)(pixel % view->width) + 0.5f,
                                        (float)(pixel / view->width) + 0.5f);
        unsigned packet = count / packets->width, i = count % packets->width;
        packets->pixels[count] = pixel;
        if (packets->width == WIDE)
            SET_RAY(&packets->at.wide[packet], i, eye, d);
        else
            SET_RAY(&packets->at.narrow[packet], i, eye, d);
    }
    return count;
}

/* Intersects the p-th packet. */
static void intersect(struct packets *packets, const int *valid, unsigned p)
{
    RTCScene rtc = packets->model->rtc;
#if EMBREE_VERSION == 4
    struct RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    if (packets->width == WIDE)
        rtcIntersect16(valid, rtc, &packets->at.wide[p], &arguments);
    else
        rtcIntersect8(valid, rtc, &packets->at.narrow[p], &arguments);
#else
    query_context context;
    context_init(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    if (packets->width == WIDE)
        rtcIntersect16(valid, rtc, &context, &packets->at.wide[p]);
    else
        rtcIntersect8(valid, rtc, &context, &packets->at.narrow[p]);
#endif
}

static void intersect_packets(struct packets *packets, unsigned count)
{
    for (unsigned first = 0, p = 0; first < count; first += packets->width, p++) {
        _Alignas(64) int valid[WIDE];
        for (unsigned i = 0; i < packets->width; i++)
            valid[i] = first + i < count ? -1 : 0;
        intersect(packets, valid, p);
    }
}

/* As the farm's primary-only picture: the surface's own light, or the sky. */
static void color_packets(const struct packets *packets, unsigned count, float *rgb)
{
    const struct model *model = packets->model;
    for (unsigned k = 0; k < count; k++) {
        unsigned p = k / packets->width, i = k % packets->width;
        bool wide = packets->width == WIDE;
        const struct RTCRayHit16 *w = &packets->at.wide[p];
        const struct RTCRayHit8 *n = &packets->at.narrow[p];
        unsigned geometry = wide ? w->hit.geomID[i] : n->hit.geomID[i];
        unsigned primitive = wide ? w->hit.primID[i] : n->hit.primID[i];
        struct f3 color;
        if (geometry == RTC_INVALID_GEOMETRY_ID) {
            color = sky_color(packets->view,
                              wide ? f3(w->ray.dir_x[i], w->ray.dir_y[i], w->ray.dir_z[i])
                                   : f3(n->ray.dir_x[i], n->ray.dir_y[i], n->ray.dir_z[i]));
        } else {
            color = model->materials[model->parts[geometry].material[primitive]].ambient;
        }
        float *out = &rgb[3 * (size_t)packets->pixels[k]];
        out[0] = color.x;
        out[1] = color.y;
        out[2] = color.z;
    }
}

double trace_primary(const struct model *model, float *rgb)
{
    const struct view *view = &model->scene->view;
    if (view->width % SQUARE || view->height % SQUARE)
        fatal("packets need a picture whose edges are multiples of %d", SQUARE);
    struct packets *packets = aligned_alloc(64, round_up_to(sizeof *packets, 64));
    if (!packets) fatal("out of memory");
    bool wide = rtcGetDeviceProperty(model->device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) > 0;
    packets->model = model;
    packets->view = view;
    packets->width = wide ? WIDE : WIDE / 2;
    packets->next = 0;
    packets->end = (uint64_t)view->width * view->height;
    double intersect_s = 0;
    for (unsigned count; (count = fill_packets(packets)) > 0;) {
        double before = clock_thread_cpu();
        intersect_packets(packets, count);
        intersect_s += clock_thread_cpu() - before;
        color_packets(packets, count, rgb);
    }
    free(packets);
    return intersect_s;
}
