/* Tests of the files of the generated garden. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/vec.h"
#include "config/models/garden.h"
#include "config/models/models.h"
#include "test/unit.h"

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

static const char *const files[] = {
    "garden_ground.obj", "garden_water.obj",  "garden_pond.obj",  "garden_stones.obj",
    "garden_pine.obj",   "garden_plants.obj", "garden_built.obj",
};

/* Two runs of the generator, made once for all tests. */
static char runs[2][32] = {"/tmp/farm-garden-a-XXXXXX", "/tmp/farm-garden-b-XXXXXX"};

static FILE *open_file(int run, size_t file)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", runs[run], files[file]);
    FILE *stream = fopen(path, "r");
    assert_non_null(stream);
    return stream;
}

/* The contents of one OBJ file. */
struct model {
    struct vec3 *vertices;
    size_t vertices_count, normals_count, triangles;
    double largest_normal_error; /* | |n| - 1 | */
    double smallest_area;
    struct vec3 low, high;
    double lowest_up; /* the least y of a unit face normal */
};

static struct vec3 grow_low(struct vec3 a, struct vec3 b)
{
    return vec3(fmin(a.x, b.x), fmin(a.y, b.y), fmin(a.z, b.z));
}

static struct vec3 grow_high(struct vec3 a, struct vec3 b)
{
    return vec3(fmax(a.x, b.x), fmax(a.y, b.y), fmax(a.z, b.z));
}

static struct vec3 read_vector(const char *text)
{
    struct vec3 v;
    char *end;
    v.x = strtod(text, &end);
    v.y = strtod(end, &end);
    v.z = strtod(end, &end);
    assert_int_equal(*end, '\n');
    assert_true(vec_is_finite(v));
    return v;
}

static void take_vertex(struct model *model, struct vec3 p)
{
    if ((model->vertices_count & (model->vertices_count - 1)) == 0) {
        size_t capacity = model->vertices_count == 0 ? 1 : 2 * model->vertices_count;
        model->vertices = realloc(model->vertices, capacity * sizeof *model->vertices);
        assert_non_null(model->vertices);
    }
    model->vertices[model->vertices_count++] = p;
    model->low = grow_low(model->low, p);
    model->high = grow_high(model->high, p);
}

/* Reads "12" or "12//7"; both indices count from 1. */
static size_t read_corner(const struct model *model, const char **text)
{
    char *end;
    unsigned long vertex = strtoul(*text, &end, 10);
    assert_in_range(vertex, 1, model->vertices_count);
    if (end[0] == '/') {
        assert_int_equal(end[1], '/');
        unsigned long normal = strtoul(end + 2, &end, 10);
        assert_in_range(normal, 1, model->normals_count);
    }
    *text = end;
    return vertex - 1;
}

static void take_triangle(struct model *model, const char *text)
{
    struct vec3 p[3];
    for (int i = 0; i < 3; i++)
        p[i] = model->vertices[read_corner(model, &text)];
    assert_int_equal(*text, '\n');
    struct vec3 cross = vec_cross(vec_sub(p[1], p[0]), vec_sub(p[2], p[0]));
    double length = vec_length(cross);
    model->triangles++;
    model->smallest_area = fmin(model->smallest_area, length / 2);
    model->lowest_up = fmin(model->lowest_up, length > 0 ? cross.y / length : -1);
}

static struct model read_model(size_t file)
{
    struct model model = {.smallest_area = HUGE_VAL,
                          .low = vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL),
                          .high = vec3(-HUGE_VAL, -HUGE_VAL, -HUGE_VAL),
                          .lowest_up = 1};
    FILE *stream = open_file(0, file);
    char line[256];
    while (fgets(line, sizeof line, stream)) {
        if (strncmp(line, "v ", 2) == 0) {
            take_vertex(&model, read_vector(line + 2));
        } else if (strncmp(line, "vn ", 3) == 0) {
            double error = fabs(vec_length(read_vector(line + 3)) - 1);
            model.largest_normal_error = fmax(model.largest_normal_error, error);
            model.normals_count++;
        } else if (strncmp(line, "f ", 2) == 0) {
            take_triangle(&model, line + 2);
        }
    }
    fclose(stream);
    free(model.vertices);
    model.vertices = NULL;
    return model;
}

static struct model models[COUNT(files)]; /* of the first run */

static int make_gardens(void **state)
{
    for (int i = 0; i < 2; i++)
        if (mkdtemp(runs[i]) == NULL || !write_garden(runs[i])) return -1;
    for (size_t i = 0; i < COUNT(files); i++)
        models[i] = read_model(i);
    return 0;
}

static int remove_gardens(void **state)
{
    for (int run = 0; run < 2; run++) {
        for (size_t i = 0; i < COUNT(files); i++) {
            char path[128];
            snprintf(path, sizeof path, "%s/%s", runs[run], files[i]);
            unlink(path);
        }
        /* Fails when the generator has written a file that this list does not know. */
        if (rmdir(runs[run]) != 0) return -1;
    }
    return 0;
}

static void has_enough_triangles(void **state)
{
    size_t sum = 0;
    for (size_t i = 0; i < COUNT(files); i++) {
        assert_in_range(models[i].triangles, 1000, 1000000);
        sum += models[i].triangles;
    }
    assert_in_range(sum, 300000, 1500000);
}

static void is_sound(void **state)
{
    for (size_t i = 0; i < COUNT(files); i++) {
        const struct model *model = &models[i];
        /* Normals have five decimals. */
        assert_true(model->largest_normal_error < 2e-5);
        assert_true(model->smallest_area > 0);
        assert_true(model->low.x > -160 && model->low.y > -2 && model->low.z > -170);
        assert_true(model->high.x < 160 && model->high.y < 60 && model->high.z < 9);
    }
}

/* If the sheet faced down, rays from above would count as leaving the water. */
static void water_lies_face_up(void **state)
{
    const struct model *water = &models[1];
    assert_true(water->lowest_up > 0.95);
    assert_true(water->low.y > -0.03 && water->high.y < 0.03);
}

/* There is ground under all water, without holes. */
static void pond_has_a_bed(void **state)
{
    int wet = 0;
    for (int ix = -60; ix <= 60; ix++)
        for (int iz = -60; iz <= 60; iz++) {
            double x = ix * 0.1, z = iz * 0.1, d = pond_distance(x, z), y = ground_height(x, z);
            assert_true(y > -1 && y < 4);
            if (d < -0.01) assert_true(y < 0);
            if (d > 0.15) assert_true(y > 0.03);
            wet += d < 0;
        }
    assert_in_range(wet, 3000, 9000);
}

static void is_the_same_again(void **state)
{
    static char a[1 << 16], b[1 << 16];
    for (size_t i = 0; i < COUNT(files); i++) {
        FILE *first = open_file(0, i), *second = open_file(1, i);
        for (size_t count = sizeof a; count > 0;) {
            count = fread(a, 1, sizeof a, first);
            assert_int_equal(fread(b, 1, sizeof b, second), count);
            assert_memory_equal(a, b, count);
        }
        fclose(first);
        fclose(second);
    }
}

static void is_not_too_large(void **state)
{
    long sum = 0;
    for (size_t i = 0; i < COUNT(files); i++) {
        FILE *stream = open_file(0, i);
        assert_int_equal(fseek(stream, 0, SEEK_END), 0);
        sum += ftell(stream);
        fclose(stream);
    }
    assert_in_range(sum, 1, 64000000);
}

static void says_that_it_cannot_write(void **state)
{
    char folder[64];
    snprintf(folder, sizeof folder, "%s/missing", runs[0]);
    assert_false(write_garden(folder));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(has_enough_triangles),      cmocka_unit_test(is_sound),
        cmocka_unit_test(water_lies_face_up),        cmocka_unit_test(pond_has_a_bed),
        cmocka_unit_test(is_the_same_again),         cmocka_unit_test(is_not_too_large),
        cmocka_unit_test(says_that_it_cannot_write),
    };
    return cmocka_run_group_tests_name("garden", tests, make_gardens, remove_gardens);
}
