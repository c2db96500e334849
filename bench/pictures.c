#include "bench/pictures.h"

#include <glob.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "test/renderer_fixture.h"

/* ---- scenes from files ---- */

struct scene *picture_load(const char *path, const char *const *overrides)
{
    struct scene *scene = scene_load(path, overrides, REACH_FOLDER);
    if (!scene) fatal("%s cannot be loaded", path);
    scene->view.processor = stage_kernel();
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

void picture_files_check(bool quick)
{
    const char *const none[] = {NULL};
    char **files = picture_files(quick);
    for (char **file = files; *file; file++)
        free(picture_load(*file, none));
    picture_files_free(files);
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
        struct vec3 center = random_point(random, 10);
        stage_sphere(builder, center, random_between(random, 0.2, 2));
        struct vec3 a = random_point(random, 10), b = random_point(random, 4);
        struct vec3 c = random_point(random, 4);
        stage_triangle(builder, a, vec_add(a, b), vec_add(a, c));
        struct vec3 low = random_point(random, 10), size = random_point(random, 1);
        struct box box = {.min = low, .material = m};
        box.max = vec_add(low, vec3(fabs(size.x), fabs(size.y), fabs(size.z)));
        expect_added(builder_add_box(builder, &box));
        struct disc disc = {.center = random_point(random, 10), .material = m};
        disc.normal = random_unit(random);
        disc.radius = random_between(random, 0.2, 2);
        expect_added(builder_add_disc(builder, &disc));
        struct cone cone = {.base = random_point(random, 10), .material = m, .capped = 1};
        cone.base_radius = random_between(random, 0.2, 1);
        cone.apex_radius = random_between(random, 0, 1);
        cone.apex = vec_add(cone.base, random_point(random, 3));
        expect_added(builder_add_cone(builder, &cone));
    }
}
