/* Rows 22 and 23: degenerate triangles, and coplanar duplicates. */
#include <stdlib.h>
#include <string.h>

#include "bench/pictures.h"
#include "bench/stability.h"
#include "bench/stability_shapes.h"
#include "worker/bvh_leaf.h"

/* ---- row 22: triangles that add nothing ---- */

static uint32_t shiny(struct builder *builder, struct vec3 color, double reflection)
{
    struct material material = {.color = color,
                                .ambient = 0.1,
                                .diffuse = 0.7,
                                .specular = 0.3,
                                .shininess = 30,
                                .reflection = reflection,
                                .ior = 1};
    uint32_t index;
    expect_added(builder_add_material(builder, &material, &index));
    return index;
}

static void add_indexed(struct builder *builder, uint32_t material, uint32_t a, uint32_t b,
                        uint32_t c)
{
    struct triangle triangle = {.vertex = {a, b, c}, .material = material};
    expect_added(builder_add_triangle(builder, &triangle));
}

/* Adds triangles without area: with repeated corners, and with the exact middle of an edge between its ends. */
static void add_degenerate(struct builder *builder, uint32_t material, const uint32_t corner[3])
{
    struct vec3 a = builder_vertex(builder, corner[0]), b = builder_vertex(builder, corner[1]);
    uint32_t middle;
    expect_added(builder_add_vertex(builder, vec_scale(vec_add(a, b), 0.5), &middle));
    add_indexed(builder, material, corner[0], corner[0], corner[1]);
    add_indexed(builder, material, corner[0], corner[1], corner[1]);
    add_indexed(builder, material, corner[2], corner[2], corner[2]);
    add_indexed(builder, material, corner[0], middle, corner[1]);
}

/* An opaque, partly mirroring ball over a floor, in the light of one lamp. extra: with degenerate and repeated
 * triangles, too. */
static struct stage ball_stage(const struct budget *budget, const struct mesh *mesh, bool extra)
{
    struct builder *builder = builder_create();
    uint32_t first, index, pick[2];
    pick[0] = shiny(builder, vec3(0.8, 0.4, 0.3), 0.4);
    pick[1] = shiny(builder, vec3(0.4, 0.6, 0.8), 0);
    for (uint32_t i = 0; i < mesh->vertices; i++)
        expect_added(builder_add_vertex(builder, mesh->vertex[i], &index));
    expect_added(builder_add_vertex(builder, vec3(-8, -1.5, -8), &first));
    expect_added(builder_add_vertex(builder, vec3(0, -1.5, 8), &index));
    expect_added(builder_add_vertex(builder, vec3(8, -1.5, -8), &index));
    for (uint32_t i = 0; i < mesh->triangles; i++) {
        const uint32_t *corner = mesh->triangle[i];
        add_indexed(builder, pick[i % 2], corner[0], corner[1], corner[2]);
    }
    add_indexed(builder, pick[0], first, first + 1, first + 2);
    for (uint32_t i = 0; extra && i < mesh->triangles; i++) {
        const uint32_t *corner = mesh->triangle[i];
        if (i % 3 == 0) add_degenerate(builder, pick[i % 2], corner);
        if (i % 3 == 1) add_indexed(builder, pick[i % 2], corner[0], corner[1], corner[2]);
        if (i % 3 == 2) add_indexed(builder, pick[i % 2], corner[1], corner[2], corner[0]);
    }
    if (extra) add_indexed(builder, pick[0], first, first + 1, first + 2);
    expect_added(builder_add_light(builder, &(struct light){{5, 8, 6}, {1, 1, 1}}));
    expect_added(builder_add_light(builder, &(struct light){{-6, 3, 4}, {0.3, 0.4, 0.5}}));
    uint32_t edge = budget->quick ? 40 : 400;
    struct view view = stage_view(vec3(1.5, 1, 4.5), vec3(0, -0.2, 0), 40, edge, edge);
    return stage_finish(builder, &view);
}

static void compare_pictures(const struct scene *plain, const struct bvh *plain_bvh,
                             const struct scene *extra, const struct bvh *extra_bvh,
                             struct score *score)
{
    struct picture a = picture_render_with(plain, plain_bvh),
                   b = picture_render_with(extra, extra_bvh);
    uint64_t pixels = (uint64_t)plain->view.region_w * plain->view.region_h;
    for (uint64_t i = 0; i < pixels; i++) {
        if (memcmp(a.rgb + 3 * i, b.rgb + 3 * i, 3 * sizeof *a.rgb) != 0) score_wrong(score, i);
    }
    picture_free(&a);
    picture_free(&b);
}

static void run_22(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    struct mesh mesh = ball_mesh(12, 0);
    struct stage plain = ball_stage(budget, &mesh, false);
    struct stage extra = ball_stage(budget, &mesh, true);
    compare_pictures(plain.ours, plain.bvh, extra.ours, extra.bvh, &tally.ours);
    compare_pictures(plain.paper, plain.bvh, extra.paper, extra.bvh, &tally.paper);
    tally.samples = (uint64_t)plain.ours->view.region_w * plain.ours->view.region_h;
    stage_free(&plain);
    stage_free(&extra);
    mesh_free(&mesh);
    conclude(result, &tally, NULL, 0);
}

/* ---- row 23: triangles in the same place ---- */

#define COPIES 24

/* COPIES copies of one triangle, each with its corners in a random cyclic order. */
static struct stage copies_stage(struct random *random)
{
    struct builder *builder = builder_create();
    uint32_t material = stage_material(builder), corner[3];
    for (int i = 0; i < 3; i++) {
        struct vec3 p = random_away(random, random_between(random, 1, 10));
        expect_added(builder_add_vertex(builder, p, &corner[i]));
    }
    for (int i = 0; i < COPIES; i++) {
        uint64_t turn = random_below(random, 3);
        add_indexed(builder, material, corner[turn], corner[(turn + 1) % 3],
                    corner[(turn + 2) % 3]);
    }
    return stage_finish(builder, NULL);
}

/* Triangles that overlap in the plane z = 1, whose t is exact, in random order. */
static struct stage overlap_stage(struct random *random)
{
    struct builder *builder = builder_create();
    uint32_t material = stage_material(builder), corner[3];
    for (int i = 0; i < COPIES; i++) {
        for (int k = 0; k < 3; k++) {
            double x = (double)random_below(random, 17) - 8;
            struct vec3 p = vec3(x, (double)random_below(random, 17) - 8, 1);
            expect_added(builder_add_vertex(builder, p, &corner[k]));
        }
        add_indexed(builder, material, corner[0], corner[1], corner[2]);
    }
    return stage_finish(builder, NULL);
}

/* A tree of a single triangle. */
struct lone_tree {
    struct bvh head;
    struct bvh_node node;
    struct bvh_leaf leaves[ENTRY_ROOM + LEAF_END];
};

static void plant_alone(struct lone_tree *tree, const struct stage *stage,
                        const struct scene *scene, uint32_t id)
{
    *tree = (struct lone_tree){.head = *stage->bvh, .leaves = {bvh_leaf_of(scene, id)}};
    tree->head.node_count = tree->head.leaf_count = tree->node.count[0] = 1;
    tree->head.next_offset = tree->head.boxes_offset = 0;
    tree->head.nodes_offset = offsetof(struct lone_tree, node);
    tree->head.leaves_offset = offsetof(struct lone_tree, leaves);
    for (int axis = 0; axis < 3; axis++) {
        for (int slot = 0; slot < BVH_WIDTH; slot++) {
            tree->node.min[axis][slot] = slot == 0 ? tree->head.min[axis] : INFINITY;
            tree->node.max[axis][slot] = slot == 0 ? tree->head.max[axis] : -INFINITY;
        }
    }
    bvh_write_corners(scene, tree->head.center, tree->leaves, 1);
}

/* The lowest id of the triangles that the ray hits, by brute force with the kernel's own test: each triangle is tested
 * in a tree of its own. All hits have the same distance. */
static uint32_t lowest_alone(const struct stage *stage, const struct scene *scene,
                             const struct ray *ray)
{
    uint64_t count = scene->primitives[PRIMITIVE_TRIANGLE].count;
    for (uint32_t id = 0; id < count; id++) {
        struct lone_tree tree;
        struct hit hit;
        uint64_t fallbacks = 0;
        plant_alone(&tree, stage, scene, id);
        nearest(scene, &tree.head, ray, 1, &hit, &fallbacks);
        if (hit.primitive != PRIMITIVE_NONE) return id;
    }
    return PRIMITIVE_NONE;
}

static void copies_block(struct block *block, const void *context)
{
    (void)context;
    struct random *random = &block->random;
    struct tally *tally = block->tally;
    struct stage stage = {NULL, NULL, NULL};
    for (uint64_t i = 0; i < block->count; i++) {
        bool copies = i / 32 % 2;
        if (i % 32 == 0) {
            stage_free(&stage);
            stage = copies ? copies_stage(random) : overlap_stage(random);
        }
        /* Overlaps: exactly through integer points of the plane z = 1; copies: in any direction. */
        double x = (double)random_below(random, 17) - 8, y = (double)random_below(random, 17) - 8;
        struct vec3 target = vec3(x, y, 1);
        struct vec3 from = copies ? vec_scale(random_unit(random), 30) : vec3(x, y, -7);
        if (copies) target = vec_scale(target, 0.2);
        struct ray ray = stage_ray(from, vec_sub(target, from));
        uint32_t lowest = lowest_alone(&stage, stage.ours, &ray);
        if (lowest == PRIMITIVE_NONE) continue;
        struct hit ours = stage_nearest(&stage, stage.ours, &ray, &tally->fallbacks);
        struct hit paper = stage_nearest(&stage, stage.paper, &ray, NULL);
        if (ours.primitive != lowest) score_wrong(&tally->ours, block->first + i);
        if (paper.primitive != lowest_alone(&stage, stage.paper, &ray))
            score_wrong(&tally->paper, block->first + i);
        tally->samples++;
    }
    stage_free(&stage);
}

const struct stability_case coplanar_cases[] = {
    {22, "degenerate and duplicate triangles added", "the picture without them",
     "picture bitwise unchanged", .run = run_22},
    {23, "coplanar duplicates", "brute force", "lowest id, whatever the order",
     .work = copies_block},
    {.number = 0},
};
