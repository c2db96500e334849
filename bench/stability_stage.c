/* Shared by the cases: scenes, threads, and sums of errors. */
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <mpfr.h>

#include "bench/stability.h"
#include "common/message.h"

struct vec3 random_unit(struct random *random)
{
    double z = random_between(random, -1, 1), angle = random_between(random, 0, 2 * acos(-1));
    double r = sqrt(1 - z * z);
    return vec3(r * cos(angle), r * sin(angle), z);
}

struct vec3 random_away(struct random *random, double length)
{
    return vec_scale(random_unit(random), length);
}

void random_frame(struct random *random, struct vec3 axis, struct vec3 *u, struct vec3 *v)
{
    do
        *u = vec_cross(axis, random_unit(random));
    while (vec_length(*u) < 0.25);
    *u = vec_normalize(*u);
    *v = vec_cross(axis, *u);
}

/* ---- scores ---- */

static void score_add(struct score *total, const struct score *part)
{
    if (part->wrong && (total->wrong == 0 || part->wrong_at < total->wrong_at))
        total->wrong_at = part->wrong_at;
    total->wrong += part->wrong;
    if (part->worst > 0) score_error(total, part->worst, part->worst_at);
}

static void tally_add(struct tally *total, const struct tally *part)
{
    score_add(&total->paper, &part->paper);
    score_add(&total->ours, &part->ours);
    total->samples += part->samples;
    total->paper_samples += part->paper_samples;
    total->fallbacks += part->fallbacks;
}

/* A loop whose items threads share out among themselves. */
struct loop {
    uint64_t items;
    void (*work)(uint64_t item, void *context);
    void *context;
    atomic_uint_fast64_t next;
};

static void *run_items(void *argument)
{
    struct loop *loop = argument;
    for (;;) {
        uint64_t item = atomic_fetch_add(&loop->next, 1);
        if (item >= loop->items) break;
        loop->work(item, loop->context);
    }
    mpfr_free_cache(); /* of this thread */
    return NULL;
}

void share_out(const struct budget *budget, uint64_t items,
               void (*work)(uint64_t item, void *context), void *context)
{
    struct loop loop = {.items = items, .work = work, .context = context};
    pthread_t *threads = allocate(budget->threads, sizeof *threads);
    for (unsigned i = 0; i < budget->threads; i++) {
        if (pthread_create(&threads[i], NULL, run_items, &loop) != 0)
            fatal("cannot start a thread");
    }
    for (unsigned i = 0; i < budget->threads; i++)
        pthread_join(threads[i], NULL);
    free(threads);
}

struct blocks {
    int number;
    uint64_t samples;
    void (*work)(struct block *block, const void *context);
    const void *context;
    pthread_mutex_t lock; /* of total */
    struct tally *total;
};

static void work_on_block(uint64_t item, void *context)
{
    struct blocks *blocks = context;
    uint64_t first = item * SHARE_BLOCK, left = blocks->samples - first;
    struct tally tally = {.samples = 0};
    struct block block = {.first = first,
                          .count = left < SHARE_BLOCK ? left : SHARE_BLOCK,
                          .random = random_seeded((uint64_t)blocks->number, first),
                          .tally = &tally};
    blocks->work(&block, blocks->context);
    pthread_mutex_lock(&blocks->lock);
    tally_add(blocks->total, &tally);
    pthread_mutex_unlock(&blocks->lock);
}

void share(const struct budget *budget, int number, uint64_t samples,
           void (*work)(struct block *block, const void *context), const void *context,
           struct tally *total)
{
    struct blocks blocks = {number, samples, work, context, PTHREAD_MUTEX_INITIALIZER, total};
    share_out(budget, (samples + SHARE_BLOCK - 1) / SHARE_BLOCK, work_on_block, &blocks);
}

static void describe(char *text, size_t size, const struct score *score, uint64_t samples,
                     const char *unit)
{
    double percent = 100 * (double)score->wrong / (double)(samples ? samples : 1);
    char wrong[48] = "0 wrong";
    if (score->wrong)
        snprintf(wrong, sizeof wrong, "%llu wrong (%.2g %%)", (unsigned long long)score->wrong,
                 percent);
    if (unit)
        snprintf(text, size, "%.3g %s, %s", score->worst, unit, wrong);
    else
        snprintf(text, size, "%s", wrong);
}

void conclude(struct case_result *result, const struct tally *tally, const char *unit, double limit)
{
    uint64_t paper_samples = tally->paper_samples ? tally->paper_samples : tally->samples;
    describe(result->paper, sizeof result->paper, &tally->paper, paper_samples, unit);
    describe(result->ours, sizeof result->ours, &tally->ours, tally->samples, unit);
    result->unit = unit;
    result->worst = tally->ours.worst;
    result->limit = limit;
    result->paper_worst = tally->paper.worst;
    result->paper_wrong = tally->paper.wrong;
    result->paper_samples = paper_samples;
    result->samples = tally->samples;
    result->wrong = tally->ours.wrong;
    result->fallbacks = tally->fallbacks;
    bool passed = tally->ours.wrong == 0 && tally->ours.worst <= limit && tally->samples > 0;
    result->verdict = passed ? VERDICT_GREEN : VERDICT_RED;
    if (passed) return;
    if (tally->ours.wrong)
        snprintf(result->note, sizeof result->note, "first wrong: sample %llu",
                 (unsigned long long)tally->ours.wrong_at);
    else
        snprintf(result->note, sizeof result->note, "worst: sample %llu",
                 (unsigned long long)tally->ours.worst_at);
}

/* ---- the kernel ---- */

static struct stage_way the_way = {PROCESSOR_AUTO, 1};

void stage_set_way(struct stage_way way)
{
    the_way = way;
}

enum processor_level stage_kernel(void)
{
    return the_way.kernel;
}

/* Calls nearest() or occluded(). answers: one per ray, all of the same size and without padding. */
typedef void ask_kernel(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                        size_t count, void *answers, uint64_t *fallbacks);

static void ask_nearest(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                        size_t count, void *answers, uint64_t *fallbacks)
{
    nearest(scene, bvh, rays, count, answers, fallbacks);
}

static void ask_occluded(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                         size_t count, void *answers, uint64_t *fallbacks)
{
    occluded(scene, bvh, rays, count, answers, fallbacks);
}

_Static_assert(sizeof(struct hit) == 3 * sizeof(double) + 2 * sizeof(uint32_t), "no padding");

static void ask(ask_kernel *kernel, const struct scene *scene, const struct bvh *bvh,
                const struct ray *rays, size_t count, void *answers, size_t size,
                uint64_t *fallbacks)
{
    unsigned alike = the_way.alike;
    if (alike == 1) {
        kernel(scene, bvh, rays, count, answers, fallbacks);
        return;
    }
    struct ray same[ALIKE_MAX];
    union {
        struct hit hits[ALIKE_MAX];
        struct vec3 light[ALIKE_MAX];
    } found;
    const char *first = (const char *)&found;
    for (size_t i = 0; i < count; i++) {
        for (unsigned k = 0; k < alike; k++)
            same[k] = rays[i];
        kernel(scene, bvh, same, alike, &found, fallbacks);
        for (unsigned k = 1; k < alike; k++)
            if (memcmp(first, first + k * size, size) != 0)
                fatal("a ray and its copies differ in what they meet");
        memcpy((char *)answers + i * size, first, size);
    }
}

void stage_hits(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                size_t count, struct hit *hits, uint64_t *fallbacks)
{
    ask(ask_nearest, scene, bvh, rays, count, hits, sizeof *hits, fallbacks);
}

static void stage_light(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                        size_t count, struct vec3 *transmittance, uint64_t *fallbacks)
{
    ask(ask_occluded, scene, bvh, rays, count, transmittance, sizeof *transmittance, fallbacks);
}

/* ---- scenes ---- */

void expect_added(const char *why)
{
    if (why) fatal("a case made a bad scene: %s", why);
}

uint32_t stage_material(struct builder *builder)
{
    struct material material = {
        .color = vec3(1, 1, 1), .diffuse = 1, .transmission = 0.5, .ior = 1};
    uint32_t index;
    expect_added(builder_add_material(builder, &material, &index));
    return index;
}

void stage_sphere(struct builder *builder, struct vec3 center, double radius)
{
    struct sphere sphere = {
        .center = center, .radius = radius, .material = stage_material(builder)};
    expect_added(builder_add_sphere(builder, &sphere));
}

void stage_triangle(struct builder *builder, struct vec3 a, struct vec3 b, struct vec3 c)
{
    struct triangle triangle = {.material = stage_material(builder)};
    expect_added(builder_add_vertex(builder, a, &triangle.vertex[0]));
    expect_added(builder_add_vertex(builder, b, &triangle.vertex[1]));
    expect_added(builder_add_vertex(builder, c, &triangle.vertex[2]));
    expect_added(builder_add_triangle(builder, &triangle));
}

struct view stage_view(struct vec3 eye, struct vec3 look_at, double fov, uint32_t width,
                       uint32_t height)
{
    double half = tan(fov / 2 * acos(-1) / 180);
    struct vec3 forward = vec_normalize(vec_sub(look_at, eye));
    struct vec3 right = vec_normalize(vec_cross(forward, vec3(0, 1, 0)));
    struct vec3 down = vec_cross(forward, right);
    return (struct view){.camera = {eye, forward, vec_scale(right, half), vec_scale(down, half)},
                         .background_bottom = {0.2, 0.3, 0.4},
                         .background_top = {0.6, 0.7, 0.9},
                         .background_up = {0, 1, 0},
                         .processor = stage_kernel(),
                         .width = width,
                         .height = height,
                         .region_w = width,
                         .region_h = height,
                         .max_depth = 8,
                         .shadows = 1,
                         .min_samples = 1,
                         .max_samples = 1};
}

struct stage stage_finish(struct builder *builder, const struct view *view)
{
    struct view all = view ? *view : stage_view(vec3(0, 0, 0), vec3(0, 0, -1), 40, 1, 1);
    all.variant = VARIANT_FULL; /* keeps primitives that coincide with others */
    struct stage stage = {.ours = builder_finish(builder, &all)};
    stage.ours->view.variant = VARIANT_AUTO;
    builder_destroy(builder);
    const char *why;
    if (!scene_valid(stage.ours, stage.ours->bytes, &why)) fatal("a case's scene: %s", why);
    stage.paper = allocate(stage.ours->bytes, 1);
    memcpy(stage.paper, stage.ours, stage.ours->bytes);
    stage.ours->view.formulas = FORMULAS_EXACT;
    stage.paper->view.formulas = FORMULAS_PAPER;
    stage.bvh = scene_tree(stage.ours);
    return stage;
}

void stage_free(struct stage *stage)
{
    free(stage->ours);
    free(stage->paper);
    free(stage->bvh);
}

struct ray stage_ray(struct vec3 origin, struct vec3 direction)
{
    return (struct ray){origin, direction, HUGE_VAL, PRIMITIVE_NONE, 0};
}

struct ray stage_going_on(const struct surface *surface, const struct hit *hit,
                          struct vec3 direction)
{
    struct ray ray = stage_ray(surface->point, direction);
    ray.from = hit->primitive;
    ray.from_part = hit->part;
    return ray;
}

struct hit stage_nearest(const struct stage *stage, const struct scene *scene,
                         const struct ray *ray, uint64_t *fallbacks)
{
    struct hit hit;
    uint64_t other = 0;
    stage_hits(scene, stage->bvh, ray, 1, &hit,
               fallbacks && scene == stage->ours ? fallbacks : &other);
    return hit;
}

/* Rays that go through occluded() together. */
#define BATCH 256

void stage_crossings(const struct stage *stage, const struct scene *scene, const struct ray *rays,
                     size_t count, unsigned *crossings, uint64_t *fallbacks)
{
    struct vec3 light[BATCH];
    uint64_t other = 0;
    for (size_t first = 0; first < count; first += BATCH) {
        size_t n = count - first < BATCH ? count - first : BATCH;
        stage_light(scene, stage->bvh, rays + first, n, light,
                    fallbacks && scene == stage->ours ? fallbacks : &other);
        for (size_t i = 0; i < n; i++) {
            int exponent; /* light = 2^-crossings = 0.5 * 2^exponent */
            (void)frexp(light[i].x, &exponent);
            crossings[first + i] = (unsigned)(1 - exponent);
        }
    }
}
