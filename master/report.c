#include "master/report.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"

struct balance report_balance(const struct report *report)
{
    double sum = 0, most = 0, cpu = 0, most_cpu = 0, first = HUGE_VAL, last = 0;
    for (int i = 0; i < report->renderer_count; i++) {
        const struct renderer_stats *stats = &report->renderers[i];
        sum += stats->busy_s;
        most = fmax(most, stats->busy_s);
        cpu += stats->cpu_s;
        most_cpu = fmax(most_cpu, stats->cpu_s);
        if (!stats->silent) first = fmin(first, stats->finish_s);
        last = fmax(last, stats->finish_s);
    }
    int count = report->renderer_count;
    double whole = count * report->time.render;
    return (struct balance){
        .efficiency = whole > 0 ? sum / whole : 0,
        .imbalance = sum > 0 ? most / (sum / count) : 1,
        .tail_s = first < last ? last - first : 0,
        .cpu_share = sum > 0 ? fmin(cpu / sum, 1) : 1,
        .cpu_imbalance = cpu > 0 ? most_cpu / (cpu / count) : 1,
    };
}

struct render_counts report_counts(const struct report *report)
{
    struct render_counts sum = {0};
    for (int i = 0; i < report->renderer_count; i++)
        render_counts_add(&sum, &report->renderers[i].counts);
    return sum;
}

struct render_counts report_picture_counts(const struct report *report)
{
    struct render_counts sum = report->picture;
    render_counts_add(&sum, &report->resumed.counts);
    return sum;
}

const struct renderer_stats *report_finder(const struct report *report,
                                           const struct bad_sample *bad)
{
    for (int i = 0; i < report->renderer_count; i++) {
        const struct render_counts *counts = &report->renderers[i].counts;
        const struct bad_sample *first = &counts->first;
        if (counts->nonfinite && first->x == bad->x && first->y == bad->y &&
            first->sample == bad->sample && first->depth == bad->depth)
            return &report->renderers[i];
    }
    return NULL;
}

char *report_bad_samples(const struct report *report)
{
    struct render_counts counts = report_picture_counts(report);
    if (!counts.nonfinite) return NULL;
    const struct bad_sample *bad = &counts.first;
    const struct renderer_stats *stats = report_finder(report, bad);
    char *who = stats ? format_text("rank %u", stats->rank) : copy_text("an earlier run");
    char *origin = format_vector(bad->origin), *direction = format_vector(bad->direction);
    char *text =
        format_text("%llu sample%s not finite, or too bright for floats; the first is sample %u of "
                    "pixel %u %u, "
                    "%s, by the ray from %s along %s",
                    (unsigned long long)counts.nonfinite, counts.nonfinite == 1 ? " is" : "s are",
                    bad->sample, bad->x, bad->y, who, origin, direction);
    free(who);
    free(origin);
    free(direction);
    return text;
}
