/* Rows 15 and 16: boxes, against rationals. */
#include <float.h>
#include <stdlib.h>

#include <gmp.h>

#include "bench/stability_compare.h"

/* The closed interval in which a line is in a box, in rationals. */
struct box_truth {
    mpq_t enter, leave, in, out, part;
    mpfr_t t;
    bool hit;
};

static void box_truth_init(struct box_truth *truth)
{
    mpq_inits(truth->enter, truth->leave, truth->in, truth->out, truth->part, NULL);
    mpfr_init2(truth->t, ORACLE_BITS);
}

static void box_truth_clear(struct box_truth *truth)
{
    mpq_clears(truth->enter, truth->leave, truth->in, truth->out, truth->part, NULL);
    mpfr_clear(truth->t);
}

/* t = (face - origin) / speed */
static void face_distance(mpq_t t, mpq_t part, double face, double origin, double speed)
{
    mpq_set_d(t, face);
    mpq_set_d(part, origin);
    mpq_sub(t, t, part);
    mpq_set_d(part, speed);
    mpq_div(t, t, part);
}

/* The part of the line between all pairs of faces; false when there is none. */
static bool line_in_box(struct box_truth *truth, const struct box *box, const struct ray *ray)
{
    bool bounded = false;
    for (unsigned axis = 0; axis < 3; axis++) {
        double min = vec_component(&box->min, axis), max = vec_component(&box->max, axis);
        double origin = vec_component(&ray->origin, axis),
               speed = vec_component(&ray->direction, axis);
        if (speed == 0) {
            if (origin < min || origin > max) return false;
            continue;
        }
        face_distance(truth->in, truth->part, speed > 0 ? min : max, origin, speed);
        face_distance(truth->out, truth->part, speed > 0 ? max : min, origin, speed);
        if (!bounded || mpq_cmp(truth->in, truth->enter) > 0) mpq_set(truth->enter, truth->in);
        if (!bounded || mpq_cmp(truth->out, truth->leave) < 0) mpq_set(truth->leave, truth->out);
        bounded = true;
    }
    return mpq_cmp(truth->enter, truth->leave) <= 0;
}

/* Finds the first crossing with t > 0; none if t is larger than any double. */
static void solve_box(struct box_truth *truth, const struct box *box, const struct ray *ray)
{
    truth->hit = false;
    if (!line_in_box(truth, box, ray)) return;
    mpq_t *first = mpq_sgn(truth->enter) > 0 ? &truth->enter : &truth->leave;
    if (mpq_sgn(*first) <= 0) return;
    mpfr_set_q(truth->t, *first, MPFR_RNDN);
    truth->hit = mpfr_cmp_d(truth->t, DBL_MAX) <= 0;
}

static struct box any_box(struct random *random)
{
    struct vec3 a = integer_point(random, 8), b = integer_point(random, 8);
    if (random_bits(random) >> 63) {
        a = random_point(random, 8);
        b = random_point(random, 8);
    }
    struct box box = {.min = {fmin(a.x, b.x), fmin(a.y, b.y), fmin(a.z, b.z)},
                      .max = {fmax(a.x, b.x), fmax(a.y, b.y), fmax(a.z, b.z)}};
    for (unsigned axis = 0; axis < 3; axis++) {
        double min = vec_component(&box.min, axis);
        if (min == vec_component(&box.max, axis)) set_component(&box.max, axis, min + 1);
    }
    return box;
}

/* A point on a face, an edge or a corner, or inside: every coordinate is min, max or between. */
static struct vec3 point_of_box(struct random *random, const struct box *box)
{
    struct vec3 p;
    for (unsigned axis = 0; axis < 3; axis++) {
        double min = vec_component(&box->min, axis), max = vec_component(&box->max, axis);
        double between[3] = {min, max, random_between(random, min, max)};
        if (random_bits(random) >> 63) between[2] = floor(between[2]) < min ? min : between[2];
        set_component(&p, axis, between[random_below(random, 3)]);
    }
    return p;
}

/* A direction with components that are hard cases for a box. */
static struct vec3 hard_direction(struct random *random)
{
    static const double hard[] = {0.0, -0.0, 1, -1, 1e-310, -1e-310, 2, -3, 0x1p-40, -0x1p-40};
    struct vec3 d;
    do {
        for (unsigned axis = 0; axis < 3; axis++)
            set_component(&d, axis, hard[random_below(random, sizeof hard / sizeof *hard)]);
        if (random_below(random, 4) == 0) d.x = random_between(random, -1, 1);
    } while (vec_is_zero(d));
    return d;
}

static struct ray aim_at_box(struct random *random, const struct box *box)
{
    struct vec3 on = point_of_box(random, box), direction = hard_direction(random);
    switch (random_below(random, 4)) {
    case 0: /* from the surface */
        return stage_ray(on, direction);
    case 1: /* towards it, in steps that are exact for integers */
        return stage_ray(vec_add_scaled(on, direction, -(double)random_below(random, 9)),
                         direction);
    case 2: { /* towards it from anywhere, rounded */
        struct vec3 origin = random_point(random, 30);
        return stage_ray(origin, vec_sub(on, origin));
    }
    default: { /* towards it from integers: exact for integer boxes */
        struct vec3 origin = integer_point(random, 30);
        direction = vec_sub(on, origin);
        return stage_ray(origin, vec_is_zero(direction) ? vec3(1, 0, 0) : direction);
    }
    }
}

/* Replaces the scene by one of a random box. */
static void change_box(struct stage *stage, struct random *random)
{
    stage_free(stage);
    struct builder *builder = builder_create();
    struct box solid = any_box(random);
    solid.material = stage_material(builder);
    expect_added(builder_add_box(builder, &solid));
    *stage = stage_finish(builder, NULL);
}

static void box_block(struct block *block, const void *context)
{
    (void)context;
    struct stage stage = {NULL, NULL, NULL};
    struct box_truth truth;
    box_truth_init(&truth);
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) change_box(&stage, &block->random);
        const struct box *box = scene_boxes(stage.ours);
        struct ray ray = aim_at_box(&block->random, box);
        solve_box(&truth, box, &ray);
        compare_both(&stage, &ray, truth.hit, truth.t, ulps, block->tally, block->first + i);
    }
    stage_free(&stage);
    box_truth_clear(&truth);
}

/* The loaders refuse a box without volume, so the scene block is changed by hand: such a block is
 * valid. */
static void flatten(struct stage *stage, unsigned axis)
{
    struct scene *scenes[2] = {stage->ours, stage->paper};
    for (int i = 0; i < 2; i++) {
        char *block = (char *)scenes[i];
        struct box *box =
            (struct box *)(void *)(block + scenes[i]->primitives[PRIMITIVE_BOX].offset);
        set_component(&box->max, axis, vec_component(&box->min, axis));
    }
    free(stage->bvh);
    stage->bvh = scene_tree(stage->ours);
}

static bool in_sheets_plane(const struct box *box, const struct ray *ray)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        if (vec_component(&box->min, axis) == vec_component(&box->max, axis))
            return vec_component(&ray->direction, axis) == 0;
    }
    return false;
}

/* The ray must cross the sheet exactly once if the oracle says so (expected), else never; and a ray that goes on from
 * there must not hit it again. */
static void cross_sheet(const struct stage *stage, const struct scene *scene, struct ray ray,
                        bool expected, struct score *score, uint64_t sample)
{
    unsigned crossings;
    uint64_t fallbacks = 0;
    stage_crossings(stage, scene, &ray, 1, &crossings, &fallbacks);
    struct hit hit = stage_nearest(stage, scene, &ray, &fallbacks);
    bool good = crossings == expected && (hit.primitive != PRIMITIVE_NONE) == expected;
    if (good && expected) {
        struct surface surface;
        surface_at(scene, &ray, &hit, &surface);
        ray = stage_going_on(&surface, &hit, ray.direction);
        good = stage_nearest(stage, scene, &ray, &fallbacks).primitive == PRIMITIVE_NONE;
    }
    if (!good) score_wrong(score, sample);
}

static void sheet_block(struct block *block, const void *context)
{
    (void)context;
    struct tally *tally = block->tally;
    struct stage stage = {NULL, NULL, NULL};
    struct box_truth truth;
    box_truth_init(&truth);
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            change_box(&stage, &block->random);
            flatten(&stage, (unsigned)random_below(&block->random, 3));
        }
        const struct box *box = scene_boxes(stage.ours);
        struct ray ray = aim_at_box(&block->random, box);
        solve_box(&truth, box, &ray);
        if (in_sheets_plane(box, &ray)) continue; /* nothing is crossed */
        cross_sheet(&stage, stage.ours, ray, truth.hit, &tally->ours, block->first + i);
        cross_sheet(&stage, stage.paper, ray, truth.hit, &tally->paper, block->first + i);
        tally->samples++;
    }
    stage_free(&stage);
    box_truth_clear(&truth);
}

const struct stability_case box_cases[] = {
    {15, "box: d = +-0, 1e-310, from faces and corners", "rationals",
     "hit or miss exact and closed, t <= 2 ulp", .work = box_block, .unit = "ulp", .limit = 2},
    {16, "box without thickness", "rationals", "one hit", .work = sheet_block},
    {.number = 0},
};
