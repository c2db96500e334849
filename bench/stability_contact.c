/* Rows 26-29: secondary rays, which start on the surface that their parent has hit. */
#include <string.h>

#include "bench/stability.h"
#include "worker/shade.h"

static struct vec3 any_center(struct random *random, double size)
{
    return random_away(random, size * random_log(random, 0.01, 100));
}

/* ---- row 26: a convex shape is not hit again ---- */

static void add_convex(struct builder *builder, struct random *random, double size)
{
    uint32_t material = stage_material(builder);
    struct vec3 center = any_center(random, size), axis = random_unit(random);
    double r = size * random_between(random, 0.2, 1);
    struct vec3 reach = vec3(r, size * random_between(random, 0.2, 1), r);
    struct vec3 end = vec_add_scaled(center, axis, size * random_between(random, 0.2, 2));
    struct sphere sphere = {.center = center, .radius = r, .material = material};
    struct box box = {vec_sub(center, reach), vec_add(center, reach), material, 0};
    struct cone cone = {center, end, r, r, material, 1};
    struct disc disc = {center, axis, r, material, 0};
    switch (random_below(random, 7)) {
    case 0:
        expect_added(builder_add_sphere(builder, &sphere));
        break;
    case 1:
        expect_added(builder_add_box(builder, &box));
        break;
    case 2:
        expect_added(builder_add_cone(builder, &cone));
        break;
    case 3:
        cone.apex_radius = 0;
        expect_added(builder_add_cone(builder, &cone));
        break;
    case 4:
        cone.base_radius = random_between(random, 0, 3) * r;
        expect_added(builder_add_cone(builder, &cone));
        break;
    case 5:
        expect_added(builder_add_disc(builder, &disc));
        break;
    default:
        stage_triangle(builder, center, vec_add_scaled(center, axis, r),
                       vec_add(center, random_away(random, r)));
    }
}

/* A ray from a distance of some sizes to a point near the centre of the shape or, for a triangle, near a vertex. */
static struct ray ray_to_shape(struct random *random, const struct scene *scene, double size)
{
    struct vec3 middle;
    if (scene->primitives[PRIMITIVE_SPHERE].count)
        middle = scene_spheres(scene)->center;
    else if (scene->primitives[PRIMITIVE_BOX].count)
        middle = vec_scale(vec_add(scene_boxes(scene)->min, scene_boxes(scene)->max), 0.5);
    else if (scene->primitives[PRIMITIVE_CONE].count)
        middle = vec_scale(vec_add(scene_cones(scene)->base, scene_cones(scene)->apex), 0.5);
    else if (scene->primitives[PRIMITIVE_DISC].count)
        middle = scene_discs(scene)->center;
    else
        middle = scene_vertices(scene)[random_below(random, 3)];
    struct vec3 from = vec_add(middle, vec_scale(random_unit(random), 4 * size));
    struct vec3 target = vec_add(middle, vec_scale(random_unit(random), 0.5 * size));
    return stage_ray(from, vec_normalize(vec_sub(target, from)));
}

/* A direction away from the surface on the side of its normal; for half of the rays at grazing angles down to 1e-12. */
static struct vec3 outward(struct random *random, struct vec3 normal)
{
    struct vec3 d = random_unit(random), u, v;
    if (vec_dot(d, normal) < 0) d = vec_neg(d);
    if (random_bits(random) >> 63) return d;
    random_frame(random, normal, &u, &v);
    return vec_normalize(vec_add_scaled(u, normal, random_log(random, 1e-12, 1)));
}

/* Continues outward from the hit of a ray (for a triangle or disc on the side that it came from). Returns how often the
 * shape was hit in all; 2 is an error. */
static int meets_again(const struct stage *stage, const struct scene *scene, const struct ray *ray,
                       struct random random, uint64_t *fallbacks)
{
    struct hit hit = stage_nearest(stage, scene, ray, fallbacks);
    if (hit.primitive == PRIMITIVE_NONE) return 0;
    struct surface surface;
    surface_at(scene, ray, &hit, &surface);
    bool sheet = primitive_kind(hit.primitive) == PRIMITIVE_TRIANGLE ||
                 primitive_kind(hit.primitive) == PRIMITIVE_DISC;
    struct vec3 normal = surface.geometric;
    if (sheet && vec_dot(ray->direction, normal) > 0) normal = vec_neg(normal);
    struct ray next = stage_going_on(&surface, &hit, outward(&random, normal));
    return stage_nearest(stage, scene, &next, fallbacks).primitive == PRIMITIVE_NONE ? 1 : 2;
}

/* Tests shapes of sizes from 1e-8 to 1e8 with 1000 rays each. */
static void convex_block(struct block *block, const void *context)
{
    (void)context;
    struct random *random = &block->random;
    struct stage stage = {NULL, NULL, NULL};
    double size = 1;
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % 1000 == 0) {
            stage_free(&stage);
            struct builder *builder = builder_create();
            size = random_log(random, 1e-8, 1e8);
            add_convex(builder, random, size);
            stage = stage_finish(builder, NULL);
        }
        struct ray ray = ray_to_shape(random, stage.ours, size);
        struct random next = {random_bits(random)};
        int ours = meets_again(&stage, stage.ours, &ray, next, &block->tally->fallbacks);
        if (ours == 2) score_wrong(&block->tally->ours, block->first + i);
        if (meets_again(&stage, stage.paper, &ray, next, NULL) == 2)
            score_wrong(&block->tally->paper, block->first + i);
        if (ours > 0) block->tally->samples++; /* a ray that misses the shape is no sample */
    }
    stage_free(&stage);
}

/* ---- row 27: thin shells ---- */

static const double gaps[] = {4e-5, 1e-8, 1e-12};

/* A scene of two shells, an outer and an inner one, a small gap apart: spheres, boxes or discs of size about 1. The
 * outer one has the lower id. The inner one lies on the side of the outer one that its normal points away from. */
static struct stage shells(struct random *random)
{
    struct builder *builder = builder_create();
    double gap = gaps[random_below(random, 3)], r = random_between(random, 0.5, 2);
    struct vec3 c = random_away(random, random_between(random, 0, 3));
    struct vec3 n = random_unit(random), corner = {r, 1, 2}, inner = {r - gap, 1 - gap, 2 - gap};
    uint32_t material = stage_material(builder);
    switch (random_below(random, 3)) {
    case 0:
        stage_sphere(builder, c, r);
        stage_sphere(builder, c, r - gap);
        break;
    case 1:
        expect_added(builder_add_box(
            builder, &(struct box){vec_sub(c, corner), vec_add(c, corner), material, 0}));
        expect_added(builder_add_box(
            builder, &(struct box){vec_sub(c, inner), vec_add(c, inner), material, 0}));
        break;
    default:
        expect_added(builder_add_disc(builder, &(struct disc){c, n, r, material, 0}));
        expect_added(builder_add_disc(
            builder, &(struct disc){vec_add_scaled(c, n, -gap), n, 2 * r, material, 0}));
    }
    return stage_finish(builder, NULL);
}

/* A direction into the shape, at no more than 60 degrees to its normal, so that it meets the inner shell. */
static struct vec3 inward(struct random *random, struct vec3 normal)
{
    struct vec3 u, v;
    random_frame(random, normal, &u, &v);
    return vec_normalize(vec_sub(vec_scale(u, random_between(random, 0, 1.7)), normal));
}

static enum primitive_kind shell_kind(const struct scene *scene)
{
    if (scene->primitives[PRIMITIVE_SPHERE].count) return PRIMITIVE_SPHERE;
    return scene->primitives[PRIMITIVE_BOX].count ? PRIMITIVE_BOX : PRIMITIVE_DISC;
}

/* A ray to a point of the outer shell that is not near an edge or rim. */
static struct ray ray_to_shell(struct random *random, const struct scene *scene)
{
    struct vec3 n = random_unit(random), u, v, target;
    switch (shell_kind(scene)) {
    case PRIMITIVE_SPHERE: {
        const struct sphere *sphere = scene_spheres(scene);
        target = vec_add_scaled(sphere->center, n, sphere->radius);
        break;
    }
    case PRIMITIVE_BOX: {
        const struct box *box = scene_boxes(scene);
        struct vec3 middle = vec_scale(vec_add(box->min, box->max), 0.5);
        struct vec3 half = vec_scale(vec_sub(box->max, box->min), 0.5);
        double x = random_between(random, -0.9, 0.9), y = random_between(random, -0.9, 0.9);
        struct vec3 w = random_bits(random) >> 63 ? vec3(x, y, 1) : vec3(1, x, y);
        if (random_bits(random) >> 63) w = vec3(w.y, w.z, w.x);
        w = vec_scale(w, random_sign(random));
        target = vec_add(middle, vec_mul(half, w));
        n = vec_normalize(
            vec3(w.x * (fabs(w.x) == 1), w.y * (fabs(w.y) == 1), w.z * (fabs(w.z) == 1)));
        break;
    }
    default: {
        const struct disc *disc = scene_discs(scene);
        n = disc->normal;
        random_frame(random, n, &u, &v);
        target = vec_add_scaled(disc->center, u, disc->radius * random_between(random, 0, 0.9));
    }
    }
    struct vec3 d = inward(random, n);
    return stage_ray(vec_add_scaled(target, d, -random_between(random, 1, 20)), d);
}

/* Whether the ray hits the outer shell first, and a ray that goes on inward from there hits the inner one. */
static bool finds_inner(const struct stage *stage, const struct scene *scene, const struct ray *ray,
                        struct random random, uint64_t *fallbacks)
{
    enum primitive_kind kind = shell_kind(scene);
    struct hit hit = stage_nearest(stage, scene, ray, fallbacks);
    if (hit.primitive != primitive_id(kind, 0)) return false;
    struct surface surface;
    surface_at(scene, ray, &hit, &surface);
    struct ray next = stage_going_on(&surface, &hit, inward(&random, surface.geometric));
    return stage_nearest(stage, scene, &next, fallbacks).primitive == primitive_id(kind, 1);
}

static void gap_block(struct block *block, const void *context)
{
    (void)context;
    struct random *random = &block->random;
    struct stage stage = {NULL, NULL, NULL};
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            stage = shells(random);
        }
        struct ray ray = ray_to_shell(random, stage.ours);
        struct random next = {random_bits(random)};
        if (!finds_inner(&stage, stage.ours, &ray, next, &block->tally->fallbacks))
            score_wrong(&block->tally->ours, block->first + i);
        if (!finds_inner(&stage, stage.paper, &ray, next, NULL))
            score_wrong(&block->tally->paper, block->first + i);
        block->tally->samples++;
    }
    stage_free(&stage);
}

/* ---- row 28: a pane of glass ---- */

#define GLASS_IOR 1.5

static uint32_t glass(struct builder *builder)
{
    struct material material = {.color = {1, 1, 1}, .transmission = 1, .ior = GLASS_IOR};
    uint32_t index;
    expect_added(builder_add_material(builder, &material, &index));
    return index;
}

/* A box, 4 units of the last place of its coordinate thick or more, across a random axis. */
static struct stage pane(struct random *random, unsigned *axis, double *thickness)
{
    struct builder *builder = builder_create();
    double at = random_bits(random) >> 63 ? 0 : 1e6;
    double ulp = nextafter(at, HUGE_VAL) - at;
    if (at == 0) ulp = 1e-15;
    double far = at + ulp * floor(random_log(random, 4, 1e9));
    double low[3], high[3];
    *axis = (unsigned)random_below(random, 3);
    for (unsigned i = 0; i < 3; i++) {
        low[i] = i == *axis ? at : -1000;
        high[i] = i == *axis ? far : 1000;
    }
    *thickness = far - at;
    struct box box = {.min = {low[0], low[1], low[2]}, .max = {high[0], high[1], high[2]}};
    box.material = glass(builder);
    expect_added(builder_add_box(builder, &box));
    return stage_finish(builder, NULL);
}

static struct ray ray_to_pane(struct random *random, const struct scene *scene, unsigned axis)
{
    const struct box *box = scene_boxes(scene);
    struct vec3 target = random_point(random, 500), direction = random_point(random, 1);
    set_component(&target, axis, vec_component(&box->min, axis));
    set_component(&direction, axis, random_signed(random, random_between(random, 0.1, 1)));
    direction = vec_normalize(direction);
    return stage_ray(vec_add_scaled(target, direction, -random_between(random, 1, 100)), direction);
}

/* Continues the ray through the surface that it hits by Snell's law, from one index of refraction to another. *cosine:
 * that of the angle between the ray and the normal. false: it hits nothing, or is totally reflected. */
static bool pass_surface(const struct stage *stage, const struct scene *scene, struct ray *ray,
                         double from, double to, double *cosine, uint64_t *fallbacks)
{
    struct hit hit = stage_nearest(stage, scene, ray, fallbacks);
    if (hit.primitive == PRIMITIVE_NONE) return false;
    struct surface surface;
    surface_at(scene, ray, &hit, &surface);
    struct shading_point at = shading_point(scene, ray, &surface);
    struct vec3 direction;
    if (!refract(&at, from, to, &direction)) return false;
    *cosine = fabs(vec_dot(ray->direction, surface.geometric));
    *ray = stage_going_on(&surface, &hit, direction);
    return true;
}

/*
 * The ray must enter the pane, leave it, and go on in its first direction without a further hit. The direction in the
 * glass is rounded to doubles. If its component along the surface errs by u, the component across the surface errs by
 * 1 / cos times as much when the ray leaves at that angle. No formula can undo that, so the error is measured in
 * u / cos.
 */
static void through_pane(const struct stage *stage, const struct scene *scene, struct ray ray,
                         struct score *score, uint64_t sample, uint64_t *fallbacks)
{
    struct vec3 before = ray.direction;
    double cosine = 1, inner;
    bool in = pass_surface(stage, scene, &ray, 1, GLASS_IOR, &cosine, fallbacks);
    bool out = in && pass_surface(stage, scene, &ray, GLASS_IOR, 1, &inner, fallbacks);
    if (!out || stage_nearest(stage, scene, &ray, fallbacks).primitive != PRIMITIVE_NONE) {
        score_wrong(score, sample);
        return;
    }
    score_error(score, vec_length(vec_sub(ray.direction, before)) * cosine * 0x1p53, sample);
}

static void pane_block(struct block *block, const void *context)
{
    (void)context;
    struct random *random = &block->random;
    struct stage stage = {NULL, NULL, NULL};
    unsigned axis = 0;
    double thickness = 0;
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            stage = pane(random, &axis, &thickness);
        }
        struct ray ray = ray_to_pane(random, stage.ours, axis);
        struct tally *tally = block->tally;
        uint64_t sample = block->first + i;
        through_pane(&stage, stage.ours, ray, &tally->ours, sample, &tally->fallbacks);
        through_pane(&stage, stage.paper, ray, &tally->paper, sample, NULL);
        tally->samples++;
    }
    stage_free(&stage);
}

static void run_28(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 28, budget->rays, pane_block, NULL, &tally);
    conclude(result, &tally, "u/cos", 4);
    if (result->verdict == VERDICT_RED) return;
    result->verdict = VERDICT_MARKED;
    strcpy(result->note, "4 u is out of reach for flat rays: a direction in the glass rounded to "
                         "doubles is u/2 sin^2/cos off when it leaves, > 4 u beyond 83 degrees; "
                         "the bound that holds for all is 4 u / cos, 2 events always");
}

/* ---- row 29: a ball on the floor ---- */

/* A ball that touches the floor y = 0 exactly: a plane, or two large triangles. */
static struct stage ball_on_floor(struct random *random)
{
    struct builder *builder = builder_create();
    double r = random_log(random, 0.01, 100);
    uint32_t material = stage_material(builder);
    double x = random_between(random, -5, 5);
    stage_sphere(builder, vec3(x, r, random_between(random, -5, 5)), r);
    if (random_bits(random) >> 63) {
        expect_added(
            builder_add_plane(builder, &(struct plane){{0, 0, 0}, {0, 1, 0}, material, 0}));
    } else {
        stage_triangle(builder, vec3(-1e4, 0, -1e4), vec3(-1e4, 0, 1e4), vec3(1e4, 0, 1e4));
        stage_triangle(builder, vec3(1e4, 0, 1e4), vec3(1e4, 0, -1e4), vec3(-1e4, 0, -1e4));
    }
    return stage_finish(builder, NULL);
}

/* A ray from above through the ball to a point of its lower half, which is beside the point of contact by 1e-12 to 0.5
 * times the radius. */
static struct ray ray_through_ball(struct random *random, const struct sphere *ball)
{
    double angle = random_between(random, 0, 2 * acos(-1));
    double beside = ball->radius * random_log(random, 1e-12, 0.5);
    struct vec3 exit = ball->center;
    exit.x += beside * cos(angle);
    exit.z += beside * sin(angle);
    exit.y -= sqrt(ball->radius * ball->radius - beside * beside);
    struct vec3 from = vec_add_scaled(ball->center, random_unit(random), 3 * ball->radius);
    from.y = fabs(from.y) + 2 * ball->radius;
    return stage_ray(from, vec_normalize(vec_sub(exit, from)));
}

/* Whether the ray enters the ball, leaves it, and only then hits the floor. */
static bool reaches_floor(const struct stage *stage, const struct scene *scene, struct ray ray,
                          uint64_t *fallbacks)
{
    uint32_t ball = primitive_id(PRIMITIVE_SPHERE, 0);
    for (int i = 0; i < 2; i++) {
        struct hit hit = stage_nearest(stage, scene, &ray, fallbacks);
        if (hit.primitive != ball) return false;
        struct surface surface;
        surface_at(scene, &ray, &hit, &surface);
        ray = stage_going_on(&surface, &hit, ray.direction);
    }
    struct hit hit = stage_nearest(stage, scene, &ray, fallbacks);
    return hit.primitive != PRIMITIVE_NONE && hit.primitive != ball;
}

static void floor_block(struct block *block, const void *context)
{
    (void)context;
    struct stage stage = {NULL, NULL, NULL};
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            stage = ball_on_floor(&block->random);
        }
        struct ray ray = ray_through_ball(&block->random, scene_spheres(stage.ours));
        if (!reaches_floor(&stage, stage.ours, ray, &block->tally->fallbacks))
            score_wrong(&block->tally->ours, block->first + i);
        if (!reaches_floor(&stage, stage.paper, ray, NULL))
            score_wrong(&block->tally->paper, block->first + i);
        block->tally->samples++;
    }
    stage_free(&stage);
}

const struct stability_case contact_cases[] = {
    {26, "convex shapes met again, scales 1e-8-1e8", "closed form", "0 re-hits",
     .work = convex_block},
    {27, "shell gaps 4e-5, 1e-8, 1e-12", "closed form", "inner found 100 %", .work = gap_block},
    {28, "pane of 4 ulp and more, at 0 and 1e6", "closed form", "2 events; out || in <= 4 u",
     .run = run_28},
    {29, "ball touching the floor", "closed form", "0 leaks", .work = floor_block},
    {.number = 0},
};
