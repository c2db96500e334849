/* Koi below the surface of the pond, wild geese in the sky. */
#include "config/models/garden.h"
#include "config/models/scatter.h"

/* The pose and colours of a koi. Its body bends from side to side about its heading. */
struct koi {
    double x, y, z, yaw, size;
    double swing;      /* phase of the bend, radians */
    uint32_t pattern;  /* seed of its patches */
    const char *patch; /* material of the patches */
};

static struct vec3 swimming(const void *context, struct vec3 p)
{
    const struct koi *koi = context;
    double tail = 0.5 - p.x;
    return vec3(p.x, p.y, p.z + 0.10 * tail * tail * sin(4 * p.x + koi->swing));
}

struct koi_paint {
    uint32_t white, patch, seed;
};

static uint32_t paint_koi(const void *context, struct vec3 p, struct vec3 normal)
{
    const struct koi_paint *paint = context;
    bool patch =
        noise_fractal(vec3(p.x * 5, 0, p.z * 4), 2, paint->seed) > -0.05 && normal.y > -0.1;
    return patch ? paint->patch : paint->white;
}

/* A fin: a flat triangle fan from its root to its rim. */
static void add_fin(struct mesh *mesh, struct vec3 root, struct vec3 a, struct vec3 b,
                    struct vec3 c)
{
    uint32_t r = mesh_vertex(mesh, root), m = mesh_vertex(mesh, b);
    mesh_triangle(mesh, r, mesh_vertex(mesh, a), m);
    mesh_triangle(mesh, r, m, mesh_vertex(mesh, c));
}

/* Adds a koi that is modelled with a length of one metre and its nose towards +x, then scaled. */
static void add_one(struct mesh *mesh, const struct koi *koi)
{
    static const struct point2 profile[] = {{0.012, 0.06}, {0.03, 0.14},  {0.065, 0.28},
                                            {0.10, 0.45},  {0.115, 0.62}, {0.105, 0.76},
                                            {0.08, 0.87},  {0.045, 0.95}, {0, 0.985}};
    struct mesh_mark part = mesh_mark(mesh);
    mesh_use(mesh, "koi_white");
    mesh_revolve(mesh, profile, sizeof profile / sizeof profile[0], 18);
    struct mesh_transform lie = transform_turn(vec3(0, 0, 1), -90);
    lie.origin = vec3(-0.5, 0, 0);
    mesh_apply(mesh, part, &lie);
    mesh_refine(mesh, part, 0.055); /* so that the patches have smooth outlines */
    struct koi_paint paint = {mesh_material(mesh, "koi_white"), mesh_material(mesh, koi->patch),
                              koi->pattern};
    mesh_paint(mesh, part, paint_koi, &paint);
    add_fin(mesh, vec3(-0.40, 0, 0), vec3(-0.60, 0.03, 0.10), vec3(-0.53, 0, 0),
            vec3(-0.60, -0.03, -0.10));
    add_fin(mesh, vec3(0.22, -0.02, 0.09), vec3(0.12, -0.03, 0.24), vec3(0.08, -0.03, 0.20),
            vec3(0.10, -0.02, 0.09));
    add_fin(mesh, vec3(0.22, -0.02, -0.09), vec3(0.10, -0.02, -0.09), vec3(0.08, -0.03, -0.20),
            vec3(0.12, -0.03, -0.24));
    mesh_bend(mesh, part, swimming, koi);
    mesh_smooth(mesh, part, 60);
    struct mesh_transform t = transform_place(vec3(koi->x, koi->y, koi->z), koi->yaw, koi->size);
    mesh_apply(mesh, part, &t);
}

void add_koi(struct mesh *mesh)
{
    static const struct koi school[] = {
        {-0.55, -0.12, 4.25, 155, 0.50, 0.5, 901, "koi_red"},
        {0.35, -0.15, 4.05, 200, 0.46, 2.0, 905, "koi_red"},
        {-0.05, -0.18, 3.45, 120, 0.44, 3.5, 907, "koi_gold"},
        {-0.95, -0.16, 3.75, 60, 0.42, 1.2, 909, "koi_gold"},
        {1.05, -0.20, 4.55, 20, 0.46, 4.4, 911, "koi_black"},
    };
    for (size_t i = 0; i < sizeof school / sizeof school[0]; i++)
        add_one(mesh, &school[i]);
}

/* A wing: out from the shoulder and up, then level to the tip. side: 1 left, -1 right. */
static void add_wing(struct mesh *mesh, double side, double beat)
{
    double elbow = 0.16 + 0.14 * beat, tip = elbow - 0.02 + 0.12 * beat;
    uint32_t front = mesh_vertex(mesh, vec3(0.12, 0.03, side * 0.04));
    uint32_t back = mesh_vertex(mesh, vec3(-0.16, 0.03, side * 0.04));
    uint32_t elbow_front = mesh_vertex(mesh, vec3(0.20, elbow, side * 0.36));
    uint32_t elbow_back = mesh_vertex(mesh, vec3(-0.08, elbow, side * 0.36));
    uint32_t end = mesh_vertex(mesh, vec3(-0.06, tip, side * 0.84));
    mesh_quad(mesh, front, elbow_front, elbow_back, back);
    mesh_triangle(mesh, elbow_front, end, elbow_back);
}

static void add_goose(struct mesh *mesh, double beat)
{
    mesh_ball(mesh, vec3(0, 0, 0), vec3(0.30, 0.085, 0.085), 4);
    mesh_ball(mesh, vec3(0.36, 0.03, 0), vec3(0.20, 0.032, 0.032), 3);
    mesh_ball(mesh, vec3(0.55, 0.045, 0), vec3(0.065, 0.04, 0.035), 3);
    add_wing(mesh, 1, beat);
    add_wing(mesh, -1, beat);
}

/* A skein of geese on its way past the moon. */
void add_geese(struct mesh *mesh)
{
    /* Positions relative to the leader: metres behind and to the side. */
    static const struct vec3 places[] = {
        {0, 0, 0},          {-1.9, -0.75, 1.2}, {-3.7, -1.5, 2.2}, {-5.6, -2.2, 3.3},
        {-2.1, 0.55, -1.3}, {-4.0, 1.15, -2.6}, {-6.2, 1.7, -3.8},
    };
    struct dice dice = {950, 0};
    mesh_use(mesh, "goose");
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        struct mesh_mark part = mesh_mark(mesh);
        add_goose(mesh, dice_between(&dice, -1, 1));
        struct vec3 wander = vec_scale(dice_direction(&dice), 0.18);
        struct vec3 at = vec_add(vec3(-9.2, 16.2, -58), vec_add(places[i], wander));
        struct mesh_transform t = transform_place(at, 14, 1);
        mesh_apply(mesh, part, &t);
    }
}
