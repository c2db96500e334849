/* Irises, water lilies and grass. */
#include "config/models/garden.h"
#include "config/models/scatter.h"

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

/* ---- irises ---- */

/* A sword-shaped leaf that grows up from the ground and bends over towards `lean`. */
struct blade {
    struct vec3 foot, lean;
    double height, width, bow;
};

static void add_blade(struct mesh *mesh, const struct blade *blade)
{
    enum { STEPS = 5 };
    struct vec3 side = vec_normalize(vec_cross(vec3(0, 1, 0), blade->lean));
    uint32_t before[2] = {0, 0};
    for (int i = 0; i <= STEPS; i++) {
        double t = (double)i / STEPS, half = blade->width / 2 * (1 - t * t);
        struct vec3 p = vec_add_scaled(blade->foot, blade->lean, blade->bow * t * t);
        p.y += blade->height * t * (1 - 0.25 * blade->bow * t);
        if (i == STEPS) {
            mesh_triangle(mesh, before[0], before[1], mesh_vertex(mesh, p));
            break;
        }
        uint32_t a = mesh_vertex(mesh, vec_add_scaled(p, side, -half));
        uint32_t b = mesh_vertex(mesh, vec_add_scaled(p, side, half));
        if (i > 0) mesh_quad(mesh, before[0], before[1], b, a);
        before[0] = a;
        before[1] = b;
    }
}

static struct blade random_blade(struct dice *dice, struct vec3 foot, double height, double width)
{
    double angle = dice_between(dice, 0, 2 * PI);
    return (struct blade){foot, vec3(cos(angle), 0, sin(angle)),
                          height * dice_between(dice, 0.6, 1.1), width,
                          height * dice_between(dice, 0.08, 0.4)};
}

/* A spoon-shaped petal that arches outward and down. */
struct petal {
    struct vec3 center, out;
    double length, rise;
};

static struct vec3 petal_point(const void *context, double u, double v)
{
    const struct petal *petal = context;
    struct vec3 side = vec_cross(petal->out, vec3(0, 1, 0));
    double width = petal->length * 0.75 * sin(PI * (0.08 + 0.9 * v)) * (u - 0.5);
    struct vec3 p = vec_add_scaled(petal->center, petal->out, petal->length * v);
    p = vec_add_scaled(p, side, width);
    p.y += petal->rise * sin(PI * 0.9 * v) -
           petal->length * 0.8 * v * v * (petal->rise > 0.04 ? 0 : 1);
    return p;
}

static void add_iris(struct mesh *mesh, struct dice *dice, struct vec3 foot)
{
    struct vec3 top =
        vec_add(foot, vec3(dice_between(dice, -0.06, 0.06), dice_between(dice, 0.5, 0.66),
                           dice_between(dice, -0.06, 0.06)));
    struct vec3 stem[] = {foot, vec_mix(foot, top, 0.5), top};
    struct limb limb = {stem, COUNT(stem), 0.007, 0.006, 5, 5};
    mesh_use(mesh, "iris_leaf_1");
    add_limb(mesh, &limb);
    double turn = dice_between(dice, 0, 2 * PI);
    for (int i = 0; i < 6; i++) {
        double angle = turn + 2 * PI * i / 6;
        bool standard = i % 2 == 1; /* three petals stand up, three hang down */
        struct petal petal = {top, vec3(cos(angle), 0, sin(angle)), standard ? 0.045 : 0.095,
                              standard ? 0.075 : 0.03};
        mesh_use(mesh, standard ? "iris_1" : "iris_0");
        mesh_grid(mesh, 4, 6, petal_point, &petal);
    }
    mesh_use(mesh, "iris_heart");
    mesh_ball(mesh, vec_add(top, vec3(0, 0.012, 0)), vec3(0.014, 0.02, 0.014), 2);
}

void add_irises(struct mesh *mesh)
{
    static const struct clump {
        double x, z, radius;
        int blades, flowers;
    } clumps[] = {
        {-1.95, 4.95, 0.25, 60, 6}, {2.75, 3.3, 0.28, 60, 6},   {-2.5, -0.55, 0.2, 30, 3},
        {-3.3, 3.2, 0.3, 50, 4},    {-1.3, -0.45, 0.25, 40, 4}, {3.5, 1.6, 0.3, 50, 4},
        {-5.1, -0.6, 0.35, 50, 3},  {0.7, -4.2, 0.3, 40, 3},
    };
    struct dice dice = {860, 0};
    struct mesh_mark part = mesh_mark(mesh);
    for (size_t i = 0; i < COUNT(clumps); i++) {
        const struct clump *c = &clumps[i];
        for (int k = 0; k < c->blades + c->flowers; k++) {
            double angle = dice_between(&dice, 0, 2 * PI),
                   r = c->radius * sqrt(dice_between(&dice, 0, 1));
            struct vec3 foot = ground_point(c->x + r * cos(angle), c->z + r * sin(angle), -0.02);
            if (k >= c->blades) {
                foot.y = fmax(foot.y, -0.1);
                add_iris(mesh, &dice, foot);
                continue;
            }
            mesh_use(mesh, k % 3 == 0 ? "iris_leaf_0" : k % 3 == 1 ? "iris_leaf_1" : "iris_leaf_2");
            struct blade blade = random_blade(&dice, foot, 0.62, 0.022);
            add_blade(mesh, &blade);
        }
    }
    mesh_smooth(mesh, part, 60);
}

/* ---- water lilies ---- */

static void add_lily_leaf(struct mesh *mesh, struct dice *dice, struct vec3 at, double radius)
{
    enum { POINTS = 22 };
    double turn = dice_between(dice, 0, 2 * PI);
    struct vec3 tilt = vec3(dice_between(dice, -0.03, 0.03), 0, dice_between(dice, -0.03, 0.03));
    uint32_t rim[POINTS], middle = mesh_vertex(mesh, vec_add(at, vec3(0, -0.004, 0)));
    for (int i = 0; i < POINTS; i++) {
        /* The rim leaves a notch of a tenth of the circle. */
        double angle = turn + 2 * PI * 0.9 * i / (POINTS - 1);
        double r = radius * (1 + 0.04 * sin(5 * angle));
        double x = r * cos(angle), z = -r * sin(angle);
        rim[i] = mesh_vertex(mesh, vec_add(at, vec3(x, tilt.x * x + tilt.z * z + 0.006, z)));
    }
    for (int i = 0; i + 1 < POINTS; i++)
        mesh_triangle(mesh, middle, rim[i], rim[i + 1]);
}

static void add_lily_flower(struct mesh *mesh, struct dice *dice, struct vec3 at)
{
    double turn = dice_between(dice, 0, 2 * PI);
    for (int ring = 0; ring < 3; ring++)
        for (int i = 0; i < 9; i++) {
            double angle = turn + 2 * PI * (i + 0.5 * ring) / 9, open = 75 - 27 * ring;
            double s = sin(open * PI / 180), c = cos(open * PI / 180);
            struct vec3 along = vec3(cos(angle) * s, c, sin(angle) * s);
            struct vec3 across = vec3(-sin(angle), 0, cos(angle));
            mesh_use(mesh, ring == 0 ? "lily_0" : "lily_1");
            add_leaf(mesh, at, along, across, 0.095 - 0.012 * ring, 0.04);
        }
    mesh_use(mesh, "iris_heart");
    mesh_ball(mesh, vec_add(at, vec3(0, 0.02, 0)), vec3(0.016, 0.02, 0.016), 2);
}

void add_lilies(struct mesh *mesh)
{
    static const struct point2 groups[] = {{-1.9, 3.4}, {1.9, 1.5}, {-3.9, -1.6}, {0.3, -2.4}};
    static const char *const names[] = {"lily_leaf_0", "lily_leaf_1", "lily_leaf_2"};
    struct dice dice = {880, 0};
    for (size_t g = 0; g < COUNT(groups); g++)
        for (int i = 0; i < 13; i++) {
            double angle = 2.4 * i, r = 0.2 * sqrt((double)i) + dice_between(&dice, 0, 0.05);
            double x = groups[g].x + 1.3 * r * cos(angle), z = groups[g].y + r * sin(angle);
            double radius = dice_between(&dice, 0.08, 0.14);
            if (pond_distance(x, z) > -0.3) continue;
            mesh_use(mesh, names[dice_pick(&dice, COUNT(names))]);
            add_lily_leaf(mesh, &dice, vec3(x, 0.016, z), radius);
            if (i % 5 == 2) add_lily_flower(mesh, &dice, vec3(x + 0.1, 0.02, z + 0.06));
        }
}

/* Short grass along the banks, thickest where the viewer stands. */
void add_grass(struct mesh *mesh)
{
    static const char *const names[] = {"grass_0", "grass_1", "grass_2"};
    struct dice dice = {890, 0};
    for (int i = 0; i < 30000; i++) {
        double z = dice_between(&dice, -6, 7), x = dice_between(&dice, -0.55, 0.55) * (10.5 - z);
        double d = pond_distance(x, z), patch = noise(vec3(x * 1.2, 0, z * 1.2), 91);
        if (d < 0.1 || patch < -0.05 || ground_height(x, z) < 0.08) continue;
        double height = 0.05 + 0.09 * patch;
        mesh_use(mesh, names[dice_pick(&dice, COUNT(names))]);
        struct vec3 up = dice_cone(&dice, vec3(0, 1, 0), 35);
        add_needle(mesh, ground_point(x, z, -0.01), up, height * dice_between(&dice, 0.7, 1.4),
                   0.005);
    }
}
