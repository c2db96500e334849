#include "bench/kernel_report.h"

#include <math.h>

#include "bench/median.h"
#include "bench/outside.h"

#define UNKNOWN ((double)NAN) /* a figure that was not measured */

/* ---- medians and what is derived from them ---- */

static double series_median(const struct series *series, enum metric metric)
{
    double values[REPEAT_MAX];
    unsigned n = series->count;
    if (n == 0) return UNKNOWN;
    for (unsigned i = 0; i < n; i++)
        values[i] = series->runs[i].at[metric];
    return median_of(values, n);
}

static double median(const struct scene_results *at, enum program program, enum step step,
                     enum metric metric)
{
    return series_median(&at->series[program][step], metric);
}

/* The ratios of the farm's time to the other program's, round by round, as disturbances of a round affect both.
 * Returns their number. */
static unsigned time_ratios(const struct scene_results *at, enum program other,
                            double ratios[REPEAT_MAX])
{
    const struct series *farm = &at->series[PROGRAM_FARM][STEP_PICTURE];
    const struct series *peer = &at->series[other][STEP_PICTURE];
    unsigned count = farm->count < peer->count ? farm->count : peer->count;
    for (unsigned i = 0; i < count; i++)
        ratios[i] = farm->runs[i].at[RENDER_S] / peer->runs[i].at[RENDER_S];
    return count;
}

static double time_ratio(const struct scene_results *at, enum program other)
{
    double ratios[REPEAT_MAX];
    unsigned count = time_ratios(at, other, ratios);
    return count ? median_of(ratios, count) : UNKNOWN;
}

static double all_rays(const struct scene_results *at, enum program program, enum step step)
{
    double sum = 0;
    for (unsigned m = RAYS_PRIMARY; m <= RAYS_REFRACTION; m++) {
        double rays = median(at, program, step, m);
        if (isfinite(rays)) sum += rays;
    }
    return sum;
}

/* Rates in million rays per second, including all that belongs to a ray: by the difference in time of two steps. */
enum rate { RATE_ALL, RATE_SHADOW, RATE_DEEPER, RATE_PRIMARY, RATE_KERNEL, RATE_COUNT };

static double rate_of(const struct scene_results *at, enum program program, enum rate rate)
{
    double picture = median(at, program, STEP_PICTURE, RENDER_S);
    double direct = median(at, program, STEP_DIRECT, RENDER_S);
    double shadowless = median(at, program, STEP_SHADOWLESS, RENDER_S);
    double rays = all_rays(at, program, STEP_PICTURE), few = all_rays(at, program, STEP_DIRECT);
    double primary = median(at, program, STEP_PRIMARY, RAYS_PRIMARY);
    switch (rate) {
    case RATE_ALL:
        return 1e-6 * rays / picture;
    case RATE_SHADOW:
        return 1e-6 * median(at, program, STEP_DIRECT, RAYS_SHADOW) / (direct - shadowless);
    case RATE_DEEPER:
        return rays > few ? 1e-6 * (rays - few) / (picture - direct) : UNKNOWN;
    case RATE_PRIMARY:
        return 1e-6 * primary / median(at, program, STEP_PRIMARY, RENDER_S);
    case RATE_KERNEL:
        return 1e-6 * primary / median(at, program, STEP_PRIMARY, INTERSECT_S);
    case RATE_COUNT:
        break;
    }
    return UNKNOWN;
}

static double bytes_per_triangle(const struct scene_results *at, enum program program)
{
    double triangles = median(at, program, STEP_PICTURE, TRIANGLES);
    if (triangles < 0.9 * median(at, program, STEP_PICTURE, PRIMITIVES)) return UNKNOWN;
    return median(at, program, STEP_PICTURE, BYTES) / triangles;
}

/* ---- figures in cells ---- */

static const char *cell(char text[16], double value)
{
    if (!isfinite(value)) return "-";
    int decimals = value < 9.995 ? 3 : value < 99.95 ? 1 : 0;
    snprintf(text, 16, "%.*f", decimals, value);
    return text;
}

static void put(FILE *out, double value)
{
    char text[16];
    fprintf(out, " %9s", cell(text, value));
}

void report_scene(FILE *out, const struct scene_results *at, bool first)
{
    if (first) {
        fputs("CPU seconds of rendering, median, and what part of them the farm takes\n"
              "scene            farm    embree   tachyon    povray | /embree  /tachyon   /povray |"
              " M primary/s: farm, packets\n",
              out);
    }
    fprintf(out, "%-11s", at->scene.name);
    for (unsigned p = 0; p < PROGRAM_COUNT; p++)
        put(out, median(at, p, STEP_PICTURE, RENDER_S));
    fputs(" |", out);
    for (unsigned p = PROGRAM_EMBREE; p < PROGRAM_COUNT; p++)
        put(out, time_ratio(at, p));
    fputs(" |", out);
    put(out, rate_of(at, PROGRAM_FARM, RATE_KERNEL));
    put(out, rate_of(at, PROGRAM_EMBREE, RATE_KERNEL));
    fputc('\n', out);
}

/* ---- marks ---- */

struct mean {
    double log_sum, largest, smallest;
    unsigned count;
    const char *largest_at, *smallest_at;
};

static void mean_add(struct mean *mean, double value, const char *name)
{
    if (!isfinite(value) || !(value > 0)) return;
    mean->log_sum += log(value);
    if (mean->count == 0 || value > mean->largest) mean->largest = value, mean->largest_at = name;
    if (mean->count == 0 || value < mean->smallest)
        mean->smallest = value, mean->smallest_at = name;
    mean->count++;
}

static double mean_value(const struct mean *mean)
{
    return mean->count ? exp(mean->log_sum / mean->count) : UNKNOWN;
}

/* How the figures of several scenes are summarised for a mark; not all scenes need to be measured. */
enum summary { GEOMETRIC_MEAN, LARGEST, SMALLEST };

struct mark {
    const char *what;
    const struct mean *mean;
    enum summary summary;
    double bound;
    bool at_least; /* the bound is a lower one */
    size_t scenes; /* that may have a figure */
};

static void verdict(FILE *out, const struct mark *mark)
{
    const struct mean *mean = mark->mean;
    const char *where = "";
    double value = mean_value(mean);
    if (mark->summary == LARGEST) value = mean->largest, where = mean->largest_at;
    if (mark->summary == SMALLEST) value = mean->smallest, where = mean->smallest_at;
    bool met = mark->at_least ? value >= mark->bound : value <= mark->bound;
    if (mean->count == 0) {
        fprintf(out, "not measured: %s\n", mark->what);
        return;
    }
    fprintf(out, "%-7s %s: %.3f (%s %.3g)%s%s, over %u of %zu scenes\n", met ? "met" : "MISSED",
            mark->what, value, mark->at_least ? "at least" : "at most", mark->bound,
            *where ? ", at " : "", where, mean->count, mark->scenes);
}

void report_summary(FILE *out, const struct scene_results *results, size_t count)
{
    struct mean time[PROGRAM_COUNT] = {0}, kernel = {0}, whole = {0}, bytes = {0};
    size_t meshes = 0;
    for (size_t i = 0; i < count; i++) {
        const struct scene_results *at = &results[i];
        for (unsigned p = PROGRAM_EMBREE; p < PROGRAM_COUNT; p++)
            mean_add(&time[p], time_ratio(at, p), at->scene.name);
        mean_add(&bytes,
                 bytes_per_triangle(at, PROGRAM_FARM) / bytes_per_triangle(at, PROGRAM_EMBREE),
                 at->scene.name);
        if (!at->scene.has_mesh) continue;
        meshes++;
        mean_add(&kernel,
                 rate_of(at, PROGRAM_FARM, RATE_KERNEL) / rate_of(at, PROGRAM_EMBREE, RATE_KERNEL),
                 at->scene.name);
        mean_add(&whole,
                 rate_of(at, PROGRAM_FARM, RATE_PRIMARY) /
                     rate_of(at, PROGRAM_EMBREE, RATE_PRIMARY),
                 at->scene.name);
    }
    fputc('\n', out);
    const struct mean *embree = &time[PROGRAM_EMBREE];
    const struct mark marks[] = {
        {"time / Embree, geometric mean", embree, GEOMETRIC_MEAN, 1, false, count},
        {"time / Embree, worst scene", embree, LARGEST, 1.3, false, count},
        {"time / Tachyon, geometric mean", &time[PROGRAM_TACHYON], GEOMETRIC_MEAN, 0.2, false,
         count},
        {"time / POV-Ray, geometric mean", &time[PROGRAM_POVRAY], GEOMETRIC_MEAN, 0.2, false,
         count},
        {"primary rays/s of the kernel / Embree's packets on meshes, geometric mean", &kernel,
         GEOMETRIC_MEAN, 1, true, meshes},
        {"the same, worst mesh", &kernel, SMALLEST, 1, true, meshes},
        {"the same with making rays and colours, geometric mean", &whole, GEOMETRIC_MEAN, 1, true,
         meshes},
        {"bytes per triangle / Embree's, worst mesh", &bytes, LARGEST, 1, false, meshes},
    };
    for (size_t i = 0; i < sizeof marks / sizeof *marks; i++)
        verdict(out, &marks[i]);
}

/* ---- files ---- */

/* Prints the median, least and largest ratio of the farm's time to another program's; empty if there is none. */
static void csv_ratio(FILE *out, const struct scene_results *at, unsigned program, unsigned step)
{
    double ratios[REPEAT_MAX];
    bool peer = program != PROGRAM_FARM && step == STEP_PICTURE;
    unsigned count = peer ? time_ratios(at, program, ratios) : 0;
    if (count) {
        double middle = median_of(ratios, count); /* which sorts them */
        fprintf(out, ",%.4f,%.4f,%.4f\n", middle, ratios[0], ratios[count - 1]);
    } else {
        fputs(",,,\n", out);
    }
}

void report_csv(const char *path, const struct scene_results *results, size_t count)
{
    FILE *out = open_to_write("%s", path);
    fputs("scene,program,step,runs", out);
    for (unsigned m = 0; m < METRIC_COUNT; m++)
        fprintf(out, ",%s", metric_names[m]);
    fputs(",farm_ratio,farm_ratio_least,farm_ratio_most\n", out);
    for (size_t i = 0; i < count; i++)
        for (unsigned p = 0; p < PROGRAM_COUNT; p++)
            for (unsigned s = 0; s < STEP_COUNT; s++) {
                const struct series *series = &results[i].series[p][s];
                if (series->count == 0) continue;
                fprintf(out, "%s,%s,%s,%u", results[i].scene.name, program_names[p], step_names[s],
                        series->count);
                for (unsigned m = 0; m < METRIC_COUNT; m++) {
                    double value = series_median(series, m);
                    if (isfinite(value))
                        fprintf(out, ",%.9g", value);
                    else
                        fputc(',', out);
                }
                csv_ratio(out, &results[i], p, s);
            }
    close_written(out);
}

static void row_begin(FILE *out, const struct scene_results *at)
{
    fprintf(out, "| %s |", at->scene.name);
}

static void row_cell(FILE *out, double value)
{
    char text[16];
    fprintf(out, " %s |", cell(text, value));
}

static void markdown_times(FILE *out, const struct scene_results *results, size_t count)
{
    fputs(
        "CPU seconds of rendering the picture; behind them the whole process's; what part the farm "
        "takes\n\n"
        "| scene | farm | Embree | Tachyon | POV-Ray | farm, process | Embree | Tachyon | POV-Ray |"
        " farm/Embree | farm/Tachyon | farm/POV-Ray "
        "|\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        out);
    for (size_t i = 0; i < count; i++) {
        row_begin(out, &results[i]);
        for (unsigned p = 0; p < PROGRAM_COUNT; p++)
            row_cell(out, median(&results[i], p, STEP_PICTURE, RENDER_S));
        for (unsigned p = 0; p < PROGRAM_COUNT; p++)
            row_cell(out, median(&results[i], p, STEP_PICTURE, PROCESS_S));
        for (unsigned p = PROGRAM_EMBREE; p < PROGRAM_COUNT; p++)
            row_cell(out, time_ratio(&results[i], p));
        fputc('\n', out);
    }
}

static void markdown_rates(FILE *out, const struct scene_results *results, size_t count)
{
    static const char *const heads[RATE_COUNT] = {"all", "shadow", "deeper", "primary", "kernel"};
    fputs(
        "\nMillion rays a second: of the picture; of shadow rays; of rays behind the first and "
        "their "
        "shadows; of primary rays alone (Embree: packets); of these within the kernel\n\n| scene |",
        out);
    for (unsigned rate = 0; rate < RATE_COUNT; rate++)
        fprintf(out, " %s: farm | Embree |", heads[rate]);
    fputs("\n|---|---|---|---|---|---|---|---|---|---|---|\n", out);
    for (size_t i = 0; i < count; i++) {
        row_begin(out, &results[i]);
        for (unsigned rate = 0; rate < RATE_COUNT; rate++) {
            row_cell(out, rate_of(&results[i], PROGRAM_FARM, rate));
            row_cell(out, rate_of(&results[i], PROGRAM_EMBREE, rate));
        }
        fputc('\n', out);
    }
}

static void markdown_sizes(FILE *out, const struct scene_results *results, size_t count)
{
    fputs("\nRays of the picture in thousands (primary, shadow, reflected, refracted), seconds to "
          "build, bytes "
          "per triangle\n\n| scene | primitives | farm: rays | Embree: rays | farm: build | Embree "
          "| farm: bytes |"
          " Embree |\n|---|---|---|---|---|---|---|---|\n",
          out);
    for (size_t i = 0; i < count; i++) {
        const struct scene_results *at = &results[i];
        row_begin(out, at);
        fprintf(out, " %.0f |", median(at, PROGRAM_FARM, STEP_PICTURE, PRIMITIVES));
        for (unsigned p = PROGRAM_FARM; p <= PROGRAM_EMBREE; p++) {
            for (unsigned m = RAYS_PRIMARY; m <= RAYS_REFRACTION; m++)
                fprintf(out, " %.1f", 1e-3 * median(at, p, STEP_PICTURE, m));
            fputs(" |", out);
        }
        row_cell(out, median(at, PROGRAM_FARM, STEP_PICTURE, BUILD_S));
        row_cell(out, median(at, PROGRAM_EMBREE, STEP_PICTURE, BUILD_S));
        row_cell(out, bytes_per_triangle(at, PROGRAM_FARM));
        row_cell(out, bytes_per_triangle(at, PROGRAM_EMBREE));
        fputc('\n', out);
    }
}

static void markdown_pictures(FILE *out, const struct scene_results *results, size_t count)
{
    fputs("\nDifference from the farm's picture: root of the mean square, and per cent of pixels "
          "that are off by "
          "more than 16/255\n\n| scene | Embree | Tachyon | POV-Ray |\n|---|---|---|---|\n",
          out);
    for (size_t i = 0; i < count; i++) {
        row_begin(out, &results[i]);
        for (unsigned p = PROGRAM_EMBREE; p < PROGRAM_COUNT; p++) {
            const struct picture_difference *d = &results[i].difference[p];
            if (isnan(d->rmse))
                fputs(" not measured |", out);
            else
                fprintf(out, " %.4f, %.2f %% |", d->rmse, 100 * d->differing);
        }
        fputc('\n', out);
    }
}

static const char inside_the_figures[] = "Medians of rounds in which the programs take turns, one "
                                         "thread each. CPU seconds of the thread that "
                                         "renders: without start, loading, and building of tree or "
                                         "grid (POV-Ray's slabs, Tachyon's grid), all of "
                                         "which are in the whole process's. Tachyon tells wall "
                                         "time alone: scaled by the share of a processor that "
                                         "its process had. Farm and Embree follow the same rules "
                                         "of depth and pruning; POV-Ray prunes ray by ray at "
                                         "the same weight; Tachyon by depth alone, and its rays go "
                                         "straight through glass. Cones are cylinders "
                                         "there. A ratio is the median of the rounds' ratios.\n\n";

void report_markdown(const char *path, const struct scene_results *results, size_t count)
{
    FILE *out = open_to_write("%s", path);
    fputs(inside_the_figures, out);
    markdown_times(out, results, count);
    markdown_rates(out, results, count);
    markdown_sizes(out, results, count);
    markdown_pictures(out, results, count);
    fputs("\n```\n", out);
    report_summary(out, results, count);
    fputs("```\n", out);
    close_written(out);
}
