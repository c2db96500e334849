#include "scene_fixture.h"

#include "worker/triangle.h"

static struct crossings cross(const struct vec3 corner[3], const struct ray *ray, uint64_t *exact)
{
    struct shear shear = shear_of(&ray->direction);
    return triangle_crossings(&corner[0], &corner[1], &corner[2], ray, &shear, &ALL_CROSSINGS,
                              exact);
}

static void test_hit_and_weights(void **state)
{
    const struct vec3 corner[3] = {{0, 0, 3}, {4, 0, 3}, {0, 4, 3}};
    uint64_t exact = 0;
    struct ray ray = ray_along(vec3(1, 2, 0), vec3(0, 0, 0.5));
    struct crossings found = cross(corner, &ray, &exact);
    assert_same(found.t[0], 6);
    assert_same(found.t[1], NOT_CROSSED);
    assert_same(found.u, 0.25);
    assert_same(found.v, 0.5);
    ray = ray_along(vec3(1, 2, 6), vec3(0, 0, -0.5)); /* from its back */
    found = cross(corner, &ray, &exact);
    assert_same(found.t[0], 6);
    assert_same(found.u, 0.25);
    assert_int_equal(exact, 0);
}

static void test_every_dominant_axis(void **state)
{
    uint64_t random = 8, exact = 0;
    for (int i = 0; i < 50000; i++) {
        struct vec3 corner[3];
        for (int k = 0; k < 3; k++)
            corner[k] = random_vector(&random, 10);
        double u = random_between(&random, -0.5, 1.5), v = random_between(&random, -0.5, 1.5);
        if (fabs(u) < 1e-6 || fabs(v) < 1e-6 || fabs(1 - u - v) < 1e-6) continue;
        struct vec3 target = vec_add_scaled(corner[0], vec_sub(corner[1], corner[0]), u);
        target = vec_add_scaled(target, vec_sub(corner[2], corner[0]), v);
        struct ray ray = ray_to(random_vector(&random, 30), target);
        struct vec3 normal = triangle_normal(&corner[0], &corner[1], &corner[2]);
        if (fabs(vec_dot(vec_normalize(ray.direction), normal)) < 1e-3) continue;
        if (vec_length(vec_cross(vec_sub(corner[1], corner[0]), vec_sub(corner[2], corner[0]))) < 1)
            continue;
        struct crossings found = cross(corner, &ray, &exact);
        bool inside = u > 0 && v > 0 && u + v < 1;
        assert_int_equal(count_ahead(&found), inside);
        if (!inside) continue;
        assert_near(found.t[0], 1, 1e-11);
        assert_near(found.u, u, 1e-9);
        assert_near(found.v, v, 1e-9);
    }
}

static void test_in_its_plane_and_without_area(void **state)
{
    const struct vec3 flat[3] = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
    const struct vec3 line[3] = {{0, 0, 0}, {1, 1, 1}, {3, 3, 3}};
    const struct vec3 point[3] = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
    uint64_t exact = 0;
    struct ray edge_on = ray_along(vec3(-1, 1, 0), vec3(1, 0, 0));
    struct crossings found = cross(flat, &edge_on, &exact);
    assert_int_equal(count_ahead(&found), 0);
    struct ray at_line = ray_to(vec3(5, -3, 0), vec3(2, 2, 2));
    found = cross(line, &at_line, &exact);
    assert_int_equal(count_ahead(&found), 0);
    struct ray at_point = ray_to(vec3(5, -3, 0), vec3(1, 1, 1));
    found = cross(point, &at_point, &exact);
    assert_int_equal(count_ahead(&found), 0);
    assert_true(exact > 0);
}

/*
 * Products of up to 2^106 against integer arithmetic, for an edge that passes the ray closely: of
 * the triangles on its two sides exactly the right one is met.
 */
static void test_edges_are_exact(void **state)
{
    uint64_t random = 9, exact = 0;
    for (int i = 0; i < 50000; i++) {
        int64_t p[2], q[2];
        int shift = (int)random_below(&random, 26);
        for (int k = 0; k < 2; k++) {
            p[k] = (int64_t)random_between(&random, -0x1p52, 0x1p52) >> shift;
            q[k] = -p[k] + (int64_t)random_below(&random, 3) - 1;
        }
        if (p[0] < 9 && p[0] > -9 && p[1] < 9 && p[1] > -9) continue;
        __int128 e = (__int128)p[0] * q[1] - (__int128)p[1] * q[0];
        int expected = (e > 0) - (e < 0);
        if (expected == 0) expected = (q[1] > p[1]) - (q[1] < p[1]);
        if (expected == 0) expected = (p[0] > q[0]) - (p[0] < q[0]);
        struct vec3 from = vec3((double)p[0], (double)p[1], 5);
        struct vec3 to = vec3((double)q[0], (double)q[1], 5);
        const struct vec3 left[3] = {from, to, vec3(from.y, -from.x, 5)};
        const struct vec3 right[3] = {to, from, vec3(-from.y, from.x, 5)};
        struct ray ray = ray_along(vec3(0, 0, 0), vec3(0, 0, 1));
        struct crossings found = cross(left, &ray, &exact);
        assert_int_equal(count_ahead(&found), expected > 0);
        found = cross(right, &ray, &exact);
        assert_int_equal(count_ahead(&found), expected < 0);
    }
    assert_true(exact > 1000); /* the filter was often undecided */
}

/* Far from needing it: a long thin triangle, whose edge values cancel in plain products. */
static void test_needle(void **state)
{
    uint64_t random = 10, exact = 0;
    for (int i = 0; i < 10000; i++) {
        double width = ldexp(1, -(int)random_below(&random, 30));
        struct vec3 corner[3] = {{0, 0, 5}, {1, 1, 6}, {0.5 + width, 0.5 - width, 5.5}};
        double u = random_between(&random, 0.1, 0.4), v = random_between(&random, 0.1, 0.4);
        double x = u + v * corner[2].x, y = u + v * corner[2].y;
        struct ray ray = ray_along(vec3(x, y, 0), vec3(0, 0, 1));
        struct crossings found = cross(corner, &ray, &exact);
        if (count_ahead(&found) == 0) continue; /* rounding of x and y has moved it outside */
        /* The plane is z = 5 + (x + y) / 2 for every width. */
        assert_near(found.t[0], 5 + (x + y) / 2, 1e-14);
    }
}

static void test_scaling_by_powers_of_two(void **state)
{
    const struct vec3 corner[3] = {{0.1, 0.2, 3}, {4.3, 0.4, 3.7}, {0.3, 4.1, 2.9}};
    uint64_t exact = 0;
    struct ray ray = ray_along(vec3(0.3, 0.2, -1), vec3(0.21, 0.17, 1));
    struct crossings found = cross(corner, &ray, &exact);
    assert_int_equal(count_ahead(&found), 1);
    for (int k = -60; k <= 60; k += 20) {
        double scale = ldexp(1, k);
        struct vec3 scaled[3];
        for (int i = 0; i < 3; i++)
            scaled[i] = vec_scale(corner[i], scale);
        struct ray other = ray_along(vec_scale(ray.origin, scale), ray.direction);
        struct crossings same = cross(scaled, &other, &exact);
        assert_same(same.t[0], found.t[0] * scale);
        assert_same(same.u, found.u);
    }
}

/* A closed mesh around the origin: an icosahedron, its triangles divided in four again and again.
 */
struct mesh {
    struct vec3 (*corners)[3];
    size_t count;
};

static struct mesh icosahedron(void)
{
    const double g = 1.6180339887498949;
    const struct vec3 v[12] = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                               {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                               {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    const int f[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                          {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                          {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                          {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    struct mesh mesh = {malloc(20 * sizeof *mesh.corners), 20};
    assert_non_null(mesh.corners);
    for (size_t i = 0; i < 20; i++)
        for (size_t k = 0; k < 3; k++)
            mesh.corners[i][k] = v[f[i][k]];
    return mesh;
}

/* The middle of an edge, the same for both of its triangles, whatever the direction. */
static struct vec3 middle(struct vec3 a, struct vec3 b)
{
    return vec_scale(vec_add(a, b), 0.5);
}

static struct mesh refined(struct mesh coarse)
{
    struct mesh fine = {malloc(4 * coarse.count * sizeof *fine.corners), 4 * coarse.count};
    assert_non_null(fine.corners);
    for (size_t i = 0; i < coarse.count; i++) {
        const struct vec3 *c = coarse.corners[i];
        struct vec3 m[3] = {middle(c[0], c[1]), middle(c[1], c[2]), middle(c[2], c[0])};
        const struct vec3 parts[4][3] = {
            {c[0], m[0], m[2]}, {m[0], c[1], m[1]}, {m[2], m[1], c[2]}, {m[0], m[1], m[2]}};
        memcpy(fine.corners[4 * i], parts, sizeof parts);
    }
    free(coarse.corners);
    return fine;
}

/* Out to unequal radii that depend on the vertex alone: star-shaped, not convex; then deformed. */
static struct mesh star(struct vec3 scale, struct vec3 offset)
{
    struct mesh mesh = refined(refined(icosahedron()));
    for (size_t i = 0; i < mesh.count; i++) {
        for (size_t k = 0; k < 3; k++) {
            struct vec3 *p = &mesh.corners[i][k];
            *p = vec_normalize(*p);
            *p = vec_scale(*p, 1 + 0.3 * sin(7 * p->x + 11 * p->y) * cos(5 * p->z));
            *p = vec_add(vec_mul(*p, scale), offset);
        }
    }
    return mesh;
}

static void assert_one_hit(const struct mesh *mesh, struct vec3 origin, struct vec3 target)
{
    struct ray ray = ray_to(origin, target);
    uint64_t exact = 0;
    unsigned hits = 0;
    for (size_t i = 0; i < mesh->count; i++) {
        struct crossings found = cross(mesh->corners[i], &ray, &exact);
        hits += count_ahead(&found);
    }
    assert_int_equal(hits, 1);
}

/* Asserts that every ray from the middle hits exactly one triangle, also at vertices and along edges. */
static void assert_watertight(struct vec3 scale, struct vec3 offset)
{
    struct mesh mesh = star(scale, offset);
    uint64_t random = 11;
    for (size_t i = 0; i < mesh.count; i++) {
        const struct vec3 *c = mesh.corners[i];
        for (size_t k = 0; k < 3; k++) {
            struct vec3 next = c[(k + 1) % 3];
            assert_one_hit(&mesh, offset, c[k]);
            assert_one_hit(&mesh, offset, middle(c[k], next));
            double share = random_between(&random, 0, 1);
            assert_one_hit(&mesh, offset, vec_add_scaled(c[k], vec_sub(next, c[k]), share));
        }
    }
    free(mesh.corners);
}

static void test_closed_mesh(void **state)
{
    assert_watertight(vec3(1, 1, 1), vec3(0, 0, 0));
}

static void test_closed_mesh_far_away(void **state)
{
    assert_watertight(vec3(1, 1, 1), vec3(1e6, -1e6, 1e6));
    assert_watertight(vec3(1, 1, 1), vec3(148376, 1234, -223423));
}

static void test_closed_mesh_of_slivers(void **state)
{
    assert_watertight(vec3(1, 1e-6, 1e-3), vec3(0, 0, 0));
}

/* Axis-parallel rays down on every point of a grid of triangles, all coordinates integers. */
static void test_lattice(void **state)
{
    uint64_t exact = 0;
    for (int px = 1; px < 8; px++) {
        for (int py = 1; py < 8; py++) {
            struct ray ray = ray_along(vec3(px * 0.5, py * 0.5, 7), vec3(0, 0, -1));
            unsigned hits = 0;
            for (int i = 0; i < 16; i++) {
                double x = i % 4, y = (int)(i / 4);
                const struct vec3 lower[3] = {{x, y, 0}, {x + 1, y, 0}, {x, y + 1, 0}};
                const struct vec3 upper[3] = {{x + 1, y, 0}, {x + 1, y + 1, 0}, {x, y + 1, 0}};
                struct crossings a = cross(lower, &ray, &exact), b = cross(upper, &ray, &exact);
                hits += count_ahead(&a) + count_ahead(&b);
            }
            assert_int_equal(hits, 1);
        }
    }
}

static void test_normal_and_bounds(void **state)
{
    const struct vec3 c[3] = {{0, 0, 3}, {4, 0, 3}, {0, -4, 1}};
    assert_vector_near(triangle_normal(&c[0], &c[2], &c[1]), vec3(0, -1 / sqrt(5), 2 / sqrt(5)),
                       1e-15);
    assert_true(vec_is_zero(triangle_normal(&c[0], &c[0], &c[1])));
    struct bounds bounds = triangle_bounds(&c[0], &c[1], &c[2]);
    assert_same(bounds.min[1], -4);
    assert_same(bounds.max[0], 4);
    assert_same(bounds.min[2], 1);
}

/* A triangle of any size has the same normal, bit for bit. */
static void test_normals_of_all_sizes(void **state)
{
    const struct vec3 corners[3] = {{0.3, -0.1, 3}, {4, 0.7, 2.5}, {0.2, -4, 1}};
    struct vec3 normal = triangle_normal(&corners[0], &corners[1], &corners[2]);
    for (int exponent = -1000; exponent <= 1000; exponent += 50) {
        struct vec3 c[3];
        for (int i = 0; i < 3; i++)
            c[i] = vec_scale_exactly(corners[i], exponent);
        struct vec3 n = triangle_normal(&c[0], &c[1], &c[2]);
        assert_true(n.x == normal.x && n.y == normal.y && n.z == normal.z);
    }
}

/* A ray that begins on an edge passes through both triangles at once, at any size. */
static void test_passage_of_all_sizes(void **state)
{
    for (int exponent = -900; exponent <= 900; exponent += 50) {
        struct vec3 from[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
        struct vec3 of[3] = {{0, 0, 0}, {0, -1, 0.5}, {1, 0, 0}};
        struct vec3 other[3] = {{0, 0, -1}, {0, -1, -1}, {1, 0, -1}};
        for (int i = 0; i < 3; i++) {
            from[i] = vec_scale_exactly(from[i], exponent);
            of[i] = vec_scale_exactly(of[i], exponent);
            other[i] = vec_scale_exactly(other[i], exponent);
        }
        struct vec3 origin = vec_scale_exactly(vec3(0.5, 0, 0x1p-53), exponent);
        struct ray ray = {.origin = origin, .direction = vec3(0.1, 0.2, -1), .t_max = INFINITE};
        assert_true(triangle_is_same_passage(from, of, &ray));
        assert_false(triangle_is_same_passage(from, other, &ray));
        ray.direction.z = 1;
        assert_false(triangle_is_same_passage(from, of, &ray));
    }
}

/* The plain distance and the corrected one against double-double, at all slopes and sizes. */
static void test_distance(void **state)
{
    uint64_t random = 12, exact = 0;
    unsigned hits = 0;
    double worst = 0;
    for (int i = 0; i < 300000; i++) {
        struct vec3 at = random_vector(&random, 10), corner[3];
        double size = pow(10, random_between(&random, -4, 1.5));
        for (unsigned k = 0; k < 3; k++)
            corner[k] = vec_add(at, random_vector(&random, size));
        double u = random_between(&random, 0, 1), v = random_between(&random, 0, 1 - u);
        struct vec3 target = vec_add_scaled(corner[0], vec_sub(corner[1], corner[0]), u);
        target = vec_add_scaled(target, vec_sub(corner[2], corner[0]), v);
        struct ray ray = ray_to(random_vector(&random, 30), target);
        struct shear shear = shear_of(&ray.direction);
        struct crossings found = cross(corner, &ray, &exact);
        struct dd t;
        struct crossings exactly = triangle_crossings_exact(corner, &ray, &shear, &t);
        assert_int_equal(count_ahead(&found), count_ahead(&exactly));
        if (count_ahead(&found) == 0) continue;
        hits++;
        double error = fabs((found.t[0] - t.high) - t.low) / t.high;
        worst = fmax(worst, error);
    }
    assert_true(hits > 290000);
    assert_true(worst <= 8 * UNIT_ROUNDOFF);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_hit_and_weights),
        cmocka_unit_test(test_every_dominant_axis),
        cmocka_unit_test(test_in_its_plane_and_without_area),
        cmocka_unit_test(test_edges_are_exact),
        cmocka_unit_test(test_needle),
        cmocka_unit_test(test_scaling_by_powers_of_two),
        cmocka_unit_test(test_closed_mesh),
        cmocka_unit_test(test_closed_mesh_far_away),
        cmocka_unit_test(test_closed_mesh_of_slivers),
        cmocka_unit_test(test_lattice),
        cmocka_unit_test(test_normal_and_bounds),
        cmocka_unit_test(test_normals_of_all_sizes),
        cmocka_unit_test(test_passage_of_all_sizes),
        cmocka_unit_test(test_distance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
