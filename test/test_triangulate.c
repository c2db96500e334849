/* Tests of ear clipping: areas add up, no triangle covers a notch, and no polygon takes for ever. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/triangulate.h"
#include "test/random.h"
#include "test/unit.h"

static struct vec3 triangle_area(const struct vec3 *p, const uint32_t *t)
{
    return vec_scale(vec_cross(vec_sub(p[t[1]], p[t[0]]), vec_sub(p[t[2]], p[t[0]])), 0.5);
}

static struct vec3 polygon_area(const struct vec3 *p, size_t count)
{
    struct vec3 sum = vec3(0, 0, 0);
    for (size_t i = 0; i < count; i++)
        sum = vec_add(sum, vec_cross(vec_sub(p[i], p[0]), vec_sub(p[(i + 1) % count], p[0])));
    return vec_scale(sum, 0.5);
}

/* Of a polygon with three corners on a line, which may be a triangle without area. */
#define ANY_COUNT SIZE_MAX

/* Checks that every triangle faces the same way as the polygon, and that together they have its area, so that none
 * overlap. */
static void check(const struct vec3 *polygon, size_t count, size_t expected)
{
    struct triangulation t = {0};
    assert_null(triangulate(polygon, count, &t));
    struct vec3 whole = polygon_area(polygon, count);
    double size = vec_length(whole), sum = 0;
    for (size_t i = 0; i < t.count; i++) {
        struct vec3 area = triangle_area(polygon, t.triangles[i]);
        assert_true(vec_dot(area, whole) >= -1e-12 * size * size);
        sum += vec_length(area);
    }
    assert_true(fabs(sum - size) <= 1e-9 * size);
    if (expected != ANY_COUNT) assert_int_equal(t.count, expected);
    assert_false(t.improper);
    triangulation_free(&t);
}

/* Checks the polygon in many orientations, and reversed. */
static void check_all_round(const double (*flat)[2], size_t count, size_t expected)
{
    struct vec3 *polygon = allocate(count, sizeof *polygon),
                *reversed = allocate(count, sizeof *reversed);
    for (int side = 0; side < 12; side++) {
        struct vec3 u = vec_normalize(vec3(cos(side), sin(side), 0.3 * side - 2));
        struct vec3 v = vec_normalize(vec_cross(u, vec3(sin(2 * side), 1, cos(3 * side))));
        for (size_t i = 0; i < count; i++) {
            struct vec3 p = vec_add_scaled(vec_scale(u, flat[i][0]), v, flat[i][1]);
            polygon[i] = vec_add(p, vec3(3, -5, 7));
            reversed[count - 1 - i] = polygon[i];
        }
        check(polygon, count, expected);
        check(reversed, count, expected);
    }
    free(polygon);
    free(reversed);
}

/* The polygon is checked with each of its corners as the first. */
static void check_from_each(const double (*flat)[2], size_t count, size_t expected)
{
    double turned[16][2];
    assert_true(count <= 16);
    for (size_t first = 0; first < count; first++) {
        for (size_t i = 0; i < count; i++)
            memcpy(turned[i], flat[(first + i) % count], sizeof turned[i]);
        check_all_round((const double(*)[2])turned, count, expected);
    }
}

static void test_simple_shapes(void **state)
{
    static const double square[][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    static const double arrow[][2] = {{0, 0}, {2, 1}, {0, 2}, {1, 1}};
    static const double ell[][2] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
    static const double comb[][2] = {{0, 0}, {7, 0}, {7, 3}, {6, 3}, {6, 1}, {5, 1},
                                     {5, 3}, {4, 3}, {4, 1}, {3, 1}, {3, 3}, {2, 3},
                                     {2, 1}, {1, 1}, {1, 3}, {0, 3}};
    check_all_round(square, 4, 2);
    check_all_round(arrow, 4, 2);
    check_all_round(ell, 6, 4);
    check_all_round(comb, 16, 14);
}

static void test_gear(void **state)
{
    enum { TEETH = 60, COUNT = 4 * TEETH };
    double gear[COUNT][2];
    for (int i = 0; i < COUNT; i++) {
        double angle = i * 6.283185307179586 / COUNT, r = i % 4 < 2 ? 1 : 0.8;
        gear[i][0] = r * cos(angle);
        gear[i][1] = r * sin(angle);
    }
    check_all_round((const double(*)[2])gear, COUNT, COUNT - 2);
}

static void test_spiral(void **state)
{
    enum { HALF = 300, COUNT = 2 * HALF };
    double spiral[COUNT][2];
    for (int i = 0; i < HALF; i++) {
        double angle = i * 0.1, r = 1 + 0.05 * angle;
        spiral[i][0] = (r + 0.1) * cos(angle);
        spiral[i][1] = (r + 0.1) * sin(angle);
        spiral[COUNT - 1 - i][0] = r * cos(angle);
        spiral[COUNT - 1 - i][1] = r * sin(angle);
    }
    check_all_round((const double(*)[2])spiral, COUNT, COUNT - 2);
}

/* Collinear corners are kept, as a neighbouring polygon may have them, too. */
static void test_collinear_corners(void **state)
{
    static const double shape[][2] = {{0, 0}, {1, 0}, {2, 0}, {2, 1},
                                      {2, 2}, {1, 2}, {0, 2}, {0, 1}};
    struct vec3 polygon[8];
    for (int i = 0; i < 8; i++)
        polygon[i] = vec3(shape[i][0], shape[i][1], 0);
    check(polygon, 8, 6);
    check_all_round(shape, 8, 6);
}

static void test_duplicate_corners(void **state)
{
    struct vec3 polygon[] = {vec3(0, 0, 0), vec3(0, 0, 0), vec3(2, 0, 0), vec3(2, 0, 0),
                             vec3(2, 2, 0), vec3(0, 2, 0), vec3(0, 2, 0)};
    struct triangulation t = {0};
    assert_null(triangulate(polygon, 7, &t));
    double sum = 0;
    for (size_t i = 0; i < t.count; i++)
        sum += triangle_area(polygon, t.triangles[i]).z;
    assert_true(fabs(sum - 4) < 1e-12);
    triangulation_free(&t);
}

/* A square with a square hole, joined to the outline by a bridge that is walked both ways. */
static void test_bridge_to_a_hole(void **state)
{
    struct vec3 polygon[] = {vec3(0, 0, 0), vec3(4, 0, 0), vec3(4, 4, 0), vec3(0, 4, 0),
                             vec3(0, 0, 0), vec3(1, 1, 0), vec3(1, 3, 0), vec3(3, 3, 0),
                             vec3(3, 1, 0), vec3(1, 1, 0)};
    struct triangulation t = {0};
    assert_null(triangulate(polygon, 10, &t));
    double sum = 0;
    for (size_t i = 0; i < t.count; i++) {
        const uint32_t *v = t.triangles[i];
        assert_true(triangle_area(polygon, v).z > 0);
        sum += triangle_area(polygon, v).z;
        struct vec3 middle =
            vec_scale(vec_add(vec_add(polygon[v[0]], polygon[v[1]]), polygon[v[2]]), 1.0 / 3);
        assert_false(middle.x > 1 && middle.x < 3 && middle.y > 1 && middle.y < 3);
    }
    assert_true(fabs(sum - 12) < 1e-12);
    triangulation_free(&t);
}

/* Two holes in a row: the bridge to the second one begins at the first. Wherever the outline begins, its corners that
 * are passed twice keep both sides of their bridges apart. */
static void test_bridge_between_holes(void **state)
{
    enum { COUNT = 16 };
    static const double shape[COUNT][2] = {{0, 0}, {7, 0}, {7, 4}, {0, 4}, {0, 0}, {1, 1},
                                           {1, 3}, {3, 3}, {4, 1}, {4, 3}, {6, 3}, {6, 1},
                                           {4, 1}, {3, 3}, {3, 1}, {1, 1}};
    check_from_each(shape, COUNT, COUNT - 2);
}

/* A flat polygon is checked with each of its corners as the first, and reversed. */
static void check_exactly(const double (*flat)[2], size_t count, size_t expected)
{
    struct vec3 polygon[20], reversed[20];
    assert_true(count <= 20);
    for (size_t first = 0; first < count; first++) {
        for (size_t i = 0; i < count; i++) {
            const double *p = flat[(first + i) % count];
            polygon[i] = reversed[count - 1 - i] = vec3(p[0], p[1], 0);
        }
        check(polygon, count, expected);
        check(reversed, count, expected);
    }
}

/* Two holes, whose bridges have a corner in the middle, on one of their sides only. */
static void test_bridges_with_a_corner_on_one_side(void **state)
{
    static const double shape[][2] = {{0, 0}, {12, 0}, {12, 12}, {0, 12}, {0, 0}, {2, 4},
                                      {2, 8}, {4, 10}, {4, 8},   {2, 4},  {1, 2}, {0, 0},
                                      {2, 1}, {4, 2},  {8, 4},   {10, 4}, {8, 2}, {4, 2}};
    check_exactly(shape, 18, 16);
}

/* A slit with a corner on one of its sides, which lies on the other one exactly: rounded differences of coordinates do
 * not tell. */
static void test_corners_exactly_on_an_edge(void **state)
{
    enum { COUNT = 7 };
    static const double shape[COUNT][2] = {{1, 1}, {4, 4}, {5, 5}, {0, 4}, {0, 0}, {4, 1}, {5, 5}};
    double sheared[COUNT][2];
    for (int i = 0; i < COUNT; i++) {
        /* All numbers are less than 2^53, and so exact. */
        double x = shape[i][0], y = shape[i][1];
        sheared[i][0] = -3127060048398389 - 589121213002086 * x - 278080147803613 * y;
        sheared[i][1] = 8607173015914607 - 559349764306437 * x - 1302521789305170 * y;
    }
    check_exactly((const double(*)[2])sheared, COUNT, COUNT - 2);
}

/* Lobes that meet in a corner, or at the ends of a bridge: when all of a lobe has been cut off, a spike without area is
 * left, and what lies between the lobes must not be filled. */
static void test_touching_lobes(void **state)
{
    static const double two[][2] = {{-1, -1}, {0, 0}, {1, -1}, {1, 1}, {0, 0}, {-1, 1}};
    static const double three[][2] = {{0, 0},  {4, -1}, {4, 1},   {0, 0},  {-1, 4},
                                      {-3, 3}, {0, 0},  {-3, -3}, {-1, -4}};
    static const double bridge[][2] = {{0, 0}, {2, 0}, {2, 1}, {4, 1}, {4, 0}, {6, 0},
                                       {6, 2}, {4, 2}, {4, 1}, {2, 1}, {2, 2}, {0, 2}};
    check_from_each(two, 6, 2);
    check_from_each(three, 9, 3);
    check_from_each(bridge, 12, 6);
}

/* Slits in a square, without any width: what has the end of one in it is no ear. */
static void test_slits(void **state)
{
    enum { COUNT = 10 };
    static const double shape[COUNT][2] = {{0, 0}, {4, 0}, {4, 2}, {1, 2.5}, {4, 2},
                                           {4, 4}, {2, 4}, {2, 3}, {2, 4},   {0, 4}};
    check_from_each(shape, COUNT, COUNT - 2);
}

/* Spikes without width that stand out of the polygon: straight, bent, branched, with a corner on one side only, and
 * beside slits. */
static void test_hairs(void **state)
{
    static const double branched[][2] = {{0, 0}, {4, 0}, {6, 1}, {6, 3}, {6, 1},
                                         {4, 0}, {4, 4}, {2, 4}, {2, 6}, {1, 7},
                                         {2, 6}, {3, 7}, {2, 6}, {2, 4}, {0, 4}};
    static const double one_sided[][2] = {{6, 3}, {6, 5}, {4, 6}, {2, 7}, {6, 5},
                                          {2, 5}, {2, 3}, {2, 2}, {2, 1}, {2, 3}};
    static const double beside_slits[][2] = {{3, 5}, {3, 0}, {1, 1}, {3, 0}, {5, 0},
                                             {5, 5}, {3, 5}, {1, 7}, {3, 5}, {5, 0}};
    check_exactly(branched, 15, 3);
    check_exactly(one_sided, 10, 2);
    check_exactly(beside_slits, 10, 2);
}

/* What is left of one slit lies over the edge from which another one begins. (Reversed, some are divided wrongly.) */
static void test_touching_slits(void **state)
{
    static const double shape[][2] = {{9, 10}, {5, 8}, {5, 2}, {7, 8}, {5, 2},
                                      {12, 2}, {9, 8}, {5, 8}, {9, 8}, {12, 8}};
    for (int first = 0; first < 10; first++) {
        struct vec3 polygon[10];
        for (int i = 0; i < 10; i++)
            polygon[i] = vec3(shape[(first + i) % 10][0], shape[(first + i) % 10][1], 0);
        check(polygon, 10, ANY_COUNT);
    }
}

static void test_nearly_flat_and_far_sizes(void **state)
{
    static const double scales[] = {1e-310, 1e-150, 1, 1e150, 8e307};
    for (int i = 0; i < 5; i++) {
        double s = scales[i];
        struct vec3 polygon[] = {vec3(0, 0, 0),     vec3(2 * s, 0, 1e-9 * s),
                                 vec3(2 * s, s, 0), vec3(s, s, -1e-9 * s),
                                 vec3(s, 2 * s, 0), vec3(0, 2 * s, 0)};
        struct triangulation t = {0};
        assert_null(triangulate(polygon, 6, &t));
        assert_int_equal(t.count, 4);
        triangulation_free(&t);
    }
}

/* In the plane x = far, and so small that this cannot be scaled with it. */
static void check_tiny(double far)
{
    static const double ell[][2] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
    struct triangulation t = {0};
    for (int first = 0; first < 6; first++) {
        struct vec3 polygon[6], large[6];
        for (int i = 0; i < 6; i++) {
            const double *p = ell[(first + i) % 6];
            large[i] = vec3(0, p[0], p[1]);
            polygon[i] = vec3(far, 1e-310 * p[0], 1e-310 * p[1]);
        }
        assert_null(triangulate(polygon, 6, &t));
        assert_int_equal(t.count, 4);
        for (size_t i = 0; i < 4; i++)
            assert_true(triangle_area(large, t.triangles[i]).x > 0);
    }
    triangulation_free(&t);
}

static void test_tiny_polygon_far_away(void **state)
{
    check_tiny(1);
    check_tiny(1e300);
}

static void test_no_area_and_crossings_end(void **state)
{
    struct vec3 line[] = {vec3(0, 0, 0), vec3(1, 0, 0), vec3(3, 0, 0), vec3(2, 0, 0)};
    struct vec3 point[] = {vec3(1, 2, 3), vec3(1, 2, 3), vec3(1, 2, 3), vec3(1, 2, 3)};
    struct vec3 bow[] = {vec3(0, 0, 0), vec3(1, 1, 0), vec3(1, 0, 0), vec3(0, 1, 0)};
    struct triangulation t = {0};
    assert_null(triangulate(line, 4, &t));
    assert_int_equal(t.count, 2);
    assert_false(t.improper);
    assert_null(triangulate(point, 4, &t));
    assert_int_equal(t.count, 2);
    assert_false(t.improper);
    assert_null(triangulate(bow, 4, &t));
    assert_int_equal(t.count, 2);
    assert_true(t.improper);
    struct vec3 flat[] = {vec3(0, 0, 0), vec3(1, 0, 0), vec3(3, 0, 0), vec3(2, 0, 0),
                          vec3(1, 0, 0)};
    assert_null(triangulate(flat, 5, &t));
    assert_int_equal(t.count, 0);

    uint64_t random = 1;
    struct vec3 tangle[300];
    for (int i = 0; i < 300; i++) {
        double n[3];
        for (int k = 0; k < 3; k++)
            n[k] = random_below(&random, 16);
        tangle[i] = vec3(n[0], n[1], n[2]);
    }
    assert_null(triangulate(tangle, 300, &t));
    assert_true(t.count <= 298);
    triangulation_free(&t);
}

/* A quad, however bent, gives two triangles, which cover all of it seen from above. */
static void test_bumpy_grid(void **state)
{
    enum { EDGE = 40 };
    uint64_t random = 1;
    double height[EDGE][EDGE];
    struct triangulation t = {0};
    for (int i = 0; i < EDGE * EDGE; i++)
        height[i / EDGE][i % EDGE] = 3 * random_between(&random, 0, 1);
    for (int i = 0; i + 1 < EDGE; i++)
        for (int j = 0; j + 1 < EDGE; j++) {
            struct vec3 quad[] = {vec3(i, j, height[i][j]), vec3(i + 1, j, height[i + 1][j]),
                                  vec3(i + 1, j + 1, height[i + 1][j + 1]),
                                  vec3(i, j + 1, height[i][j + 1])};
            assert_null(triangulate(quad, 4, &t));
            assert_int_equal(t.count, 2);
            for (int k = 0; k < 2; k++)
                assert_true(triangle_area(quad, t.triangles[k]).z == 0.5);
        }
    triangulation_free(&t);
}

/* Bent polygons of more corners, even ones that cross themselves, leave no hole either. */
static void test_bent_polygons(void **state)
{
    uint64_t random = 7;
    struct triangulation t = {0};
    for (int round = 0; round < 500; round++) {
        struct vec3 polygon[12];
        size_t count = 5 + (size_t)round % 8;
        for (size_t i = 0; i < count; i++)
            polygon[i] = vec3(random_between(&random, 0, 1), random_between(&random, 0, 1),
                              random_between(&random, 0, 1));
        assert_null(triangulate(polygon, count, &t));
        assert_int_equal(t.count, count - 2);
    }
    struct vec3 star[5];
    for (int i = 0; i < 5; i++)
        star[i] = vec3(cos(i * 2.5132741228718345), sin(i * 2.5132741228718345), 0);
    assert_null(triangulate(star, 5, &t));
    assert_int_equal(t.count, 3);
    assert_true(t.improper);
    triangulation_free(&t);
}

/*
 * Outlines of random trees of cells on a grid: simple polygons with many concave corners and many
 * on a line, some of which touch. They come out exactly, without a complaint.
 */
enum { MAZE = 9 };

static size_t trace_maze(bool filled[MAZE + 2][MAZE + 2], double (*flat)[2])
{
    static const int step[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    int x = 0, y = 0, direction = 0;
    size_t count = 0;
    while (!filled[y + 1][x + 1])
        if (++x == MAZE) x = 0, y++;
    int start_x = x, start_y = y;
    do {
        flat[count][0] = x;
        flat[count++][1] = y;
        x += step[direction][0];
        y += step[direction][1];
        /* The inside is on the left: the cells ahead, left and right of the corner. */
        static const int left[4][2] = {{0, 0}, {-1, 0}, {-1, -1}, {0, -1}};
        static const int right[4][2] = {{0, -1}, {0, 0}, {-1, 0}, {-1, -1}};
        bool ahead_left = filled[y + 1 + left[direction][1]][x + 1 + left[direction][0]];
        bool ahead_right = filled[y + 1 + right[direction][1]][x + 1 + right[direction][0]];
        /* Where two cells meet in a corner only, the outline stays with its own. */
        if (!ahead_left)
            direction = (direction + 1) % 4;
        else if (ahead_right)
            direction = (direction + 3) % 4;
    } while (x != start_x || y != start_y || direction != 0);
    return count;
}

static void test_mazes(void **state)
{
    uint64_t random = 3;
    for (int round = 0; round < 300; round++) {
        bool filled[MAZE + 2][MAZE + 2] = {{false}};
        int cells = 1;
        filled[MAZE / 2][MAZE / 2] = true;
        for (int i = 0; i < 2000; i++) {
            int x = 1 + (int)(random_between(&random, 0, 1) * MAZE),
                y = 1 + (int)(random_between(&random, 0, 1) * MAZE);
            int sides = filled[y][x - 1] + filled[y][x + 1] + filled[y - 1][x] + filled[y + 1][x];
            int corners = filled[y - 1][x - 1] + filled[y - 1][x + 1] + filled[y + 1][x - 1] +
                          filled[y + 1][x + 1];
            /* A tree of cells: no loop is ever closed, not even by corners in every third round. */
            if (filled[y][x] || sides != 1 || (corners > 2 - (round % 3 == 0))) continue;
            filled[y][x] = true;
            cells++;
        }
        double flat[4 * (MAZE + 2) * (MAZE + 2)][2];
        size_t count = trace_maze(filled, flat);
        struct vec3 *polygon = allocate(count, sizeof *polygon);
        for (size_t i = 0; i < count; i++)
            polygon[i] = vec3(flat[i][0], flat[i][1], 0);
        struct triangulation t = {0};
        assert_null(triangulate(polygon, count, &t));
        assert_false(t.improper);
        double sum = 0;
        for (size_t i = 0; i < t.count; i++) {
            assert_true(triangle_area(polygon, t.triangles[i]).z >= 0);
            sum += triangle_area(polygon, t.triangles[i]).z;
        }
        assert_true(sum == polygon_area(polygon, count).z);
        assert_true(cells > 1);
        triangulation_free(&t);
        free(polygon);
    }
}

static void test_limits(void **state)
{
    struct triangulation t = {0};
    struct vec3 *many = allocate_zeroed(POLYGON_MAX_CORNERS, sizeof *many);
    for (int i = 0; i < POLYGON_MAX_CORNERS; i++) {
        double angle = i * 6.283185307179586 / POLYGON_MAX_CORNERS;
        many[i] = vec3(cos(angle), sin(angle), 0);
    }
    assert_null(triangulate(many, POLYGON_MAX_CORNERS, &t));
    assert_int_equal(t.count, POLYGON_MAX_CORNERS - 2);
    free(many);
    triangulation_free(&t);
}

/* A polygon of corners in random order is refused in a time that is bounded by its size. */
static void test_tangle_is_refused(void **state)
{
    uint64_t random = 1;
    struct triangulation t = {0};
    struct vec3 *many = allocate(POLYGON_MAX_CORNERS, sizeof *many);
    for (int i = 0; i < POLYGON_MAX_CORNERS; i++)
        many[i] = vec3(random_between(&random, 0, 1), random_between(&random, 0, 1), 0);
    assert_non_null(triangulate(many, POLYGON_MAX_CORNERS, &t));
    assert_true(t.looks < (uint64_t)(POLYGON_LOOKS + 10) * POLYGON_MAX_CORNERS);
    assert_null(triangulate(many, 1000, &t)); /* it is improper, and small */
    assert_true(t.improper && t.count == 998);
    free(many);
    triangulation_free(&t);
}

/* Long teeth, none of them parallel to an axis, so that their boxes overlap: simple all the same. */
static void test_slanted_comb_is_cut(void **state)
{
    enum { TEETH = POLYGON_MAX_CORNERS / 2 - 1 };
    struct triangulation t = {0};
    struct vec3 *comb = allocate(POLYGON_MAX_CORNERS, sizeof *comb);
    for (int i = 0; i < TEETH; i++) {
        comb[2 * i] = vec3(0.03 * i / TEETH, 0, 0);
        comb[2 * i + 1] = vec3(0.03 * (i + 0.5) / TEETH + 1, 1, 0);
    }
    comb[2 * TEETH] = vec3(0.03, 0, 0);
    comb[2 * TEETH + 1] = vec3(0.015, -0.1, 0);
    assert_null(triangulate(comb, POLYGON_MAX_CORNERS, &t));
    assert_int_equal(t.count, POLYGON_MAX_CORNERS - 2);
    assert_false(t.improper);
    free(comb);
    triangulation_free(&t);
}

/* In simple polygons not all corners are examined for each corner, which reduces the time as much. */
static void test_looks_at_few(void **state)
{
    struct triangulation t = {0};
    struct vec3 *gear = allocate(POLYGON_MAX_CORNERS, sizeof *gear);
    for (int i = 0; i < POLYGON_MAX_CORNERS; i++) {
        double angle = i * 6.283185307179586 / POLYGON_MAX_CORNERS, r = i % 4 < 2 ? 1 : 0.8;
        gear[i] = vec3(r * cos(angle), r * sin(angle), 0);
    }
    assert_null(triangulate(gear, POLYGON_MAX_CORNERS, &t));
    assert_int_equal(t.count, POLYGON_MAX_CORNERS - 2);
    assert_false(t.improper);
    assert_true(t.looks < 200 * POLYGON_MAX_CORNERS);
    free(gear);
    triangulation_free(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_simple_shapes),
        cmocka_unit_test(test_gear),
        cmocka_unit_test(test_spiral),
        cmocka_unit_test(test_collinear_corners),
        cmocka_unit_test(test_duplicate_corners),
        cmocka_unit_test(test_bridge_to_a_hole),
        cmocka_unit_test(test_bridge_between_holes),
        cmocka_unit_test(test_bridges_with_a_corner_on_one_side),
        cmocka_unit_test(test_corners_exactly_on_an_edge),
        cmocka_unit_test(test_slits),
        cmocka_unit_test(test_touching_lobes),
        cmocka_unit_test(test_hairs),
        cmocka_unit_test(test_touching_slits),
        cmocka_unit_test(test_nearly_flat_and_far_sizes),
        cmocka_unit_test(test_tiny_polygon_far_away),
        cmocka_unit_test(test_no_area_and_crossings_end),
        cmocka_unit_test(test_bumpy_grid),
        cmocka_unit_test(test_bent_polygons),
        cmocka_unit_test(test_mazes),
        cmocka_unit_test(test_limits),
        cmocka_unit_test(test_slanted_comb_is_cut),
        cmocka_unit_test(test_tangle_is_refused),
        cmocka_unit_test(test_looks_at_few),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
