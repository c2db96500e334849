/*
 * Compares the error that pruned pictures claim with their true error: for every scene of config/,
 * config/extreme/ and the folder that SCENES names, at depths 0 to 20 and cutoffs from 1/16 to 1/65536, pixel by
 * pixel, against the same picture DEEP levels deep, whose own claim is allowed for. Writes one CSV row for each,
 * and a table of scenes.
 *
 *   error_truncation [--quick] [--csv FILE] [--markdown FILE] [--size WxH]
 *
 * Exit status 1 when a claim is violated.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/outside.h"
#include "bench/pictures.h"
#include "common/clock.h"
#include "common/message.h"
#include "test/renderer_fixture.h"

/* Depth and cutoff of the reference. */
#define DEEP        60
#define DEEP_CUTOFF 0x1p-18

struct options {
    bool quick;
    const char *csv, *markdown;
    uint32_t width, height;
};

/* A picture whose pixels were rendered separately, so that there is a claim for each one. */
struct claimed {
    float *rgb;
    double *claim;
    uint64_t rays, bound_rays;
    double seconds; /* CPU seconds */
};

static struct claimed render(const struct scene *scene, const struct bvh *bvh)
{
    uint32_t w = scene->view.region_w, h = scene->view.region_h;
    struct claimed picture = {.rgb = allocate((size_t)w * h, 3 * sizeof(float)),
                              .claim = allocate((size_t)w * h, sizeof(double))};
    struct renderer *renderer = renderer_create(scene, bvh);
    double start = clock_thread_cpu();
    for (uint32_t i = 0; i < w * h; i++) {
        struct tile tile = {.x = i % w, .y = i / w, .w = 1, .h = 1, .step = 1};
        struct render_counts counts;
        renderer_tile(renderer, &tile, picture.rgb + 3 * (size_t)i, &counts);
        picture.claim[i] = counts.truncation;
        picture.rays += render_counts_rays(&counts);
        picture.bound_rays += counts.bound_rays;
    }
    picture.seconds = clock_thread_cpu() - start;
    renderer_destroy(renderer);
    return picture;
}

static void claimed_free(struct claimed *picture)
{
    free(picture->rgb);
    free(picture->claim);
}

/* A picture compared with the reference. A pixel is unbounded when it or the reference claims no bound; its
 * claim cannot be violated, unless its error is not a number. */
struct row {
    uint64_t pixels, broken, unbounded;
    double claim_max, claim_sum; /* over the pixels with a bound */
    double error_max, error_sum; /* over all pixels */
    double reference_max;        /* the reference's own largest claim, over pixels with a bound */
};

/* The error of a pixel; HUGE_VAL when a component is NaN. */
static double pixel_error(const float *a, const float *b, double *rounding)
{
    double error = 0;
    for (int c = 0; c < 3; c++) {
        double off = fabs((double)a[c] - (double)b[c]);
        error = isnan(off) ? HUGE_VAL : fmax(error, off);
        *rounding = fmax(*rounding, 0x1p-23 * (double)fmaxf(a[c], b[c]));
    }
    return error;
}

static struct row compare(const struct claimed *picture, const struct claimed *deep,
                          uint32_t pixels)
{
    struct row row = {.pixels = pixels};
    for (uint32_t i = 0; i < pixels; i++) {
        double rounding = 0, claim = picture->claim[i];
        double error =
            pixel_error(picture->rgb + 3 * (size_t)i, deep->rgb + 3 * (size_t)i, &rounding);
        row.broken += isinf(error) || !(error <= claim + deep->claim[i] + rounding);
        row.error_max = fmax(row.error_max, error);
        row.error_sum += error;
        if (isinf(claim) || isinf(deep->claim[i])) {
            row.unbounded++;
            continue;
        }
        row.reference_max = fmax(row.reference_max, deep->claim[i]);
        row.claim_max = fmax(row.claim_max, claim);
        row.claim_sum += claim;
    }
    return row;
}

/* Sums over the rows of a scene. */
struct summary {
    uint64_t rows, pixels, broken, unbounded;
    double reference_max;
    double ratio_sum, ratio_max; /* ratio of the largest claim to the largest error */
    uint64_t ratios;
};

static void add_row(struct summary *summary, const struct row *row)
{
    summary->rows++;
    summary->pixels += row->pixels;
    summary->broken += row->broken;
    summary->unbounded += row->unbounded;
    summary->reference_max = fmax(summary->reference_max, row->reference_max);
    if (!(row->error_max > 0x1p-12) || row->unbounded) return;
    double ratio = row->claim_max / row->error_max;
    summary->ratio_sum += log(ratio);
    summary->ratio_max = fmax(summary->ratio_max, ratio);
    summary->ratios++;
}

static void run_row(struct scene *scene, const struct bvh *bvh, const struct claimed *deep,
                    const char *name, FILE *csv, struct summary *summary)
{
    uint32_t pixels = scene->view.region_w * scene->view.region_h;
    struct claimed picture = render(scene, bvh);
    struct row row = compare(&picture, deep, pixels);
    uint64_t bounded = row.pixels - row.unbounded;
    add_row(summary, &row);
    fprintf(csv, "%s,%u,%.9g,%llu,%llu,%llu,%.6g,%.6g,%.6g,%.6g,%.6g,%llu,%llu,%.4f\n", name,
            scene->view.max_depth, scene->view.cutoff, (unsigned long long)row.pixels,
            (unsigned long long)row.broken, (unsigned long long)row.unbounded, row.claim_max,
            row.error_max, bounded ? row.claim_sum / (double)bounded : (double)NAN,
            row.error_sum / (double)row.pixels, row.reference_max, (unsigned long long)picture.rays,
            (unsigned long long)picture.bound_rays, picture.seconds);
    claimed_free(&picture);
}

static struct summary run_scene(struct scene *scene, const char *name, bool quick, FILE *csv)
{
    struct summary summary = {0};
    struct bvh *bvh = scene_tree(scene);
    scene->view.max_depth = DEEP;
    scene->view.cutoff = DEEP_CUTOFF;
    struct claimed deep = render(scene, bvh);
    scene->view.cutoff = 1.0 / 512;
    for (uint32_t depth = 0; depth <= 20; depth += quick ? 5 : 1) {
        scene->view.max_depth = depth;
        run_row(scene, bvh, &deep, name, csv, &summary);
    }
    scene->view.max_depth = 20;
    for (double cutoff = 1.0 / 16; cutoff >= 1.0 / 65536; cutoff /= quick ? 64 : 4) {
        scene->view.cutoff = cutoff;
        run_row(scene, bvh, &deep, name, csv, &summary);
    }
    claimed_free(&deep);
    free(bvh);
    return summary;
}

static void put_summary(FILE *out, const char *name, const struct summary *summary)
{
    fprintf(out, "| %s | %llu | %llu | %llu | %llu |", name, (unsigned long long)summary->rows,
            (unsigned long long)summary->pixels,
            (unsigned long long)(summary->pixels - summary->unbounded),
            (unsigned long long)summary->broken);
    if (summary->pixels > summary->unbounded)
        fprintf(out, " %.2g |", summary->reference_max);
    else
        fprintf(out, " |");
    if (summary->ratios)
        fprintf(out, " %.3g | %.3g |\n", exp(summary->ratio_sum / (double)summary->ratios),
                summary->ratio_max);
    else
        fprintf(out, " | |\n");
}

static bool parse_options(int argc, char **argv, struct options *options)
{
    *options = (struct options){.width = 40, .height = 30};
    for (int i = 1; i < argc; i++) {
        bool value = i + 1 < argc;
        if (!strcmp(argv[i], "--quick"))
            options->quick = true;
        else if (!strcmp(argv[i], "--csv") && value)
            options->csv = argv[++i];
        else if (!strcmp(argv[i], "--markdown") && value)
            options->markdown = argv[++i];
        else if (!strcmp(argv[i], "--size") && value &&
                 sscanf(argv[i + 1], "%5ux%5u", &options->width, &options->height) == 2)
            i++;
        else
            return false;
    }
    return options->width > 0 && options->height > 0;
}

static struct scene *load(const char *path, const struct options *options)
{
    char width[32], height[32];
    snprintf(width, sizeof width, "image.width=%u", options->width);
    snprintf(height, sizeof height, "image.height=%u", options->height);
    const char *overrides[] = {width, height, "sampling.samples=1", NULL};
    return picture_load(path, overrides);
}

static void put_heads(FILE *csv, FILE *markdown)
{
    fputs(
        "scene,max_depth,cutoff,pixels,broken,unbounded,claim_max,error_max,claim_mean,error_mean,"
        "reference_claim,rays,bound_rays,cpu_s\n",
        csv);
    fputs("A claim is broken where a pixel is off by more than its claim, the claim of the "
          "reference's "
          "pixel and rounding together, or is no number.\n\n"
          "| scene | pictures | pixels | with a bound | broken claims | the reference claims at "
          "most | "
          "claim / error | at most |\n"
          "|---|---|---|---|---|---|---|---|\n",
          markdown);
}

/* Tests a scene file; returns the number of claims that did not hold. */
static uint64_t run_file(const char *file, const struct options *options, FILE *csv, FILE *markdown)
{
    struct scene *scene = load(file, options);
    const char *slash = strrchr(file, '/'), *name = slash ? slash + 1 : file;
    struct summary summary = run_scene(scene, name, options->quick, csv);
    put_summary(markdown, name, &summary);
    fflush(markdown);
    fflush(csv);
    free(scene);
    return summary.broken;
}

int main(int argc, char **argv)
{
    struct options options;
    if (!parse_options(argc, argv, &options)) {
        fputs("usage: error_truncation [--quick] [--csv FILE] [--markdown FILE] [--size WxH]\n",
              stderr);
        return 2;
    }
    FILE *csv = options.csv ? open_to_write("%s", options.csv) : stdout;
    FILE *markdown = options.markdown ? open_to_write("%s", options.markdown) : stdout;
    uint64_t broken = 0;
    put_heads(csv, markdown);
    char **files = picture_files(options.quick);
    for (char **file = files; *file; file++)
        broken += run_file(*file, &options, csv, markdown);
    picture_files_free(files);
    if (csv != stdout) close_written(csv);
    if (markdown != stdout) close_written(markdown);
    return broken > 0;
}
