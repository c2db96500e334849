/* Tests of whole tiles: ray trees, pruning and its bound, and that pictures do not depend on the tiles. */
#include <stdlib.h>
#include <string.h>

#include "master/builder.h"
#include "test/unit.h"
#include "test/view_fixture.h"
#include "worker/color_sum.h"
#include "worker/medium.h"
#include "worker/renderer.h"

#define SIZE 24u

static void must(const char *problem)
{
    if (problem) fail_msg("%s", problem);
}

static uint32_t material(struct builder *builder, double reflection, double transmission)
{
    uint32_t index;
    struct material m = {.color = {0.9, 0.8, 0.7},
                         .ambient = 0.1,
                         .diffuse = 0.4,
                         .specular = 0.2,
                         .shininess = 30,
                         .reflection = reflection,
                         .transmission = transmission,
                         .ior = 1.5};
    must(builder_add_material(builder, &m, &index));
    return index;
}

static void add_sphere(struct builder *builder, double x, double y, double z, double radius,
                       uint32_t m)
{
    struct sphere sphere = {.center = {x, y, z}, .radius = radius, .material = m};
    must(builder_add_sphere(builder, &sphere));
}

static void add_light(struct builder *builder, double x, double y, double z)
{
    struct light light = {.position = {x, y, z}, .color = {0.8, 0.8, 0.8}};
    must(builder_add_light(builder, &light));
}

static void add_disc(struct builder *builder, double z, double normal, uint32_t m)
{
    struct disc disc = {.center = {0, 0, z}, .normal = {0, 0, normal}, .radius = 50, .material = m};
    must(builder_add_disc(builder, &disc));
}

/* A cluster of glass and mirror balls: deep trees everywhere. */
static struct builder *cluster(void)
{
    struct builder *builder = builder_create();
    uint32_t glass = material(builder, 0.2, 0.75), mirror = material(builder, 0.7, 0);
    for (int i = 0; i < 9; i++)
        add_sphere(builder, i % 3 - 1, i / 3 - 1, 0.3 * (i % 2), 0.45, i % 2 ? mirror : glass);
    add_light(builder, 3, 5, 6);
    add_light(builder, -4, 1, 3);
    return builder;
}

struct picture {
    float rgb[SIZE * SIZE * 3];
    struct render_counts counts;
};

/* Renders the scene in tiles of w x h pixels. Frees nothing of the scene. */
static void render_tiles(const struct scene *scene, uint32_t w, uint32_t h, struct picture *picture)
{
    struct bvh *bvh = tree_of(scene);
    struct renderer *renderer = renderer_create(scene, bvh);
    float *rgb = malloc((size_t)w * h * 3 * sizeof *rgb);
    memset(picture, 0, sizeof *picture);
    for (uint32_t y = 0; y < SIZE; y += h) {
        for (uint32_t x = 0; x < SIZE; x += w) {
            struct tile tile = {.x = x, .y = y, .w = w, .h = h, .step = 1};
            struct render_counts counts;
            renderer_tile(renderer, &tile, rgb, &counts);
            render_counts_add(&picture->counts, &counts);
            for (uint32_t row = 0; row < h; row++)
                memcpy(&picture->rgb[((y + row) * SIZE + x) * 3], &rgb[row * w * 3],
                       w * 3 * sizeof *rgb);
        }
    }
    free(rgb);
    renderer_destroy(renderer);
    free(bvh);
}

static void render_scene(struct builder *builder, const struct view *view, uint32_t w, uint32_t h,
                         struct picture *picture)
{
    struct scene *scene = finish_in_view(builder, view);
    render_tiles(scene, w, h, picture);
    free(scene);
}

static void test_empty_scene_is_background(void **state)
{
    static struct picture picture;
    struct view view = small_view(SIZE);
    render_scene(builder_create(), &view, SIZE, SIZE, &picture);
    assert_int_equal(picture.counts.rays[RAY_PRIMARY], SIZE * SIZE);
    assert_int_equal(picture.counts.rays[RAY_SHADOW], 0);
    /* Top rows look up, bottom rows down. */
    assert_true(picture.rgb[0] > picture.rgb[(SIZE - 1) * SIZE * 3]);
    assert_true(picture.counts.truncation == 0);
}

static void test_tiles_do_not_matter(void **state)
{
    static struct picture whole, part;
    struct view view = small_view(SIZE);
    view.min_samples = view.max_samples = 3;
    view.cutoff = 1.0 / 512;
    render_scene(cluster(), &view, SIZE, SIZE, &whole);
    const uint32_t sizes[][2] = {{1, 1}, {3, 8}, {24, 1}, {6, 12}};
    for (size_t i = 0; i < 4; i++) {
        render_scene(cluster(), &view, sizes[i][0], sizes[i][1], &part);
        assert_memory_equal(whole.rgb, part.rgb, sizeof whole.rgb);
        assert_memory_equal(whole.counts.rays, part.counts.rays, sizeof whole.counts.rays);
        assert_true(whole.counts.truncation == part.counts.truncation);
    }
    assert_true(whole.counts.rays[RAY_REFLECTION] > 0 && whole.counts.rays[RAY_REFRACTION] > 0);
    assert_int_equal(whole.counts.nonfinite, 0);
}

static double largest_difference(const struct picture *a, const struct picture *b)
{
    double largest = 0;
    for (size_t i = 0; i < SIZE * SIZE * 3; i++)
        largest = fmax(largest, fabs((double)a->rgb[i] - (double)b->rgb[i]));
    return largest;
}

/* The bound of pruning holds in every pixel, and pruning saves rays. */
static void test_cutoff_keeps_its_bound(void **state)
{
    static struct picture exact, pruned;
    struct view view = small_view(SIZE);
    view.max_depth = 12;
    render_scene(cluster(), &view, SIZE, SIZE, &exact);
    uint64_t before = render_counts_rays(&exact.counts);
    for (double cutoff = 1.0 / 4096; cutoff < 1; cutoff *= 8) {
        view.cutoff = cutoff;
        render_scene(cluster(), &view, SIZE, SIZE, &pruned);
        /* The colours are rounded to float: half an ulp below 2 each. */
        assert_true(largest_difference(&exact, &pruned) <= cutoff + 0x1p-23);
        /* Against a picture of any depth; four cutoffs of it need not be looked into. */
        assert_true(pruned.counts.truncation <= 5 * cutoff);
        uint64_t rays = render_counts_rays(&pruned.counts);
        assert_true(rays < before);
        before = rays;
    }
}

/* Depth 0 shows the surfaces alone; the error against a deep picture is below the reported bound.
 */
static void test_depth_bound(void **state)
{
    static struct picture deep, shallow;
    struct view view = small_view(SIZE);
    view.max_depth = 14;
    render_scene(cluster(), &view, SIZE, SIZE, &deep);
    for (uint32_t depth = 0; depth < 5; depth++) {
        view.max_depth = depth;
        render_scene(cluster(), &view, SIZE, SIZE, &shallow);
        double error = largest_difference(&deep, &shallow);
        assert_true(error <= shallow.counts.truncation);
        if (depth > 0) continue;
        assert_int_equal(shallow.counts.rays[RAY_REFLECTION], 0);
        assert_true(error > 0.01);
    }
}

/* A ray between two facing mirrors goes on to max_depth without a stack that could overflow. */
static void test_facing_mirrors(void **state)
{
    static struct picture picture;
    struct builder *builder = builder_create();
    uint32_t mirror = material(builder, 1, 0);
    struct plane front = {.point = {0, 0, -1}, .normal = {0, 0, 1}, .material = mirror};
    struct plane back = {.point = {0, 0, 7}, .normal = {0, 0, -1}, .material = mirror};
    must(builder_add_plane(builder, &front));
    must(builder_add_plane(builder, &back));
    struct view view = small_view(SIZE);
    view.max_depth = 10000;
    view.region_x = view.region_y = SIZE / 2;
    struct prepared prepared = prepare_scene(builder, &view);
    struct tile tile = {.w = 1, .h = 1, .step = 1};
    renderer_tile(prepared.renderer, &tile, picture.rgb, &picture.counts);
    assert_int_equal(picture.counts.rays[RAY_REFLECTION], 10000);
    /* Ambient light alone: 10001 surfaces of 0.1 * 0.9 each, nothing lost on the way. */
    assert_true(fabs((double)picture.rgb[0] - 10001 * 0.09) < 1e-3);
    prepared_free(&prepared);
}

/* Behind two glass surfaces light is weaker by transmission * color twice; behind stone it is gone.
 */
static void test_filtered_shadow(void **state)
{
    static struct picture lit, filtered, dark;
    struct picture *pictures[] = {&lit, &filtered, &dark};
    for (int i = 0; i < 3; i++) {
        struct builder *builder = builder_create();
        uint32_t wall = material(builder, 0, 0), glass = material(builder, 0, 0.75);
        struct plane plane = {.point = {0, 0, -1}, .normal = {0, 0, 1}, .material = wall};
        must(builder_add_plane(builder, &plane));
        add_light(builder, 0, 0, 50);
        if (i > 0) add_sphere(builder, 0, 0, 20, 8, i == 1 ? glass : wall);
        struct view view = small_view(SIZE);
        render_scene(builder, &view, SIZE, SIZE, pictures[i]);
    }
    size_t middle = (SIZE / 2 * SIZE + SIZE / 2) * 3;
    const double ambient[] = {0.09, 0.08, 0.07}, color[] = {0.9, 0.8, 0.7};
    for (size_t c = 0; c < 3; c++) {
        double direct = (double)lit.rgb[middle + c] - ambient[c];
        double passed = (double)filtered.rgb[middle + c] - ambient[c];
        double share = 0.75 * color[c] * 0.75 * color[c];
        assert_true(direct > 0.1);
        assert_true(fabs(passed / direct - share) < 1e-5);
        assert_true(fabs((double)dark.rgb[middle + c] - ambient[c]) < 1e-7);
    }
}

static void test_shadows_can_be_left_out(void **state)
{
    static struct picture picture;
    struct view view = small_view(SIZE);
    view.shadows = 0;
    render_scene(cluster(), &view, SIZE, SIZE, &picture);
    assert_int_equal(picture.counts.rays[RAY_SHADOW], 0);
}

/* Catalogue 54: with kr + kt = 1 no pixel takes more than D / tau rays, tau = cutoff / B(0), and
 * the error stays below what is reported. Without lights and with a white sky B is 1 at every
 * depth. */
static void test_rays_are_bounded(void **state)
{
    static struct picture picture;
    const double shares[] = {0.1, 0.5};
    for (int i = 0; i < 2; i++) {
        struct builder *builder = builder_create();
        uint32_t index;
        struct material glass = {
            .color = {1, 1, 1}, .reflection = shares[i], .transmission = 1 - shares[i], .ior = 1.5};
        must(builder_add_material(builder, &glass, &index));
        for (int k = 0; k < 27; k++)
            add_sphere(builder, k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1, 0.499, index);
        struct view view = small_view(SIZE);
        view.max_depth = 30;
        view.cutoff = 1.0 / 64;
        view.background_bottom = view.background_top = vec3(1, 1, 1);
        struct prepared prepared = prepare_scene(builder, &view);
        for (uint32_t pixel = 0; pixel < SIZE * SIZE; pixel += 7) {
            struct tile tile = {.x = pixel % SIZE, .y = pixel / SIZE, .w = 1, .h = 1, .step = 1};
            renderer_tile(prepared.renderer, &tile, picture.rgb, &picture.counts);
            assert_true(render_counts_rays(&picture.counts) <= 31 * 64);
            /* All that goes in comes out, into a sky of 1. */
            double error = fabs(1 - (double)picture.rgb[0]);
            assert_true(error <= picture.counts.truncation + 0x1p-23);
            assert_int_equal(picture.counts.unmatched_media, 0);
            assert_int_equal(picture.counts.open_media, 0);
        }
        prepared_free(&prepared);
    }
}

/* A cube of twelve triangles from -1 to 1, with common vertices or vertices of their own. */
static void add_cube(struct builder *builder, bool common, uint32_t m)
{
    static const unsigned sides[6][4] = {{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1},
                                         {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}};
    uint32_t corner[8];
    for (unsigned side = 0; side < 6; side++) {
        for (unsigned i = 0; (side == 0 || !common) && i < 8; i++)
            must(builder_add_vertex(builder, vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1),
                                    &corner[i]));
        for (unsigned i = 1; i < 3; i++) {
            struct triangle half = {
                {corner[sides[side][0]], corner[sides[side][i + 1]], corner[sides[side][i]]}, m};
            must(builder_add_triangle(builder, &half));
        }
    }
}

/* Rays that exactly meet edges of a closed mesh are not reflected out of it, nor refracted into the wrong medium. */
static void test_edges_do_not_leak(void **state)
{
    static struct picture picture;
    struct view view = small_view(SIZE);
    view.camera.right = vec3(1, 0, 0);
    view.camera.down = vec3(0, -1, 0);
    view.background_bottom = view.background_top = vec3(1000, 1000, 1000);
    view.max_depth = 40;
    for (int k = 0; k < 8; k++) {
        struct builder *builder = builder_create();
        uint32_t mirror = material(builder, 0.9, 0), glass = material(builder, 0.1, 0.8);
        view.camera.eye = vec3(0, 0, k & 2 ? 0.5 : 0);
        add_cube(builder, k & 1, k & 4 ? glass : mirror);
        add_light(builder, 0.3, 0.4, 0.2);
        render_scene(builder, &view, SIZE, SIZE, &picture);
        assert_int_equal(picture.counts.open_media + picture.counts.unmatched_media, 0);
        for (size_t i = 0; k < 4 && i < SIZE * SIZE * 3; i++)
            assert_true(picture.rgb[i] < 50);
    }
}

/* A view whose rays have slopes that are multiples of 1/24, into a sky of 1. */
static struct view lattice_view(struct vec3 eye)
{
    struct view view = small_view(SIZE);
    view.camera.eye = eye;
    view.camera.forward = vec3(1.0 / 48, 1.0 / 48, -1);
    view.background_bottom = view.background_top = vec3(1, 1, 1);
    return view;
}

/* Glass that halves the light at each surface, adds 1/4 and, if its index of refraction is 1, leaves rays straight. So
 * the light of the sky is 3/4 behind one surface, 5/8 behind two and 17/32 behind four. */
static uint32_t halving(struct builder *builder, double ior)
{
    uint32_t index;
    struct material glass = {.color = {1, 1, 1}, .ambient = 0.25, .transmission = 0.5, .ior = ior};
    must(builder_add_material(builder, &glass, &index));
    return index;
}

/* All rays pass either through two surfaces of a convex object of halving() or through none. */
static void assert_passed(struct builder *builder, const struct view *view, double ior)
{
    static struct picture picture;
    render_scene(builder, view, SIZE, SIZE, &picture);
    assert_int_equal(picture.counts.unmatched_media + picture.counts.open_media, 0);
    for (uint32_t i = 0; ior == 1 && i < SIZE * SIZE * 3; i++)
        assert_true(picture.rgb[i] == 1 || picture.rgb[i] == 0.625f);
}

/* Rays that meet the edges and corners of a cube exactly, also where one face is entered and the other one left at the
 * same place. */
static void test_edges_of_a_glass_mesh(void **state)
{
    for (unsigned k = 0; k < 8; k++) {
        struct builder *builder = builder_create();
        double ior = k & 2 ? 1 : 1.5, aside = k & 4 ? -0.5 : 0;
        struct view view = lattice_view(vec3(aside, aside, 7));
        add_cube(builder, k & 1, halving(builder, ior));
        assert_passed(builder, &view, ior);
    }
}

/* Rays that meet the rims of rods exactly, and tangents of their sides. */
static void test_rims_of_glass_rods(void **state)
{
    for (unsigned k = 0; k < 108; k++) {
        struct builder *builder = builder_create();
        double ior = k & 1 ? 1 : 1.5, x = k / 2 % 3 - 1, y = k / 6 % 3 - 1;
        struct view view = lattice_view(vec3(0, 0, 6));
        struct cone rod = {.base = {x, y, 0}, .apex = {x, y, 0}, .capped = 1};
        *(k / 18 % 3 == 0 ? &rod.apex.x : k / 18 % 3 == 1 ? &rod.apex.y : &rod.apex.z) += 2;
        rod.base_radius = rod.apex_radius = k / 54 ? 0.5 : 1;
        rod.material = halving(builder, ior);
        must(builder_add_cone(builder, &rod));
        assert_passed(builder, &view, ior);
    }
}

/* What a ray passes by brings no light: with it the ray would bring more than its bound. Rays touch the rims and sides
 * of glowing rods behind a screen that lets a half through. */
static void test_touched_glass_keeps_the_bound(void **state)
{
    static struct picture pictures[2];
    struct view view = lattice_view(vec3(0, 0, 7));
    const struct material screen = {.color = {1, 1, 1}, .transmission = 0.5, .ior = 1};
    const struct material glowing = {
        .color = {1, 1, 1}, .ambient = 0.5, .transmission = 0.25, .ior = 1};
    for (unsigned k = 0; k < 9; k++) {
        double x = k % 3 - 1.0, y = k / 3 - 1.0;
        struct cone rod = {.base = {x, y, 1}, .apex = {x + 2, y, 1}, .capped = 1};
        rod.base_radius = rod.apex_radius = 1;
        for (int pruned = 0; pruned < 2; pruned++) {
            struct builder *builder = builder_create();
            uint32_t before;
            must(builder_add_material(builder, &screen, &before));
            must(builder_add_material(builder, &glowing, &rod.material));
            add_disc(builder, 5, 1, before);
            must(builder_add_cone(builder, &rod));
            view.cutoff = pruned ? 0.51 : 0;
            render_scene(builder, &view, SIZE, SIZE, &pictures[pruned]);
        }
        double bound = pictures[1].counts.truncation;
        assert_true(bound >= 0.5 && bound < 0.5000001);
        assert_true(largest_difference(&pictures[0], &pictures[1]) <= bound);
    }
}

/* Rays that touch balls but for the rounding of their direction: some of them enter, but not by more than that. */
static void test_tangents_of_glass_balls(void **state)
{
    struct view view = lattice_view(vec3(0, 0, 6));
    for (unsigned k = 0; k < 64; k++) {
        struct builder *builder = builder_create();
        double ior = k & 1 ? 1 : 1.5, along = (k / 2 % 8 + 1) / 4.0, away = k & 16 ? 0.125 : 0.25;
        /* From the eye along a slope of 5/12, then at a right angle to it. */
        double aside = 5 * along + 12 * away, z = 6 - 12 * along + 5 * away;
        uint32_t glass = halving(builder, ior);
        add_sphere(builder, k & 32 ? aside : 0, k & 32 ? 0 : aside, z, 13 * away, glass);
        assert_passed(builder, &view, ior);
    }
}

/* Rays go exactly through points where balls of glass meet a cube. They cross both as often as the rays beside them. */
static void test_glass_balls_meet_a_mesh(void **state)
{
    static struct picture picture;
    static const struct sphere balls[] = {
        {{0, 0, -1}, 1, 0, 0}, {{0, 1, -1}, 1, 0, 0}, {{-1, 1, 0}, 1, 0, 0},
        {{1, 1, 0}, 1, 0, 0},  {{1, 1, -1}, 2, 0, 0}, {{0, 0, 1}, 2, 0, 0},
    };
    struct view view = lattice_view(vec3(0, 0, 7));
    for (unsigned k = 0; k < sizeof balls / sizeof *balls; k++) {
        struct builder *builder = builder_create();
        uint32_t glass = halving(builder, 1);
        struct vec3 center = balls[k].center;
        add_cube(builder, true, glass);
        add_sphere(builder, center.x, center.y, center.z, balls[k].radius, glass);
        render_scene(builder, &view, SIZE, SIZE, &picture);
        assert_int_equal(picture.counts.unmatched_media + picture.counts.open_media, 0);
        for (uint32_t i = 0; i < SIZE * SIZE * 3; i++)
            assert_true(picture.rgb[i] == 1 || picture.rgb[i] == 0.625f ||
                        picture.rgb[i] == 0.53125f);
    }
}

/* Clear glass around water: a wall as thin as the rounding of points. No ray is lost between its surfaces, which would
 * be crossed in turn for ever: the white sky is seen through all of it. */
static void test_wall_as_thin_as_rounding(void **state)
{
    static struct picture picture;
    struct view view = lattice_view(vec3(0, 0, 3));
    view.max_depth = 8; /* four surfaces, and as many crossings that rounding repeats */
    for (unsigned k = 0; k < 400; k++) {
        struct builder *builder = builder_create();
        struct material clear = {.color = {1, 1, 1}, .transmission = 1, .ior = 1.5};
        uint32_t glass, water;
        must(builder_add_material(builder, &clear, &glass));
        clear.ior = 1.33;
        must(builder_add_material(builder, &clear, &water));
        double radius = 1 + k / 1024.0;
        add_sphere(builder, 0, 0.125, 0, radius, glass);
        add_sphere(builder, 0, 0.125, 0, nextafter(radius, 0), water);
        render_scene(builder, &view, SIZE, SIZE, &picture);
        assert_true(picture.counts.rays[RAY_REFRACTION] > SIZE * SIZE);
        assert_true(picture.counts.truncation == 0);
        assert_int_equal(picture.counts.unmatched_media + picture.counts.open_media, 0);
        for (uint32_t i = 0; i < SIZE * SIZE * 3; i++)
            assert_true(picture.rgb[i] == 1);
    }
}

/* An eye exactly on a face, an edge or a corner of a cube: its rays leave the cube through one surface, or never were
 * in it. Some run along faces. */
static void test_eye_on_a_glass_mesh(void **state)
{
    static struct picture picture;
    for (int k = 0; k < 54; k++) {
        struct builder *builder = builder_create();
        double ior = k / 27 ? 1.5 : 1;
        struct view view = lattice_view(vec3(k % 3 - 1, k / 3 % 3 - 1, k / 9 % 3 - 1));
        add_cube(builder, true, halving(builder, ior));
        render_scene(builder, &view, SIZE, SIZE, &picture);
        assert_int_equal(picture.counts.unmatched_media + picture.counts.open_media, 0);
        for (uint32_t i = 0; ior == 1 && i < SIZE * SIZE * 3; i++)
            assert_true(picture.rgb[i] == 1 || picture.rgb[i] == 0.75f);
    }
}

/* From inside a glass ball in a larger one of water, all rays end up outside of both. */
static void test_eye_inside_glass(void **state)
{
    static struct picture picture;
    struct builder *builder = builder_create();
    uint32_t glass = material(builder, 0.1, 0.8);
    add_sphere(builder, 0, 0, 6.2, 1, glass);
    add_sphere(builder, 0, 0, 5, 3, glass);
    add_sphere(builder, 2, 0, 1, 2.5, glass);
    struct view view = small_view(SIZE);
    view.cutoff = 1.0 / 4096;
    render_scene(builder, &view, SIZE, SIZE, &picture);
    assert_int_equal(picture.counts.unmatched_media, 0);
    assert_int_equal(picture.counts.open_media, 0);
    assert_true(picture.counts.rays[RAY_REFRACTION] > SIZE * SIZE);
}

/* Two blocks of glass with two faces in one plane: a ray that is reflected between the two crosses each face as often
 * as it must, so that all media match, and all light that goes in comes out into a sky of 1. */
static void test_glass_on_glass(void **state)
{
    static struct picture picture;
    uint32_t index;
    struct builder *builder = builder_create();
    struct material glass = {
        .color = {1, 1, 1}, .reflection = 0.15, .transmission = 0.85, .ior = 1.5};
    must(builder_add_material(builder, &glass, &index));
    struct box behind = {{-2, -2, -1}, {2, 2, 0}, index, 0};
    struct box before = {{-1.6, -2.3, 0}, {2.2, 1.8, 1}, index, 0};
    must(builder_add_box(builder, &behind));
    must(builder_add_box(builder, &before));
    struct view view = small_view(SIZE);
    view.max_depth = 60;
    view.cutoff = 1.0 / 256;
    view.background_bottom = view.background_top = vec3(1, 1, 1);
    render_scene(builder, &view, SIZE, SIZE, &picture);
    assert_int_equal(picture.counts.unmatched_media, 0);
    assert_int_equal(picture.counts.open_media, 0);
    for (uint32_t i = 0; i < SIZE * SIZE * 3; i++)
        assert_true(fabs(1 - (double)picture.rgb[i]) <= picture.counts.truncation + 0x1p-20);
}

/* A ball of glass in glass of the same index cannot be seen; with the paper's formulas it can. */
static void test_equal_media_are_one(void **state)
{
    static struct picture pictures[3];
    for (int i = 0; i < 3; i++) {
        struct builder *builder = builder_create();
        uint32_t glass;
        struct material clear = {.color = {1, 1, 1}, .transmission = 1, .ior = 1.5};
        must(builder_add_material(builder, &clear, &glass));
        add_sphere(builder, 0, 0, 0, 2, glass);
        if (i > 0) add_sphere(builder, 0.3, 0.2, 0.5, 1, glass);
        struct view view = small_view(SIZE);
        view.formulas = i == 2 ? FORMULAS_PAPER : FORMULAS_EXACT;
        render_scene(builder, &view, SIZE, SIZE, &pictures[i]);
    }
    assert_true(largest_difference(&pictures[0], &pictures[1]) < 1e-7);
    assert_true(largest_difference(&pictures[0], &pictures[2]) > 1e-3);
}

/* Two lights whose sum is infinite: such samples are counted, and the first one is reported, whatever the tiles are. */
static void test_bad_samples_are_told(void **state)
{
    static struct picture whole, part;
    struct render_counts counts[2];
    for (int i = 0; i < 2; i++) {
        struct builder *builder = builder_create();
        uint32_t stone = material(builder, 0.5, 0);
        add_sphere(builder, 0, 0, 0, 1.5, stone);
        for (int k = 0; k < 2; k++) {
            struct light light = {.position = {0, 0, 9}, .color = {1.7e308, 1, 1}};
            must(builder_add_light(builder, &light));
        }
        struct view view = small_view(SIZE);
        view.min_samples = view.max_samples = 2;
        view.width = view.height = SIZE + 5;
        view.region_x = 3, view.region_y = 2;
        view.region_w = view.region_h = SIZE;
        render_scene(builder, &view, i ? 3 : SIZE, i ? 8 : SIZE, i ? &part : &whole);
        counts[i] = i ? part.counts : whole.counts;
    }
    assert_true(counts[0].nonfinite > 10);
    assert_int_equal(counts[0].nonfinite, counts[1].nonfinite);
    assert_memory_equal(&counts[0].first, &counts[1].first, sizeof counts[0].first);
    const struct bad_sample *first = &counts[0].first;
    size_t at = ((size_t)(first->y - 2) * SIZE + first->x - 3) * 3;
    assert_true(!isfinite(whole.rgb[at]));
    for (size_t i = 0; i < at; i++)
        assert_true(isfinite(whole.rgb[i]));
    assert_true(first->origin.z == 6 && first->depth == 0 && first->direction.z < 0);
}

/* Adds a mirror without light of its own, so that what is seen in it is found by rays of depth 1. */
static void add_mirror(struct builder *builder)
{
    uint32_t mirror;
    struct material bare = {.color = {1, 1, 1}, .reflection = 1, .ior = 1};
    must(builder_add_material(builder, &bare, &mirror));
    add_disc(builder, 0, 1, mirror);
}

/* A bad sample is reported with the depth of the ray that causes it. */
static void test_bad_in_a_mirror(void **state)
{
    static struct picture picture;
    struct view view = small_view(SIZE);
    struct builder *builder = builder_create();
    add_mirror(builder);
    add_disc(builder, 9, -1, material(builder, 0, 0));
    for (int k = 0; k < 2; k++) {
        struct light light = {.position = {0, 0, 8}, .color = {1.7e308, 1, 1}};
        must(builder_add_light(builder, &light));
    }
    render_scene(builder, &view, SIZE, SIZE, &picture);
    assert_true(picture.counts.nonfinite > 0 && picture.counts.first.depth == 1);
}

/* A sheet of glass is no solid: rays that enter through it never leave. */
static void test_open_media_are_counted(void **state)
{
    static struct picture picture;
    struct view view = small_view(SIZE);
    struct builder *builder = builder_create();
    add_disc(builder, 0, 1, material(builder, 0, 0.9));
    render_scene(builder, &view, SIZE, SIZE, &picture);
    assert_int_equal(picture.counts.open_media, SIZE * SIZE);
    assert_int_equal(picture.counts.primary_hits, SIZE * SIZE); /* not those behind */
}

/* Glass that is left without having been entered is counted for rays of the picture only, not for those beyond
 * max_depth. */
static void test_bound_rays_tell_no_media(void **state)
{
    static struct picture picture;
    struct view view = small_view(SIZE);
    for (uint32_t depth = 0; depth < 2; depth++) {
        struct builder *builder = builder_create();
        view.max_depth = depth;
        add_mirror(builder);
        add_disc(builder, 9, 1, material(builder, 0, 0.9));
        render_scene(builder, &view, SIZE, SIZE, &picture);
        assert_true(picture.counts.bound_rays > 0);
        assert_int_equal(picture.counts.unmatched_media, depth * SIZE * SIZE);
    }
}

/* Samples too large for floats count as not finite, even if doubles can hold them. Where the square of an error is too
 * large for a double, it does not count. */
static void test_too_bright_for_floats(void **state)
{
    static struct picture picture;
    struct view view = small_view(SIZE);
    view.background_bottom = view.background_top = vec3(0, 1e39, 0);
    render_scene(builder_create(), &view, SIZE, SIZE, &picture);
    assert_int_equal(picture.counts.nonfinite, SIZE * SIZE);
    view.background_bottom = view.background_top = vec3(0, 1e38, 0);
    render_scene(builder_create(), &view, SIZE, SIZE, &picture);
    assert_int_equal(picture.counts.nonfinite, 0);
    view.background_bottom = vec3(0, 1e200, 0);
    view.min_samples = view.max_samples = 2;
    render_scene(builder_create(), &view, SIZE, SIZE, &picture);
    assert_int_equal(picture.counts.nonfinite, 2 * SIZE * SIZE);
    assert_true(picture.counts.sampling.squares == 0 && picture.counts.sampling.fourths == 0);
}

/* Catalogue 47: small terms are not lost beside large ones. */
static void test_color_sum(void **state)
{
    struct color_sum sum = {{0, 0, 0}, {0, 0, 0}};
    for (int i = 0; i < 1 << 16; i++)
        color_sum_add(&sum, vec3(0x1p-70, i == 9 ? 1e30 : 1e14, 1e-30));
    color_sum_add(&sum, vec3(1, 1e-30, 1e30));
    color_sum_add(&sum, vec3(0x1p-53, 0, 0));
    struct vec3 value = color_sum_value(&sum);
    assert_true(value.x == 1 + 0x1p-52); /* 1 + 2^-53 + 2^-54, rounded once */
    assert_true(sum.plain.x < value.x);
    assert_true(value.y == 1e30 + 65535 * 1e14 && value.z == 1e30);
    color_sum_add(&sum, vec3(HUGE_VAL, 0, 0));
    assert_true(isinf(color_sum_value(&sum).x));
}

/* A lamp with its light on its surface: lit towards the light, dark behind the lamp, no noise. */
static void test_light_on_a_surface(void **state)
{
    static struct picture lit, bare;
    for (int i = 0; i < 2; i++) {
        struct builder *builder = builder_create();
        uint32_t wall = material(builder, 0, 0);
        struct plane plane = {.point = {0, 0, -1}, .normal = {0, 0, 1}, .material = wall};
        must(builder_add_plane(builder, &plane));
        double x = 0.3, y = -0.7, z = 3.1, radius = 0.37;
        if (i == 0) add_sphere(builder, x, y, z, radius, wall);
        add_light(builder, x, y, z - radius);
        struct view view = small_view(SIZE);
        view.camera.eye.z = 2.5; /* in front of the lamp */
        render_scene(builder, &view, SIZE, SIZE, i ? &bare : &lit);
    }
    /* Every pixel sees the wall; the lamp is behind its own light and shades nothing of it. */
    assert_memory_equal(lit.rgb, bare.rgb, sizeof lit.rgb);
}

static void test_lights_in_a_plane(void **state)
{
    static struct picture lit, bare;
    for (int k = 0; k < 8; k++) {
        for (int i = 0; i < 2; i++) {
            struct builder *builder = builder_create();
            uint32_t wall = material(builder, 0, 0);
            struct plane plane = {.point = {0, 0, -1}, .normal = {0, 0, 1}, .material = wall};
            must(builder_add_plane(builder, &plane));
            double x = 0.1 + 0.07 * k, y = 0.2 - 0.03 * k, z = 1.3 + 0.11 * k;
            struct plane lamp = {
                .point = {x, y, z}, .normal = {0.1, 0.03 * k, -1}, .material = wall};
            if (i == 0) must(builder_add_plane(builder, &lamp));
            add_light(builder, x, y, z);
            struct view view = small_view(SIZE);
            view.camera.eye.z = 0.5;
            render_scene(builder, &view, SIZE, SIZE, i ? &bare : &lit);
        }
        assert_memory_equal(lit.rgb, bare.rgb, sizeof lit.rgb);
    }
}

/* A scene that is ready to be rendered. */
static struct prepared prepare(uint32_t min_samples, uint32_t max_samples)
{
    struct view view = small_view(SIZE);
    view.min_samples = min_samples;
    view.max_samples = max_samples;
    return prepare_scene(cluster(), &view);
}

/* Of four samples those of even number are one half, those of odd number the other one; a pass of two samples gives
 * each of them. */
static void test_spread_of_four_samples(void **state)
{
    enum { PIXELS = SIZE * SIZE };
    static float mean[3][PIXELS * 3], difference[2][PIXELS * 3], spread[2][PIXELS];
    static struct refinement refinements[PIXELS];
    struct prepared two = prepare(2, 4), four = prepare(4, 4);
    struct tile tile = {.w = SIZE, .h = SIZE, .step = 1};
    struct render_counts counts;
    for (uint8_t pass = 0; pass < 2; pass++) {
        for (uint32_t k = 0; k < PIXELS; k++)
            refinements[k] = (struct refinement){pass, pass + 1};
        struct task task = {.tile = &tile,
                            .refinements = refinements,
                            .to.mean = mean[pass],
                            .to.difference = difference[pass],
                            .to.spread = spread[0]};
        assert_true(renderer_task(two.renderer, &task, &counts));
        for (uint32_t k = 0; k < PIXELS; k++)
            assert_true(spread[0][k] <= 1e-7f); /* one sample in each half */
    }
    struct task task = {.tile = &tile, .to.mean = mean[2], .to.spread = spread[1]};
    assert_true(renderer_task(four.renderer, &task, &counts));
    double most = 0;
    for (uint32_t k = 0; k < PIXELS; k++) {
        double sum = 0;
        for (uint32_t c = 3 * k; c < 3 * k + 3; c++) {
            double means = (double)mean[0][c] - (double)mean[1][c];
            double apart = ((double)difference[0][c] - (double)difference[1][c]) / 2;
            sum += (pow(means + apart, 2) + pow(means - apart, 2)) / 2;
        }
        assert_true(fabs((double)spread[1][k] - sqrt(sum / 12)) < 1e-6);
        most = fmax(most, sum);
    }
    assert_true(most > 0.01);
    prepared_free(&two);
    prepared_free(&four);
}

/* With three samples, of which two are one half, the errors of the halves are weighted as for edges. Where all samples
 * are alike, so are the halves. */
static void test_error_of_three_samples(void **state)
{
    enum { PIXELS = SIZE * SIZE };
    static float mean[PIXELS * 3], difference[PIXELS * 3], rays[PIXELS];
    struct prepared three = prepare(3, 3);
    struct tile tile = {.w = SIZE, .h = SIZE, .step = 1};
    struct render_counts counts;
    struct task task = {
        .tile = &tile, .to.mean = mean, .to.difference = difference, .to.rays = rays};
    assert_true(renderer_task(three.renderer, &task, &counts));
    assert_true(mean[0] > 0.1f && fabsf(difference[0]) < 0.01f);
    double sum_of_rays = 0;
    for (uint32_t k = 0; k < PIXELS; k++)
        sum_of_rays += 3 * (double)rays[k];
    assert_true(fabs(sum_of_rays / (double)render_counts_rays(&counts) - 1) < 1e-5);
    double sum = 0, share = (sqrt(2) + 1) / 9 / (1 / sqrt(8) + 1);
    for (uint32_t c = 0; c < 3 * PIXELS; c++)
        sum += pow((double)difference[c], 2) / 3;
    assert_true(sum > 0.01);
    assert_true(fabs(counts.sampling.squares / (share * sum) - 1) < 1e-5);
    prepared_free(&three);
}

/* Which pixels get how many samples in which pass changes no sample: the means of the passes add up
 * to what one pass gives, and so do the differences of the halves. */
static void test_passes_add_up(void **state)
{
    enum { PIXELS = SIZE * SIZE };
    static float whole[2][PIXELS * 3], part[2][PIXELS * 3], sum[2][PIXELS * 3];
    static struct refinement refinements[PIXELS];
    struct prepared at_once = prepare(16, 16), passes = prepare(2, 16);
    struct tile tile = {.w = SIZE, .h = SIZE, .step = 1};
    struct render_counts all, counts;
    struct task task = {.tile = &tile, .to.mean = whole[0], .to.difference = whole[1]};
    assert_true(renderer_task(at_once.renderer, &task, &all));
    task = (struct task){
        .tile = &tile, .refinements = refinements, .to.mean = part[0], .to.difference = part[1]};
    for (uint8_t pass = 0; pass < 4; pass++) {
        uint32_t in = 0;
        for (uint32_t k = 0; k < PIXELS; k++) {
            /* Some pixels have all samples after two passes, some get samples in all four. */
            unsigned step = k % 3 == 0 ? 1 : 2, from = pass * step, to = from + step;
            refinements[k].from = (uint8_t)(from < 4 ? from : 4);
            refinements[k].to = (uint8_t)(to < 4 ? to : 4);
        }
        assert_true(renderer_task(passes.renderer, &task, &counts));
        for (uint32_t k = 0; k < PIXELS; k++) {
            uint32_t more = level_samples(&passes.scene->view, refinements[k].to) -
                            level_samples(&passes.scene->view, refinements[k].from);
            if (more == 0) continue;
            for (uint32_t c = 0; c < 6; c++)
                sum[c / 3][3 * k + c % 3] += part[c / 3][3 * in + c % 3] * (float)more / 16;
            in++;
        }
    }
    for (uint32_t i = 0; i < PIXELS * 3; i++) {
        assert_true(fabsf(sum[0][i] - whole[0][i]) < 1e-6f);
        assert_true(fabsf(sum[1][i] - whole[1][i]) < 1e-6f);
    }
    assert_true(all.sampling.squares > 0 && all.halfway.squares > all.sampling.squares);
    prepared_free(&at_once);
    prepared_free(&passes);
}

/* A pass that gives each pixel one sample has empty halves, which tell no error. */
static void test_passes_of_one_sample(void **state)
{
    static float mean[SIZE * SIZE * 3], difference[SIZE * SIZE * 3], spread[SIZE * SIZE];
    static struct refinement refinements[SIZE * SIZE];
    struct prepared prepared = prepare(1, 4);
    struct tile tile = {.w = SIZE, .h = SIZE, .step = 1};
    struct render_counts counts;
    struct task task = {.tile = &tile,
                        .refinements = refinements,
                        .to.mean = mean,
                        .to.difference = difference,
                        .to.spread = spread};
    for (uint8_t pass = 0; pass < 2; pass++) {
        for (uint32_t k = 0; k < SIZE * SIZE; k++) {
            refinements[k] = (struct refinement){pass, pass + 1};
            difference[3 * k] = spread[k] = 1;
        }
        assert_true(renderer_task(prepared.renderer, &task, &counts));
        for (uint32_t k = 0; k < SIZE * SIZE; k++)
            assert_true(difference[3 * k] == 0 && spread[k] == 0);
        assert_true(counts.sampling.squares == 0);
    }
    prepared_free(&prepared);
}

/* The error half way through a pass is that of the first one. */
static void test_halfway_of_the_first_pass(void **state)
{
    static float mean[SIZE * SIZE * 3];
    static struct refinement refinements[SIZE * SIZE];
    struct prepared prepared = prepare(4, 16);
    struct tile tile = {.w = SIZE, .h = SIZE, .step = 1};
    struct render_counts counts;
    struct task task = {.tile = &tile, .refinements = refinements, .to.mean = mean};
    for (uint8_t pass = 0; pass < 2; pass++) {
        for (uint32_t k = 0; k < SIZE * SIZE; k++)
            refinements[k] = (struct refinement){pass, pass + 1};
        assert_true(renderer_task(prepared.renderer, &task, &counts));
        assert_true(counts.sampling.squares > 0);
        assert_int_equal(counts.halfway.squares > 0, pass == 0);
    }
    prepared_free(&prepared);
}

static bool count_wave(void *waves)
{
    ++*(unsigned *)waves;
    return false;
}

/* The number of waves that 256 pixels take with this number of lights. */
static unsigned waves_with(uint32_t lights)
{
    struct builder *builder = builder_create();
    add_sphere(builder, 0, 0, 9, 1,
               material(builder, 0, 0)); /* unseen; nothing to light, no lights */
    for (uint32_t i = 0; i < lights; i++)
        add_light(builder, i, 9, 0);
    struct view view = small_view(16);
    struct prepared prepared = prepare_scene(builder, &view);
    unsigned waves = 0;
    float rgb[256 * 3];
    struct tile tile = {.w = 16, .h = 16, .step = 1};
    struct render_counts counts;
    renderer_on_wave(prepared.renderer, count_wave, &waves);
    renderer_tile(prepared.renderer, &tile, rgb, &counts);
    assert_int_equal(counts.rays[RAY_PRIMARY], 256);
    prepared_free(&prepared);
    return waves;
}

/* With many lights waves are short, as each hit may need a shadow ray to each light. */
static void test_many_lights_make_short_waves(void **state)
{
    assert_int_equal(waves_with(0), 1);
    assert_int_equal(waves_with(4000), 1);
    assert_int_equal(waves_with((1u << 17) - 1), 29); /* of 9 samples */
}

/* Rays of one column of pixels exactly touch a rod of glass: they neither enter nor leave it, and all light comes out
 * into a sky of 1. */
static void test_touched_glass(void **state)
{
    static struct picture picture;
    const double iors[] = {0.8, 1, 1.5};
    struct view view = small_view(32);
    view.region_w = view.region_h = SIZE;
    view.camera.forward.x = 1.0 / 64; /* the offset of the column */
    view.background_bottom = view.background_top = vec3(1, 1, 1);
    for (unsigned k = 0; k < 6; k++) {
        uint32_t index;
        struct builder *builder = builder_create();
        struct material glass = {.color = {1, 1, 1}, .reflection = 0.15, .transmission = 0.85};
        glass.ior = iors[k / 2];
        must(builder_add_material(builder, &glass, &index));
        struct cone rod = {{1, -3, 0}, {1, 3, k % 2}, 1, 1, index, 1};
        must(builder_add_cone(builder, &rod));
        render_scene(builder, &view, SIZE, SIZE, &picture);
        assert_int_equal(picture.counts.unmatched_media + picture.counts.open_media, 0);
        for (uint32_t i = 0; i < SIZE * SIZE * 3; i++)
            assert_true(fabs(1 - (double)picture.rgb[i]) <= picture.counts.truncation + 0x1p-20);
    }
}

/* An eye exactly on the surface of glass, along which it looks: half of its rays go into the glass and come out again,
 * the other half never were in it. */
static void test_eye_along_a_surface(void **state)
{
    static struct picture picture;
    struct view view = small_view(SIZE);
    for (unsigned k = 0; k < 4; k++) {
        struct builder *builder = builder_create();
        uint32_t glass = material(builder, 0.1, 0.8);
        struct box block = {{0, -1, -1}, {3, k == 1 ? 0 : 1, 9}, glass, 0};
        struct cone rod = {{0, 0, 6}, {3, 0, 6}, 1, 1, glass, 1};
        if (k < 2)
            must(builder_add_box(builder, &block));
        else if (k == 2)
            must(builder_add_cone(builder, &rod));
        else
            add_sphere(builder, 1, 0, 6, 1, glass);
        render_scene(builder, &view, SIZE, SIZE, &picture);
        assert_int_equal(picture.counts.unmatched_media + picture.counts.open_media, 0);
        uint32_t half = SIZE * SIZE / 2;
        assert_int_equal(picture.counts.primary_hits, k == 1 ? half / 2 : half);
    }
}

/* The stacks of media that 4096 rays through 64 balls leave behind, which overlap and are left in another order than
 * entered. A task of a million samples must not take more memory than one of a few waves. */
static void test_media_are_forgotten_between_waves(void **state)
{
    enum { EDGE = 64, BALLS = 64 };
    uint32_t index;
    struct builder *builder = builder_create();
    struct material clear = {.color = {1, 1, 1}, .transmission = 1, .ior = 1};
    must(builder_add_material(builder, &clear, &index));
    for (uint32_t i = 0; i < BALLS; i++)
        add_sphere(builder, i * 7 % BALLS * 0.02, i * 11 % BALLS * 0.02, i * 29 % BALLS * 0.02, 2,
                   index);
    struct view view = small_view(EDGE);
    view.max_depth = 2 * BALLS;
    struct prepared prepared = prepare_scene(builder, &view);
    static float rgb[EDGE * EDGE * 3];
    struct tile tile = {.w = EDGE, .h = EDGE, .step = 1};
    struct render_counts counts;
    renderer_tile(prepared.renderer, &tile, rgb, &counts);
    assert_int_equal(counts.unmatched_media, 0);
    assert_in_range(media_count(prepared.renderer->media), 1, 1 << 18);
    prepared_free(&prepared);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lights_in_a_plane),
        cmocka_unit_test(test_empty_scene_is_background),
        cmocka_unit_test(test_tiles_do_not_matter),
        cmocka_unit_test(test_cutoff_keeps_its_bound),
        cmocka_unit_test(test_depth_bound),
        cmocka_unit_test(test_facing_mirrors),
        cmocka_unit_test(test_filtered_shadow),
        cmocka_unit_test(test_shadows_can_be_left_out),
        cmocka_unit_test(test_rays_are_bounded),
        cmocka_unit_test(test_edges_do_not_leak),
        cmocka_unit_test(test_edges_of_a_glass_mesh),
        cmocka_unit_test(test_rims_of_glass_rods),
        cmocka_unit_test(test_touched_glass_keeps_the_bound),
        cmocka_unit_test(test_tangents_of_glass_balls),
        cmocka_unit_test(test_glass_balls_meet_a_mesh),
        cmocka_unit_test(test_wall_as_thin_as_rounding),
        cmocka_unit_test(test_eye_on_a_glass_mesh),
        cmocka_unit_test(test_eye_inside_glass),
        cmocka_unit_test(test_glass_on_glass),
        cmocka_unit_test(test_touched_glass),
        cmocka_unit_test(test_eye_along_a_surface),
        cmocka_unit_test(test_equal_media_are_one),
        cmocka_unit_test(test_bad_samples_are_told),
        cmocka_unit_test(test_bad_in_a_mirror),
        cmocka_unit_test(test_open_media_are_counted),
        cmocka_unit_test(test_bound_rays_tell_no_media),
        cmocka_unit_test(test_spread_of_four_samples),
        cmocka_unit_test(test_error_of_three_samples),
        cmocka_unit_test(test_passes_of_one_sample),
        cmocka_unit_test(test_halfway_of_the_first_pass),
        cmocka_unit_test(test_passes_add_up),
        cmocka_unit_test(test_many_lights_make_short_waves),
        cmocka_unit_test(test_media_are_forgotten_between_waves),
        cmocka_unit_test(test_too_bright_for_floats),
        cmocka_unit_test(test_color_sum),
        cmocka_unit_test(test_light_on_a_surface),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
