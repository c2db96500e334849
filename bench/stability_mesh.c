/*
 * Rows 17-21: closed meshes.
 *
 * How crossings are counted: every triangle transmits half of the light, so that occluded() returns 2^-k for a ray that
 * crosses k of them. nearest() is called for the same ray and has to agree on whether k is 0. From a
 * point in the kernel of a star-shaped mesh (a point that sees the whole surface) topology dictates k = 1; from
 * any other point inside, k is odd.
 */
#include <string.h>

#include "bench/stability.h"
#include "bench/stability_shapes.h"
#include "common/message.h"

/* At least 1e5 triangles at full size. */
static uint32_t mesh_cells(const struct budget *budget)
{
    return budget->quick ? 10 : 92;
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

struct star_ray {
    struct ray ray;
    bool in_kernel; /* there must be exactly one crossing; else an odd number */
};

struct star {
    struct mesh mesh;
    struct stage stage;
    struct star_ray (*draw)(const struct star *star, uint64_t sample, struct random *random);
    struct vec3 middle;
    struct vec3 scale;   /* scaling of the mesh along the axes: powers of two */
    double kernel;       /* kernel_radius() before scaling: of a ball in the mesh's kernel */
    double inside;       /* radius of a ball inside the mesh, before scaling; 0: unknown */
    bool at_the_corners; /* rays go to all vertices and edges in turn, else anywhere */
    uint32_t cells;      /* of a lattice, along each edge */
};

/* Half of the distance from p to the nearest plane of a triangle. Points closer to p than this distance are inside of
 * all planes, like p itself, and so in the kernel. */
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
    struct vec3 p = random_away(random, radius * random_between(random, 0, 1));
    return vec3(quantise(p.x), quantise(p.y), quantise(p.z));
}

/* A vertex or a point of an edge: sample numbers go through all of them in turn, again and again. */
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

/* Rays that are passed to the intersection kernel together. */
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
    stage_hits(scene, star->stage.bvh, rays, count, hits, &fallbacks);
    for (size_t i = 0; i < count; i++) {
        bool good = in_kernel[i] ? crossings[i] == 1 : crossings[i] % 2 == 1;
        if (!good || hits[i].primitive == PRIMITIVE_NONE) score_wrong(score, first + i);
    }
    if (scene == star->stage.ours)
        tally->fallbacks += fallbacks;
    else
        tally->paper_samples += count;
}

/* The paper's formulas are tested on one block of this many only, as it is not they that are certified. */
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
            struct star_ray any = star->draw(star, sample + i, &block->random);
            rays[i] = any.ray;
            in_kernel[i] = any.in_kernel;
        }
        check_batch(star, star->stage.ours, rays, in_kernel, count, sample, block->tally);
        if (block->first / SHARE_BLOCK % PAPER_SHARE == 0)
            check_batch(star, star->stage.paper, rays, in_kernel, count, sample, block->tally);
        block->tally->samples += count;
    }
}

/* Casts rays from inside the mesh; frees the mesh. */
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
    struct star star = {.mesh = ball_mesh(cells, seed),
                        .draw = any_star_ray,
                        .middle = middle,
                        .scale = {1, 1, 1},
                        .inside = 0.8};
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
 * Rays in flattened meshes are slow: the tree does not separate the two sides of a flat mesh, so a ray along the mesh
 * meets the boxes of all columns on its way. Therefore many small meshes, each with a roughness of its own, replace a
 * large one with as many triangles.
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

/* Balls flattened by these factors, then needles with fewer rays: as the boxes of needles with a common tip overlap, a
 * ray meets many of them. */
static void run_20(const struct budget *budget, struct case_result *result)
{
    static const struct vec3 scales[] = {
        {1, 0x1p-20, 0x1p-10}, {0x1p-30, 1, 0x1p-15}, {0x1p-20, 0x1p-40, 1}};
    struct tally tally = {.samples = 0};
    for (int i = 0; i < 6; i++)
        cast_in_flat_balls(budget, 2000 + 10 * i, scales[i / 2], i % 2, budget->many / 6, &tally);
    for (int i = 0; i < 2; i++) {
        struct star star = {.draw = any_star_ray, .scale = {1, 1, 1}, .at_the_corners = i % 2};
        star.mesh = needle_mesh(budget->quick ? 300 : 1000);
        star.kernel = kernel_radius(&star.mesh, star.middle);
        cast_in_star(budget, 2060 + i, budget->many / 50, &star, &tally);
    }
    conclude(result, &tally, NULL, 0);
}

/* ---- row 21: a lattice ---- */

/* The surface of a cube, with the lattice points inside its faces moved outward by whole steps. A ray along an axis
 * from inside the cube crosses it exactly once. */
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

/* A ray from a lattice point or from half-way between two, along an axis. The other components are zeros of random
 * sign. */
static struct star_ray lattice_ray(const struct star *star, uint64_t sample, struct random *random)
{
    (void)sample;
    uint32_t n = star->cells;
    double x = lattice_coordinate(random, n), y = lattice_coordinate(random, n);
    struct vec3 from = vec3(x, y, lattice_coordinate(random, n));
    double d[3];
    for (int axis = 0; axis < 3; axis++)
        d[axis] = copysign(0, random_sign(random));
    uint64_t along = random_below(random, 3);
    d[along] = random_signed(random, exp2((double)random_below(random, 9) - 4));
    return (struct star_ray){stage_ray(from, vec3(d[0], d[1], d[2])), .in_kernel = true};
}

static void run_21(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    uint32_t n = mesh_cells(budget);
    struct star star = {.mesh = lattice_mesh(n), .draw = lattice_ray, .cells = n};
    cast_in_star(budget, 21, budget->many, &star, &tally);
    conclude(result, &tally, NULL, 0);
}

const struct stability_case mesh_cases[] = {
    {17, "closed mesh, random rays from inside", "topology", "exactly 1 hit, 0 misses",
     .run = run_17},
    {18, "closed mesh, rays at every vertex and edge", "topology", "exactly 1 hit", .run = run_18},
    {19, "the same, moved by 1e6, 1e9, Embree's offset", "topology", "exactly 1 hit",
     .run = run_19},
    {20, "slivers 1e6-1e12, needle fans", "topology", "exactly 1 hit", .run = run_20},
    {21, "integer lattice, axis rays", "parity", "exactly 1 hit", .run = run_21},
    {.number = 0},
};
