/* Rows 35-39: the bounding volume hierarchy finds the same hits as a test of every primitive. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/pictures.h"
#include "common/clock.h"
#include "common/message.h"
#include "common/whole.h"
#include "worker/bvh_leaf.h"
#include "worker/primitive.h"

/* ---- other trees ---- */

/* The number of entries in all trees that the farm has built for a scene. */
static uint64_t entries_of(const struct bvh *model)
{
    uint64_t count = 0;
    for (; model; model = bvh_next(model))
        count += model->leaf_count;
    return count;
}

static struct bvh *allocate_tree(const struct bvh *model, uint32_t nodes)
{
    size_t head = round_up_to(sizeof(struct bvh), 64);
    size_t list = head + nodes * sizeof(struct bvh_node);
    size_t entries = entries_of(model) * ENTRY_ROOM + LEAF_END;
    size_t bytes = list + round_up_to(entries * sizeof(struct bvh_leaf), 64);
    struct bvh *tree = aligned_alloc(64, bytes);
    if (!tree) fatal("no memory for a tree");
    memset(tree, 0, bytes);
    *tree = (struct bvh){.bytes = bytes,
                         .node_count = nodes,
                         .leaf_count = entries_of(model),
                         .nodes_offset = head,
                         .leaves_offset = list};
    return tree;
}

static struct bvh_node *nodes_of(struct bvh *tree)
{
    return (void *)((char *)tree + tree->nodes_offset);
}

static struct bvh_leaf *leaves_of(struct bvh *tree)
{
    return (void *)((char *)tree + tree->leaves_offset);
}

/* Copies the leaves of a tree; returns where the next ones go. */
static struct bvh_leaf *copy_leaves(const struct bvh *tree, struct bvh_leaf *entries)
{
    const struct bvh_node *nodes = bvh_nodes(tree);
    for (uint64_t n = 0; n < tree->node_count; n++) {
        for (unsigned slot = 0; slot < BVH_WIDTH; slot++) {
            uint32_t count = nodes[n].count[slot];
            memcpy(entries, bvh_leaves(tree) + nodes[n].child[slot], count * sizeof *entries);
            entries += count;
        }
    }
    return entries;
}

/* Copies the entries of all leaves, one after the other; the trees made here have no more. */
static void copy_entries(const struct bvh *model, struct bvh_leaf *entries)
{
    for (; model; model = bvh_next(model))
        entries = copy_leaves(model, entries);
}

static int by_id(const void *a, const void *b)
{
    uint32_t p = ((const struct bvh_leaf *)a)->id, q = ((const struct bvh_leaf *)b)->id;
    return (p > q) - (p < q);
}

struct box3 {
    float min[3], max[3];
};

static const struct box3 nothing = {{INFINITY, INFINITY, INFINITY},
                                    {-INFINITY, -INFINITY, -INFINITY}};

static void set_slot(struct bvh_node *node, int slot, const struct box3 *box)
{
    for (int axis = 0; axis < 3; axis++) {
        node->min[axis][slot] = box->min[axis];
        node->max[axis][slot] = box->max[axis];
    }
}

static void clear_node(struct bvh_node *node)
{
    memset(node, 0, sizeof *node);
    for (int slot = 0; slot < BVH_WIDTH; slot++)
        set_slot(node, slot, &nothing);
}

/*
 * A tree that is a single leaf with infinite bounds: brute force with the same tests. (Slabs that are infinite
 * on both sides let every ray pass.) Its quantised corners are marked as invalid, so that it does not rely on
 * them: what the farm's trees decide by them is checked, too.
 */
static struct bvh *one_leaf(const struct scene *scene, const struct bvh *model)
{
    static const struct box3 everything = {{-INFINITY, -INFINITY, -INFINITY},
                                           {INFINITY, INFINITY, INFINITY}};
    struct bvh *tree = allocate_tree(model, 1);
    clear_node(nodes_of(tree));
    set_slot(nodes_of(tree), 0, &everything);
    uint32_t count = nodes_of(tree)->count[0] = (uint32_t)entries_of(model);
    struct bvh_leaf *leaves = leaves_of(tree);
    copy_entries(model, leaves);
    qsort(leaves, count, sizeof *leaves, by_id);
    if (bvh_write_corners(scene, tree->center, leaves, count) > 0)
        ((struct bvh_corners *)(void *)(leaves + count))->inverse = NAN;
    return tree;
}

/* A tree built by median splits along alternating axes, with `leaf` primitives per leaf; nodes have two
 * children. */
struct median {
    const struct scene *scene;
    const struct bvh_leaf *model;
    const struct box3 *bounds; /* of every place in the model's list */
    struct bvh_node *nodes;
    struct bvh_leaf *leaves;
    uint32_t *places;
    uint32_t used, leaf;
};

static int by_axis(const void *a, const void *b, void *context)
{
    const struct median *median = ((void **)context)[0];
    unsigned axis = *(const unsigned *)((void **)context)[1];
    const struct box3 *p = &median->bounds[*(const uint32_t *)a];
    const struct box3 *q = &median->bounds[*(const uint32_t *)b];
    float x = p->min[axis] + p->max[axis], y = q->min[axis] + q->max[axis];
    return (x > y) - (x < y);
}

static struct box3 bounds_around(const struct median *median, uint32_t first, uint32_t count)
{
    struct box3 all = nothing;
    for (uint32_t i = first; i < first + count; i++) {
        for (int a = 0; a < 3; a++) {
            all.min[a] = fminf(all.min[a], median->bounds[median->places[i]].min[a]);
            all.max[a] = fmaxf(all.max[a], median->bounds[median->places[i]].max[a]);
        }
    }
    return all;
}

static void write_leaf(const struct median *median, struct bvh_leaf *leaves, uint32_t first,
                       uint32_t count)
{
    static const double center[3] = {0, 0, 0};
    for (uint32_t i = 0; i < count; i++)
        leaves[i] = median->model[median->places[first + i]];
    qsort(leaves, count, sizeof *leaves, by_id);
    bvh_write_corners(median->scene, center, leaves, count);
}

static void split(struct median *median, uint32_t at, uint32_t first, uint32_t count,
                  unsigned axis);

static void set_child(struct median *median, uint32_t at, int slot, uint32_t first, uint32_t count,
                      unsigned axis)
{
    struct bvh_node *node = &median->nodes[at];
    struct box3 box = bounds_around(median, first, count);
    set_slot(node, slot, &box);
    if (count > median->leaf) {
        node->child[slot] = median->used++;
        split(median, node->child[slot], first, count, (axis + 1) % 3);
        return;
    }
    node->child[slot] = first * ENTRY_ROOM;
    node->count[slot] = count;
    write_leaf(median, median->leaves + node->child[slot], first, count);
}

static void split(struct median *median, uint32_t at, uint32_t first, uint32_t count, unsigned axis)
{
    void *context[] = {median, &axis};
    clear_node(&median->nodes[at]);
    qsort_r(median->places + first, count, sizeof *median->places, by_axis, context);
    if (count / 2 > 0) set_child(median, at, 0, first, count / 2, axis);
    set_child(median, at, count / 2 > 0, first + count / 2, count - count / 2, axis);
}

static float outward(double x, float towards)
{
    return nextafterf((float)x, towards);
}

/* Around the origin, whatever centre the farm's tree has. */
static struct box3 bounds_of(const struct scene *scene, uint32_t id)
{
    struct bounds bounds = primitive_bounds(scene, id);
    struct box3 box;
    for (int axis = 0; axis < 3; axis++) {
        box.min[axis] = outward(bounds.min[axis], -HUGE_VALF);
        box.max[axis] = outward(bounds.max[axis], HUGE_VALF);
    }
    return box;
}

static struct bvh *median_tree(const struct scene *scene, const struct bvh *model, uint32_t leaf)
{
    uint32_t count = (uint32_t)entries_of(model);
    struct bvh *tree = allocate_tree(model, count);
    struct box3 *bounds = allocate(count, sizeof *bounds);
    struct bvh_leaf *entries = allocate(count, sizeof *entries);
    copy_entries(model, entries);
    struct median median = {.scene = scene,
                            .model = entries,
                            .bounds = bounds,
                            .nodes = nodes_of(tree),
                            .leaves = leaves_of(tree),
                            .used = 1,
                            .leaf = leaf};
    median.places = allocate(count, sizeof *median.places);
    for (uint32_t i = 0; i < count; i++) {
        bounds[i] = bounds_of(scene, median.model[i].id);
        median.places[i] = i;
    }
    split(&median, 0, 0, count, 0);
    struct box3 all = bounds_around(&median, 0, count);
    memcpy(tree->min, all.min, sizeof tree->min);
    memcpy(tree->max, all.max, sizeof tree->max);
    for (unsigned axis = 0; axis < 3; axis++) {
        double far = fmax(fabs((double)all.min[axis]), fabs((double)all.max[axis]));
        tree->reach = tree->size = fmax(tree->reach, far);
    }
    tree->node_count = median.used;
    free(median.places);
    free(entries);
    free(bounds);
    return tree;
}

/* ---- 35-37 ---- */

#define TREES 6

/* One scene, the tree of the farm and some of other shapes, and how rays for it are made. */
struct forest {
    struct stage stage;
    struct bvh *brute, *trees[TREES];
    struct ray (*draw)(struct random *random);
};

static void plant(struct forest *forest)
{
    const struct bvh *model = forest->stage.bvh;
    forest->brute = one_leaf(forest->stage.ours, model);
    forest->trees[0] = forest->stage.bvh;
    for (uint32_t i = 1; i < TREES; i++) /* leaves of 1, 2, 4, 8, 16 */
        forest->trees[i] = median_tree(forest->stage.ours, model, 1u << (i - 1));
}

static void fell(struct forest *forest)
{
    for (int i = 1; i < TREES; i++)
        free(forest->trees[i]);
    free(forest->brute);
    stage_free(&forest->stage);
}

static bool same_hit(const struct hit *a, const struct hit *b)
{
    return a->primitive == b->primitive && a->part == b->part &&
           memcmp(&a->t, &b->t, sizeof a->t) == 0 && memcmp(&a->u, &b->u, sizeof a->u) == 0;
}

static bool trees_agree(const struct forest *forest, const struct scene *scene,
                        const struct ray *ray, uint64_t *fallbacks)
{
    struct hit brute, hit;
    nearest(scene, forest->brute, ray, 1, &brute, fallbacks);
    for (int i = 0; i < TREES; i++) {
        uint64_t ignored = 0;
        stage_hits(scene, forest->trees[i], ray, 1, &hit, &ignored);
        if (!same_hit(&brute, &hit)) return false;
    }
    return true;
}

static void walk_trees(struct block *block, const void *context)
{
    const struct forest *forest = context;
    for (uint64_t i = 0; i < block->count; i++) {
        struct ray ray = forest->draw(&block->random);
        uint64_t ignored = 0;
        if (!trees_agree(forest, forest->stage.ours, &ray, &block->tally->fallbacks))
            score_wrong(&block->tally->ours, block->first + i);
        if (!trees_agree(forest, forest->stage.paper, &ray, &ignored))
            score_wrong(&block->tally->paper, block->first + i);
        block->tally->samples++;
    }
}

static void compare_trees(const struct budget *budget, struct case_result *result, int number,
                          struct builder *builder, struct ray (*draw)(struct random *random),
                          uint64_t rays)
{
    struct forest forest = {.stage = stage_finish(builder, NULL), .draw = draw};
    struct tally tally = {.samples = 0};
    plant(&forest);
    share(budget, number, rays, walk_trees, &forest, &tally);
    fell(&forest);
    conclude(result, &tally, NULL, 0);
}

static struct ray any_ray(struct random *random)
{
    struct vec3 origin = random_point(random, 15);
    return stage_ray(origin, vec_sub(random_point(random, 10), origin));
}

static void run_tree(const struct budget *budget, struct case_result *result)
{
    struct random random = random_seeded(35, 0);
    struct builder *builder = builder_create();
    picture_mixture(builder, &random, budget->quick ? 12 : 40);
    compare_trees(budget, result, 35, builder, any_ray, budget->rays * 10);
}

/* Components that are 0, -0, denormal, or so small that 1 / d overflows; at least one is not. */
static double odd_component(struct random *random)
{
    const double odd[] = {0, -0.0, 0x1p-1074, -0x1p-1074, 1e-310, -1e-310, 1e-300, 1, -1};
    return odd[random_below(random, sizeof odd / sizeof *odd)];
}

static struct ray odd_ray(struct random *random)
{
    struct vec3 d;
    for (unsigned axis = 0; axis < 3; axis++)
        set_component(&d, axis, odd_component(random));
    struct vec3 o = integer_point(random, 4);
    if (vec_is_zero(d)) d.z = 0x1p-1074;
    if (random_bits(random) & 1) d.x = random_sign(random);
    return stage_ray(o, d);
}

/* Boxes, triangles, discs and balls on a lattice, so that origins lie in their bounds' planes. */
static void run_tree_axes(const struct budget *budget, struct case_result *result)
{
    struct random random = random_seeded(36, 0);
    struct builder *builder = builder_create();
    uint32_t m = stage_material(builder);
    for (int i = 0; i < 40; i++) {
        struct vec3 p;
        for (unsigned axis = 0; axis < 3; axis++)
            set_component(&p, axis, (double)random_below(&random, 8) - 4);
        struct box box = {.min = p, .max = vec_add(p, vec3(1, 1, 1)), .material = m};
        struct disc disc = {.center = p, .normal = {0, 0, 1}, .radius = 1, .material = m};
        if (i % 4 == 0) expect_added(builder_add_box(builder, &box));
        if (i % 4 == 1) expect_added(builder_add_disc(builder, &disc));
        if (i % 4 == 2) stage_sphere(builder, p, 1);
        if (i % 4 == 3)
            stage_triangle(builder, p, vec_add(p, vec3(1, 0, 0)), vec_add(p, vec3(0, 1, 0)));
    }
    compare_trees(budget, result, 36, builder, odd_ray, budget->rays);
}

static struct ray far_ray(struct random *random)
{
    double reach = random_log(random, 1e-9, 1e12);
    struct vec3 origin = random_away(random, reach);
    struct vec3 target = random_away(random, random_log(random, 1e-9, 1e9));
    return stage_ray(origin, vec_sub(target, origin));
}

static void run_tree_sizes(const struct budget *budget, struct case_result *result)
{
    struct random random = random_seeded(37, 0);
    struct builder *builder = builder_create();
    for (int i = 0; i < 60; i++) {
        double size = pow(10, random_between(&random, -9, 9));
        struct vec3 p = vec_scale(random_unit(&random), 4 * size);
        struct vec3 a = vec_scale(random_unit(&random), size);
        struct vec3 b = vec_scale(random_unit(&random), size);
        if (i % 2)
            stage_sphere(builder, p, size);
        else
            stage_triangle(builder, p, vec_add(p, a), vec_add(p, b));
    }
    compare_trees(budget, result, 37, builder, far_ray, budget->rays);
}

/* ---- 38 ---- */

/* Nodes on the longest way down. */
static unsigned depth_of(const struct bvh *bvh, uint32_t at)
{
    const struct bvh_node *node = &bvh_nodes(bvh)[at];
    unsigned depth = 0;
    for (int slot = 0; slot < BVH_WIDTH; slot++) {
        if (node->count[slot] > 0 || node->child[slot] == 0) continue;
        unsigned below = depth_of(bvh, node->child[slot]);
        depth = below > depth ? below : depth;
    }
    return 1 + depth;
}

static void run_equal_centroids(const struct budget *budget, struct case_result *result)
{
    uint64_t count = budget->quick ? 20000 : 1000000;
    struct builder *builder = builder_create();
    struct sphere sphere = {.center = {1, 2, 3}, .radius = 1, .material = stage_material(builder)};
    for (uint64_t i = 0; i < count; i++) {
        if (i % 2) sphere.radius += 0x1p-20;
        expect_added(builder_add_sphere(builder, &sphere));
    }
    double start = clock_wall();
    struct stage stage = stage_finish(builder, NULL);
    double seconds = clock_wall() - start;
    unsigned depth = depth_of(stage.bvh, 0);
    snprintf(result->paper, sizeof result->paper, "the same tree");
    snprintf(result->ours, sizeof result->ours, "depth %u of %d, %.2g s", depth, BVH_MAX_DEPTH,
             seconds);
    picture_verdict(result, count, depth > BVH_MAX_DEPTH);
    stage_free(&stage);
}

/* ---- 39 ---- */

#define BAD_RAYS 4096

static struct ray bad_ray(struct random *random)
{
    const double bad[] = {(double)NAN, HUGE_VAL, -HUGE_VAL};
    struct ray ray = any_ray(random);
    double *place[] = {&ray.origin.x,    &ray.origin.y,    &ray.origin.z,
                       &ray.direction.x, &ray.direction.y, &ray.direction.z};
    uint64_t which = random_below(random, 6);
    *place[which] = bad[random_below(random, 3)];
    return ray;
}

static double time_of(const struct stage *stage, const struct ray *rays, struct hit *hits)
{
    uint64_t exact = 0;
    double start = clock_wall();
    nearest(stage->ours, stage->bvh, rays, BAD_RAYS, hits, &exact);
    return clock_wall() - start;
}

static void run_bad_rays(const struct budget *budget, struct case_result *result)
{
    struct random random = random_seeded(39, 0);
    struct builder *builder = builder_create();
    picture_mixture(builder, &random, 12);
    struct stage stage = stage_finish(builder, NULL);
    struct ray *rays = allocate(2 * BAD_RAYS, sizeof *rays);
    struct hit *hits = allocate(BAD_RAYS, sizeof *hits);
    uint64_t met = 0, rounds = budget->rays / BAD_RAYS + 3;
    double good_s = HUGE_VAL, bad_s = HUGE_VAL; /* the fastest round of each */
    for (uint64_t round = 0; round < rounds; round++) {
        for (int i = 0; i < BAD_RAYS; i++) {
            rays[i] = any_ray(&random);
            rays[BAD_RAYS + i] = bad_ray(&random);
        }
        good_s = fmin(good_s, time_of(&stage, rays, hits));
        bad_s = fmin(bad_s, time_of(&stage, rays + BAD_RAYS, hits));
        for (int i = 0; i < BAD_RAYS; i++)
            met += hits[i].primitive != PRIMITIVE_NONE;
    }
    snprintf(result->paper, sizeof result->paper, "the same check");
    snprintf(result->ours, sizeof result->ours, "%llu met something, %.2f x the time",
             (unsigned long long)met, bad_s / good_s);
    picture_verdict(result, rounds * BAD_RAYS, met + (bad_s > 2.5 * good_s));
    free(hits);
    free(rays);
    stage_free(&stage);
}

const struct stability_case tree_cases[] = {
    {35, "BVH against brute force, all leaf sizes", "brute force", "id and t bitwise",
     .run = run_tree},
    {36, "direction 0 or denormal, origin on slabs", "brute force", "id and t bitwise",
     .run = run_tree_axes},
    {37, "1e-9 and 1e9 in one tree, origin at 1e12", "brute force", "id and t bitwise",
     .run = run_tree_sizes},
    {38, "1e6 equal centroids", "-", "build ends, depth <= cap", .run = run_equal_centroids},
    {39, "rays that are NaN or infinite", "-", "miss, <= 2.5 times the time", .run = run_bad_rays},
    {.number = 0},
};
