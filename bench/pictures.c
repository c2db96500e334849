#include "bench/pictures.h"

#include <glob.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "test/renderer_fixture.h"

const struct stability_case picture_cases[] = {
    {30, "whole scene x 2^k, |k| <= 60", "self", "pictures identical", .run = run_scaling},
    {31, "scene x 10^+-9", "self", "same ids, <= 1e-12 outside the mask",
     .run = run_decimal_scaling},
    {32, "scene moved by 2^20 .. 2^40", "MPFR", "ids as on the rounded input",
     .run = run_translation},
    {33, "light on a surface, inside, at the hit", "closed form", "finite, as told",
     .run = run_light_places},
    {34, "visibility p to l against l to p", "MPFR", "agree outside the bound",
     .run = run_mutual_visibility},
    {35, "BVH against brute force, all leaf sizes", "brute force", "id and t bitwise",
     .run = run_tree},
    {36, "direction 0 or denormal, origin on slabs", "brute force", "id and t bitwise",
     .run = run_tree_axes},
    {37, "1e-9 and 1e9 in one tree, origin at 1e12", "brute force", "id and t bitwise",
     .run = run_tree_sizes},
    {38, "1e6 equal centroids", "-", "build ends, depth <= cap", .run = run_equal_centroids},
    {39, "rays that are NaN or infinite", "-", "miss, <= 2.5 times the time", .run = run_bad_rays},
    {45, "Phong, n = 1 .. 1e9", "MPFR", "<= 1e-14; <= 5e-13 below 1e-12", .run = run_phong},
    {46, "Phong, n = 0, infinite, cos b <= 0, underflow", "closed form", "no NaN, <= 1.05 x time",
     .run = run_phong_ends},
    {47, "lights of 1e30 and 1e-30; light x 2^k", "MPFR, self", "<= 4 u; bitwise",
     .run = run_light_sums},
    {48, "refraction between equal media", "closed form", "direction bitwise",
     .run = run_equal_media},
    {49, "eta 1+1e-7, 1e+-3, critical +-1e-12", "MPFR", "k <= 1e-15; total reflection exact",
     .run = run_snell},
    {50, "reflection at grazing 1e-12", "MPFR", "r.n >= 0, |r| - 1 <= 2 u", .run = run_grazing},
    {51, "1000 and 10000 plane mirrors", "closed form", "series <= D 2 u; 128 kB stack",
     .run = run_mirrors},
    {52, "mirror balls, depth 20", "MPFR", "<= u x amplification", .run = run_mirror_balls},
    {53, "cutoff sweep", "deep run", "error <= bound in every pixel", .run = run_cutoff},
    {54, "glass cluster, depth 30, kr + kt = 1", "-", "rays <= D / tau per pixel",
     .run = run_glass_cluster},
    {55, "media: nested, overlapping, eye inside", "closed form", "0 unmatched, 0 left open",
     .run = run_media},
    {56, "ranks, tile sizes, schedules", "self", "pictures identical", .run = run_processes},
    {57, "builds: FMA, -O0 / -O3, gcc / clang", "self", "pictures identical", .run = run_builds},
    {58, "any scene", "-", "0 non-finite; injected NaN found", .run = run_any_scene},
    {59, "kernel against a picture in 448 bits", "MPFR", "0 unexplained pixels",
     .run = run_reference},
    {.number = 0},
};

/* ---- scenes from files ---- */

struct scene *picture_load(const char *path, const char *const *overrides)
{
    struct scene *scene = scene_load(path, overrides, REACH_FOLDER);
    if (scene) scene->view.processor = stage_kernel();
    return scene;
}

char **picture_files(bool quick)
{
    glob_t found;
    const char *more = getenv("SCENES");
    char pattern[4096];
    glob("config/extreme/*.ini", 0, NULL, &found);
    glob(quick ? "config/hello.ini" : "config/*.ini", GLOB_APPEND, NULL, &found);
    glob("test/data/everything.ini", GLOB_APPEND, NULL, &found);
    if (more && !quick &&
        snprintf(pattern, sizeof pattern, "%s/*.[ion][nbf][ijf]", more) < (int)sizeof pattern)
        glob(pattern, GLOB_APPEND, NULL, &found);
    char **files = allocate_zeroed(found.gl_pathc + 1, sizeof *files);
    for (size_t i = 0; i < found.gl_pathc; i++)
        files[i] = strdup(found.gl_pathv[i]);
    globfree(&found);
    return files;
}

void picture_files_free(char **files)
{
    for (char **file = files; *file; file++)
        free(*file);
    free(files);
}

static struct scene *moved(const struct scene *scene, double factor, struct vec3 by)
{
    struct scene *copy = allocate(scene->bytes, 1);
    memcpy(copy, scene, scene->bytes);
    scene_move(copy, factor, by);
    return copy;
}

struct scene *picture_scaled(const struct scene *scene, double factor)
{
    return moved(scene, factor, vec3(0, 0, 0));
}

struct scene *picture_moved(const struct scene *scene, struct vec3 by)
{
    return moved(scene, 1, by);
}

/* ---- pictures ---- */

struct picture picture_render_with(const struct scene *scene, const struct bvh *bvh)
{
    const struct view *view = &scene->view;
    struct picture picture = {.width = view->region_w, .height = view->region_h};
    struct tile tile = {.w = view->region_w, .h = view->region_h, .step = 1};
    picture.rgb = allocate((size_t)tile_pixels(&tile) * 3, sizeof *picture.rgb);
    struct renderer *renderer = renderer_create(scene, bvh);
    renderer_tile(renderer, &tile, picture.rgb, &picture.counts);
    renderer_destroy(renderer);
    return picture;
}

struct picture picture_render(const struct scene *scene)
{
    struct bvh *bvh = scene_tree(scene);
    struct picture picture = picture_render_with(scene, bvh);
    free(bvh);
    return picture;
}

void picture_free(struct picture *picture)
{
    free(picture->rgb);
}

uint64_t picture_differences(const struct picture *a, const struct picture *b)
{
    uint64_t different = 0;
    for (size_t i = 0; i < (size_t)a->width * a->height; i++)
        different += memcmp(&a->rgb[3 * i], &b->rgb[3 * i], 3 * sizeof *a->rgb) != 0;
    return different;
}

void picture_verdict(struct case_result *result, uint64_t samples, uint64_t wrong)
{
    result->samples = samples;
    result->wrong = wrong;
    result->verdict = wrong == 0 && samples > 0 ? VERDICT_GREEN : VERDICT_RED;
}

/* ---- random objects ---- */

void picture_mixture(struct builder *builder, struct random *random, int count)
{
    uint32_t m = stage_material(builder);
    for (int i = 0; i < count; i++) {
        struct vec3 p = random_point(random, 10);
        stage_sphere(builder, random_point(random, 10), random_between(random, 0.2, 2));
        stage_triangle(builder, p, vec_add(p, random_point(random, 4)),
                       vec_add(p, random_point(random, 4)));
        struct vec3 low = random_point(random, 10), size = random_point(random, 1);
        struct box box = {.min = low, .material = m};
        box.max = vec_add(low, vec3(fabs(size.x), fabs(size.y), fabs(size.z)));
        expect_added(builder_add_box(builder, &box));
        struct disc disc = {.center = random_point(random, 10),
                            .normal = random_unit(random),
                            .radius = random_between(random, 0.2, 2),
                            .material = m};
        expect_added(builder_add_disc(builder, &disc));
        struct cone cone = {.base = random_point(random, 10),
                            .base_radius = random_between(random, 0.2, 1),
                            .apex_radius = random_between(random, 0, 1),
                            .material = m,
                            .capped = 1};
        cone.apex = vec_add(cone.base, random_point(random, 3));
        expect_added(builder_add_cone(builder, &cone));
    }
}
