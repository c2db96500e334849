/* Rows 33 and 34: lights in awkward places, and mutual visibility. */
#include <stdio.h>
#include <stdlib.h>

#include "bench/pictures.h"
#include "test/reference.h"

/* ---- 33 ---- */

#define EDGE 24u

/* A matt ball of radius 1 on a matt floor, under one light. */
static struct scene *ball_under(struct vec3 light, enum formulas formulas)
{
    struct builder *builder = builder_create();
    struct material matt = {.color = {0.8, 0.8, 0.8},
                            .ambient = 0.25,
                            .diffuse = 0.5,
                            .specular = 0.5,
                            .shininess = 40};
    struct light lamp = {.position = light, .color = {1, 1, 1}};
    struct sphere ball = {.center = {0, 1, 0}, .radius = 1};
    struct plane floor = {.point = {0, 0, 0}, .normal = {0, 1, 0}};
    matt.ior = 1.5;
    expect_added(builder_add_material(builder, &matt, &ball.material));
    expect_added(builder_add_light(builder, &lamp));
    expect_added(builder_add_sphere(builder, &ball));
    expect_added(builder_add_plane(builder, &floor));
    struct view view = stage_view(vec3(0, 2.5, 6), vec3(0, 0.8, 0), 40, EDGE, EDGE);
    view.formulas = formulas;
    view.background_bottom = view.background_top = vec3(0, 0, 0);
    struct scene *scene = builder_finish(builder, &view);
    builder_destroy(builder);
    return scene;
}

enum expectation {
    NOTHING_LIT, /* all visible surfaces have their ambient light alone */
    SOMETHING_LIT,
    JUST_FINITE
};

/* The number of pixel values that are not finite, or are lit although nothing can light them, or 1 when none is
 * lit that should be. */
static uint64_t bad_pixels(struct vec3 light, enum expectation expected, enum formulas formulas)
{
    struct scene *scene = ball_under(light, formulas);
    struct picture picture = picture_render(scene);
    const float ambient = (float)(0.25 * 0.8);
    uint64_t bad = 0, lit = 0;
    for (size_t i = 0; i < EDGE * EDGE * 3; i++) {
        bad += isfinite(picture.rgb[i]) ? 0 : 1;
        lit += picture.rgb[i] > ambient;
    }
    picture_free(&picture);
    free(scene);
    if (expected == NOTHING_LIT) bad += lit;
    if (expected == SOMETHING_LIT) bad += lit == 0;
    return bad;
}

static void run_light_places(const struct budget *budget, struct case_result *result)
{
    (void)budget;
    const struct {
        struct vec3 light;
        enum expectation expected;
    } places[] = {
        {{0, 1, 0}, NOTHING_LIT}, /* in the middle of the ball */
        {{0.3, 1.2, 0.5}, NOTHING_LIT},
        {{0, 2, 0}, NOTHING_LIT}, /* on the ball: no point of ball or floor is on its side */
        {{0, 2 - 0x1p-52, 0}, NOTHING_LIT}, /* an ulp below */
        {{0, 2 + 0x1p-51, 0}, JUST_FINITE}, /* an ulp above */
        {{0, 0, 3}, SOMETHING_LIT},         /* in the plane of the floor, in sight of the ball */
        {{2, 0x1p-1074, 2}, SOMETHING_LIT},
        {{0, 2.5, 6}, SOMETHING_LIT}, /* at the eye */
        {{0, -3, 0}, NOTHING_LIT},    /* below the floor */
        {{0, 1e300, 0}, SOMETHING_LIT},
    };
    uint64_t wrong = 0, paper = 0, count = sizeof places / sizeof *places;
    for (uint64_t i = 0; i < count; i++) {
        struct vec3 at = places[i].light;
        uint64_t bad = bad_pixels(at, places[i].expected, FORMULAS_EXACT);
        if (bad && !result->note[0])
            snprintf(result->note, sizeof result->note, "light at %g %.17g %g", at.x, at.y, at.z);
        wrong += bad;
        paper += bad_pixels(at, places[i].expected, FORMULAS_PAPER);
    }
    snprintf(result->paper, sizeof result->paper, "%llu pixels wrong", (unsigned long long)paper);
    snprintf(result->ours, sizeof result->ours, "%llu pixels wrong", (unsigned long long)wrong);
    picture_verdict(result, count * EDGE * EDGE, wrong);
}

/* ---- 34 ---- */

/* The bound on rounding for the crossings of a segment, in roundings of every coordinate: TEST_ERROR of the
 * tree's own margin. */
#define SEGMENT_BOUND 64.0

static unsigned crossings(const struct stage *stage, const struct scene *scene, struct vec3 from,
                          struct vec3 to, uint64_t *fallbacks)
{
    struct ray ray = stage_ray(from, vec_sub(to, from));
    unsigned count;
    ray.t_max = 1;
    stage_crossings(stage, scene, &ray, 1, &count, fallbacks);
    return count;
}

/* Whether roundings within the bound change the number of surfaces between p and l. */
static bool uncertain(struct reference *reference, struct vec3 p, struct vec3 l)
{
    uint64_t plain = reference_crossings(reference, p, l, 0, 0);
    for (uint64_t seed = 1; seed <= 64; seed++)
        if (reference_crossings(reference, p, l, SEGMENT_BOUND, seed) != plain) return true;
    return false;
}

static void see_both_ways(struct block *block, const void *context)
{
    const struct stage *stage = context;
    struct reference *reference = reference_create(stage->ours, REFERENCE_BITS);
    struct random *random = &block->random;
    for (uint64_t i = 0; i < block->count; i++) {
        struct vec3 p = random_point(random, 12), l = random_point(random, 12);
        unsigned there = crossings(stage, stage->ours, p, l, &block->tally->fallbacks);
        unsigned back = crossings(stage, stage->ours, l, p, &block->tally->fallbacks);
        if (there != back && !uncertain(reference, p, l))
            score_wrong(&block->tally->ours, block->first + i);
        there = crossings(stage, stage->paper, p, l, NULL);
        back = crossings(stage, stage->paper, l, p, NULL);
        if (there != back && !uncertain(reference, p, l))
            score_wrong(&block->tally->paper, block->first + i);
        block->tally->samples++;
    }
    reference_free(reference);
}

static void run_mutual_visibility(const struct budget *budget, struct case_result *result)
{
    struct random random = random_seeded(34, 0);
    struct builder *builder = builder_create();
    struct tally tally = {.samples = 0};
    picture_mixture(builder, &random, 12);
    struct stage stage = stage_finish(builder, NULL);
    share(budget, 34, budget->rays, see_both_ways, &stage, &tally);
    stage_free(&stage);
    conclude(result, &tally, NULL, 0);
}

const struct stability_case ray_cases[] = {
    {33, "light on a surface, inside, at the hit", "closed form", "finite, as told",
     .run = run_light_places},
    {34, "visibility p to l against l to p", "MPFR", "agree outside the bound",
     .run = run_mutual_visibility},
    {.number = 0},
};
