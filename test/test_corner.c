/* Tests of rays that exactly meet edges and corners of several primitives. */
#include "scene_fixture.h"

#include "worker/box.h"
#include "worker/corner.h"
#include "worker/primitive.h"

#define WALLS   6
#define BOUNCES 20

/* A cube whose edge is 2 sizes. */
struct room {
    struct vec3 middle;
    double size;
    struct scene *scene;
    struct bvh *bvh;
};

static struct vec3 place_in(const struct room *room, struct vec3 unit)
{
    return vec_scale(vec_add(room->middle, unit), room->size);
}

static struct vec3 vec_of(const double at[3])
{
    return vec3(at[0], at[1], at[2]);
}

/* Behind the wall a box of the room's size, a plane or a disc in it, by kind. */
static void add_wall(struct builder *builder, const struct room *room, unsigned wall,
                     enum primitive_kind kind)
{
    struct vec3 out = box_normal(wall), at = place_in(room, out);
    struct plane plane = {.point = at, .normal = vec_neg(out)};
    struct disc disc = {at, vec_neg(out), 4 * room->size, 0, 0};
    double min[3] = {-3, -3, -3}, max[3] = {3, 3, 3};
    if (wall % 2)
        min[wall / 2] = 1;
    else
        max[wall / 2] = -1;
    if (kind == PRIMITIVE_BOX)
        add_box(builder, place_in(room, vec_of(min)), place_in(room, vec_of(max)), 0);
    else if (kind == PRIMITIVE_PLANE)
        assert_added(builder_add_plane(builder, &plane));
    else
        assert_added(builder_add_disc(builder, &disc));
}

/* More specks far away than there are behind the walls: what is here is in another tree than the first. */
static void add_specks(struct builder *builder, const struct room *room)
{
    for (unsigned i = 0; i < 200; i++) {
        double along = i / 256.0;
        struct vec3 far = place_in(room, vec3(0x1p30, along, 0));
        struct vec3 behind = place_in(room, vec3(2 + along, 2, 2));
        add_sphere(builder, far, room->size / 256, 0);
        if (i < 80) add_sphere(builder, behind, room->size / 1024, 0);
    }
}

static struct room make_room(uint64_t *random, bool specks)
{
    static const enum primitive_kind kinds[] = {PRIMITIVE_PLANE, PRIMITIVE_BOX, PRIMITIVE_DISC};
    struct room room = {.size = ldexp(1, random_exponent(random, -30, 30))};
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    double middle[3];
    for (unsigned axis = 0; axis < 3; axis++)
        middle[axis] = random_below(random, 9) - 4.0;
    room.middle = vec_of(middle);
    for (unsigned wall = 0; wall < WALLS; wall++)
        add_wall(builder, &room, wall, kinds[random_below(random, 3)]);
    if (specks) add_specks(builder, &room);
    room.scene = finish_scene(builder);
    room.bvh = build_tree(room.scene);
    assert_int_equal(bvh_next(room.bvh) != NULL, specks);
    return room;
}

static void free_room(struct room *room)
{
    free(room->bvh);
    free(room->scene);
}

/* A ray from a point inside, on a grid of quarters, to a corner or to a point that divides an edge in eighths. Nothing
 * is rounded. */
static struct ray ray_to_corner(uint64_t *random, const struct room *room)
{
    double from[3], to[3];
    for (unsigned axis = 0; axis < 3; axis++) {
        from[axis] = (random_below(random, 7) - 3.0) / 4;
        to[axis] = random_below(random, 2) ? 1 : -1;
    }
    to[random_below(random, 3)] = (random_below(random, 17) - 8.0) / 8;
    return ray_to(place_in(room, vec_of(from)), place_in(room, vec_of(to)));
}

/* The surface at a hit, with the point from which secondary rays start. */
static struct surface surface_met(const struct room *room, const struct ray *ray,
                                  const struct hit *hit)
{
    struct surface surface;
    surface_at(room->scene, ray, hit, &surface);
    if (hit->in_corner) surface.point = corner_point(room->scene, room->bvh, ray, hit);
    return surface;
}

static struct ray thrown_back(const struct room *room, const struct ray *ray, const struct hit *hit)
{
    struct surface surface = surface_met(room, ray, hit);
    double along = vec_dot(ray->direction, surface.geometric);
    struct vec3 back = vec_add_scaled(ray->direction, surface.geometric, -2 * along);
    return ray_going_on(surface.point, hit, back);
}

static void test_mirrors_keep_what_meets_their_edges(void **state)
{
    uint64_t random = 171;
    unsigned in_corners = 0;
    for (unsigned i = 0; i < 200; i++) {
        struct room room = make_room(&random, i % 4 == 3);
        for (unsigned k = 0; k < 50; k++) {
            struct ray ray = ray_to_corner(&random, &room);
            for (unsigned bounce = 0; bounce < BOUNCES; bounce++) {
                struct hit hit = nearest_of(room.scene, room.bvh, &ray);
                assert_int_not_equal(hit.primitive, PRIMITIVE_NONE);
                in_corners += hit.in_corner;
                ray = thrown_back(&room, &ray, &hit);
            }
        }
        free_room(&room);
    }
    assert_true(in_corners > 200 * 50);
}

/* Three surfaces that meet in one point at angles of 45 degrees or more; one of them may exist twice. normal: towards
 * the inside. */
static struct room make_corner(uint64_t *random, struct vec3 at, struct vec3 normal[3])
{
    struct room room = {.middle = at, .size = 1};
    struct builder *builder = builder_create();
    double roof = random_between(random, M_PI / 4, M_PI / 2), turn = random_between(random, 1, 2.6);
    normal[0] = vec3(0, 1, 0);
    normal[1] = vec3(-1, 0, 0);
    normal[2] = vec_normalize(vec3(-sin(roof) * cos(turn), -cos(roof), sin(roof) * sin(turn)));
    add_material(builder, vec3(1, 1, 1), 0);
    unsigned twice = random_below(random, 6), first = random_below(random, 3);
    for (unsigned i = 0; i < 3 + (twice < 3); i++) {
        unsigned k = i < 3 ? (i + first) % 3 : twice;
        struct plane plane = {.point = at, .normal = normal[k]};
        struct disc disc = {at, normal[k], 8, 0, 0};
        if (random_below(random, 2))
            assert_added(builder_add_plane(builder, &plane));
        else
            assert_added(builder_add_disc(builder, &disc));
    }
    room.scene = finish_scene(builder);
    room.bvh = build_tree(room.scene);
    return room;
}

static double depth_in(const struct room *room, const struct vec3 normal[3], struct vec3 point)
{
    struct vec3 way = vec_sub(point, room->middle);
    double depth = HUGE_VAL;
    for (unsigned k = 0; k < 3; k++)
        depth = fmin(depth, vec_dot(normal[k], way));
    return depth;
}

/* Rays from inside go exactly to the corner, and are reflected out of it by the mirrors. */
static void test_corners_of_any_shape(void **state)
{
    static const double places[] = {0, 1, 1024};
    uint64_t random = 174;
    unsigned lost = 0;
    for (unsigned i = 0; i < 2000; i++) {
        double at = places[i % 3];
        struct vec3 normal[3], from;
        struct room room = make_corner(&random, vec3(at, at, at), normal);
        do {
            double x = random_below(&random, 65) - 32.0, y = random_below(&random, 65) - 32.0;
            from = vec3(at + x / 32, at + y / 32, at + (random_below(&random, 65) - 32.0) / 32);
        } while (depth_in(&room, normal, from) < 0.005);
        struct ray ray = ray_to(from, room.middle);
        for (unsigned bounce = 0; bounce < BOUNCES; bounce++) {
            struct hit hit = nearest_of(room.scene, room.bvh, &ray);
            if (hit.primitive == PRIMITIVE_NONE) break; /* all walls are behind it */
            ray = thrown_back(&room, &ray, &hit);
        }
        struct vec3 later = vec_add_scaled(ray.origin, ray.direction, 1e-3);
        lost += !(depth_in(&room, normal, later) > 0);
        free_room(&room);
    }
    /* One that comes by a wall at less than rounding, at a low angle, may not see it. */
    assert_true(lost <= 2);
}

/* Rims of a closed cylinder, or of a cone, which is one primitive. */
static void test_rims_keep_what_meets_them(void **state)
{
    static const double on_circle[][2] = {{3, 4}, {4, 3}, {5, 0}, {-3, 4}, {0, -5}, {-4, -3}};
    uint64_t random = 173;
    for (unsigned i = 0; i < 40; i++) {
        struct builder *builder = builder_create();
        add_material(builder, vec3(1, 1, 1), 0);
        struct cone tube = {{0, 0, -5}, {0, 0, 5}, 5, i % 2 ? 5 : 10, 0, 1};
        assert_added(builder_add_cone(builder, &tube));
        struct room room = {.scene = finish_scene(builder)};
        room.bvh = build_tree(room.scene);
        for (unsigned k = 0; k < 6; k++) {
            double x = random_below(&random, 5) - 2.0, y = random_below(&random, 5) - 2.0;
            struct ray ray = ray_to(vec3(x, y, 0), vec3(on_circle[k][0], on_circle[k][1], -5));
            for (unsigned bounce = 0; bounce < BOUNCES; bounce++) {
                struct hit hit = nearest_of(room.scene, room.bvh, &ray);
                assert_int_not_equal(hit.primitive, PRIMITIVE_NONE);
                ray = thrown_back(&room, &ray, &hit);
            }
        }
        free_room(&room);
    }
}

/* Points are moved along the wall, and by no more than rounding requires. */
static void test_points_stay_where_they_are(void **state)
{
    uint64_t random = 172;
    for (unsigned i = 0; i < 200; i++) {
        struct room room = make_room(&random, false);
        struct ray ray = ray_to_corner(&random, &room);
        struct hit hit = nearest_of(room.scene, room.bvh, &ray);
        struct surface alone, surface = surface_met(&room, &ray, &hit);
        surface_at(room.scene, &ray, &hit, &alone);
        struct vec3 moved = vec_sub(surface.point, alone.point);
        double u = 0x1p-53 * 5 * room.size;
        assert_true(hit.in_corner);
        assert_true(vec_largest(moved) > 16 * u / 5);
        assert_true(vec_largest(moved) <= 72 * u);
        assert_true(fabs(vec_dot(moved, surface.geometric)) <= 4 * u);
        free_room(&room);
    }
}

/* Two panes with a gap of a few ulps: a ray through the first one hits the second one. */
static void test_no_corner_between_panes(void **state)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 1);
    double next = nextafter(nextafter(nextafter(nextafter(1, 2), 2), 2), 2);
    for (unsigned i = 0; i < 2; i++) {
        struct plane plane = {.point = {0, i ? next : 1, 0}, .normal = {0, -1, 0}};
        assert_added(builder_add_plane(builder, &plane));
    }
    struct room room = {.scene = finish_scene(builder)};
    room.bvh = build_tree(room.scene);
    struct ray ray = ray_along(vec3(0.25, 0, 0.5), vec3(0.5, 1, 0));
    struct hit hit = nearest_of(room.scene, room.bvh, &ray);
    struct surface alone, surface = surface_met(&room, &ray, &hit);
    surface_at(room.scene, &ray, &hit, &alone);
    assert_int_equal(hit.primitive, primitive_id(PRIMITIVE_PLANE, 0));
    assert_memory_equal(&surface.point, &alone.point, sizeof alone.point);
    ray.origin = surface.point;
    ray.from = hit.primitive;
    hit = nearest_of(room.scene, room.bvh, &ray);
    assert_int_equal(hit.primitive, primitive_id(PRIMITIVE_PLANE, 1));
    free_room(&room);
}

/* More surfaces than are taken into account meet in one point: the tip of a pyramid with 24 sides, seen from
 * its axis. */
static void test_a_crowd_in_one_point(void **state)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    for (unsigned i = 0; i < 24; i++) {
        double angle = i * (2 * acos(-1) / 24);
        struct vec3 inward = vec_normalize(vec3(cos(angle), sin(angle), -1));
        struct plane plane = {.point = {0, 0, 1}, .normal = inward};
        assert_added(builder_add_plane(builder, &plane));
    }
    struct room room = {.scene = finish_scene(builder)};
    room.bvh = build_tree(room.scene);
    struct ray ray = ray_along(vec3(0, 0, 0), vec3(0, 0, 1));
    struct hit hit = nearest_of(room.scene, room.bvh, &ray);
    struct surface surface = surface_met(&room, &ray, &hit);
    assert_true(hit.in_corner);
    assert_vector_near(surface.point, vec3(0, 0, 1), 1e-12);
    free_room(&room);
}

/* A heap of small balls and boxes, some of which are smaller than the distance by which a point is moved out of a
 * corner. */
static struct room make_heap(uint64_t *random)
{
    struct builder *builder = builder_create();
    struct room room = {.middle = random_vector(random, 2), .size = 256 * UNIT_ROUNDOFF};
    add_material(builder, vec3(1, 1, 1), 0);
    for (unsigned i = 0; i < 60; i++) {
        struct vec3 at = vec_add(room.middle, random_vector(random, room.size));
        double radius = room.size / (1 + random_below(random, 16));
        struct vec3 half = vec3(radius, radius, radius);
        if (i % 2)
            add_sphere(builder, at, radius, 0);
        else
            add_box(builder, vec_sub(at, half), vec_add(at, half), 0);
    }
    room.scene = finish_scene(builder);
    room.bvh = build_tree(room.scene);
    return room;
}

/* The largest distance, over the axes, of a point from a box; 0 inside. */
static double way_to_box(struct vec3 point, struct bounds bounds)
{
    double way = 0;
    for (unsigned axis = 0; axis < 3; axis++) {
        double at = vec_component(&point, axis);
        way = fmax(way, fmax(bounds.min[axis] - at, at - bounds.max[axis]));
    }
    return way;
}

/* Points are moved by no more than the boxes of the tree are enlarged. */
static void test_points_stay_within_small_surfaces(void **state)
{
    uint64_t random = 174;
    unsigned in_corners = 0;
    for (unsigned i = 0; i < 2000; i++) {
        struct room room = make_heap(&random);
        struct vec3 from = vec_add(room.middle, random_vector(&random, 1));
        struct ray ray = ray_to(from, vec_add(room.middle, random_vector(&random, room.size)));
        struct hit hit = nearest_of(room.scene, room.bvh, &ray);
        if (hit.primitive != PRIMITIVE_NONE && hit.in_corner) {
            struct surface surface = surface_met(&room, &ray, &hit);
            struct bounds bounds = primitive_bounds(room.scene, hit.primitive);
            assert_true(way_to_box(surface.point, bounds) <= 8 * UNIT_ROUNDOFF * 2);
            in_corners++;
        }
        free_room(&room);
    }
    assert_true(in_corners > 200);
}

/* Rays that are close enough to each other to be traced together. */
#define CLOSE_RAYS 64

/* Walls at x = edge.x and y = edge.y, which reach a little beyond the edge in which they meet. Behind them is a box as
 * large as the eye's distance, or float would not do for packets. */
static struct room make_edge(struct vec3 edge, double distance, enum primitive_kind x_wall,
                             enum primitive_kind y_wall)
{
    double size = 0x1p-14;
    struct room room = {.middle = edge, .size = size};
    struct vec3 behind = vec3(edge.x + distance, edge.y + distance, edge.z);
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    add_box(builder, behind, vec_add(behind, vec3(distance, distance, distance)), 0);
    for (unsigned axis = 0; axis < 2; axis++) {
        enum primitive_kind kind = axis ? y_wall : x_wall;
        struct vec3 out = vec3(!axis, axis, 0), along = vec3(axis, !axis, 0), up = vec3(0, 0, 1);
        struct vec3 low = vec_add_scaled(vec_add_scaled(edge, along, -size), up, -size);
        struct cone pill = {edge, vec_add_scaled(edge, out, size), size, size, 0, 1};
        if (kind == PRIMITIVE_CONE)
            assert_added(builder_add_cone(builder, &pill));
        else if (kind == PRIMITIVE_TRIANGLE)
            add_triangle(builder, low, vec_add_scaled(low, along, 4 * size),
                         vec_add_scaled(low, up, 4 * size), 0);
        else
            assert_added(builder_add_plane(builder, &(struct plane){edge, vec_neg(out), 0, 0}));
    }
    room.scene = finish_scene(builder);
    room.bvh = build_tree(room.scene);
    return room;
}

/* Whether secondary rays from the hit have to start away from other surfaces. */
static bool is_moved(const struct room *room, const struct ray *ray, const struct hit *hit)
{
    struct surface surface;
    surface_at(room->scene, ray, hit, &surface);
    struct vec3 moved = corner_point(room->scene, room->bvh, ray, hit);
    return !vec_is_same(moved, surface.point);
}

/* Rays from the eye that pass the edge by this error; returns how many hits have points that are moved. */
static unsigned count_moved(const struct room *room, struct vec3 eye, double error,
                            uint64_t *random)
{
    struct ray rays[CLOSE_RAYS];
    struct hit hits[CLOSE_RAYS];
    uint64_t exact = 0;
    unsigned moved = 0;
    for (unsigned i = 0; i < CLOSE_RAYS; i++)
        rays[i] = ray_to(eye, vec_add(room->middle, random_vector(random, error)));
    for (enum processor_level level = PROCESSOR_PORTABLE; level < PROCESSOR_LEVELS; level++) {
        if (!processor_has(level)) continue;
        kernel_at(level)->nearest(room->scene, room->bvh, rays, CLOSE_RAYS, hits, &exact);
        for (unsigned i = 0; i < CLOSE_RAYS; i++) {
            if (!is_moved(room, &rays[i], &hits[i])) continue;
            assert_true(hits[i].in_corner);
            moved++;
        }
    }
    return moved;
}

/* Rays that are traced together find the corners of all hits whose points are moved: where the eye has large
 * coordinates, so that their rounding counts, and where it has none, so that only the distance's does. */
static void test_rays_together_find_corners(void **state)
{
    static const enum primitive_kind kinds[] = {PRIMITIVE_CONE, PRIMITIVE_TRIANGLE,
                                                PRIMITIVE_PLANE};
    static const struct vec3 eyes[] = {{0, 0, 0}, {0x1p30, 0x1p30, 0x1p30}};
    static const struct vec3 ways[] = {{0.5, 1, 0.25}, {2048, 4096, 1024}};
    uint64_t random = 175;
    for (unsigned i = 0; i < 2 * 3 * 3; i++) {
        struct vec3 eye = eyes[i % 2], edge = vec_add(eye, ways[i % 2]);
        double error = 64 * UNIT_ROUNDOFF * vec_largest(edge);
        struct room room = make_edge(edge, ways[i % 2].y, kinds[i / 2 % 3], kinds[i / 6]);
        assert_true(count_moved(&room, eye, error, &random) > CLOSE_RAYS / 4);
        free_room(&room);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mirrors_keep_what_meets_their_edges),
        cmocka_unit_test(test_corners_of_any_shape),
        cmocka_unit_test(test_rims_keep_what_meets_them),
        cmocka_unit_test(test_points_stay_where_they_are),
        cmocka_unit_test(test_no_corner_between_panes),
        cmocka_unit_test(test_a_crowd_in_one_point),
        cmocka_unit_test(test_points_stay_within_small_surfaces),
        cmocka_unit_test(test_rays_together_find_corners),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
