/* The ground of the garden, with the bed of the pond, and the hills behind it. */
#include "config/models/garden.h"
#include "config/models/scatter.h"

/* The pond is a smooth union of round basins (x, z, radius), less the islets. */
static const struct vec3 basins[] = {
    {0.3, 1.6, 3.5},   {-2.5, -0.6, 3.1}, {2.6, 4.0, 2.4},  {-1.8, 4.6, 2.7},
    {-4.9, -3.4, 1.7}, {-6.9, -5.4, 1.3}, {1.3, -2.4, 1.9},
};
static const struct vec3 islets[] = {{-2.35, 0.15, 0.72}, {-2.35, 4.85, 0.85}, {2.9, 3.35, 0.55}};

/* Mounds: (x, z) of the top, height, radius. */
static const struct mound {
    double x, z, height, radius;
} mounds[] = {
    {3.7, -2.7, 0.5, 1.5}, {-7.8, -8.5, 1.3, 3.0}, {0.6, -9.5, 0.9, 3.2}, {7.6, -5.5, 1.1, 2.6},
    {-6.5, 1.0, 0.7, 1.8}, {5.2, 3.2, 0.35, 1.2},  {-3.9, 6.4, 0.3, 1.3}, {-2.0, -8.0, 0.5, 1.8},
};

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

static double smooth_min(double a, double b, double width)
{
    double h = fmin(1, fmax(0, 0.5 + 0.5 * (b - a) / width));
    return b + (a - b) * h - width * h * (1 - h);
}

double pond_distance(double x, double z)
{
    double d = 1e3;
    for (size_t i = 0; i < COUNT(basins); i++) {
        double r = hypot(x - basins[i].x, z - basins[i].y) - basins[i].z;
        d = smooth_min(d, r, 0.8);
    }
    for (size_t i = 0; i < COUNT(islets); i++) {
        double land = islets[i].z - hypot((x - islets[i].x) * 0.8, z - islets[i].y);
        d = -smooth_min(-d, -land, 0.25);
    }
    return d + 0.14 * noise(vec3(x * 0.9, 0.5, z * 0.9), 11);
}

static double mound_height(double x, double z)
{
    double sum = 0;
    for (size_t i = 0; i < COUNT(mounds); i++) {
        double dx = x - mounds[i].x, dz = z - mounds[i].z;
        sum += mounds[i].height * exp(-(dx * dx + dz * dz) / (mounds[i].radius * mounds[i].radius));
    }
    return sum;
}

double ground_height(double x, double z)
{
    double d = pond_distance(x, z);
    struct vec3 p = vec3(x, 0, z);
    if (d < 0)
        return -0.62 * (1 - exp(d / 0.75)) + 0.03 * noise(vec_scale(p, 3), 21) * ramp(0, 0.6, -d);
    double rise = 0.2 * (1 - exp(-d / 0.3));
    double swell = mound_height(x, z) + 0.1 * noise_fractal(vec_scale(p, 0.35), 3, 22);
    double moss = 0.014 * noise(vec_scale(p, 6), 23) + 0.008 * noise(vec_scale(p, 15), 24);
    /* Behind the garden the land rises a little towards the hills. */
    double valley = 0.035 * fmax(0, -8 - z);
    return rise + (swell + moss) * ramp(0, 1.6, d) + moss * ramp(0, 0.2, d) + valley;
}

struct vec3 ground_point(double x, double z, double up)
{
    return vec3(x, ground_height(x, z) + up, z);
}

/* A point of the ground's grid, whose cells are 6 cm wide near the viewer and grow to a metre at the far edge. */
static struct vec3 ground_surface(const void *context, double u, double v)
{
    (void)context;
    double s = 2 * u - 1;
    double x = 6.5 * s + 22 * pow(s, 5);
    double z = 7.5 - 14.5 * v - 38 * pow(v, 6);
    return ground_point(x, z, 0);
}

struct ground_paint {
    uint32_t bed[3], shore, moss[4];
};

static uint32_t paint_ground(const void *context, struct vec3 p, struct vec3 normal)
{
    const struct ground_paint *paint = context;
    (void)normal;
    double grain = 0.5 + 0.5 * noise(vec_scale(p, 9), 31);
    if (p.y < 0.012) {
        double patch =
            0.5 + 0.5 * noise_fractal(vec3(p.x * 1.3, 0, p.z * 1.3), 3, 32) + 0.3 * (grain - 0.5);
        return paint->bed[patch < 0.42 ? 0 : patch < 0.62 ? 1 : 2];
    }
    /* A frayed edge, as the grid would be visible otherwise. */
    double fray = chance(34, (uint32_t)(int)(p.x * 1000) ^ (uint32_t)(int)(p.z * 1000) << 12);
    if (p.y < 0.025 + 0.03 * grain + 0.05 * fray) return paint->shore;
    double patch =
        0.5 + 0.6 * noise_fractal(vec3(p.x * 0.8, 0, p.z * 0.8), 4, 33) + 0.35 * (grain - 0.5);
    return paint->moss[patch < 0.3 ? 0 : patch < 0.52 ? 1 : patch < 0.72 ? 2 : 3];
}

void add_ground(struct mesh *mesh)
{
    struct ground_paint paint = {
        .bed = {mesh_material(mesh, "bed_0"), mesh_material(mesh, "bed_1"),
                mesh_material(mesh, "bed_2")},
        .shore = mesh_material(mesh, "shore"),
        .moss = {mesh_material(mesh, "moss_0"), mesh_material(mesh, "moss_1"),
                 mesh_material(mesh, "moss_2"), mesh_material(mesh, "moss_3")},
    };
    mesh_use(mesh, "moss_1");
    struct mesh_mark part = mesh_mark(mesh);
    mesh_grid(mesh, 185, 215, ground_surface, NULL);
    mesh_paint(mesh, part, paint_ground, &paint);
    mesh_smooth(mesh, part, 180);
}

/* A ridge: a curtain of land whose upper edge is fractal. */
struct ridge {
    double z, height, roughness, width;
    uint32_t seed;
};

static struct vec3 ridge_surface(const void *context, double u, double v)
{
    const struct ridge *ridge = context;
    double x = (u - 0.5) * ridge->width;
    double crest =
        ridge->height *
        (1 + ridge->roughness * noise_fractal(vec3(x / ridge->height / 3, 0, 0), 5, ridge->seed));
    double fold = 0.15 * crest * noise_fractal(vec3(x / crest * 2, v * 2, 0), 3, ridge->seed + 1);
    return vec3(x, v * crest, ridge->z - v * crest * 0.8 + fold * (1 - v));
}

/* Adds bands of mist in front of the hills. Each consists of flat ellipses of six sizes, one in front of the other, so
 * that it is thickest in its middle. */
static void add_mist(struct mesh *mesh)
{
    enum { POINTS = 64, LAYERS = 6 };
    static const struct band {
        double x, y, z, width, height;
    } bands[] = {{-12, 2.6, -47, 21, 0.5}, {15, 2.9, -49, 19, 0.5}, {3, 4.2, -72, 30, 0.7},
                 {-30, 6.0, -74, 26, 0.7}, {34, 6.4, -76, 24, 0.8}, {-16, 9.0, -120, 40, 0.9},
                 {34, 12.0, -122, 38, 0.9}};
    mesh_use(mesh, "mist");
    for (size_t i = 0; i < COUNT(bands) * LAYERS; i++) {
        const struct band *band = &bands[i / LAYERS];
        double size = 1 - 0.14 * (double)(i % LAYERS), z = band->z + 0.1 * (double)(i % LAYERS);
        double x = band->x + 0.12 * band->width * noise(vec3(0.7 * (double)i, 0.5, 0.5), 45);
        uint32_t middle = mesh_vertex(mesh, vec3(x, band->y, z)), rim[POINTS];
        for (int k = 0; k < POINTS; k++) {
            double angle = 2 * PI * k / POINTS;
            rim[k] = mesh_vertex(mesh, vec3(x + size * band->width * cos(angle),
                                            band->y + size * band->height * sin(angle), z));
        }
        for (int k = 0; k < POINTS; k++)
            mesh_triangle(mesh, middle, rim[k], rim[(k + 1) % POINTS]);
    }
}

void add_hills(struct mesh *mesh)
{
    static const struct ridge ridges[] = {
        {-52, 6.5, 0.5, 90, 41}, {-80, 13, 0.6, 140, 42}, {-130, 28, 0.6, 220, 43}};
    static const char *const names[] = {"hill_near", "hill_middle", "hill_far"};
    struct mesh_mark part = mesh_mark(mesh);
    for (size_t i = 0; i < COUNT(ridges); i++) {
        mesh_use(mesh, names[i]);
        mesh_grid(mesh, 240, 10, ridge_surface, &ridges[i]);
    }
    mesh_smooth(mesh, part, 180);
    add_mist(mesh);
}
