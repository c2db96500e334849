/* Rows 60 and 61: an object that exactly fills another one, and rays that exactly hit edges. */

#include "bench/stability.h"
#include "worker/corner.h"

/* ---- row 60: water in a glass ---- */

struct filled {
    struct stage stage;
    struct vec3 center, axis; /* axis: of a cylinder or cone; else 0 */
    double radius;
};

/* Two solids with a common surface, the water in its glass: the same sphere or cone twice, or two cylinders of one
 * radius of which the inner one is shorter. */
static struct filled fill(struct random *random)
{
    struct builder *builder = builder_create();
    uint32_t material = stage_material(builder);
    double r = random_log(random, 1e-8, 1e8);
    struct filled filled = {.center = random_away(random, r * random_log(random, 0.01, 100)),
                            .radius = r};
    unsigned kind = (unsigned)random_below(random, 3), axis = (unsigned)random_below(random, 3);
    if (kind > 0) set_component(&filled.axis, axis, 1);
    for (unsigned i = 0; i < 2; i++) {
        double length = kind == 1 ? r * (i + 1) * 8 : r * 8;
        struct cone cone = {vec_add_scaled(filled.center, filled.axis, -length),
                            vec_add_scaled(filled.center, filled.axis, length),
                            r,
                            kind == 1 ? r : r / 2,
                            material,
                            1};
        if (kind == 0)
            stage_sphere(builder, filled.center, r);
        else
            expect_added(builder_add_cone(builder, &cone));
    }
    filled.stage = stage_finish(builder, NULL);
    return filled;
}

/* A ray from the side towards a point near the middle. */
static struct ray ray_to_middle(struct random *random, const struct filled *filled)
{
    struct vec3 from = random_unit(random);
    from = vec_normalize(vec_add_scaled(from, filled->axis, -vec_dot(from, filled->axis)));
    from = vec_add_scaled(from, filled->axis, random_between(random, -0.3, 0.3));
    struct vec3 target = random_away(random, filled->radius * random_between(random, 0, 0.7));
    from = vec_scale(from, filled->radius * random_between(random, 2, 20));
    struct vec3 way = vec_sub(target, from);
    return stage_ray(vec_add(filled->center, from), vec_normalize(way));
}

/* Whether the ray enters both solids, leaves both, and hits nothing more. */
static bool passes_both(const struct stage *stage, const struct scene *scene, struct ray ray,
                        uint64_t *fallbacks)
{
    for (uint32_t k = 0;; k++) {
        struct surface surface;
        struct hit hit = stage_nearest(stage, scene, &ray, fallbacks);
        if (hit.primitive == PRIMITIVE_NONE) return k == 4;
        if (k == 4 || primitive_index(hit.primitive) != k % 2) return false;
        surface_at(scene, &ray, &hit, &surface);
        ray = stage_going_on(&surface, &hit, ray.direction);
    }
}

static void filled_block(struct block *block, const void *context)
{
    (void)context;
    struct filled filled = {.radius = 0};
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&filled.stage);
            filled = fill(&block->random);
        }
        const struct stage *stage = &filled.stage;
        struct ray ray = ray_to_middle(&block->random, &filled);
        if (!passes_both(stage, stage->ours, ray, &block->tally->fallbacks))
            score_wrong(&block->tally->ours, block->first + i);
        if (!passes_both(stage, stage->paper, ray, NULL))
            score_wrong(&block->tally->paper, block->first + i);
        block->tally->samples++;
    }
    stage_free(&filled.stage);
}

/* ---- row 61: a room of mirrors ---- */

#define BOUNCES 20

struct room {
    struct stage stage;
    struct vec3 corner[8];
    unsigned corners;
};

static struct vec3 turned(const struct vec3 frame[3], struct vec3 v)
{
    struct vec3 sum = vec_scale(frame[0], v.x);
    return vec_add_scaled(vec_add_scaled(sum, frame[1], v.y), frame[2], v.z);
}

/* Adds the walls of the room as triangles with common vertices. */
static void add_mesh(struct builder *builder, const struct room *room, uint32_t material)
{
    static const unsigned cube[12][3] = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5},
                                         {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                         {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
    static const unsigned tetrahedron[4][3] = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    uint32_t index[8];
    bool is_cube = room->corners == 8;
    for (unsigned i = 0; i < room->corners; i++)
        expect_added(builder_add_vertex(builder, room->corner[i], &index[i]));
    for (unsigned i = 0; i < (is_cube ? 12u : 4u); i++) {
        const unsigned *corner = is_cube ? cube[i] : tetrahedron[i];
        struct triangle wall = {{index[corner[0]], index[corner[1]], index[corner[2]]}, material};
        expect_added(builder_add_triangle(builder, &wall));
    }
}

/* Adds the walls of a cube, each as a plane or a disc. */
static void add_walls(struct builder *builder, struct random *random, const struct room *room,
                      const struct vec3 frame[3], uint32_t material)
{
    double size = vec_largest(vec_sub(room->corner[7], room->corner[0]));
    for (unsigned i = 0; i < 6; i++) {
        /* Three walls meet in corner 0, the other three in corner 7. */
        struct vec3 at = room->corner[i % 2 ? 7 : 0];
        struct vec3 inward = vec_scale(frame[i / 2], i % 2 ? -1 : 1);
        struct plane plane = {at, inward, material, 0};
        struct disc disc = {at, inward, 4 * size, material, 0};
        if (random_bits(random) >> 63)
            expect_added(builder_add_plane(builder, &plane));
        else
            expect_added(builder_add_disc(builder, &disc));
    }
}

/* A room of mirrors: a cube or a tetrahedron, aligned with the axes or turned. */
static struct room make_room(struct random *random)
{
    static const unsigned of_cube[4] = {0, 3, 5, 6};
    struct builder *builder = builder_create();
    uint32_t material = stage_material(builder);
    struct vec3 frame[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    bool is_cube = random_bits(random) >> 63;
    struct room room = {.corners = is_cube ? 8 : 4};
    if (random_bits(random) >> 63) {
        frame[2] = random_unit(random);
        random_frame(random, frame[2], &frame[0], &frame[1]);
    }
    struct vec3 at = integer_point(random, 4);
    double size = ldexp(1, (int)random_below(random, 61) - 30);
    for (unsigned i = 0; i < room.corners; i++) {
        unsigned k = is_cube ? i : of_cube[i];
        struct vec3 unit = vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
        room.corner[i] = vec_scale(vec_add(at, turned(frame, unit)), size);
    }
    if (is_cube && random_bits(random) >> 63)
        add_walls(builder, random, &room, frame, material);
    else
        add_mesh(builder, &room, material);
    room.stage = stage_finish(builder, NULL);
    return room;
}

/* A ray from inside to a point of an edge or of a face's diagonal that divides it in eighths, or to a corner. If the
 * room is not turned, it meets this point exactly. */
static struct ray ray_to_edge(struct random *random, const struct room *room)
{
    struct vec3 from = {0, 0, 0}, target;
    unsigned a = (unsigned)random_below(random, room->corners),
             b = (unsigned)random_below(random, room->corners);
    double part = (double)random_below(random, 9) / 8;
    for (unsigned i = 0; i < room->corners; i++)
        from = vec_add_scaled(from, room->corner[i], 1.0 / room->corners);
    from = vec_add_scaled(vec_scale(from, 0.75), room->corner[random_below(random, room->corners)],
                          0.25);
    while (room->corners == 8 && (a ^ b) == 7)
        b = (unsigned)random_below(random, 8); /* not a diagonal of the cube */
    target = vec_add_scaled(vec_scale(room->corner[a], 1 - part), room->corner[b], part);
    return stage_ray(from, vec_sub(target, from));
}

static bool stays_within(const struct stage *stage, const struct scene *scene, struct ray ray,
                         uint64_t *fallbacks)
{
    for (unsigned k = 0; k < BOUNCES; k++) {
        struct surface surface;
        struct hit hit = stage_nearest(stage, scene, &ray, fallbacks);
        if (hit.primitive == PRIMITIVE_NONE) return false;
        surface_at(scene, &ray, &hit, &surface);
        if (hit.in_corner) surface.point = corner_point(scene, stage->bvh, &ray, &hit);
        double along = vec_dot(ray.direction, surface.geometric);
        struct vec3 back = vec_add_scaled(ray.direction, surface.geometric, -2 * along);
        ray = stage_going_on(&surface, &hit, back);
    }
    return true;
}

static void room_block(struct block *block, const void *context)
{
    (void)context;
    struct room room = {.corners = 0};
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&room.stage);
            room = make_room(&block->random);
        }
        struct ray ray = ray_to_edge(&block->random, &room);
        if (!stays_within(&room.stage, room.stage.ours, ray, &block->tally->fallbacks))
            score_wrong(&block->tally->ours, block->first + i);
        if (!stays_within(&room.stage, room.stage.paper, ray, NULL))
            score_wrong(&block->tally->paper, block->first + i);
        block->tally->samples++;
    }
    stage_free(&room.stage);
}

static void run_61(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 61, budget->rays / 10, room_block, NULL, &tally);
    conclude(result, &tally, NULL, 0);
}

const struct stability_case touching_cases[] = {
    {60, "glass filled to the wall, scales 1e-8-1e8", "topology", "each passed once",
     .work = filled_block},
    {61, "edges of a room of mirrors", "topology", "0 leaks", .run = run_61},
    {.number = 0},
};
