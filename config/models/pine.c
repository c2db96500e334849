/*
 * The pine: a black pine trained as a garden tree (niwaki), with a sinuous trunk and bare limbs that end in flat clouds
 * of needles. The lowest limb reaches far out over the water.
 */
#include "config/models/garden.h"
#include "config/models/scatter.h"

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

static const struct vec3 trunk[] = {
    {3.20, -0.15, -2.10}, {3.12, 0.35, -2.02}, {2.86, 0.95, -1.85}, {3.18, 1.62, -1.95},
    {3.02, 2.25, -2.10},  {2.42, 2.72, -2.02}, {2.36, 3.25, -2.05}, {2.10, 3.78, -2.05},
};

/* Where a limb leaves the trunk (0 foot .. 1 tip), the point where it bends, and its cloud. */
static const struct cloud {
    double leaves;
    struct vec3 bend, center;
    struct vec3 radii;
    double thick; /* radius of the limb where it leaves the trunk, metres */
} clouds[] = {
    {0.98, {2.10, 3.80, -2.05}, {2.05, 3.98, -2.05}, {0.72, 0.30, 0.60}, 0.035},
    {0.80, {2.75, 3.18, -2.20}, {3.05, 3.42, -2.35}, {0.62, 0.26, 0.55}, 0.045},
    {0.82, {1.85, 3.05, -1.90}, {1.28, 3.22, -1.85}, {0.72, 0.27, 0.58}, 0.050},
    {0.60, {3.45, 2.55, -2.10}, {3.85, 2.82, -2.05}, {0.78, 0.29, 0.62}, 0.060},
    {0.66, {2.05, 2.55, -1.55}, {1.75, 2.58, -1.25}, {0.62, 0.24, 0.50}, 0.050},
    {0.52, {2.95, 2.15, -2.70}, {2.85, 2.35, -3.05}, {0.75, 0.27, 0.60}, 0.055},
    {0.42, {3.75, 1.80, -1.75}, {4.35, 2.02, -1.60}, {0.80, 0.28, 0.62}, 0.065},
    {0.40, {2.65, 1.62, -1.35}, {2.42, 1.72, -0.95}, {0.52, 0.20, 0.44}, 0.050},
};

/* The long limb over the water and the clouds along it. */
static const struct vec3 long_limb[] = {
    {2.98, 1.25, -1.88}, {2.35, 1.62, -1.70}, {1.70, 1.58, -1.50},
    {1.10, 1.86, -1.42}, {0.45, 1.62, -1.25}, {-0.25, 1.52, -1.12},
};
static const struct cloud long_clouds[] = {
    {0.42, {1.55, 1.75, -1.65}, {1.42, 1.98, -1.80}, {0.58, 0.22, 0.48}, 0.035},
    {0.62, {0.95, 1.95, -1.30}, {0.78, 2.10, -1.20}, {0.60, 0.23, 0.50}, 0.035},
    {0.84, {0.20, 1.72, -1.30}, {0.10, 1.84, -1.42}, {0.52, 0.20, 0.44}, 0.028},
    {0.98, {-0.25, 1.52, -1.10}, {-0.42, 1.56, -1.02}, {0.56, 0.21, 0.46}, 0.024},
};

static const char *const greens[] = {"pine_0", "pine_1", "pine_2", "pine_3"};

/* Adds a bundle of needles. light: from 0 (the shade below a cloud) to 1 (its sunlit top). */
static void add_tuft(struct mesh *mesh, struct dice *dice, struct vec3 base, struct vec3 axis,
                     double light)
{
    double shade = fmin(3.99, fmax(0, 4 * light + dice_between(dice, -0.9, 0.9)));
    mesh_use(mesh, greens[(size_t)shade]);
    for (int i = 0; i < 17; i++) {
        struct vec3 direction = dice_cone(dice, axis, 58);
        double length = dice_between(dice, 0.085, 0.14);
        add_needle(mesh, base, direction, length, 0.0048);
    }
}

/* Adds a cloud's tufts, on the upper half of an ellipsoid and a little below its rim. */
static void add_tufts(struct mesh *mesh, struct dice *dice, const struct cloud *cloud)
{
    double area = cloud->radii.x * cloud->radii.z;
    int count = (int)(760 * area);
    uint32_t seed = dice_pick(dice, 1000);
    for (int i = 0; i < count; i++) {
        struct vec3 d = dice_direction(dice);
        if (d.y < -0.15) d.y = -d.y;
        /* Lobes, as a cloud consists of many small tufts of twigs. */
        double lobe = 0.86 + 0.24 * noise(vec3(d.x * 2.2, d.y * 2.2, d.z * 2.2), seed);
        lobe *= dice_between(dice, 0.82, 1);
        struct vec3 p = vec3(d.x * cloud->radii.x * lobe, d.y * cloud->radii.y * lobe,
                             d.z * cloud->radii.z * lobe);
        struct vec3 axis = vec_normalize(vec3(d.x * 0.75, 0.65 + 0.3 * d.y, d.z * 0.75));
        double light = 0.15 + 0.55 * d.y + 0.9 * (lobe - 0.75);
        add_tuft(mesh, dice, vec_add(cloud->center, p), axis, light);
    }
}

/* Bare twigs from the end of the limb to the underside of the cloud. */
static void add_twigs(struct mesh *mesh, struct dice *dice, const struct cloud *cloud,
                      struct vec3 hub)
{
    mesh_use(mesh, "bark_1");
    for (int i = 0; i < 14; i++) {
        double angle = dice_between(dice, 0, 2 * PI), r = dice_between(dice, 0.5, 0.95);
        struct vec3 end = vec_add(cloud->center, vec3(cloud->radii.x * r * cos(angle), 0.02,
                                                      cloud->radii.z * r * sin(angle)));
        struct vec3 middle = vec_mix(hub, end, 0.5);
        middle.y += dice_between(dice, -0.05, 0.02);
        struct vec3 points[] = {hub, middle, end};
        struct limb twig = {points, COUNT(points), 0.011, 0.004, 5, 5};
        add_limb(mesh, &twig);
    }
}

static void add_cloud(struct mesh *mesh, struct dice *dice, const struct cloud *cloud,
                      struct vec3 root)
{
    struct vec3 hub = vec_add(cloud->center, vec3(0, -0.35 * cloud->radii.y, 0));
    struct vec3 points[] = {root, cloud->bend, hub};
    struct limb limb = {points, COUNT(points), cloud->thick, 0.014, 16, 9};
    struct mesh_mark part = mesh_mark(mesh);
    mesh_use(mesh, "bark_1");
    add_limb(mesh, &limb);
    mesh_roughen(mesh, part, 0.008, 12, 71);
    add_twigs(mesh, dice, cloud, hub);
    mesh_smooth(mesh, part, 60);
    add_tufts(mesh, dice, cloud);
}

/* Displaces a point for plates of bark, which are elongated along the limb, with deep gaps between them. */
static struct vec3 bark_point(const void *context, struct vec3 p)
{
    (void)context;
    struct vec3 q = vec3(p.x * 11, p.y * 5.5, p.z * 11);
    double plate = fabs(noise(q, 72)), push = 0.045 * (fmin(plate, 0.35) - 0.2);
    struct vec3 axis = vec3(0, 0, 0);
    double nearest = 1e9;
    for (int i = 0; i <= 120; i++) {
        struct vec3 c = curve_at(trunk, COUNT(trunk), i / 120.0);
        double distance = vec_length(vec_sub(p, c));
        if (distance < nearest) nearest = distance, axis = c;
    }
    if (nearest < 0.03) return p;
    return vec_add_scaled(p, vec_sub(p, axis), push / nearest);
}

static uint32_t paint_bark(const void *context, struct vec3 p, struct vec3 normal)
{
    const uint32_t *materials = context;
    (void)normal;
    double plate = fabs(noise(vec3(p.x * 11, p.y * 5.5, p.z * 11), 72));
    return materials[plate < 0.12 ? 2 : plate < 0.3 ? 1 : 0];
}

static void add_trunk(struct mesh *mesh)
{
    uint32_t materials[] = {mesh_material(mesh, "bark_0"), mesh_material(mesh, "bark_1"),
                            mesh_material(mesh, "bark_2")};
    struct mesh_mark part = mesh_mark(mesh);
    mesh_use(mesh, "bark_0");
    struct limb limb = {trunk, COUNT(trunk), 0.25, 0.05, 96, 36};
    add_limb(mesh, &limb);
    /* Roots that grip the ground. */
    for (int i = 0; i < 6; i++) {
        double angle = 2 * PI * (i + 0.3 * chance(73, (uint32_t)i)) / 6;
        double x = trunk[0].x + 0.75 * cos(angle), z = trunk[0].z + 0.65 * sin(angle);
        struct vec3 points[] = {
            vec_add(trunk[1], vec3(0.05 * cos(angle), 0.05, 0.05 * sin(angle))),
            ground_point(trunk[0].x + 0.3 * cos(angle), trunk[0].z + 0.28 * sin(angle), 0.06),
            ground_point(x, z, -0.06)};
        struct limb root = {points, COUNT(points), 0.15, 0.035, 24, 14};
        add_limb(mesh, &root);
    }
    mesh_bend(mesh, part, bark_point, NULL);
    mesh_paint(mesh, part, paint_bark, materials);
    mesh_smooth(mesh, part, 60);
}

static void add_long_limb(struct mesh *mesh, struct dice *dice)
{
    struct mesh_mark part = mesh_mark(mesh);
    struct limb limb = {long_limb, COUNT(long_limb), 0.095, 0.024, 72, 16};
    mesh_use(mesh, "bark_1");
    add_limb(mesh, &limb);
    mesh_roughen(mesh, part, 0.014, 10, 74);
    mesh_smooth(mesh, part, 60);
    for (size_t i = 0; i < COUNT(long_clouds); i++)
        add_cloud(mesh, dice, &long_clouds[i],
                  curve_at(long_limb, COUNT(long_limb), long_clouds[i].leaves));
}

void add_pine(struct mesh *mesh)
{
    struct dice dice = {700, 0};
    add_trunk(mesh);
    for (size_t i = 0; i < COUNT(clouds); i++)
        add_cloud(mesh, &dice, &clouds[i], curve_at(trunk, COUNT(trunk), clouds[i].leaves));
    add_long_limb(mesh, &dice);
}
