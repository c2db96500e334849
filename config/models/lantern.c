/* The stone lantern of the paper's picture CG1. Built from the ground upwards, in metres. */
#include "config/models/lantern.h"

#include <stdlib.h>

#include "config/models/models.h"
#include "config/models/stonework.h"

#define SIDES STONEWORK_SIDES

/* Converts a number of points at detail 1 to that at this detail. */
static size_t scaled(double count, double detail)
{
    double n = floor(count * detail + 0.5);
    return n < 4 ? 4 : (size_t)n;
}

static void finish_stone(struct mesh *mesh, struct mesh_mark from, const struct lantern *lantern,
                         double crease)
{
    const struct stone stone = {lantern->moss, lantern->seed};
    stone_finish(mesh, from, &stone, crease);
}

/* ---- base, shaft, platform ---- */

static void add_base(struct mesh *mesh, const struct lantern *lantern)
{
    double step = 0.012 / lantern->detail;
    struct profile profile;
    struct mesh_mark from = mesh_mark(mesh);
    profile_start(&profile, 0.30, 0, 0.015 / lantern->detail);
    profile_line(&profile, 0.545, 0);
    profile_line(&profile, 0.555, 0.01);
    profile_line(&profile, 0.555, 0.10);
    profile_curve(&profile, 0.555, 0.12, 0.535, 0.12);
    profile_line(&profile, 0.36, 0.125);
    profile_cut(mesh, &profile, 0.03, scaled(44, lantern->detail));
    finish_stone(mesh, from, lantern, 40);

    from = mesh_mark(mesh);
    profile_start(&profile, 0.30, 0.11, 0.65 * step);
    profile_line(&profile, 0.40, 0.11);
    profile_curve(&profile, 0.425, 0.13, 0.415, 0.165);
    profile_curve(&profile, 0.385, 0.25, 0.25, 0.282);
    profile_curve(&profile, 0.195, 0.295, 0.19, 0.325);
    profile_line(&profile, 0.12, 0.335);
    profile_turn(mesh, &profile, scaled(480, lantern->detail));
    const struct petals petals = {.root = 0.298,
                                  .tip = 0.128,
                                  .inner = 0.19,
                                  .count = 10,
                                  .relief = 0.058,
                                  .direction = {0.85, 0.45, 0}};
    mesh_bend(mesh, from, petals_carve, &petals);
    finish_stone(mesh, from, lantern, 65);
}

/* A band around the shaft that stands out by height, between two thin ones. */
static void profile_band(struct profile *profile, double radius, double y, double height)
{
    const double thin = 0.022, wide = 0.05, r = radius;
    profile_line(profile, r, y - wide / 2 - thin);
    profile_curve(profile, r + height, y - wide / 2 - thin, r + height * 0.55, y - wide / 2);
    profile_line(profile, r + height * 0.35, y - wide / 2);
    profile_curve(profile, r + height * 1.7, y, r + height * 0.35, y + wide / 2);
    profile_line(profile, r + height * 0.55, y + wide / 2);
    profile_curve(profile, r + height, y + wide / 2 + thin, r, y + wide / 2 + thin);
}

static void add_shaft(struct mesh *mesh, const struct lantern *lantern)
{
    struct profile profile;
    struct mesh_mark from = mesh_mark(mesh);
    profile_start(&profile, 0.10, 0.30, 0.012 / lantern->detail);
    profile_line(&profile, 0.168, 0.305);
    profile_line(&profile, 0.168, 0.345);
    profile_curve(&profile, 0.148, 0.36, 0.145, 0.385);
    profile_band(&profile, 0.140, 0.44, 0.022);
    profile_band(&profile, 0.134, 0.69, 0.036);
    profile_band(&profile, 0.138, 0.94, 0.022);
    profile_line(&profile, 0.145, 0.99);
    profile_curve(&profile, 0.148, 1.015, 0.168, 1.03);
    profile_line(&profile, 0.168, 1.06);
    profile_line(&profile, 0.10, 1.065);
    profile_turn(mesh, &profile, scaled(120, lantern->detail));
    finish_stone(mesh, from, lantern, 40);
}

/* A long panel sunk into each side of the platform. */
static struct vec3 sink_panels(const void *context, struct vec3 p)
{
    (void)context;
    double angle = atan2(p.z, p.x), sixth = PI / 3;
    double face = (floor(angle / sixth) + 0.5) * sixth;
    double out = p.x * cos(face) + p.z * sin(face), along = p.z * cos(face) - p.x * sin(face);
    if (out < 0.36) return p;
    double margin = fmin(0.175 - fabs(along), 0.030 - fabs(p.y - 1.295));
    double depth = 0.016 * fmin(fmax(margin / 0.010, 0), 1);
    return vec3(p.x - depth * cos(face), p.y, p.z - depth * sin(face));
}

static void add_platform(struct mesh *mesh, const struct lantern *lantern)
{
    double step = 0.012 / lantern->detail;
    struct profile profile;
    struct mesh_mark from = mesh_mark(mesh);
    profile_start(&profile, 0.10, 1.04, 0.65 * step);
    profile_line(&profile, 0.185, 1.045);
    profile_curve(&profile, 0.195, 1.075, 0.24, 1.09);
    profile_curve(&profile, 0.385, 1.13, 0.410, 1.225);
    profile_line(&profile, 0.400, 1.245);
    profile_line(&profile, 0.30, 1.25);
    profile_turn(mesh, &profile, scaled(480, lantern->detail));
    const struct petals petals = {.root = 1.068,
                                  .tip = 1.238,
                                  .inner = 0.19,
                                  .count = 10,
                                  .relief = 0.050,
                                  .direction = {0.85, -0.45, 0}};
    mesh_bend(mesh, from, petals_carve, &petals);
    finish_stone(mesh, from, lantern, 65);

    from = mesh_mark(mesh);
    profile_start(&profile, 0.30, 1.24, step);
    profile_line(&profile, 0.465, 1.243);
    profile_curve(&profile, 0.475, 1.243, 0.475, 1.253);
    profile_line(&profile, 0.475, 1.337);
    profile_curve(&profile, 0.475, 1.347, 0.465, 1.347);
    profile_line(&profile, 0.37, 1.352);
    profile_line(&profile, 0.365, 1.375);
    profile_line(&profile, 0.34, 1.378);
    profile_line(&profile, 0.10, 1.378);
    profile_cut(mesh, &profile, 0.02, scaled(44, lantern->detail));
    mesh_bend(mesh, from, sink_panels, NULL);
    finish_stone(mesh, from, lantern, 40);
}

/* ---- fire box: foot on y = 0 ---- */

#define BOX_RADIUS 0.305 /* of the outer corners */
#define BOX_HEIGHT 0.42
#define BOX_WALL   0.045

enum window { WINDOW_ARCH, WINDOW_ROUND };

/* The distance of the opening's edge from its middle in the direction (dx, dy). */
static double window_edge(enum window window, double dx, double dy)
{
    if (window == WINDOW_ROUND) return 0.090;
    /* a rectangle with rounded shoulders and the point of an ogee arch on top */
    const double half_width = 0.100, bottom = 0.150, top = 0.125;
    double flat = half_width / fmax(fabs(dx), 1e-9);
    if (dy < 0) return fmin(flat, bottom / -dy);
    double arch = 1 / pow(pow(fabs(dx) / half_width, 3) + pow(dy / top, 3), 1.0 / 3);
    double angle = atan2(fabs(dx), dy);
    return fmin(flat, arch) + 0.022 * exp(-angle / 0.16);
}

struct panel {
    enum window window;
    double half_width, half_inner; /* of the front; of the back, which is narrower by the mitre */
};

/* Point i of n on the panel's border, clockwise from the lower right corner: x -1 .. 1, y 0 .. 1.
 */
static struct point2 border_point(size_t i, size_t per_side)
{
    double t = (double)(i % per_side) / (double)per_side;
    switch (i / per_side) {
    case 0:
        return (struct point2){1 - 2 * t, 0};
    case 1:
        return (struct point2){-1, t};
    case 2:
        return (struct point2){2 * t - 1, 1};
    default:
        return (struct point2){1, 1 - t};
    }
}

/*
 * The rings of a panel, from the border of its front over the edge of the opening to the border of its back: front,
 * moulding, reveal, back. share: 0 at the panel's border, 1 at the edge of the opening. depth: into the wall, 0 at its
 * front, 1 at its back; < 0: in front of it.
 */
static const struct {
    double share, depth;
} panel_rings[] = {{0, 0},        {0.11, 0},     {0.22, 0},     {0.33, 0},     {0.44, 0},
                   {0.55, 0},     {0.66, 0},     {0.68, -0.16}, {0.74, -0.26}, {0.85, -0.30},
                   {0.95, -0.26}, {0.995, -0.1}, {1, 0},        {1, 0.33},     {1, 0.67},
                   {1, 1},        {0.83, 1},     {0.66, 1},     {0.5, 1},      {0.33, 1},
                   {0.17, 1},     {0, 1}};
#define PANEL_RINGS  (sizeof panel_rings / sizeof *panel_rings)
#define MAX_PER_SIDE 40

static struct vec3 panel_point(const struct panel *panel, struct point2 border, size_t ring)
{
    const double middle = 0.50 * BOX_HEIGHT, apothem = BOX_RADIUS * cos(PI / 6);
    double share = panel_rings[ring].share, depth = panel_rings[ring].depth;
    double back = fmin(fmax(depth, 0), 1);
    double half = panel->half_width + (panel->half_inner - panel->half_width) * back;
    struct point2 b = {border.x * half, border.y * BOX_HEIGHT - middle};
    struct point2 front = {border.x * panel->half_width, b.y};
    double length = hypot(front.x, front.y);
    double edge = window_edge(panel->window, front.x / length, front.y / length);
    struct point2 e = {front.x / length * edge, front.y / length * edge};
    return vec3(b.x + (e.x - b.x) * share, middle + b.y + (e.y - b.y) * share,
                apothem - depth * BOX_WALL);
}

static void add_panel(struct mesh *mesh, const struct panel *panel, size_t per_side)
{
    struct vec3 rings[PANEL_RINGS * 4 * MAX_PER_SIDE] = {{0, 0, 0}};
    size_t size = 4 * per_side;
    for (size_t r = 0; r < PANEL_RINGS; r++)
        for (size_t i = 0; i < size; i++)
            rings[r * size + i] = panel_point(panel, border_point(i, per_side), r);
    mesh_loft(mesh, rings, PANEL_RINGS, size, MESH_OPEN);
    /* lower and upper side of the wall; the left and the right one are shared with the next panels */
    const struct vec3 *back = rings + (PANEL_RINGS - 1) * size;
    for (size_t i = 0; i < size; i++) {
        if (i / per_side % 2 == 1) continue;
        size_t next = (i + 1) % size;
        mesh_quad(mesh, mesh_vertex(mesh, back[i]), mesh_vertex(mesh, rings[i]),
                  mesh_vertex(mesh, rings[next]), mesh_vertex(mesh, back[next]));
    }
}

static void add_walls(struct mesh *mesh, const struct lantern *lantern)
{
    size_t per_side = scaled(26, lantern->detail);
    if (per_side > MAX_PER_SIDE) per_side = MAX_PER_SIDE;
    struct mesh_mark from = mesh_mark(mesh);
    double half = BOX_RADIUS / 2, inner = half - BOX_WALL * tan(PI / 6);
    for (int face = 0; face < SIDES; face++) {
        struct mesh_mark side = mesh_mark(mesh);
        const struct panel panel = {face % 2 == 0 ? WINDOW_ARCH : WINDOW_ROUND, half, inner};
        add_panel(mesh, &panel, per_side);
        struct mesh_transform turn = transform_turn(vec3(0, 1, 0), 60 * face);
        mesh_apply(mesh, side, &turn);
    }
    finish_stone(mesh, from, lantern, 45);
}

static void add_posts(struct mesh *mesh, const struct lantern *lantern)
{
    struct profile profile;
    profile_start(&profile, 0.02, -0.01, 0.012 / lantern->detail);
    profile_line(&profile, 0.034, -0.005);
    profile_line(&profile, 0.034, 0.03);
    profile_curve(&profile, 0.033, 0.045, 0.024, 0.05);
    profile_line(&profile, 0.024, BOX_HEIGHT - 0.05);
    profile_curve(&profile, 0.033, BOX_HEIGHT - 0.045, 0.034, BOX_HEIGHT - 0.03);
    profile_line(&profile, 0.034, BOX_HEIGHT + 0.01);
    profile_line(&profile, 0.02, BOX_HEIGHT + 0.015);
    struct mesh_mark from = mesh_mark(mesh);
    for (int corner = 0; corner < SIDES; corner++) {
        struct mesh_mark post = mesh_mark(mesh);
        profile_turn(mesh, &profile, scaled(24, lantern->detail));
        double angle = corner * PI / 3, r = BOX_RADIUS - 0.008;
        struct mesh_transform t = transform_place(vec3(r * cos(angle), 0, r * sin(angle)), 0, 1);
        mesh_apply(mesh, post, &t);
    }
    finish_stone(mesh, from, lantern, 40);
}

/* Adds a pane in the middle of the wall, set into the stone around the opening, and bars in front of it. */
static void add_window(struct mesh *mesh, enum window window)
{
    const double y = 0.50 * BOX_HEIGHT, z = BOX_RADIUS * cos(PI / 6) - 0.55 * BOX_WALL;
    double x = window == WINDOW_ARCH ? 0.112 : 0.10;
    double low = window == WINDOW_ARCH ? 0.162 : 0.10, high = window == WINDOW_ARCH ? 0.16 : 0.10;
    struct mesh_mark from = mesh_mark(mesh);
    mesh_use(mesh, "pane");
    mesh_box(mesh, vec3(-x, y - low, z - 0.004), vec3(x, y + high, z + 0.004), 0);
    if (window != WINDOW_ARCH) return;
    mesh_use(mesh, "lattice");
    for (int i = -1; i <= 1; i++)
        mesh_box(mesh, vec3(0.05 * i - 0.0045, y - low, z + 0.007),
                 vec3(0.05 * i + 0.0045, y + high, z + 0.016), 0.0015);
    for (int i = -1; i <= 1; i++)
        mesh_box(mesh, vec3(-x, y - 0.01 + 0.075 * i - 0.0045, z + 0.012),
                 vec3(x, y - 0.01 + 0.075 * i + 0.0045, z + 0.021), 0.0015);
    mesh_smooth(mesh, from, 1);
}

static void add_lamp(struct mesh *mesh, const struct lantern *lantern)
{
    struct profile profile;
    struct mesh_mark from = mesh_mark(mesh);
    mesh_use(mesh, "brass");
    profile_start(&profile, 0, 0, 0.006 / lantern->detail);
    profile_line(&profile, 0.06, 0);
    profile_curve(&profile, 0.02, 0.02, 0.022, 0.065);
    profile_curve(&profile, 0.075, 0.07, 0.085, 0.102);
    profile_line(&profile, 0.080, 0.102);
    profile_curve(&profile, 0.065, 0.076, 0, 0.076);
    profile_turn(mesh, &profile, scaled(64, lantern->detail));
    mesh_smooth(mesh, from, 40);

    from = mesh_mark(mesh);
    mesh_use(mesh, "flame");
    profile_start(&profile, 0, 0.080, 0.006 / lantern->detail);
    profile_curve(&profile, 0.036, 0.088, 0.032, 0.125);
    profile_curve(&profile, 0.026, 0.165, 0, 0.215);
    profile_turn(mesh, &profile, scaled(48, lantern->detail));
    mesh_smooth(mesh, from, 80);
}

static void add_fire_box(struct mesh *mesh, const struct lantern *lantern, double y)
{
    struct mesh_mark from = mesh_mark(mesh);
    add_walls(mesh, lantern);
    add_posts(mesh, lantern);
    if (lantern->lamp) {
        for (int face = 0; face < SIDES; face++) {
            struct mesh_mark window = mesh_mark(mesh);
            add_window(mesh, face % 2 == 0 ? WINDOW_ARCH : WINDOW_ROUND);
            struct mesh_transform turn = transform_turn(vec3(0, 1, 0), 60 * face);
            mesh_apply(mesh, window, &turn);
        }
        add_lamp(mesh, lantern);
    }
    struct mesh_transform t = transform_place(vec3(0, y, 0), 0, 1);
    mesh_apply(mesh, from, &t);
}

/* ---- roof: its lower side on y = 0 in the middle ---- */

struct roof {
    double radius; /* of the corners */
    double height; /* from the lower edge at the middle of an eave to the top */
    double upturn; /* how far the corners rise above that */
};

/* The share of the upturn at a point: 0 in the middle of an eave, 1 at its corner. */
static double cornerness(struct point2 outline)
{
    double edge = cos(PI / 6);
    double share = (hypot(outline.x, outline.y) - edge) / (1 - edge);
    return share > 0 ? pow(fmin(share, 1), 1.3) : 0;
}

#define EAVE_THICKNESS 0.075
#define ROOF_TOP       0.13 /* the flat top, as a share of the radius */

static double roof_height(const struct roof *roof, double share, double corner)
{
    double slope = pow(1 - share, 1.75);
    return EAVE_THICKNESS + (roof->height - EAVE_THICKNESS) * slope +
           roof->upturn * corner * pow(share, 5);
}

static void add_roof_body(struct mesh *mesh, const struct lantern *lantern, const struct roof *roof)
{
    struct point2 outline[STONEWORK_POINTS];
    size_t size = hexagon_outline(outline, 0.02, scaled(31, lantern->detail));
    struct profile profile; /* x: share of the radius; y: 0 below .. 1 above */
    profile_start(&profile, 0.30, 0, 0.022 / lantern->detail);
    profile_line(&profile, 0.955, 0);
    profile_line(&profile, 0.965, 0.02);
    profile_line(&profile, 0.995, 0.75);
    profile_line(&profile, 1, 0.8);
    profile_line(&profile, 0.992, 1);
    profile_line(&profile, ROOF_TOP, 1);
    profile_line(&profile, 0.04, 1);
    struct vec3 *rings = mesh_allocate(profile.count * size, sizeof *rings);
    for (size_t r = 0; r < profile.count; r++)
        for (size_t i = 0; i < size; i++) {
            double share = profile.points[r].x, level = profile.points[r].y;
            double corner = cornerness(outline[i]);
            double above = roof_height(roof, fmax(share, ROOF_TOP), corner);
            double below = roof->upturn * corner * pow(share, 5) - 0.012 * pow(share, 2);
            rings[r * size + i] =
                vec3(outline[i].x * share * roof->radius, below + (above - below) * level,
                     outline[i].y * share * roof->radius);
        }
    struct mesh_mark from = mesh_mark(mesh);
    mesh_loft(mesh, rings, profile.count, size, MESH_CAPPED);
    free(rings);
    finish_stone(mesh, from, lantern, 40);
}

#define RIDGE_POINTS  40
#define SCROLL_POINTS 90

/* A ridge down along a corner (in the plane z = 0) that ends in a fern's curl. */
static void add_ridge(struct mesh *mesh, const struct lantern *lantern, const struct roof *roof)
{
    struct vec3 path[RIDGE_POINTS + SCROLL_POINTS];
    double radii[RIDGE_POINTS + SCROLL_POINTS];
    for (int i = 0; i < RIDGE_POINTS; i++) {
        double t = (double)i / (RIDGE_POINTS - 1),
               share = ROOF_TOP * 0.9 + (0.96 - ROOF_TOP * 0.9) * t;
        path[i] = vec3(share * roof->radius, roof_height(roof, share, 1) + 0.002, 0);
        radii[i] = 0.020 + 0.016 * t * t;
    }
    struct vec3 end = vec_sub(path[RIDGE_POINTS - 1], path[RIDGE_POINTS - 2]);
    double heading = atan2(end.y, end.x);
    const double length = 0.34, step = length / SCROLL_POINTS;
    for (int i = 0; i < SCROLL_POINTS; i++) {
        double t = (double)(i + 1) / SCROLL_POINTS;
        /* the bend gets narrower all the way, so the curl never meets itself */
        double bend = 0.085 * pow(1 - t, 1.5) + 0.034;
        heading += step / bend;
        path[RIDGE_POINTS + i] =
            vec_add(path[RIDGE_POINTS + i - 1], vec3(step * cos(heading), step * sin(heading), 0));
        radii[RIDGE_POINTS + i] = 0.036 - 0.014 * t;
    }
    mesh_tube(mesh, path, radii, RIDGE_POINTS + SCROLL_POINTS, scaled(18, lantern->detail));
}

static void add_ridges(struct mesh *mesh, const struct lantern *lantern, const struct roof *roof)
{
    struct mesh_mark from = mesh_mark(mesh);
    for (int corner = 0; corner < SIDES; corner++) {
        struct mesh_mark ridge = mesh_mark(mesh);
        add_ridge(mesh, lantern, roof);
        struct mesh_transform turn = transform_turn(vec3(0, 1, 0), 60 * corner);
        mesh_apply(mesh, ridge, &turn);
    }
    finish_stone(mesh, from, lantern, 60);
}

/* ---- jewel: on a cup of petals ---- */

static void add_jewel(struct mesh *mesh, const struct lantern *lantern)
{
    struct profile profile;
    struct mesh_mark from = mesh_mark(mesh);
    double step = 0.008 / lantern->detail;
    profile_start(&profile, 0.04, -0.02, step);
    profile_line(&profile, 0.088, -0.015);
    profile_line(&profile, 0.088, 0.02);
    profile_curve(&profile, 0.060, 0.025, 0.062, 0.04);
    profile_curve(&profile, 0.125, 0.05, 0.130, 0.115);
    profile_line(&profile, 0.115, 0.118);
    profile_curve(&profile, 0.095, 0.09, 0.02, 0.085);
    profile_turn(mesh, &profile, scaled(192, lantern->detail));
    const struct petals petals = {.root = 0.035,
                                  .tip = 0.122,
                                  .inner = 0.05,
                                  .count = 8,
                                  .relief = 0.022,
                                  .direction = {0.9, -0.4, 0}};
    mesh_bend(mesh, from, petals_carve, &petals);
    finish_stone(mesh, from, lantern, 65);

    from = mesh_mark(mesh);
    mesh_use(mesh, "brass");
    profile_start(&profile, 0.05, 0.075, step);
    profile_line(&profile, 0.088, 0.080);
    profile_curve(&profile, 0.112, 0.098, 0.088, 0.116);
    profile_line(&profile, 0.05, 0.118);
    profile_turn(mesh, &profile, scaled(96, lantern->detail));
    mesh_smooth(mesh, from, 40);

    from = mesh_mark(mesh);
    mesh_use(mesh, "jewel");
    profile_start(&profile, 0, 0.121, step);
    profile_curve(&profile, 0.095, 0.122, 0.130, 0.188);
    profile_curve(&profile, 0.162, 0.265, 0.086, 0.330);
    profile_curve(&profile, 0.024, 0.370, 0, 0.430);
    profile_turn(mesh, &profile, scaled(96, lantern->detail));
    if (lantern->glass_jewel)
        mesh_smooth(mesh, from, 60);
    else
        finish_stone(mesh, from, lantern, 60);
}

static void add_roof(struct mesh *mesh, const struct lantern *lantern, const struct roof *roof,
                     double y)
{
    struct mesh_mark from = mesh_mark(mesh);
    add_roof_body(mesh, lantern, roof);
    add_ridges(mesh, lantern, roof);
    struct mesh_mark jewel = mesh_mark(mesh);
    add_jewel(mesh, lantern);
    struct mesh_transform up = transform_place(vec3(0, roof_height(roof, ROOF_TOP, 0), 0), 0, 1);
    mesh_apply(mesh, jewel, &up);
    struct mesh_transform t = transform_place(vec3(0, y, 0), 0, 1);
    mesh_apply(mesh, from, &t);
}

/* ---- the lower half of the snow-viewing style ---- */

#define YUKIMI_SLAB 0.52 /* height of the slab on the legs */

/* A leg in the plane z = 0, from under the slab outwards and down to its foot. */
static void add_leg(struct mesh *mesh, const struct lantern *lantern)
{
    enum { POINTS = 48 };
    struct vec3 path[POINTS];
    double radii[POINTS];
    for (int i = 0; i < POINTS; i++) {
        double t = (double)i / (POINTS - 1), s = 1 - t;
        path[i] = vec3(s * s * 0.20 + 2 * s * t * 0.52 + t * t * 0.47,
                       s * s * (YUKIMI_SLAB + 0.02) + 2 * s * t * 0.42, 0);
        radii[i] = 0.085 - 0.02 * t;
    }
    mesh_tube(mesh, path, radii, POINTS, scaled(28, lantern->detail));
}

static void add_legs(struct mesh *mesh, const struct lantern *lantern)
{
    struct mesh_mark from = mesh_mark(mesh);
    for (int leg = 0; leg < 4; leg++) {
        struct mesh_mark one = mesh_mark(mesh);
        add_leg(mesh, lantern);
        struct mesh_transform turn = transform_turn(vec3(0, 1, 0), 45 + 90 * leg);
        mesh_apply(mesh, one, &turn);
    }
    finish_stone(mesh, from, lantern, 50);

    struct profile profile;
    from = mesh_mark(mesh);
    profile_start(&profile, 0.05, YUKIMI_SLAB - 0.04, 0.012 / lantern->detail);
    profile_line(&profile, 0.28, YUKIMI_SLAB - 0.04);
    profile_curve(&profile, 0.44, YUKIMI_SLAB - 0.02, 0.46, YUKIMI_SLAB + 0.04);
    profile_line(&profile, 0.46, YUKIMI_SLAB + 0.075);
    profile_curve(&profile, 0.455, YUKIMI_SLAB + 0.09, 0.43, YUKIMI_SLAB + 0.09);
    profile_line(&profile, 0.05, YUKIMI_SLAB + 0.10);
    profile_cut(mesh, &profile, 0.03, scaled(22, lantern->detail));
    finish_stone(mesh, from, lantern, 40);
}

/* ---- the whole ---- */

#define KASUGA_BOX 1.37 /* where the fire box stands */
#define YUKIMI_BOX (YUKIMI_SLAB + 0.09)

static double box_foot(const struct lantern *lantern)
{
    return lantern->style == LANTERN_KASUGA ? KASUGA_BOX : YUKIMI_BOX;
}

void lantern_add(struct mesh *mesh, const struct lantern *lantern, const struct mesh_transform *t)
{
    struct mesh_mark from = mesh_mark(mesh);
    struct roof roof = {0.66, 0.40, 0.10};
    if (lantern->style == LANTERN_KASUGA) {
        add_base(mesh, lantern);
        add_shaft(mesh, lantern);
        add_platform(mesh, lantern);
    } else {
        add_legs(mesh, lantern);
        roof = (struct roof){0.82, 0.30, 0.04};
    }
    roof.radius *= lantern->roof_width;
    add_fire_box(mesh, lantern, box_foot(lantern));
    add_roof(mesh, lantern, &roof, box_foot(lantern) + BOX_HEIGHT - 0.005);
    mesh_apply(mesh, from, t);
}

struct lantern lantern_default(enum lantern_style style)
{
    return (struct lantern){.style = style,
                            .detail = 0.85,
                            .roof_width = 1,
                            .moss = 0.45,
                            .lamp = true,
                            .glass_jewel = true,
                            .seed = 1};
}

bool write_lantern(const char *folder)
{
    const struct lantern lantern = lantern_default(LANTERN_KASUGA);
    const struct mesh_transform t = transform_identity();
    struct mesh mesh;
    mesh_init(&mesh);
    lantern_add(&mesh, &lantern, &t);
    bool good = mesh_write_obj(&mesh, folder, "lantern.obj");
    mesh_free(&mesh);
    return good;
}
