/* Tests of the generated models: they are complete and closed, face outward, and are the same on every run. */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "config/models/lantern.h"
#include "config/models/models.h"
#include "test/files.h"
#include "test/unit.h"

#define TRIANGLES_OF_CG1 50000 /* the least number that the sample scene must have */
#define ALL_MATERIALS    UINT32_MAX

static int compare_edges(const void *a, const void *b)
{
    const uint64_t *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

static bool counts(const struct mesh_triangle *triangle, uint32_t material)
{
    return material == ALL_MATERIALS || triangle->material == material;
}

/* The directed edges of a material's triangles, sorted; NULL when one occurs twice. */
static uint64_t *directed_edges(const struct mesh *mesh, uint32_t material, size_t *count)
{
    uint64_t *edges = malloc((3 * mesh->triangle_count + 1) * sizeof *edges);
    assert_non_null(edges);
    *count = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++)
        for (int k = 0; k < 3 && counts(&mesh->triangles[i], material); k++) {
            const uint32_t *v = mesh->triangles[i].vertex;
            edges[(*count)++] = (uint64_t)v[k] << 32 | v[(k + 1) % 3];
        }
    qsort(edges, *count, sizeof *edges, compare_edges);
    for (size_t i = 1; i < *count; i++)
        if (edges[i] == edges[i - 1]) {
            free(edges);
            return NULL;
        }
    return edges;
}

/* Every edge belongs to two triangles that run along it in opposite directions. */
static bool closed(const struct mesh *mesh, uint32_t material)
{
    size_t count;
    uint64_t *edges = directed_edges(mesh, material, &count);
    if (edges == NULL) return false;
    bool all = count > 0;
    for (size_t i = 0; i < count && all; i++) {
        uint64_t back = edges[i] << 32 | edges[i] >> 32;
        all = bsearch(&back, edges, count, sizeof *edges, compare_edges) != NULL;
    }
    free(edges);
    return all;
}

/* Six times the volume within the triangles of a material; positive when they look outward. */
static double volume(const struct mesh *mesh, uint32_t material)
{
    double sum = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const struct mesh_triangle *t = &mesh->triangles[i];
        if (!counts(t, material)) continue;
        struct vec3 a = mesh->vertices[t->vertex[0]], b = mesh->vertices[t->vertex[1]];
        sum += vec_dot(a, vec_cross(b, mesh->vertices[t->vertex[2]]));
    }
    return sum;
}

static struct vec3 direction_of(const struct mesh *mesh, const struct mesh_triangle *t)
{
    struct vec3 a = mesh->vertices[t->vertex[0]];
    return vec_cross(vec_sub(mesh->vertices[t->vertex[1]], a),
                     vec_sub(mesh->vertices[t->vertex[2]], a));
}

/* Indices in range, numbers finite, triangles with an area, normals of unit length and on the
 * triangle's front. */
static void assert_sane(const struct mesh *mesh)
{
    for (size_t i = 0; i < mesh->vertex_count; i++)
        assert_true(vec_is_finite(mesh->vertices[i]));
    for (size_t i = 0; i < mesh->normal_count; i++)
        assert_true(fabs(vec_length(mesh->normals[i]) - 1) < 1e-12);
    size_t turned_away = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const struct mesh_triangle *t = &mesh->triangles[i];
        assert_true(t->material < mesh->material_count);
        for (int k = 0; k < 3; k++)
            assert_true(t->vertex[k] < mesh->vertex_count);
        struct vec3 face = direction_of(mesh, t);
        assert_true(vec_length(face) > 0);
        for (int k = 0; k < 3 && t->normal[0] != MESH_FLAT; k++) {
            assert_true(t->normal[k] < mesh->normal_count);
            if (vec_dot(mesh->normals[t->normal[k]], face) <= 0) turned_away++;
        }
    }
    assert_int_equal(turned_away, 0);
}

static void make_lantern(struct mesh *mesh, enum lantern_style style)
{
    const struct lantern lantern = lantern_default(style);
    const struct mesh_transform t = transform_identity();
    mesh_init(mesh);
    lantern_add(mesh, &lantern, &t);
}

static void test_lantern_has_enough_triangles(void **state)
{
    struct mesh mesh;
    make_lantern(&mesh, LANTERN_KASUGA);
    assert_true(mesh.triangle_count >= TRIANGLES_OF_CG1);
    mesh_free(&mesh);
}

static void test_lantern_is_closed_and_sane(void **state)
{
    for (int style = LANTERN_KASUGA; style <= LANTERN_YUKIMI; style++) {
        struct mesh mesh;
        make_lantern(&mesh, (enum lantern_style)style);
        assert_sane(&mesh);
        assert_true(closed(&mesh, ALL_MATERIALS));
        mesh_free(&mesh);
    }
}

/* Refractive parts must be closed solids, or rays would enter them and never leave. */
static void test_glass_is_solid(void **state)
{
    struct mesh mesh;
    make_lantern(&mesh, LANTERN_KASUGA);
    const char *const transparent[] = {"pane", "jewel", "flame"};
    for (size_t i = 0; i < 3; i++) {
        uint32_t material = mesh_material(&mesh, transparent[i]);
        assert_true(closed(&mesh, material));
        assert_true(volume(&mesh, material) > 0);
    }
    mesh_free(&mesh);
}

static void test_lantern_stands_on_its_foot(void **state)
{
    struct mesh mesh;
    make_lantern(&mesh, LANTERN_KASUGA);
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (size_t i = 0; i < mesh.vertex_count; i++) {
        low = fmin(low, mesh.vertices[i].y);
        high = fmax(high, mesh.vertices[i].y);
    }
    assert_true(fabs(low) < 0.02);
    assert_true(high > 2.2 && high < 2.8);
    mesh_free(&mesh);
}

static void test_two_runs_write_the_same_bytes(void **state)
{
    char folder[] = "/tmp/farm_models_XXXXXX", path[64];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/lantern.obj", folder);
    size_t first_size, second_size;
    assert_true(write_lantern(folder));
    char *first = read_bytes(path, &first_size);
    assert_true(write_lantern(folder));
    char *second = read_bytes(path, &second_size);
    assert_int_equal(remove(path), 0);
    assert_int_equal(rmdir(folder), 0);
    assert_int_equal(first_size, second_size);
    assert_memory_equal(first, second, first_size);
    assert_null(strstr(first, "nan"));
    free(first);
    free(second);
}

static void test_write_errors_are_told(void **state)
{
    assert_false(write_lantern("/nonexistent/folder"));
    struct mesh mesh;
    mesh_init(&mesh);
    mesh_box(&mesh, vec3(0, 0, 0), vec3(1, 1, 1), 0);
    if (access("/dev/full", W_OK) == 0) assert_false(mesh_write_obj(&mesh, "/dev", "full"));
    mesh_free(&mesh);
}

/* One of each shape, apart from each other, with its volume by elementary formulas. */
static void test_shapes_are_closed_and_outward(void **state)
{
    const struct point2 profile[] = {{0, 0}, {1, 0}, {1, 2}, {0, 2}};
    const struct vec3 path[] = {{0, 0, 0}, {0, 1, 0}, {0, 2, 0}};
    const double radii[] = {0.5, 0.5, 0.5};
    struct point2 hexagon[6];
    assert_int_equal(mesh_polygon(hexagon, 6, 0, 1, 0), 6);
    const double expected[] = {24, 24, 4 * PI / 3 * 6, 2 * PI, 3 * sqrt(3), PI / 2, 1.5 * sqrt(3)};
    const double tolerance[] = {1e-12, 1, 0.2, 0.02, 1e-12, 0.02, 1e-12};
    for (int shape = 0; shape < 7; shape++) {
        struct mesh mesh;
        mesh_init(&mesh);
        switch (shape) {
        case 0:
            mesh_box(&mesh, vec3(-1, -1, -1), vec3(1, 2, 3), 0);
            break;
        case 1:
            mesh_box(&mesh, vec3(-1, -1, -1), vec3(1, 2, 3), 0.1);
            break;
        case 2:
            mesh_ball(&mesh, vec3(5, 6, 7), vec3(1, 2, 3), 24);
            break;
        case 3:
            mesh_revolve(&mesh, profile, 4, 100);
            break;
        case 4:
            mesh_prism(&mesh, hexagon, 6, profile, 4);
            break;
        case 5:
            mesh_tube(&mesh, path, radii, 3, 64);
            break;
        default:
            mesh_extrude(&mesh, hexagon, 6, 3, 4, 0);
            break;
        }
        assert_sane(&mesh);
        assert_true(closed(&mesh, ALL_MATERIALS));
        assert_true(fabs(volume(&mesh, ALL_MATERIALS) / 6 - expected[shape]) <= tolerance[shape]);
        mesh_free(&mesh);
    }
}

static void test_refining_keeps_a_mesh_closed(void **state)
{
    struct mesh mesh;
    mesh_init(&mesh);
    struct mesh_mark from = mesh_mark(&mesh);
    mesh_box(&mesh, vec3(0, 0, 0), vec3(1, 0.3, 0.1), 0.02);
    double before = volume(&mesh, ALL_MATERIALS);
    mesh_refine(&mesh, from, 0.05);
    assert_true(closed(&mesh, ALL_MATERIALS));
    assert_true(fabs(volume(&mesh, ALL_MATERIALS) - before) < 1e-12);
    for (size_t i = 0; i < mesh.triangle_count; i++)
        for (int k = 0; k < 3; k++) {
            const uint32_t *v = mesh.triangles[i].vertex;
            struct vec3 edge = vec_sub(mesh.vertices[v[k]], mesh.vertices[v[(k + 1) % 3]]);
            assert_true(vec_length(edge) <= 0.05);
        }
    mesh_roughen(&mesh, from, 0.01, 5, 3);
    mesh_smooth(&mesh, from, 40);
    assert_true(closed(&mesh, ALL_MATERIALS));
    assert_sane(&mesh);
    mesh_free(&mesh);
}

static void test_smoothing_respects_creases(void **state)
{
    struct mesh mesh;
    mesh_init(&mesh);
    const struct mesh_mark all = mesh_mark(&mesh);
    mesh_box(&mesh, vec3(0, 0, 0), vec3(1, 1, 1), 0);
    mesh_smooth(&mesh, all, 80);
    assert_int_equal(mesh.normal_count, 26); /* three at each corner, one in each cap */
    mesh_smooth(&mesh, all, 100);
    assert_int_equal(mesh.normal_count, 10);
    mesh_free(&mesh);
}

static void test_chance_and_noise_stay_in_range(void **state)
{
    double sum = 0;
    for (uint32_t i = 0; i < 10000; i++) {
        double c = chance(7, i);
        assert_true(c >= 0 && c < 1);
        sum += c;
        double n = noise(vec3(0.37 * i, -1.91 * i, 0.11 * i), i);
        assert_true(n >= -1 && n <= 1);
    }
    assert_true(fabs(sum / 10000 - 0.5) < 0.01);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lantern_has_enough_triangles),
        cmocka_unit_test(test_lantern_is_closed_and_sane),
        cmocka_unit_test(test_glass_is_solid),
        cmocka_unit_test(test_lantern_stands_on_its_foot),
        cmocka_unit_test(test_two_runs_write_the_same_bytes),
        cmocka_unit_test(test_write_errors_are_told),
        cmocka_unit_test(test_shapes_are_closed_and_outward),
        cmocka_unit_test(test_refining_keeps_a_mesh_closed),
        cmocka_unit_test(test_smoothing_respects_creases),
        cmocka_unit_test(test_chance_and_noise_stay_in_range),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
