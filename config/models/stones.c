/* The stones of the garden: rocks about the shore, stepping stones, pebbles on the bed. */
#include "config/models/garden.h"
#include "config/models/scatter.h"

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

#define CUTS 9

/* A boulder is a ball cut by planes: its points have point . direction <= distance. */
struct cuts {
    struct vec3 center;
    struct vec3 direction[CUTS];
    double distance[CUTS];
};

static struct vec3 cut_point(const void *context, struct vec3 p)
{
    const struct cuts *cuts = context;
    struct vec3 d = vec_sub(p, cuts->center);
    for (size_t i = 0; i < CUTS; i++) {
        double beyond = vec_dot(d, cuts->direction[i]) - cuts->distance[i];
        if (beyond > 0) d = vec_add_scaled(d, cuts->direction[i], -0.92 * beyond);
    }
    return vec_add(cuts->center, d);
}

struct rock {
    double x, z;
    struct vec3 radii;
    double sink; /* share of its height that is below the ground: 0 .. 1 */
    size_t detail;
};

struct stone_paint {
    uint32_t stone, dark, moss;
    double mossy; /* 0 bare .. 1 overgrown */
    double base;  /* height below which it is wet and dark */
};

static uint32_t paint_stone(const void *context, struct vec3 p, struct vec3 normal)
{
    const struct stone_paint *paint = context;
    if (p.y < paint->base + 0.02 * noise(vec_scale(p, 9), 61)) return paint->dark;
    double green = normal.y + 0.5 * noise_fractal(vec_scale(p, 5), 3, 62);
    if (green > 1.3 - 0.6 * paint->mossy) return paint->moss;
    return noise_fractal(vec_scale(p, 7), 3, 63) > 0.3 ? paint->dark : paint->stone;
}

static struct stone_paint stone_colours(struct mesh *mesh, struct dice *dice, double mossy)
{
    static const char *const names[] = {"stone_0", "stone_1", "stone_2", "stone_3"};
    uint32_t kind = dice_pick(dice, COUNT(names) - 1);
    return (struct stone_paint){.stone = mesh_material(mesh, names[kind]),
                                .dark = mesh_material(mesh, names[kind + 1]),
                                .moss = mesh_material(mesh, "moss_1"),
                                .mossy = mossy,
                                .base = 0.025};
}

static void add_rock(struct mesh *mesh, struct dice *dice, const struct rock *rock)
{
    struct mesh_mark part = mesh_mark(mesh);
    double smallest = fmin(rock->radii.x, fmin(rock->radii.y, rock->radii.z));
    struct vec3 center = ground_point(rock->x, rock->z, rock->radii.y * (1 - 2 * rock->sink));
    struct cuts cuts = {.center = vec3(0, 0, 0)};
    for (size_t i = 0; i < CUTS; i++) {
        cuts.direction[i] = dice_direction(dice);
        cuts.distance[i] = dice_between(dice, 0.58, 0.86);
    }
    uint32_t seed = dice_pick(dice, 1000);
    mesh_use(mesh, "stone_0");
    mesh_ball(mesh, vec3(0, 0, 0), vec3(1, 1, 1), rock->detail);
    mesh_bend(mesh, part, cut_point, &cuts);
    mesh_roughen(mesh, part, 0.10, 1.6, seed);
    mesh_roughen(mesh, part, 0.05, 4, seed + 1);
    mesh_roughen(mesh, part, 0.02, 11, seed + 3);
    struct mesh_transform t = transform_turn(vec3(0, 1, 0), dice_between(dice, 0, 360));
    t.x = vec_scale(t.x, rock->radii.x);
    t.y = vec_scale(t.y, rock->radii.y);
    t.z = vec_scale(t.z, rock->radii.z);
    t.origin = center;
    mesh_apply(mesh, part, &t);
    mesh_roughen(mesh, part, 0.03 * smallest, 3 / smallest, seed + 2);
    struct stone_paint paint = stone_colours(mesh, dice, dice_between(dice, 0, 0.8));
    mesh_paint(mesh, part, paint_stone, &paint);
    mesh_smooth(mesh, part, 50);
}

/* Stones placed individually: around the islet, the pine, the bridge and the near bank. */
static const struct rock set_rocks[] = {
    {-3.05, 0.45, {0.34, 0.30, 0.28}, 0.35, 12}, {-2.75, 0.85, {0.26, 0.17, 0.22}, 0.35, 10},
    {-1.75, 0.72, {0.36, 0.26, 0.26}, 0.35, 12}, {-1.50, 0.15, {0.26, 0.34, 0.24}, 0.30, 12},
    {-2.30, 1.05, {0.22, 0.11, 0.17}, 0.30, 10}, {-3.1, -0.2, {0.24, 0.26, 0.26}, 0.35, 10},
    {2.15, -0.55, {0.52, 0.46, 0.36}, 0.35, 14}, {2.95, -0.05, {0.40, 0.26, 0.34}, 0.35, 12},
    {1.55, -1.05, {0.30, 0.24, 0.26}, 0.40, 10}, {3.70, 0.55, {0.46, 0.36, 0.36}, 0.35, 14},
    {4.35, 1.05, {0.36, 0.30, 0.34}, 0.35, 12},  {4.1, -1.1, {0.45, 0.40, 0.40}, 0.45, 12},
    {-1.62, 4.62, {0.21, 0.15, 0.17}, 0.30, 14}, {-2.05, 4.2, {0.27, 0.27, 0.22}, 0.35, 16},
    {-4.55, 3.9, {0.42, 0.52, 0.38}, 0.35, 14},  {-4.9, 3.1, {0.36, 0.26, 0.36}, 0.35, 12},
    {2.45, 3.75, {0.26, 0.20, 0.22}, 0.35, 14},  {4.35, 4.55, {0.5, 0.42, 0.4}, 0.35, 14},
    {-1.2, -4.1, {0.42, 0.50, 0.36}, 0.30, 12},  {-0.6, -4.35, {0.34, 0.28, 0.30}, 0.30, 10},
    {-1.75, -4.2, {0.30, 0.24, 0.28}, 0.30, 10}, {0.4, -4.75, {0.5, 0.34, 0.4}, 0.35, 10},
    {2.5, -5.7, {0.5, 0.66, 0.45}, 0.30, 12},    {3.1, -5.3, {0.42, 0.36, 0.4}, 0.30, 10},
};

/* Adds small rocks along the shore. */
static void add_shore_rocks(struct mesh *mesh, struct dice *dice)
{
    for (int i = 0; i < 900; i++) {
        double x = dice_between(dice, -8, 6), z = dice_between(dice, -6.5, 6.2);
        double size = 0.05 + 0.16 * pow(dice_between(dice, 0, 1), 2.5);
        struct rock rock = {x, z, {0, 0, 0}, dice_between(dice, 0.25, 0.45), size > 0.11 ? 7 : 4};
        rock.radii = vec3(size * dice_between(dice, 0.9, 1.5), size * dice_between(dice, 0.6, 1),
                          size * dice_between(dice, 0.8, 1.2));
        if (fabs(pond_distance(x, z) + 0.02) < 0.13) add_rock(mesh, dice, &rock);
    }
}

/* Flat stones from the near right bank towards the islet. */
static void add_stepping_stones(struct mesh *mesh, struct dice *dice)
{
    static const struct point2 steps[] = {{2.72, 4.75}, {2.05, 4.2},  {1.5, 3.55}, {0.8, 3.2},
                                          {0.2, 2.6},   {-0.45, 2.2}, {-0.95, 1.6}};
    for (size_t i = 0; i < COUNT(steps); i++) {
        struct mesh_mark part = mesh_mark(mesh);
        double rx = dice_between(dice, 0.27, 0.36), rz = dice_between(dice, 0.24, 0.32);
        uint32_t seed = dice_pick(dice, 1000);
        mesh_use(mesh, "stone_1");
        /* A tall ellipsoid whose top is cut off, and whose foot stands on the bed. */
        mesh_ball(mesh, vec3(0, 0, 0), vec3(rx, 0.6, rz), 16);
        struct cuts cuts = {.center = vec3(0, 0, 0)};
        for (size_t k = 0; k < CUTS; k++) {
            cuts.direction[k] =
                vec_normalize(vec3(cos((double)k * 2.4), 0.3, sin((double)k * 2.4)));
            cuts.distance[k] = dice_between(dice, 0.24, 0.32);
        }
        cuts.direction[0] = vec3(0, 1, 0);
        cuts.distance[0] = 0.085;
        mesh_bend(mesh, part, cut_point, &cuts);
        mesh_roughen(mesh, part, 0.035, 3, seed);
        mesh_roughen(mesh, part, 0.012, 12, seed + 1);
        struct mesh_transform t =
            transform_place(vec3(steps[i].x, -0.035, steps[i].y), dice_between(dice, 0, 360), 1);
        mesh_apply(mesh, part, &t);
        struct stone_paint paint = stone_colours(mesh, dice, 0.25);
        paint.stone = mesh_material(mesh, "stone_0");
        paint.dark = mesh_material(mesh, "stone_1");
        mesh_paint(mesh, part, paint_stone, &paint);
        mesh_smooth(mesh, part, 65);
    }
}

void add_stones(struct mesh *mesh)
{
    struct dice dice = {600, 0};
    for (size_t i = 0; i < COUNT(set_rocks); i++)
        add_rock(mesh, &dice, &set_rocks[i]);
    add_shore_rocks(mesh, &dice);
    add_stepping_stones(mesh, &dice);
}

static void add_pebble(struct mesh *mesh, struct dice *dice, double x, double z, double size)
{
    static const char *const names[] = {"pebble_0", "pebble_1", "pebble_2", "pebble_3"};
    double wide = dice_between(dice, 0.9, 1.5), high = dice_between(dice, 0.5, 0.8);
    mesh_use(mesh, names[dice_pick(dice, COUNT(names))]);
    mesh_ball(mesh, ground_point(x, z, size * 0.3), vec3(size * wide, size * high, size), 2);
}

/* Shingle along the water's edge. */
static void add_shingle(struct mesh *mesh, struct dice *dice)
{
    for (int i = 0; i < 10000; i++) {
        double z = dice_between(dice, -6, 5), x = dice_between(dice, -0.55, 0.55) * (10 - z);
        double size = 0.02 + 0.05 * pow(dice_between(dice, 0, 1), 3);
        if (fabs(pond_distance(x, z) - 0.02) < 0.08) add_pebble(mesh, dice, x, z, size);
    }
}

/* Adds pebbles where the bed is visible, as the water is clear and near, and along the water's edge. */
void add_pebbles(struct mesh *mesh)
{
    struct dice dice = {650, 0};
    struct mesh_mark part = mesh_mark(mesh);
    for (int i = 0; i < 2600; i++) {
        double x = dice_between(&dice, -4.6, 4.2);
        double z = 6 - 5 * pow(dice_between(&dice, 0, 1), 1.4);
        double size = 0.022 + 0.07 * pow(dice_between(&dice, 0, 1), 3);
        if (pond_distance(x, z) > 0.12 || fabs(x) > 0.52 * (9.8 - z)) continue;
        add_pebble(mesh, &dice, x, z, size);
    }
    add_shingle(mesh, &dice);
    mesh_smooth(mesh, part, 180);
}
