/*
 * Rows 17-23: closed meshes, and triangles that lie in each other.
 *
 * How crossings are counted: every triangle lets half of the light through, so that occluded()
 * returns 2^-k for a ray that crosses k of them; nearest() is asked about the same ray and has to
 * agree on whether k is 0. From a point in the kernel of a star-shaped mesh (a point that sees all
 * of the surface) topology dictates k = 1, from any other point inside that k is odd.
 */
#include <stdlib.h>
#include <string.h>

#include "bench/stability.h"
#include "common/message.h"

struct mesh {
    struct vec3 *vertex;
    uint32_t (*triangle)[3];
    uint32_t vertices, triangles;
};

static void mesh_free(struct mesh *mesh)
{
    free(mesh->vertex);
    free(mesh->triangle);
}

/* ---- the surface of a cube of n^3 cells, vertices shared ---- */

#define UNSEEN UINT32_MAX

struct lattice {
    struct mesh *mesh;
    uint32_t *index; /* of the vertex at (x, y, z), 0 .. n each */
    uint32_t n;
};

static uint32_t lattice_vertex(struct lattice *lattice, const uint32_t at[3])
{
    uint32_t n = lattice->n;
    uint32_t *index = &lattice->index[(at[0] * (n + 1) + at[1]) * (n + 1) + at[2]];
    struct mesh *mesh = lattice->mesh;
    if (*index == UNSEEN) {
        double half = 0.5 * n;
        mesh->vertex[mesh->vertices] = vec3(at[0] - half, at[1] - half, at[2] - half);
        *index = mesh->vertices++;
    }
    return *index;
}

/* The cell (i, j) of the face of `axis` at 0 or n, as two triangles that face outward; its diagonal
 * alternates like the colours of a chess-board. */
static void add_cell(struct lattice *lattice, unsigned axis, bool far, uint32_t i, uint32_t j)
{
    unsigned u = (axis + 1) % 3, v = (axis + 2) % 3;
    uint32_t corner[4];
    for (unsigned k = 0; k < 4; k++) {
        uint32_t at[3];
        at[axis] = far ? lattice->n : 0;
        at[u] = i + (k == 1 || k == 2);
        at[v] = j + (k >= 2);
        corner[far ? k : 3 - k] = lattice_vertex(lattice, at);
    }
    struct mesh *mesh = lattice->mesh;
    unsigned s = (i + j) % 2;
    for (unsigned k = 0; k < 2; k++) {
        uint32_t *triangle = mesh->triangle[mesh->triangles++];
        triangle[0] = corner[s];
        triangle[1] = corner[(s + 1 + k) % 4];
        triangle[2] = corner[(s + 2 + k) % 4];
    }
}

/* 12 n^2 triangles; coordinates -n/2 .. n/2. */
static struct mesh cube_mesh(uint32_t n)
{
    struct mesh mesh = {.vertices = 0};
    mesh.vertex = allocate((size_t)6 * (n + 1) * (n + 1), sizeof *mesh.vertex);
    mesh.triangle = allocate((size_t)12 * n * n, sizeof *mesh.triangle);
    size_t points = (size_t)(n + 1) * (n + 1) * (n + 1);
    struct lattice lattice = {&mesh, allocate(points, sizeof *lattice.index), n};
    memset(lattice.index, 0xff, points * sizeof *lattice.index);
    for (unsigned side = 0; side < 6; side++) {
        for (uint32_t i = 0; i < n; i++)
            for (uint32_t j = 0; j < n; j++)
                add_cell(&lattice, side / 2, side % 2, i, j);
    }
    free(lattice.index);
    return mesh;
}

/* At least 1e5 triangles at full size. */
static uint32_t mesh_cells(const struct budget *budget)
{
    return budget->quick ? 10 : 92;
}

static double quantise(double x)
{
    return rint(x * 0x1p30) * 0x1p-30;
}

/* A lumpy, rough ball about the origin, rough in another way for every seed. Coordinates are
 * multiples of 2^-30, so that differences of such points are exact and rays go exactly through
 * vertices and the middles of edges. */
static struct mesh ball_mesh(uint32_t n, uint64_t seed)
{
    struct mesh mesh = cube_mesh(n);
    struct random random = random_seeded(17, seed);
    double roughness = 0.15 / n;
    for (uint32_t i = 0; i < mesh.vertices; i++) {
        struct vec3 p = vec_normalize(mesh.vertex[i]);
        double radius = 1 + 0.05 * sin(5 * p.x + 1) * sin(4 * p.y) * cos(6 * p.z);
        radius += random_between(&random, -roughness, roughness);
        mesh.vertex[i] =
            vec3(quantise(p.x * radius), quantise(p.y * radius), quantise(p.z * radius));
    }
    return mesh;
}

/* Two tips and a ring of n vertices, in groups, whose distances go down to some 1e-12: 2 n needles.
 * The ring closes because the steps are normalised by their sum, a few hundred. */
static struct mesh needle_mesh(uint32_t n)
{
    struct mesh mesh = {.vertices = n + 2, .triangles = 2 * n};
    mesh.vertex = allocate(mesh.vertices, sizeof *mesh.vertex);
    mesh.triangle = allocate(mesh.triangles, sizeof *mesh.triangle);
    struct random random = random_seeded(20, 0);
    double *step = allocate(n, sizeof *step), sum = 0, angle = 0;
    for (uint32_t i = 0; i < n; i++)
        sum += step[i] = i % 64 == 0 ? 1 : random_log(&random, 1e-9, 0.1);
    for (uint32_t i = 0; i < n; i++) {
        mesh.vertex[i] = vec3(cos(angle), sin(angle), 0);
        angle += step[i] / sum * 2 * acos(-1);
    }
    mesh.vertex[n] = vec3(0, 0, 1);
    mesh.vertex[n + 1] = vec3(0, 0, -1);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t next = (i + 1) % n;
        memcpy(mesh.triangle[2 * i], (uint32_t[3]){i, next, n}, sizeof *mesh.triangle);
        memcpy(mesh.triangle[2 * i + 1], (uint32_t[3]){next, i, n + 1}, sizeof *mesh.triangle);
    }
    free(step);
    return mesh;
}

static void mesh_scale(struct mesh *mesh, struct vec3 factor)
{
    for (uint32_t i = 0; i < mesh->vertices; i++)
        mesh->vertex[i] = vec_mul(mesh->vertex[i], factor);
}

static void mesh_translate(struct mesh *mesh, struct vec3 by)
{
    for (uint32_t i = 0; i < mesh->vertices; i++)
        mesh->vertex[i] = vec_add(mesh->vertex[i], by);
}

static struct stage mesh_stage(const struct mesh *mesh)
{
    struct builder *builder = builder_create();
    struct triangle triangle = {.material = stage_material(builder)};
    uint32_t index;
    for (uint32_t i = 0; i < mesh->vertices; i++)
        expect_added(builder_add_vertex(builder, mesh->vertex[i], &index));
    for (uint32_t i = 0; i < mesh->triangles; i++) {
        memcpy(triangle.vertex, mesh->triangle[i], sizeof triangle.vertex);
        expect_added(builder_add_triangle(builder, &triangle));
    }
    return stage_finish(builder, NULL);
}

/* ---- rays inside a star-shaped mesh ---- */

struct star {
    struct mesh mesh;
    struct stage stage;
    struct vec3 middle;
    struct vec3 scale;   /* of the axes, powers of two: the mesh is a scaled one */
    double kernel;       /* radius, before scaling: half of what the mesh's planes leave free */
    double inside;       /* the same of a ball that is inside the mesh; 0: not known */
    bool at_the_corners; /* rays go to the vertices and edges one by one, else anywhere */
};

/* Distance of the nearest plane of a triangle from p: what p sees all triangles from inside of,
 * and all points closer to p, too. */
static double kernel_radius(const struct mesh *mesh, struct vec3 p)
{
    double least = HUGE_VAL;
    for (uint32_t i = 0; i < mesh->triangles; i++) {
        const uint32_t *index = mesh->triangle[i];
        struct vec3 a = vec_sub(mesh->vertex[index[0]], p);
        struct vec3 b = vec_sub(mesh->vertex[index[1]], p);
        struct vec3 c = vec_sub(mesh->vertex[index[2]], p);
        struct vec3 n = vec_cross(vec_sub(b, a), vec_sub(c, a));
        least = fmin(least, vec_dot(n, a) / vec_length(n));
    }
    if (!(least > 0)) fatal("a case's mesh is not star-shaped");
    return 0.5 * least;
}

static struct vec3 in_ball(struct random *random, double radius)
{
    struct vec3 p = vec_scale(random_unit(random), radius * random_between(random, 0, 1));
    return vec3(quantise(p.x), quantise(p.y), quantise(p.z));
}

/* A vertex or a point of an edge: the sample'th of all of them, over and over. */
static struct vec3 corner_target(const struct mesh *mesh, uint64_t sample, struct random *random)
{
    uint64_t which = sample % ((uint64_t)mesh->vertices + 3 * (uint64_t)mesh->triangles);
    if (which < mesh->vertices) return mesh->vertex[which];
    which -= mesh->vertices;
    const uint32_t *corner = mesh->triangle[which / 3];
    struct vec3 a = mesh->vertex[corner[which % 3]];
    struct vec3 b = mesh->vertex[corner[(which % 3 + 1) % 3]];
    double along = random_bits(random) >> 63 ? 0.5 : random_between(random, 0, 1);
    return vec_add_scaled(a, vec_sub(b, a), along);
}

struct star_ray {
    struct ray ray;
    bool in_kernel; /* exactly one crossing; else an odd number */
};

static struct star_ray any_star_ray(const struct star *star, uint64_t sample, struct random *random)
{
    struct star_ray any = {.in_kernel = star->inside == 0 || random_below(random, 4) > 0};
    struct vec3 from = in_ball(random, any.in_kernel ? star->kernel : star->inside);
    from = vec_add(vec_mul(from, star->scale), star->middle);
    struct vec3 direction;
    if (star->at_the_corners) {
        direction = vec_sub(corner_target(&star->mesh, sample, random), from);
    } else {
        direction = random_unit(random);
        if (random_bits(random) >> 63) direction = vec_mul(direction, star->scale);
    }
    any.ray = stage_ray(from, direction);
    return any;
}

/* How many rays go through the kernel together. */
#define BATCH 256

static void check_batch(const struct star *star, const struct scene *scene,
                        const struct ray rays[BATCH], const bool in_kernel[BATCH], size_t count,
                        uint64_t first, struct tally *tally)
{
    struct score *score = scene == star->stage.ours ? &tally->ours : &tally->paper;
    uint64_t fallbacks = 0;
    unsigned crossings[BATCH];
    struct hit hits[BATCH];
    stage_crossings(&star->stage, scene, rays, count, crossings, &fallbacks);
    nearest(scene, star->stage.bvh, rays, count, hits, &fallbacks);
    for (size_t i = 0; i < count; i++) {
        bool good = in_kernel[i] ? crossings[i] == 1 : crossings[i] % 2 == 1;
        if (!good || hits[i].primitive == PRIMITIVE_NONE) score_wrong(score, first + i);
    }
    if (scene == star->stage.ours)
        tally->fallbacks += fallbacks;
    else
        tally->paper_samples += count;
}

/* The paper's formulas are only counted on one block in so many: they are not what is certified. */
#define PAPER_SHARE 16

static void star_block(struct block *block, const void *context)
{
    const struct star *star = context;
    struct ray rays[BATCH];
    bool in_kernel[BATCH];
    for (uint64_t first = 0; first < block->count; first += BATCH) {
        uint64_t left = block->count - first;
        size_t count = left < BATCH ? (size_t)left : BATCH;
        uint64_t sample = block->first + first;
        for (size_t i = 0; i < count; i++) {
            struct star_ray any = any_star_ray(star, sample + i, &block->random);
            rays[i] = any.ray;
            in_kernel[i] = any.in_kernel;
        }
        check_batch(star, star->stage.ours, rays, in_kernel, count, sample, block->tally);
        if (block->first / SHARE_BLOCK % PAPER_SHARE == 0)
            check_batch(star, star->stage.paper, rays, in_kernel, count, sample, block->tally);
        block->tally->samples += count;
    }
}

/* Takes the mesh over. */
static void cast_in_star(const struct budget *budget, int number, uint64_t rays, struct star *star,
                         struct tally *tally)
{
    star->stage = mesh_stage(&star->mesh);
    share(budget, number, rays, star_block, star, tally);
    stage_free(&star->stage);
    mesh_free(&star->mesh);
}

static struct star ball(uint32_t cells, uint64_t seed, struct vec3 middle)
{
    struct star star = {
        .mesh = ball_mesh(cells, seed), .middle = middle, .scale = {1, 1, 1}, .inside = 0.8};
    mesh_translate(&star.mesh, middle);
    star.kernel = kernel_radius(&star.mesh, middle);
    return star;
}

static void run_17(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    struct star star = ball(mesh_cells(budget), 0, vec3(0, 0, 0));
    cast_in_star(budget, 17, 6 * budget->many, &star, &tally);
    conclude(result, &tally, NULL, 0);
}

static void run_18(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    struct star star = ball(mesh_cells(budget), 0, vec3(0, 0, 0));
    star.at_the_corners = true;
    cast_in_star(budget, 18, budget->many, &star, &tally);
    conclude(result, &tally, NULL, 0);
}

static void run_19(const struct budget *budget, struct case_result *result)
{
    static const struct vec3 offsets[] = {
        {1e6, 1e6, 1e6}, {1e9, 1e9, 1e9}, {148376, 1234, -223423} /* Embree's verify */
    };
    struct tally tally = {.samples = 0};
    for (int i = 0; i < 6; i++) {
        struct star star = ball(mesh_cells(budget), 0, offsets[i / 2]);
        star.at_the_corners = i % 2;
        cast_in_star(budget, 1900 + i, budget->many / (i % 2 ? 10 : 2), &star, &tally);
    }
    conclude(result, &tally, NULL, 0);
}

/*
 * Rays among flattened triangles are slow: nothing tells a tree that the sheets on both sides of a
 * flat mesh are worth separating, so that a ray along the mesh meets the boxes of all columns on its
 * way. Many small meshes, each rough in its own way, have as many triangles as the large one.
 */
static void cast_in_flat_balls(const struct budget *budget, int number, struct vec3 scale,
                               bool at_the_corners, uint64_t rays, struct tally *tally)
{
    uint64_t meshes = budget->quick ? 2 : 10;
    for (uint64_t seed = 0; seed < meshes; seed++) {
        struct star star = ball(budget->quick ? 7 : 30, seed, vec3(0, 0, 0));
        star.at_the_corners = at_the_corners;
        star.scale = scale;
        mesh_scale(&star.mesh, scale);
        cast_in_star(budget, number + (int)seed, rays / meshes, &star, tally);
    }
}

/* The ball flattened to these sizes, then needles, with fewer rays: the boxes of needles that share
 * a tip overlap, so that a ray meets a good part of them all. */
static void run_20(const struct budget *budget, struct case_result *result)
{
    static const struct vec3 scales[] = {
        {1, 0x1p-20, 0x1p-10}, {0x1p-30, 1, 0x1p-15}, {0x1p-20, 0x1p-40, 1}};
    struct tally tally = {.samples = 0};
    for (int i = 0; i < 6; i++)
        cast_in_flat_balls(budget, 2000 + 10 * i, scales[i / 2], i % 2, budget->many / 6, &tally);
    for (int i = 0; i < 2; i++) {
        struct star star = {.scale = {1, 1, 1}, .at_the_corners = i % 2};
        star.mesh = needle_mesh(budget->quick ? 300 : 1000);
        star.kernel = kernel_radius(&star.mesh, star.middle);
        cast_in_star(budget, 2060 + i, budget->many / 50, &star, &tally);
    }
    conclude(result, &tally, NULL, 0);
}

/* ---- row 21: a lattice ---- */

/* The cube's surface, with lattice points inside its faces moved outward by whole steps: along an
 * axis, from inside the cube, every ray meets one face once. */
static struct mesh lattice_mesh(uint32_t n)
{
    struct mesh mesh = cube_mesh(n);
    struct random random = random_seeded(21, 0);
    double half = 0.5 * n;
    for (uint32_t i = 0; i < mesh.vertices; i++) {
        struct vec3 *p = &mesh.vertex[i];
        double x = fabs(p->x), y = fabs(p->y), z = fabs(p->z);
        if ((x == half) + (y == half) + (z == half) != 1) continue;
        double out = (double)random_below(&random, 4);
        double *outward = x == half ? &p->x : y == half ? &p->y : &p->z;
        *outward += copysign(out, *outward);
    }
    return mesh;
}

static double lattice_coordinate(struct random *random, uint32_t n)
{
    double steps = 1 + (double)random_below(random, 2 * n - 1);
    if (random_bits(random) >> 63) steps = 2 * floor(0.5 * (steps + 1));
    return fmin(0.5 * steps, n - 1) - 0.5 * n;
}

/* From a lattice point or half-way between two, along an axis; zeros of both signs. */
static struct ray lattice_ray(struct random *random, uint32_t n)
{
    double x = lattice_coordinate(random, n), y = lattice_coordinate(random, n);
    struct vec3 from = vec3(x, y, lattice_coordinate(random, n));
    double d[3];
    for (int axis = 0; axis < 3; axis++)
        d[axis] = copysign(0, random_sign(random));
    d[random_below(random, 3)] = random_sign(random) * exp2((double)random_below(random, 9) - 4);
    return stage_ray(from, vec3(d[0], d[1], d[2]));
}

static void lattice_block(struct block *block, const void *context)
{
    const struct star *star = context;
    uint32_t n = (uint32_t)star->inside;
    struct ray rays[BATCH];
    bool in_kernel[BATCH];
    memset(in_kernel, 1, sizeof in_kernel);
    for (uint64_t first = 0; first < block->count; first += BATCH) {
        uint64_t left = block->count - first;
        size_t count = left < BATCH ? (size_t)left : BATCH;
        for (size_t i = 0; i < count; i++)
            rays[i] = lattice_ray(&block->random, n);
        uint64_t sample = block->first + first;
        check_batch(star, star->stage.ours, rays, in_kernel, count, sample, block->tally);
        if (block->first / SHARE_BLOCK % PAPER_SHARE == 0)
            check_batch(star, star->stage.paper, rays, in_kernel, count, sample, block->tally);
        block->tally->samples += count;
    }
}

static void run_21(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    uint32_t n = mesh_cells(budget);
    struct star star = {.mesh = lattice_mesh(n), .inside = n};
    star.stage = mesh_stage(&star.mesh);
    share(budget, 21, budget->many, lattice_block, &star, &tally);
    stage_free(&star.stage);
    mesh_free(&star.mesh);
    conclude(result, &tally, NULL, 0);
}

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

/* Corners repeated, and the exact middle of an edge between its ends: no area. */
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

/* A mirroring ball over a floor, opaque, in the light of two lamps. */
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
    float *a = stage_picture(plain, plain_bvh), *b = stage_picture(extra, extra_bvh);
    uint64_t pixels = (uint64_t)plain->view.region_w * plain->view.region_h;
    for (uint64_t i = 0; i < pixels; i++) {
        if (memcmp(a + 3 * i, b + 3 * i, 3 * sizeof *a) != 0) score_wrong(score, i);
    }
    free(a);
    free(b);
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

/* A triangle, COPIES times, its corners in one of three orders each. */
static struct stage copies_stage(struct random *random)
{
    struct builder *builder = builder_create();
    uint32_t material = stage_material(builder), corner[3];
    for (int i = 0; i < 3; i++) {
        struct vec3 p = vec_scale(random_unit(random), random_between(random, 1, 10));
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

/* The lowest of the triangles that the ray meets, each in a tree of its own: brute force by the
 * same test. All that it meets are equally far. */
static uint32_t lowest_alone(const struct stage *stage, const struct scene *scene,
                             const struct ray *ray)
{
    uint64_t count = scene->primitives[PRIMITIVE_TRIANGLE].count;
    for (uint32_t id = 0; id < count; id++) {
        struct {
            struct bvh head;
            struct bvh_node node;
            struct bvh_leaf leaf;
        } tree = {.head = *stage->bvh, .leaf = bvh_leaf_of(scene, id)};
        tree.head.node_count = tree.head.leaf_count = tree.node.count[0] = 1;
        tree.head.nodes_offset = (uint64_t)((char *)&tree.node - (char *)&tree);
        tree.head.leaves_offset = (uint64_t)((char *)&tree.leaf - (char *)&tree);
        for (int axis = 0; axis < 3; axis++) {
            for (int slot = 0; slot < BVH_WIDTH; slot++) {
                tree.node.min[axis][slot] = slot == 0 ? tree.head.min[axis] : INFINITY;
                tree.node.max[axis][slot] = slot == 0 ? tree.head.max[axis] : -INFINITY;
            }
        }
        struct hit hit;
        uint64_t fallbacks = 0;
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
        /* Through exact integers of the plane z = 1, or anything. */
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

static void run_23(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 23, budget->rays, copies_block, NULL, &tally);
    conclude(result, &tally, NULL, 0);
}

const struct stability_case mesh_cases[] = {
    {17, "closed mesh, random rays from inside", "topology", "exactly 1 hit, 0 misses", run_17},
    {18, "closed mesh, rays at every vertex and edge", "topology", "exactly 1 hit", run_18},
    {19, "the same, moved by 1e6, 1e9, Embree's offset", "topology", "exactly 1 hit", run_19},
    {20, "slivers 1e6-1e12, needle fans", "topology", "exactly 1 hit", run_20},
    {21, "integer lattice, axis rays", "parity", "exactly 1 hit", run_21},
    {22, "degenerate and duplicate triangles added", "the picture without them",
     "picture bitwise unchanged", run_22},
    {23, "coplanar duplicates", "brute force", "lowest id, whatever the order", run_23},
    {0, NULL, NULL, NULL, NULL},
};
