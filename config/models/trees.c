/* Trees and bushes: a maple, clipped azaleas, and the wood behind the garden. */
#include "config/models/garden.h"
#include "config/models/scatter.h"

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

/* ---- leaves on a dome: maple crowns and azaleas ---- */

struct dome {
    struct vec3 center, radii;
    int leaves;
    double size; /* of a leaf, metres */
};

/* The material of a leaf; it is brighter where the dome faces up. */
static const char *leaf_colour(struct dice *dice, const char *const names[4], double light)
{
    double shade = fmin(3.99, fmax(0, 4 * light + dice_between(dice, -1.2, 1.2)));
    return names[(size_t)shade];
}

static void add_leaves(struct mesh *mesh, struct dice *dice, const struct dome *dome, double lowest,
                       double depth, const char *const names[4])
{
    uint32_t seed = dice_pick(dice, 1000);
    for (int i = 0; i < dome->leaves; i++) {
        struct vec3 d = dice_direction(dice);
        if (d.y < lowest) d.y = -d.y;
        double r = 1 + 0.15 * noise(vec_scale(d, 2.5), seed) - dice_between(dice, 0, depth);
        struct vec3 p = vec_add(dome->center, vec3(d.x * dome->radii.x * r, d.y * dome->radii.y * r,
                                                   d.z * dome->radii.z * r));
        struct vec3 normal = dice_cone(dice, vec_normalize(vec3(d.x, d.y + 0.4, d.z)), 50);
        struct vec3 across, along;
        frame_about(normal, &across, &along);
        double turn = dice_between(dice, 0, 2 * PI),
               size = dome->size * dice_between(dice, 0.7, 1.3);
        struct vec3 a = vec_add_scaled(vec_scale(along, cos(turn)), across, sin(turn));
        mesh_use(mesh, leaf_colour(dice, names, 0.3 + 0.45 * d.y));
        add_leaf(mesh, p, a, vec_cross(a, normal), size, size * 0.8);
    }
}

void add_maple(struct mesh *mesh)
{
    static const char *const reds[4] = {"maple_0", "maple_1", "maple_2", "maple_3"};
    static const struct vec3 trunk[] = {
        {-4.9, 0.1, -6.9}, {-4.8, 0.9, -6.8}, {-5.1, 1.7, -6.7}, {-4.8, 2.6, -6.6}};
    static const struct dome crowns[] = {
        {{-4.75, 3.35, -6.6}, {0.95, 0.42, 0.8}, 2000, 0.085},
        {{-5.75, 2.95, -6.6}, {0.95, 0.38, 0.8}, 1900, 0.085},
        {{-3.75, 2.85, -6.4}, {0.95, 0.36, 0.8}, 1900, 0.085},
        {{-4.55, 2.55, -6.0}, {0.90, 0.32, 0.7}, 1600, 0.085},
        {{-6.35, 2.30, -6.3}, {0.80, 0.32, 0.7}, 1500, 0.085},
        {{-3.05, 2.20, -6.2}, {0.75, 0.30, 0.7}, 1400, 0.085},
        {{-5.35, 2.10, -5.9}, {0.70, 0.26, 0.6}, 1100, 0.085},
    };
    struct dice dice = {800, 0};
    struct mesh_mark part = mesh_mark(mesh);
    struct limb stem = {trunk, COUNT(trunk), 0.12, 0.05, 30, 12};
    mesh_use(mesh, "bark_2");
    add_limb(mesh, &stem);
    for (size_t i = 0; i < COUNT(crowns); i++) {
        struct vec3 fork = curve_at(trunk, COUNT(trunk), 0.45 + 0.07 * (double)i);
        struct vec3 middle = vec_add(vec_mix(fork, crowns[i].center, 0.55), vec3(0, -0.12, 0));
        struct vec3 points[] = {fork, middle, crowns[i].center};
        struct limb limb = {points, COUNT(points), 0.045, 0.012, 14, 8};
        add_limb(mesh, &limb);
    }
    mesh_smooth(mesh, part, 80);
    for (size_t i = 0; i < COUNT(crowns); i++)
        add_leaves(mesh, &dice, &crowns[i], -0.5, 0.5, reds);
}

void add_shrubs(struct mesh *mesh)
{
    static const char *const greens[4] = {"azalea_0", "azalea_1", "azalea_2", "azalea_3"};
    static const struct dome shrubs[] = {
        {{-2.6, 0, -5.6}, {0.85, 0.62, 0.75}, 1500, 0.06},
        {{-1.45, 0, -5.9}, {0.7, 0.55, 0.65}, 1200, 0.06},
        {{1.25, 0, -5.5}, {0.9, 0.6, 0.8}, 1500, 0.06},
        {{0.1, 0, -6.6}, {1.1, 0.85, 0.9}, 1700, 0.065},
        {{4.0, 0, -4.4}, {1.0, 0.75, 0.85}, 1600, 0.06},
        {{5.3, 0, -2.9}, {0.9, 0.7, 0.8}, 1500, 0.06},
        {{-6.0, 0, -1.6}, {0.9, 0.7, 0.8}, 1500, 0.06},
        {{-7.2, 0, -2.6}, {1.0, 0.85, 0.9}, 1500, 0.06},
        {{4.9, 0, 2.1}, {0.6, 0.5, 0.6}, 1400, 0.05},
        {{-5.6, 0, 2.1}, {0.8, 0.7, 0.8}, 1700, 0.05},
        {{5.9, 0, -5.4}, {1.3, 1.0, 1.1}, 1700, 0.07},
        {{-8.3, 0, -6.6}, {1.3, 1.0, 1.1}, 1700, 0.07},
    };
    struct dice dice = {820, 0};
    for (size_t i = 0; i < COUNT(shrubs); i++) {
        struct dome dome = shrubs[i];
        dome.center = ground_point(dome.center.x, dome.center.z, 0.05);
        struct mesh_mark part = mesh_mark(mesh);
        mesh_use(mesh, "azalea_0");
        mesh_ball(mesh, dome.center, vec_scale(dome.radii, 0.9), 8);
        mesh_smooth(mesh, part, 180);
        add_leaves(mesh, &dice, &dome, 0, 0.12, greens);
    }
}

/* ---- the wood behind the garden: cedars and round crowns, in the evening's haze ---- */

static void add_cedar(struct mesh *mesh, struct vec3 foot, double height, uint32_t seed)
{
    enum { TIERS = 9 };
    struct point2 profile[2 * TIERS + 2];
    size_t count = 0;
    profile[count++] = (struct point2){0.03 * height, 0};
    for (int i = 0; i < TIERS; i++) {
        double t = (double)i / TIERS, r = 0.2 * height * pow(1 - t, 0.8);
        profile[count++] = (struct point2){r, (0.1 + 0.86 * t) * height};
        profile[count++] = (struct point2){0.6 * r, (0.1 + 0.86 * (t + 0.75 / TIERS)) * height};
    }
    profile[count++] = (struct point2){0, height};
    struct mesh_mark part = mesh_mark(mesh);
    mesh_revolve(mesh, profile, count, 18);
    mesh_roughen(mesh, part, 0.05 * height, 5 / height, seed);
    mesh_roughen(mesh, part, 0.03 * height, 14 / height, seed + 1);
    struct mesh_transform t = transform_place(foot, 0, 1);
    mesh_apply(mesh, part, &t);
    mesh_smooth(mesh, part, 70);
}

static void add_round_tree(struct mesh *mesh, struct dice *dice, struct vec3 foot, double height,
                           const char *const greens[4])
{
    struct mesh_mark part = mesh_mark(mesh);
    uint32_t seed = dice_pick(dice, 1000);
    struct vec3 center = vec_add(foot, vec3(0, 0.5 * height, 0));
    struct dome crown = {center, vec3(0.55 * height, 0.5 * height, 0.45 * height),
                         foot.z > -18 ? 760 : 360, (foot.z > -18 ? 0.09 : 0.12) * height};
    mesh_use(mesh, greens[0]);
    mesh_ball(mesh, center, vec_scale(crown.radii, 0.85), 6);
    mesh_roughen(mesh, part, 0.14 * height, 4 / height, seed);
    mesh_smooth(mesh, part, 180);
    add_leaves(mesh, dice, &crown, -0.3, 0.3, greens);
}

void add_forest(struct mesh *mesh)
{
    /* Haze makes farther trees lighter. */
    static const char *const woods[][4] = {{"wood_0", "wood_0", "wood_1", "wood_1"},
                                           {"wood_2", "wood_2", "wood_3", "wood_3"},
                                           {"wood_4", "wood_4", "wood_5", "wood_5"}};
    struct dice dice = {840, 0};
    for (int i = 0; i < 64; i++) {
        double z = dice_between(&dice, -34, -12);
        double x = dice_between(&dice, -0.52, 0.52) * (9 - z) * 1.1;
        double height = dice_between(&dice, 1.8, 3.6) * (z < -20 ? 1.25 : 1);
        bool cedar = dice_pick(&dice, 3) == 0;
        const char *const *greens = woods[z > -18 ? 0 : z > -25 ? 1 : 2];
        /* The wood has a gap where the moon rises. */
        if (fabs(x / (9 - z) + 0.08) < 0.1 && z > -26) continue;
        mesh_use(mesh, greens[0]);
        if (cedar)
            add_cedar(mesh, ground_point(x, z, 0), height * 1.5, 850 + 2 * (uint32_t)i);
        else
            add_round_tree(mesh, &dice, ground_point(x, z, -0.1), height, greens);
    }
}
