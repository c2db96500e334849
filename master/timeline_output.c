#include "master/timeline_output.h"

#include "master/image_file.h"

bool timeline_wanted(const struct settings *settings)
{
    return *settings->output.trace || *settings->output.heatmap || *settings->output.ranks;
}

static bool picture_writable(const char *path, const char *key, uint32_t width, uint32_t height)
{
    return !*path || (output_writable(path, key) && image_size_writable(path, width, height));
}

bool timeline_writable(const struct settings *settings, uint32_t width, uint32_t height)
{
    const char *trace = settings->output.trace;
    return (!*trace || output_writable(trace, "output.trace")) &&
           picture_writable(settings->output.heatmap, "output.heatmap", width, height) &&
           picture_writable(settings->output.ranks, "output.ranks", width, height);
}

/* What a trace is made of. */
struct source {
    const struct timeline *timeline;
    const struct report *report;
};

static void put_trace(void *context, FILE *file)
{
    const struct source *source = context;
    const struct report *report = source->report;
    timeline_trace(source->timeline, report->renderers, (uint32_t)report->renderer_count,
                   report->time.render, file);
}

static bool write_trace(const struct timeline *timeline, const char *path,
                        const struct report *report)
{
    struct source source = {timeline, report};
    return text_write_for("output.trace", path, put_trace, &source);
}

static bool write_heatmap(const struct timeline *timeline, const char *path, struct report *report)
{
    struct canvas canvas;
    canvas_init(&canvas, report->image_width, report->image_height);
    report->heat = timeline_heatmap(timeline, &canvas);
    bool written = image_write_for("output.heatmap", path, &canvas);
    canvas_free(&canvas);
    return written;
}

static bool write_ranks(const struct timeline *timeline, const char *path,
                        const struct report *report)
{
    struct canvas canvas;
    canvas_init(&canvas, report->image_width, report->image_height);
    timeline_ranks(timeline, (uint32_t)report->renderer_count, &canvas);
    bool written = image_write_for("output.ranks", path, &canvas);
    canvas_free(&canvas);
    return written;
}

bool timeline_write(const struct timeline *timeline, const struct settings *settings,
                    struct report *report)
{
    const char *trace = settings->output.trace, *heatmap = settings->output.heatmap;
    const char *ranks = settings->output.ranks;
    return (!*trace || write_trace(timeline, trace, report)) &&
           (!*heatmap || write_heatmap(timeline, heatmap, report)) &&
           (!*ranks || write_ranks(timeline, ranks, report));
}
