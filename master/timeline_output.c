#include "master/timeline_output.h"

#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/heat_scale.h"
#include "master/image_file.h"
#include "master/legend.h"
#include "master/output_file.h"
#include "master/rank_colors.h"

bool timeline_wanted(const struct settings *settings)
{
    return *settings->output.trace || *settings->output.heatmap || *settings->output.ranks;
}

static bool is_writable(const char *path, const char *key)
{
    return !*path || output_writable(path, key);
}

bool timeline_writable(const struct settings *settings)
{
    return is_writable(settings->output.trace, "output.trace") &&
           is_writable(settings->output.heatmap, "output.heatmap") &&
           is_writable(settings->output.ranks, "output.ranks");
}

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
    return text_write_by("output.trace", path, put_trace, &source);
}

static bool write_heatmap(const struct timeline *timeline, const char *path, struct report *report)
{
    uint32_t width = report->image_width, height = report->image_height;
    struct canvas canvas;
    canvas_init(&canvas, width, height + heat_scale_height(width, height));
    report->heat = timeline_heatmap(timeline, height, &canvas);
    if (canvas.height > height) heat_scale_draw(&canvas, height, report->heat);
    bool written = image_write_for("output.heatmap", path, &canvas, NULL);
    canvas_free(&canvas);
    return written;
}

/* Owned by the caller. */
static struct legend_entry *legend_of(const struct report *report, float (*colors)[3])
{
    uint32_t count = (uint32_t)report->renderer_count;
    struct legend_entry *entries = allocate(count, sizeof *entries);
    for (uint32_t i = 0; i < count; i++) {
        entries[i].number = report->renderers[i].rank;
        memcpy(entries[i].rgb, colors[i], sizeof colors[i]);
    }
    return entries;
}

static bool write_ranks(const struct timeline *timeline, const char *path,
                        const struct report *report)
{
    uint32_t count = (uint32_t)report->renderer_count, height = report->image_height;
    float(*colors)[3] = allocate(count, sizeof *colors);
    rank_colors(count, colors);
    struct legend_entry *entries = legend_of(report, colors);
    struct canvas canvas;
    canvas_init(&canvas, report->image_width,
                height + legend_height(report->image_width, height, entries, count));
    timeline_ranks(timeline, colors, &canvas);
    if (canvas.height > height) legend_draw(&canvas, height, entries, count);
    bool written = image_write_for("output.ranks", path, &canvas, NULL);
    canvas_free(&canvas);
    free(entries);
    free(colors);
    return written;
}

bool timeline_write(const struct timeline *timeline, const struct settings *settings,
                    struct report *report)
{
    const char *trace = settings->output.trace, *heatmap = settings->output.heatmap;
    const char *ranks = settings->output.ranks;
    bool written = !*trace || write_trace(timeline, trace, report);
    written &= !*heatmap || write_heatmap(timeline, heatmap, report);
    written &= !*ranks || write_ranks(timeline, ranks, report);
    return written;
}
