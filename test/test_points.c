/* Tests that points computed in lanes have the same bits as from the functions for one point. */
#include "scene_fixture.h"

#include "test/sample_fixture.h"
#include "worker/corner.h"
#include "worker/lanes.h"
#include "worker/packet.h"
#include "worker/points.h"

#define MATERIALS 5

/* Random scenes: their size, the point around which they are, and a factor of scale; far: the eye is far away. */
struct recipe {
    uint64_t *random;
    double scale, far;
    struct vec3 offset;
};

static struct vec3 some_point(const struct recipe *recipe)
{
    struct vec3 p = vec_add(random_vector(recipe->random, 4), recipe->offset);
    return vec_scale(p, recipe->scale);
}

static double some_length(const struct recipe *recipe)
{
    return recipe->scale * pow(10, random_between(recipe->random, -3, 0.3));
}

static void make_materials(struct material materials[MATERIALS])
{
    const double shininess[MATERIALS] = {0, 1, 20, 1e4, 1e9};
    for (uint32_t m = 0; m < MATERIALS; m++)
        materials[m] = (struct material){.color = {0.9, 0.5, 0.3},
                                         .diffuse = 0.1 * m,
                                         .specular = m % 2 ? 0.5 : 0,
                                         .shininess = shininess[m],
                                         .reflection = 0.3,
                                         .transmission = 0.4,
                                         .ior = m ? 0.8 + 0.2 * m : 1e120};
}

static void add_materials(struct builder *builder)
{
    struct material materials[MATERIALS];
    make_materials(materials);
    for (uint32_t m = 0; m < MATERIALS; m++) {
        uint32_t index;
        assert_added(builder_add_material(builder, &materials[m], &index));
    }
}

static struct vec3 near_point(const struct recipe *recipe, struct vec3 p)
{
    return vec_add(p, random_vector(recipe->random, some_length(recipe)));
}

static void add_some(struct builder *builder, const struct recipe *recipe)
{
    uint64_t *random = recipe->random;
    uint32_t material = random_below(random, MATERIALS);
    struct vec3 p = some_point(recipe), q = near_point(recipe, p), r = near_point(recipe, p);
    struct cone cone = {p, q, some_length(recipe), some_length(recipe), material, 1};
    struct sphere shell = {p, some_length(recipe), material, 1};
    struct patch patch = {.material = material};
    struct box box = {.min = p,
                      .max = vec_add(p, vec3(some_length(recipe), some_length(recipe), 1)),
                      .material = material};
    struct disc disc = {p, vec_normalize(random_vector(random, 1)), some_length(recipe), material,
                        0};
    switch (random_below(random, 9)) {
    case 0:
        add_triangle(builder, p, q, r, material);
        break;
    case 1:
        add_triangle(builder, p, some_point(recipe), some_point(recipe), material);
        break;
    case 2:
        if (random_below(random, 2)) r = some_point(recipe);
        if (random_below(random, 2)) q = some_point(recipe);
        for (unsigned k = 0; k < 3; k++) {
            patch.vertex[k] = add_vertex(builder, k == 0 ? p : k == 1 ? q : r);
            patch.normal[k] = add_normal(builder, random_vector(random, 1));
        }
        assert_added(builder_add_patch(builder, &patch));
        break;
    case 3:
        assert_added(builder_add_cone(builder, &cone));
        break;
    case 4:
        assert_added(builder_add_sphere(builder, &shell));
        break;
    case 5:
        assert_added(builder_add_disc(builder, &disc));
        break;
    case 6:
        box.max.z = p.z + some_length(recipe);
        assert_added(builder_add_box(builder, &box));
        break;
    case 7: /* its vertex normals lie in it */
        q.z = r.z = p.z;
        for (unsigned k = 0; k < 3; k++) {
            patch.vertex[k] = add_vertex(builder, k == 0 ? p : k == 1 ? q : r);
            patch.normal[k] = add_normal(builder, k == 0 ? vec3(1, 0, 0) : vec3(0, 1, 0));
        }
        assert_added(builder_add_patch(builder, &patch));
        break;
    default:
        add_sphere(builder, p, some_length(recipe), material);
        break;
    }
}

static struct scene *random_scene(const struct recipe *recipe)
{
    struct builder *builder = builder_create();
    add_materials(builder);
    for (unsigned i = 0; i < 150; i++)
        add_some(builder, recipe);
    if (random_below(recipe->random, 2)) {
        struct plane plane = {.point = some_point(recipe),
                              .normal = vec_normalize(random_vector(recipe->random, 1))};
        assert_added(builder_add_plane(builder, &plane));
    }
    return finish_scene(builder);
}

static struct ray ray_from_to(const struct recipe *recipe, struct vec3 from, struct vec3 to)
{
    struct vec3 way = vec_normalize(vec_sub(to, from));
    return ray_along(vec_add_scaled(from, way, -recipe->far * recipe->scale), way);
}

/* Random rays: independent ones, or groups of similar directions from one point, which form bundles. */
static void random_rays(const struct recipe *recipe, struct ray *rays, uint32_t count)
{
    bool alike = random_below(recipe->random, 3) > 0;
    double apart = some_length(recipe);
    struct vec3 from = some_point(recipe), to = some_point(recipe);
    for (uint32_t i = 0; i < count; i++) {
        if (!alike || i % (BUNDLE * LANES) == 0) {
            from = some_point(recipe);
            to = some_point(recipe);
        }
        rays[i] = ray_from_to(recipe, from, vec_add(to, random_vector(recipe->random, apart)));
    }
}

static void assert_same_vector(struct vec3 value, struct vec3 expected)
{
    assert_memory_equal(&value, &expected, sizeof value);
}

static void compare_point(const struct scene *scene, const struct bvh *bvh, const struct ray *ray,
                          const struct hit *hit, const struct points *points, uint32_t i)
{
    struct surface surface;
    surface_at(scene, ray, hit, &surface);
    if (hit->in_corner) surface.point = corner_point(scene, bvh, ray, hit);
    struct shading_point at = shading_point(scene, ray, &surface);
    struct shading_point found = points_get(points, i);
    assert_same_vector(found.point, at.point);
    assert_same_vector(found.view, at.view);
    assert_same_vector(found.geometric, at.geometric);
    assert_same_vector(found.normal, at.normal);
    assert_int_equal(found.entering, at.entering);
    assert_ptr_equal(found.material, at.material);
}

/* Asserts that the points of hits, which may be rough ones, are those of the exact hits. */
static void compare_points(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                           const struct hit *told, const struct hit *hits, uint32_t count,
                           struct points *points)
{
    uint64_t exact = 0;
    points_find(scene, bvh, rays, told, count, points, &exact);
    for (uint32_t i = 0; i < points->count; i++)
        compare_point(scene, bvh, &rays[points->slot[i]], &hits[points->slot[i]], points, i);
}

/* A light near or far, or in the mirror direction, where the highlight is, or in some horizontal surface. */
static struct light some_light(const struct recipe *recipe, const struct points *points)
{
    struct light light = {.position = some_point(recipe), .color = {1, 0.5, 2}};
    struct shading_point at = points_get(points, random_below(recipe->random, points->count));
    unsigned choice = random_below(recipe->random, 4);
    double way = recipe->scale * pow(10, random_between(recipe->random, -20, 6));
    if (choice == 3) light.position.z = at.point.z;
    if (choice == 1) light.position = vec_add_scaled(at.point, reflect(&at), way);
    if (choice == 2) light.position = vec_scale(light.position, 1e6);
    return light;
}

static void compare_lit(const struct points *points, struct lit *lit)
{
    points_light(points, lit);
    for (uint32_t i = 0; i < lit->count; i++) {
        struct shading_point at = points_get(points, lit->point[i]);
        assert_same_vector(lane(&lit->color, i),
                           shade_light(&at, lane(&lit->to_light, i), lane(&lit->strength, i)));
    }
}

static void compare_lights(const struct recipe *recipe, const struct points *points)
{
    static struct faced faced;
    static struct lit lit;
    struct light light = some_light(recipe, points);
    points_face(points, &light, &faced);
    lit.count = 0;
    for (uint32_t i = 0; i < points->count; i++) {
        struct shading_point at = points_get(points, i);
        struct vec3 to_light;
        assert_int_equal(faced.faces[i] != 0, light_faces(&at, &light, &to_light));
        if (faced.faces[i] == 0) continue;
        assert_same_vector(lane(&faced.to_light, i), to_light);
        assert_true(faced.end[i] >= 0 && faced.end[i] <= 1);
        if (points->formulas == FORMULAS_PAPER) assert_true(faced.end[i] == 1);
        lit.point[lit.count] = i;
        set_lane(&lit.to_light, lit.count, to_light);
        set_lane(&lit.strength, lit.count++, light.color);
    }
    compare_lit(points, &lit);
}

static void compare_secondary(uint64_t *random, const struct points *points,
                              struct secondary_rays *secondary)
{
    const double indices[] = {1, 1.5, 1.0000000000000002, 3, 1e-200, 2e-200, 1e-150, 1e150};
    secondary->count = points->count;
    for (uint32_t i = 0; i < points->count; i++) {
        secondary->point[i] = i;
        double cosine = vec_dot(lane(&points->view, i), lane(&points->normal, i));
        double critical = sqrt(1 - cosine * cosine) * (1 + 1e-16 * random_between(random, -9, 9));
        secondary->from[i] = indices[random_below(random, 8)];
        secondary->to[i] = random_below(random, 4) ? indices[random_below(random, 8)]
                                                   : critical * secondary->from[i];
    }
    points_refract(points, secondary);
    for (uint32_t i = 0; i < points->count; i++) {
        struct shading_point at = points_get(points, i);
        struct vec3 direction;
        bool passes = refract(&at, secondary->from[i], secondary->to[i], &direction);
        assert_int_equal(secondary->passes[i] != 0, passes);
        if (passes) assert_same_vector(lane(&secondary->direction, i), direction);
    }
    points_reflect(points, secondary);
    for (uint32_t i = 0; i < points->count; i++) {
        struct shading_point at = points_get(points, i);
        assert_same_vector(lane(&secondary->direction, i), reflect(&at));
    }
}

/* Rough hits that were tested, by kind. */
static unsigned rough_hits[PRIMITIVE_KINDS];

static void count_rough(const struct hit *hits, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        if (hits[i].primitive != PRIMITIVE_NONE && is_rough_hit(&hits[i]))
            rough_hits[primitive_kind(hits[i].primitive)]++;
}

/* Compares a wave of rays, and a wave of the reflected rays. */
static uint32_t compare_waves(const struct recipe *recipe, const struct scene *scene,
                              const struct bvh *bvh)
{
    static struct points points;
    static struct secondary_rays secondary;
    struct ray rays[WAVE];
    struct hit hits[WAVE], rough[WAVE];
    uint32_t count = WAVE - random_below(recipe->random, 20), found = 0;
    uint64_t exact = 0;
    random_rays(recipe, rays, count);
    for (int wave = 0; wave < 3 && count > 0; wave++) {
        nearest(scene, bvh, rays, count, hits, &exact);
        compare_points(scene, bvh, rays, hits, hits, count, &points);
        nearest_rough(scene, bvh, rays, count, rough, &exact);
        count_rough(rough, count);
        compare_points(scene, bvh, rays, rough, hits, count, &points);
        if (points.count == 0) break;
        compare_lights(recipe, &points);
        compare_secondary(recipe->random, &points, &secondary);
        count = points.count;
        found += count;
        for (uint32_t i = 0; i < count; i++) {
            rays[i] = ray_along(lane(&points.point, i), lane(&secondary.direction, i));
            rays[i].from = hits[points.slot[i]].primitive;
            rays[i].from_part = hits[points.slot[i]].part;
        }
    }
    return found;
}

static void compare_scenes(struct recipe recipe, unsigned scenes)
{
    uint32_t found = 0;
    for (unsigned i = 0; i < scenes; i++) {
        struct scene *scene = random_scene(&recipe);
        if (i % 5 == 4) scene->view.formulas = FORMULAS_PAPER;
        struct bvh *bvh = build_tree(scene);
        found += compare_waves(&recipe, scene, bvh);
        free(bvh);
        free(scene);
    }
    assert_true(found > 50 * scenes);
}

static void test_ordinary_scenes(void **state)
{
    uint64_t random = 101;
    compare_scenes((struct recipe){&random, 1, 0, {0, 0, 0}}, 60);
    if (!processor_has(PROCESSOR_AVX2)) return; /* without SIMD there are no bundles */
    const enum primitive_kind kinds[] = {PRIMITIVE_TRIANGLE, PRIMITIVE_PATCH, PRIMITIVE_SPHERE,
                                         PRIMITIVE_CONE, PRIMITIVE_PLANE};
    for (unsigned i = 0; i < sizeof kinds / sizeof *kinds; i++)
        assert_true(rough_hits[kinds[i]] > 50);
}

static void test_far_scenes(void **state)
{
    uint64_t random = 102;
    compare_scenes((struct recipe){&random, 1, 1e7, {0, 0, 0}}, 20);
    compare_scenes((struct recipe){&random, 1, 0, {1e9, -1e8, 3e7}}, 20);
}

/* Points in edges where two surfaces meet are moved away from the other one, also where lanes are sure of them. */
static void test_corners(void **state)
{
    enum { COUNT = 64 };
    static struct points points;
    struct ray rays[COUNT];
    struct hit hits[COUNT];
    uint64_t exact = 0;
    unsigned moved = 0;
    struct builder *builder = builder_create();
    struct plane floor = {.normal = {0, 1, 0}}, wall = {.normal = {1, 0, 0}};
    add_material(builder, vec3(1, 1, 1), 0);
    assert_added(builder_add_plane(builder, &floor));
    assert_added(builder_add_plane(builder, &wall));
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    for (unsigned i = 0; i < COUNT; i++)
        rays[i] = ray_to(vec3(1 + i % 8, 1 + i / 8, 3), vec3(0, 0, i));
    nearest(scene, bvh, rays, COUNT, hits, &exact);
    compare_points(scene, bvh, rays, hits, hits, COUNT, &points);
    for (unsigned i = 0; i < COUNT; i++)
        moved += points.point.x[i] > 0 || points.point.y[i] > 0;
    assert_true(points.count == COUNT && moved > COUNT / 2);
    free(bvh);
    free(scene);
}

/* Where single points need scaling, lanes are not sure. */
static void test_scenes_of_any_size(void **state)
{
    uint64_t random = 103;
    compare_scenes((struct recipe){&random, 0x1p-60, 0, {0, 0, 0}}, 10);
    compare_scenes((struct recipe){&random, 1e90, 0, {0, 0, 0}}, 10);
    compare_scenes((struct recipe){&random, 0x1p-182, 0, {0, 0, 0}}, 20);
    compare_scenes((struct recipe){&random, 1e-120, 0, {0, 0, 0}}, 10);
}

/* A triangle of any shape and size, such as a needle, or one that is far away. */
static void any_corners(uint64_t *random, struct vec3 corner[3])
{
    double size = ldexp(1, random_below(random, 4) ? 0 : random_exponent(random, -330, 330));
    double thin = pow(10, -random_between(random, 0, random_below(random, 2) ? 12 : 0));
    struct vec3 a = random_vector(random, 2), along = random_vector(random, 1);
    if (random_below(random, 4) == 0) a = vec_scale(a, pow(10, random_between(random, 0, 9)));
    corner[0] = vec_scale(a, size);
    corner[1] = vec_scale(vec_add(a, along), size);
    corner[2] = vec_add(vec_scale(along, random_between(random, -1, 2)),
                        vec_scale(random_vector(random, 1), thin));
    corner[2] = vec_scale(vec_add(a, corner[2]), size);
}

/* A ray to a point in a triangle, sometimes next to an edge, from near or far, sometimes almost in its plane. */
static struct ray any_ray(uint64_t *random, const struct vec3 corner[3])
{
    double near = random_below(random, 2) ? pow(10, -random_between(random, 0, 17)) : 1;
    double u = near * random_between(random, 0, 1), v = random_between(random, 0, 1 - u);
    struct vec3 p = vec_sub(corner[1], corner[0]), q = vec_sub(corner[2], corner[0]);
    struct vec3 to = vec_add_scaled(vec_add_scaled(corner[0], p, u), q, v);
    double size = vec_largest(p) + vec_largest(q);
    struct vec3 way = vec_add_scaled(vec_scale(p, random_between(random, -1, 1)), q,
                                     random_between(random, -1, 1));
    double off = random_below(random, 2) ? pow(10, -random_between(random, 0, 16)) : 1;
    way = vec_add(way, random_vector(random, size * off));
    way = vec_scale(way, pow(10, random_between(random, -15, random_below(random, 3) ? 1 : 12)));
    return ray_to(vec_add(to, way), to);
}

/* A rough hit that nearest_rough() might give for a hit of nearest(). */
static struct hit roughened(uint64_t *random, const struct hit *hit, double v)
{
    double off = hit->t * pow(10, -random_between(random, 0, 15));
    double t = hit->t + off * random_between(random, -0.99, 0.99);
    return (struct hit){t, off, v, hit->primitive, 0, 0};
}

/* Moves a triangle and a ray to it so that the ray starts next to the scene's origin, and the triangle is large beside
 * all of the ray's coordinates. Directions often have components of the same size. */
static void move_to_origin(uint64_t *random, struct vec3 corner[3], struct ray *ray)
{
    double near = pow(10, -random_between(random, 0, 17)), size = vec_largest(corner[1]);
    struct vec3 d = ray->direction, to = vec_add(ray->origin, d);
    for (unsigned k = 0; k < 3; k++)
        corner[k] = vec_sub(corner[k], to);
    struct vec3 normal = vec_cross(vec_sub(corner[1], corner[0]), vec_sub(corner[2], corner[0]));
    if (random_below(random, 2) && vec_largest(normal) > 0)
        d = vec_add(vec_normalize(normal), random_vector(random, 0.2));
    if (random_below(random, 2)) d.y = copysign(d.x, d.y);
    if (random_below(random, 2)) d.z = copysign(d.y, d.z);
    ray->direction = d;
    ray->origin = vec_scale(d, -near * size / vec_largest(d));
}

/* Makes a ray start at this many times the triangle's size from the point that it is aimed at. */
static void move_away(double times, const struct vec3 corner[3], struct ray *ray)
{
    double size =
        vec_largest(vec_sub(corner[1], corner[0])) + vec_largest(vec_sub(corner[2], corner[0]));
    struct vec3 to = vec_add(ray->origin, ray->direction);
    double scale = times * size / vec_largest(ray->direction);
    *ray = ray_to(vec_add_scaled(to, ray->direction, -scale), to);
}

/*
 * Compares the points where each ray hits the primitive of its id in a scene of the builder, which is freed; returns
 * how many there are. Rough hits have this weight. With `every` = 0 none is rough, with 1 all are, otherwise all but
 * one in so many.
 */
static unsigned compare_hits(uint64_t *random, struct builder *builder, const struct ray rays[WAVE],
                             const uint32_t ids[WAVE], uint32_t every, double weight)
{
    static struct points points;
    struct scene *scene = finish_scene(builder);
    struct hit hits[WAVE], rough[WAVE];
    uint64_t exact = 0;
    for (uint32_t i = 0; i < WAVE; i++) {
        struct hit any = {1, 1, weight, ids[i], 0, 0};
        hits[i] = rough[i] = settled_hit(scene, &rays[i], &any, &exact);
        if (hits[i].primitive == PRIMITIVE_NONE || every == 0) continue;
        if (every == 1 || random_below(random, every))
            rough[i] = roughened(random, &hits[i], weight);
    }
    compare_points(scene, NULL, rays, rough, hits, WAVE, &points);
    free(scene);
    return points.count;
}

/* least: rays start at least at this many times the triangles' sizes from them; 0: anywhere. */
static unsigned compare_corners(uint64_t *random, double least)
{
    struct builder *builder = builder_create();
    struct ray rays[WAVE];
    uint32_t ids[WAVE];
    add_materials(builder);
    for (uint32_t i = 0; i < WAVE; i++) {
        struct vec3 corner[3];
        any_corners(random, corner);
        rays[i] = any_ray(random, corner);
        if (least > 0)
            move_away(least * pow(10, random_between(random, 0, 1)), corner, &rays[i]);
        else if (random_below(random, 4) == 0)
            move_to_origin(random, corner, &rays[i]);
        if (random_below(random, 8) == 0)
            rays[i].direction =
                vec_scale(rays[i].direction, ldexp(1, random_exponent(random, -450, 450)));
        add_triangle(builder, corner[0], corner[1], corner[2], 0);
        ids[i] = primitive_id(PRIMITIVE_TRIANGLE, i);
    }
    return compare_hits(random, builder, rays, ids, 1, WEIGHT_UNKNOWN);
}

/* Weights that are computed in lanes are those of the exact hit, wherever lanes say that they are sure. */
static void test_any_triangles(void **state)
{
    uint64_t random = 104;
    unsigned found = 0, waves = 1000;
    for (unsigned i = 0; i < waves; i++)
        found += compare_corners(&random, 0);
    assert_true(found > waves * WAVE / 2);
}

/* Waves whose rays all come from afar, or all but one or a few. */
static void test_triangles_from_afar(void **state)
{
    uint64_t random = 107;
    unsigned found = 0, waves = 300;
    for (unsigned i = 0; i < waves; i++)
        found += compare_corners(&random, i % 2 ? 0.6 : random_between(&random, 0.98, 1.02));
    assert_true(found > waves * WAVE / 2);
}

/* A sphere of any size, often far from the scene's origin. */
static struct sphere any_sphere(uint64_t *random)
{
    double size = ldexp(1, random_below(random, 4) ? 0 : random_exponent(random, -230, 230));
    double away = random_below(random, 2) ? pow(10, random_between(random, 0, 12)) : 1;
    return (struct sphere){.center = random_vector(random, away * size),
                           .radius = random_between(random, 0.5, 2) * size,
                           .inside_only = random_below(random, 4) == 0};
}

/* A ray from afar through the centre of a sphere at the scene's origin, which may be much smaller than any distance. */
static struct ray ray_to_dot(uint64_t *random, struct sphere *sphere)
{
    struct vec3 way = random_vector(random, 1);
    sphere->center = vec3(0, 0, 0);
    sphere->radius = ldexp(random_between(random, 0.5, 1), -random_exponent(random, 0, 520));
    return ray_along(vec_neg(way), vec_scale(way, ldexp(1, random_exponent(random, -500, 500))));
}

/* A ray that passes the centre at any distance up to the radius, where it is a tangent up to rounding; from near, from
 * far or from inside. */
static struct ray ray_by(uint64_t *random, const struct sphere *sphere)
{
    struct vec3 way = vec_normalize(random_vector(random, 1));
    struct vec3 aside = vec_normalize(vec_cross(way, random_vector(random, 1)));
    double inward = ldexp(random_between(random, 0.5, 1), random_exponent(random, -60, 0));
    double from = random_between(random, -1, 1) * pow(10, random_between(random, 0, 9));
    struct vec3 past = vec_add_scaled(sphere->center, aside, sphere->radius * (1 - inward));
    double speed = ldexp(sphere->radius, random_exponent(random, -30, 30));
    return ray_along(vec_add_scaled(past, way, from * sphere->radius), vec_scale(way, speed));
}

/* Compares so many waves; more than `part` of their rays hit what they are to hit. */
static void compare_many(unsigned (*compare)(uint64_t *random), uint64_t random, unsigned waves,
                         double part)
{
    unsigned found = 0;
    for (unsigned i = 0; i < waves; i++)
        found += compare(&random);
    assert_true(found > part * waves * WAVE);
}

static unsigned compare_spheres(uint64_t *random)
{
    struct builder *builder = builder_create();
    struct ray rays[WAVE];
    uint32_t ids[WAVE];
    add_materials(builder);
    for (uint32_t i = 0; i < WAVE; i++) {
        struct sphere sphere = any_sphere(random);
        bool is_dot = random_below(random, 4) == 0;
        rays[i] = is_dot ? ray_to_dot(random, &sphere) : ray_by(random, &sphere);
        assert_added(builder_add_sphere(builder, &sphere));
        ids[i] = primitive_id(PRIMITIVE_SPHERE, i);
    }
    return compare_hits(random, builder, rays, ids, 2, 0);
}

/* Spheres that are just touched, and spheres of sizes for which single points need scaling. */
static void test_any_spheres(void **state)
{
    compare_many(compare_spheres, 106, 300, 1.0 / 4);
}

/* Cones and cylinders whose rays meet the side or a cap next to the rim between them. */
static unsigned compare_rims(uint64_t *random)
{
    struct builder *builder = builder_create();
    struct ray rays[WAVE];
    uint32_t ids[WAVE];
    add_materials(builder);
    for (uint32_t i = 0; i < WAVE; i++) {
        double size = ldexp(1, random_below(random, 4) ? 0 : random_exponent(random, -230, 230));
        struct vec3 base = random_vector(random, size), way = random_vector(random, 1);
        struct vec3 aside = vec_normalize(vec_cross(way, random_vector(random, 1)));
        double radius = size * random_between(random, 0.5, 2);
        struct cone cone = {.base = base,
                            .apex = vec_add_scaled(base, way, size),
                            .base_radius = radius,
                            .apex_radius = random_below(random, 2) ? radius : 0.5 * radius,
                            .capped = 1};
        double off = ldexp(random_between(random, -1, 1), -random_exponent(random, 0, 56));
        struct vec3 to = vec_add_scaled(base, aside, radius * (1 + off));
        rays[i] = ray_to(vec_add(to, random_vector(random, 3 * size)), to);
        assert_added(builder_add_cone(builder, &cone));
        ids[i] = primitive_id(PRIMITIVE_CONE, i);
    }
    return compare_hits(random, builder, rays, ids, 0, 0);
}

static void test_rims(void **state)
{
    compare_many(compare_rims, 108, 300, 1.0 / 2);
}

/* A cone of any size, or a cylinder; sometimes its radius is far from its length. */
static struct cone any_cone(uint64_t *random)
{
    double size = ldexp(1, random_below(random, 4) ? 0 : random_exponent(random, -230, 230));
    double radius = size * pow(10, random_between(random, -2, random_below(random, 4) ? 0.3 : 5));
    struct vec3 base = random_vector(random, size);
    return (struct cone){.base = base,
                         .apex = vec_add(base, random_vector(random, size)),
                         .base_radius = radius,
                         .apex_radius = random_below(random, 3) * radius / 2,
                         .capped = random_below(random, 4) > 0};
}

/* A ray from where another one has met the cone: on its way through, grazing the side, or anywhere. */
static struct ray ray_from_cone(uint64_t *random, const struct scene *scene, uint32_t id)
{
    const struct cone *cone = &scene_cones(scene)[primitive_index(id)];
    struct vec3 axis = vec_sub(cone->apex, cone->base);
    struct vec3 to = vec_add_scaled(cone->base, axis, random_between(random, 0, 1));
    struct ray ray = ray_to(vec_add(to, random_vector(random, 9 * vec_largest(axis))), to);
    const struct hit any = {1, 1, 0, id, 0, 0};
    uint64_t exact = 0;
    struct hit hit = settled_hit(scene, &ray, &any, &exact);
    if (hit.primitive == PRIMITIVE_NONE) return ray;
    struct surface surface;
    surface_at(scene, &ray, &hit, &surface);
    double inward = ldexp(-1, -random_exponent(random, 0, 50));
    struct vec3 way = vec_cross(surface.geometric, random_vector(random, 1));
    if (random_below(random, 2)) inward = random_between(random, -1, 1);
    way = vec_add_scaled(way, surface.geometric, inward);
    if (random_below(random, 3)) ray.direction = way;
    ray.origin = surface.point;
    ray.from = id;
    ray.from_part = hit.part;
    return ray;
}

static unsigned compare_exits(uint64_t *random)
{
    struct builder *builder = builder_create(), *again = builder_create();
    struct ray rays[WAVE];
    uint32_t ids[WAVE];
    add_materials(builder);
    add_materials(again);
    for (uint32_t i = 0; i < WAVE; i++) {
        struct cone cone = any_cone(random);
        assert_added(builder_add_cone(builder, &cone));
        assert_added(builder_add_cone(again, &cone));
        ids[i] = primitive_id(PRIMITIVE_CONE, i);
    }
    struct scene *scene = finish_scene(again);
    for (uint32_t i = 0; i < WAVE; i++)
        rays[i] = ray_from_cone(random, scene, ids[i]);
    free(scene);
    return compare_hits(random, builder, rays, ids, 2, 0);
}

/* Cones that rays leave through the side or a cap. */
static void test_exits(void **state)
{
    compare_many(compare_exits, 109, 300, 1.0 / 4);
}

/* A point that is seen from anywhere: straight from above or along the surface, exactly or almost. Its geometric normal
 * may be another one. */
static void put_any_point(uint64_t *random, uint32_t i, struct points *points)
{
    struct vec3 normal = vec3(0, 0, 1), view = vec3(0, 0, -1);
    unsigned choice = random_below(random, 4);
    if (choice == 1) view = vec3(1, 0, 0);
    if (choice > 1) normal = vec_normalize(random_vector(random, 1));
    if (choice == 2) view = vec_normalize(random_vector(random, 1));
    if (choice == 3) {
        double steep = pow(2, random_between(random, -56, random_below(random, 2) ? -50 : 0));
        view = vec_normalize(vec_cross(normal, random_vector(random, 1)));
        view = vec_normalize(vec_add_scaled(view, normal, -steep));
    }
    struct vec3 tilted = vec_normalize(vec_add(normal, random_vector(random, 0.5)));
    struct vec3 geometric = random_below(random, 2) ? normal : tilted;
    if (vec_dot(view, geometric) > 0) view = vec_neg(view);
    if (vec_dot(view, normal) > 0) normal = vec_neg(normal);
    set_lane(&points->view, i, view);
    set_lane(&points->normal, i, normal);
    set_lane(&points->geometric, i, geometric);
}

/* To a light at any distance, often almost at right angles to the mirror direction. */
static struct vec3 any_way_to_light(uint64_t *random, const struct shading_point *at)
{
    struct vec3 way = random_vector(random, 1), mirrored = reflect(at);
    int least = random_below(random, 2) ? -60 : -540;
    double part = ldexp(1, random_exponent(random, least, 0)) * (random_below(random, 4) ? 1 : -1);
    if (random_below(random, 2)) way = vec_add_scaled(vec_cross(mirrored, way), mirrored, part);
    int far = random_below(random, 2) ? 90 : 520;
    return vec_scale(way, ldexp(1, random_exponent(random, -far, far)));
}

/* Light and secondary rays of points that are in no scene. */
static void test_any_points(void **state)
{
    static struct points points;
    static struct lit lit;
    static struct secondary_rays secondary;
    uint64_t random = 109;
    struct material materials[MATERIALS];
    make_materials(materials);
    points.count = lit.count = WAVE;
    for (unsigned wave = 0; wave < 300; wave++) {
        for (uint32_t i = 0; i < WAVE; i++) {
            put_any_point(&random, i, &points);
            points.material[i] = &materials[random_below(&random, MATERIALS)];
            struct shading_point at = points_get(&points, i);
            lit.point[i] = i;
            set_lane(&lit.to_light, i, any_way_to_light(&random, &at));
            set_lane(&lit.strength, i, random_vector(&random, 1));
        }
        compare_lit(&points, &lit);
        compare_secondary(&random, &points, &secondary);
    }
}

static struct vec3 lattice_point(uint64_t *random, double size)
{
    double x = random_below(random, 9), y = random_below(random, 9);
    return vec_scale(vec3(x - 4, y - 4, random_below(random, 9) - 4.0), size);
}

/* Adds planes and cylinders that are seen edge-on or almost so, for which most products cancel. */
static void add_flat(struct builder *builder, uint64_t *random, struct vec3 at[2])
{
    const struct vec3 normals[] = {{0, 1, 0}, {0.6, 0, 0.8}, {0, -0.8, 0.6}};
    struct plane plane = {.point = lattice_point(random, 1),
                          .normal = normals[random_below(random, 3)]};
    struct cone cone = {.base = plane.point, .base_radius = 100, .apex_radius = 100, .capped = 1};
    cone.apex = vec_add(cone.base, vec_scale(plane.normal, 5));
    assert_added(builder_add_plane(builder, &plane));
    assert_added(builder_add_cone(builder, &cone));
    at[0] = plane.point;
    at[1] = plane.normal;
}

static struct ray edge_on_ray(uint64_t *random, const struct vec3 at[2])
{
    double off = ldexp(random_between(random, 0.5, 1), -random_exponent(random, 0, 52));
    struct vec3 aside = vec_cross(at[1], lattice_point(random, 1));
    struct vec3 to = vec_add(at[0], vec_cross(at[1], lattice_point(random, 0.25)));
    return ray_to(vec_add_scaled(vec_add(to, aside), at[1], -off), to);
}

static unsigned compare_flats(uint64_t *random)
{
    struct builder *builder = builder_create();
    struct ray rays[WAVE];
    uint32_t ids[WAVE];
    struct vec3 at[2];
    add_materials(builder);
    for (uint32_t i = 0; i < WAVE / 2; i++) {
        add_flat(builder, random, at);
        rays[2 * i] = rays[2 * i + 1] = edge_on_ray(random, at);
        ids[2 * i] = primitive_id(PRIMITIVE_PLANE, i);
        ids[2 * i + 1] = primitive_id(PRIMITIVE_CONE, i);
    }
    return compare_hits(random, builder, rays, ids, 0, 0);
}

static void test_flats_from_the_edge(void **state)
{
    compare_many(compare_flats, 105, 200, 1.0 / 4);
}

/* Any picture, also one that is wider than a double's square root allows to be seen. */
static void test_sample_rays(void **state)
{
    static struct sample_lanes lanes;
    const double widths[] = {1, 1e-9, 1e200, 3e307};
    const uint32_t samples[] = {1, 2, 16, 1000000};
    struct ray rays[WAVE];
    for (unsigned w = 0; w < 4; w++) {
        struct view view = {.camera = {.eye = {1, 2, 3},
                                       .forward = {0, 0, 1},
                                       .right = {widths[w], 0, 0},
                                       .down = {0, widths[w], 0}},
                            .width = 97,
                            .height = 33,
                            .min_samples = samples[w],
                            .max_samples = samples[w]};
        for (uint32_t i = 0; i < WAVE; i++)
            sample_put(&lanes, i, i % 97, i / 97, i * 3923 % samples[w]);
        sample_rays(&view, &lanes, WAVE, rays);
        for (uint32_t i = 0; i < WAVE; i++) {
            double at[2];
            uint32_t x = i % 97, y = i / 97;
            struct ray ray = sample_ray(&view, x, y, i * 3923 % samples[w], at);
            double u = (2 * (x + at[0]) - view.width) / view.height;
            double v = (2 * (y + at[1]) - view.height) / view.height;
            struct vec3 way = vec_add_scaled(view.camera.forward, view.camera.right, u);
            way = vec_normalize(vec_add_scaled(way, view.camera.down, v));
            assert_same_vector(rays[i].origin, ray.origin);
            assert_same_vector(rays[i].direction, ray.direction);
            assert_same_vector(rays[i].direction, way);
            assert_int_equal(rays[i].from, PRIMITIVE_NONE);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ordinary_scenes),
        cmocka_unit_test(test_far_scenes),
        cmocka_unit_test(test_corners),
        cmocka_unit_test(test_scenes_of_any_size),
        cmocka_unit_test(test_any_triangles),
        cmocka_unit_test(test_triangles_from_afar),
        cmocka_unit_test(test_any_spheres),
        cmocka_unit_test(test_rims),
        cmocka_unit_test(test_exits),
        cmocka_unit_test(test_any_points),
        cmocka_unit_test(test_flats_from_the_edge),
        cmocka_unit_test(test_sample_rays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
