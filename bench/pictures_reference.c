/*
 * Row 59, beyond the catalogue: compares small pictures of the kernel with those of the reference renderer in
 * 448 bits, which shares no code with it.
 *
 * A pixel counts as the same when its floats are those of the reference, rounded, or adjacent to them. Any other
 * has to be explained in one of two ways. Either a predicate was inside its error bound: a decision of the
 * reference changes when its own rays, points and normals are displaced by what the kernel may round. (The
 * colour is not compared then: a pixel can depend on several such decisions, and few of their outcomes are among
 * the displaced ones.) Or, on curved mirrors, errors are amplified: the colour itself changes as much under
 * those displacements.
 */
#include <float.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench/pictures.h"
#include "test/reference.h"

/* Roundings of one point, direction or normal: the bounds of single hits are 2 to 4 u (rows 1-13,
 * 49, 50), a plane's point o + t d has 2 more. */
#define DISPLACEMENT 8.0

/* So many displaced pictures of a pixel in doubt. */
#define TRIES 48

struct agreement {
    uint64_t pixels, same, explained, amplified, unexplained;
    uint32_t x, y; /* of the first unexplained one */
};

static bool same_floats(const float *rgb, const double *truth)
{
    for (int c = 0; c < 3; c++) {
        float rounded = (float)truth[c];
        if (rgb[c] != rounded && rgb[c] != nextafterf(rounded, HUGE_VALF) &&
            rgb[c] != nextafterf(rounded, -HUGE_VALF))
            return false;
    }
    return true;
}

enum reason { PREDICATE, AMPLIFICATION, NO_REASON };

static enum reason reason_of(struct reference *reference, uint32_t x, uint32_t y, const float *rgb,
                             const struct reference_sample *truth)
{
    double spread[3] = {0, 0, 0};
    if (!isfinite(rgb[0]) || !isfinite(rgb[1]) || !isfinite(rgb[2])) return NO_REASON;
    for (uint64_t seed = 1; seed <= TRIES; seed++) {
        struct reference_sample other;
        reference_render(reference, x, y, DISPLACEMENT, seed, &other);
        if (other.decisions != truth->decisions) return PREDICATE;
        for (int c = 0; c < 3; c++)
            spread[c] = fmax(spread[c], fabs(other.color[c] - truth->color[c]));
    }
    for (int c = 0; c < 3; c++) {
        double rounding = (double)FLT_EPSILON * fabs(truth->color[c]);
        double error = fabs((double)rgb[c] - truth->color[c]);
        if (!(error <= spread[c] + rounding)) return NO_REASON;
    }
    return AMPLIFICATION;
}

static void compare_pixel(struct reference *reference, const struct picture *picture, uint32_t x,
                          uint32_t y, struct agreement *sum)
{
    struct reference_sample truth;
    const float *rgb = &picture->rgb[3 * ((size_t)y * picture->width + x)];
    reference_render(reference, x, y, 0, 0, &truth);
    sum->pixels++;
    if (same_floats(rgb, truth.color)) {
        sum->same++;
        return;
    }
    switch (reason_of(reference, x, y, rgb, &truth)) {
    case PREDICATE:
        sum->explained++;
        return;
    case AMPLIFICATION:
        sum->amplified++;
        return;
    case NO_REASON:
        break;
    }
    if (sum->unexplained++ == 0) {
        sum->x = x;
        sum->y = y;
    }
}

static void compare_scene(struct scene *scene, const struct picture *picture, struct agreement *sum)
{
    struct reference *reference = reference_create(scene, REFERENCE_BITS);
    for (uint32_t y = 0; y < picture->height; y++)
        for (uint32_t x = 0; x < picture->width; x++)
            compare_pixel(reference, picture, x, y, sum);
    reference_free(reference);
}

/* Colours that differ from the exact formulas' by more than one float. */
static uint64_t paper_differences(struct scene *scene, const struct picture *exact)
{
    scene->view.formulas = FORMULAS_PAPER;
    struct picture paper = picture_render(scene);
    uint64_t different = 0;
    for (size_t i = 0; i < (size_t)paper.width * paper.height; i++) {
        double truth[3] = {(double)exact->rgb[3 * i], (double)exact->rgb[3 * i + 1],
                           (double)exact->rgb[3 * i + 2]};
        different += !same_floats(&paper.rgb[3 * i], truth);
    }
    picture_free(&paper);
    return different;
}

static void run_reference(const struct budget *budget, struct case_result *result)
{
    const char *const files[] = {
        "test/data/everything.ini",   "config/extreme/ground.ini", "config/extreme/distant.ini",
        "config/extreme/slab.ini",    "config/extreme/shells.ini", "config/extreme/mirrors.ini",
        "config/extreme/slivers.ini", "config/extreme/phong.ini",  "config/extreme/lights.ini"};
    const char *const quick[] = {"image.width=8",   "image.height=6",     "sampling.samples=1",
                                 "render.cutoff=0", "render.max_depth=4", NULL};
    const char *const full[] = {"image.width=32",  "image.height=24",    "sampling.samples=1",
                                "render.cutoff=0", "render.max_depth=6", NULL};
    struct agreement sum = {.pixels = 0};
    uint64_t paper = 0;
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        struct scene *scene = picture_load(files[i], budget->quick ? quick : full);
        uint64_t before = sum.unexplained;
        struct picture picture = picture_render(scene);
        compare_scene(scene, &picture, &sum);
        if (sum.unexplained && !before)
            snprintf(result->note, sizeof result->note, "%s at %u %u", files[i], sum.x, sum.y);
        paper += paper_differences(scene, &picture);
        picture_free(&picture);
        free(scene);
    }
    snprintf(result->paper, sizeof result->paper, "%llu pixels differ", (unsigned long long)paper);
    snprintf(result->ours, sizeof result->ours,
             "%llu same, %llu explained, %llu amplified, %llu unexplained",
             (unsigned long long)sum.same, (unsigned long long)sum.explained,
             (unsigned long long)sum.amplified, (unsigned long long)sum.unexplained);
    picture_verdict(result, sum.pixels, sum.unexplained);
}

const struct stability_case reference_cases[] = {
    {59, "kernel against a picture in 448 bits", "MPFR", "0 unexplained pixels",
     .run = run_reference},
    {.number = 0},
};
