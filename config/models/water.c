/*
 * The surface of the pond: a sheet with ripples. It extends a little into the bank, so that there is no gap along the
 * shore. The opaque bed is below it, so a ray that is refracted into the water can leave it only through the sheet.
 */
#include "config/models/garden.h"
#include "config/models/scatter.h"

#define COLUMNS 250
#define ROWS    270

/* The shading model has no Fresnel term: reflection and transmission are constants of a material. So the sheet has one
 * material for each band of distance from the viewer, from water_0 at their feet (clear) to water_9 (a mirror), with
 * the reflectance that a flat pond has at that distance. */
#define BANDS 10

static const double left = -9.0, right = 6.5, near = 7.4, far = -7.0;

struct wave {
    double x, z; /* wave vector, radians per metre */
    double height, phase;
};

/* The directions of short waves differ widely, as in a light wind; there is no swell. */
static const struct wave waves[] = {
    {2.1, 7.4, 0.0021, 0.4},   {-3.4, 9.6, 0.0015, 2.1}, {6.1, 11.2, 0.0009, 4.0},
    {-7.9, 14.5, 0.0006, 1.0}, {1.2, 18.0, 0.0004, 5.2}, {10.0, -3.0, 0.0006, 3.3},
};

/* Rings where something has touched the water: (x, z) of the centre, outer radius, height. */
static const struct ring {
    double x, z, radius, height;
} rings[] = {{0.75, 2.75, 0.75, 0.009}, {-0.6, 0.3, 0.5, 0.006}, {1.2, 0.1, 0.42, 0.005}};

static double ripple(double x, double z)
{
    /* Calm by the far shore, where a pixel covers many waves, and in lee patches. */
    double calm = 0.35 + 0.65 * ramp(-4, 4, z);
    double gust = 0.75 + 0.5 * noise(vec3(x * 0.5, 0, z * 0.7), 51);
    double y = 0;
    for (size_t i = 0; i < sizeof waves / sizeof waves[0]; i++)
        y += waves[i].height * sin(waves[i].x * x + waves[i].z * z + waves[i].phase);
    y *= calm * gust;
    for (size_t i = 0; i < sizeof rings / sizeof rings[0]; i++) {
        double r = hypot(x - rings[i].x, z - rings[i].z), off = (r - rings[i].radius) / 0.22;
        y += rings[i].height * sin(2 * PI * (r - rings[i].radius) / 0.19) * exp(-off * off);
    }
    return y;
}

static struct vec3 sheet_point(size_t column, size_t row)
{
    double x = left + (right - left) * (double)column / COLUMNS;
    double z = near + (far - near) * (double)row / ROWS;
    return vec3(x, ripple(x, z), z);
}

/* Whether the cell contains the water's edge or a part of the pond. */
static bool is_wet(size_t column, size_t row)
{
    struct vec3 a = sheet_point(column, row), b = sheet_point(column + 1, row + 1);
    return pond_distance((a.x + b.x) / 2, (a.z + b.z) / 2) < 0.12;
}

static unsigned band_at(struct vec3 p)
{
    double t =
        (near - 1.2 - p.z + 0.35 * noise_fractal(vec3(p.x * 1.5, 0, p.z * 1.5), 2, 52)) / 9.5;
    return (unsigned)(fmin(0.999, fmax(0, t)) * BANDS);
}

#define NOT_MADE UINT32_MAX

/* The indices of the vertices along a row of cells; a vertex is added when a cell first needs it. */
struct row {
    size_t number;
    uint32_t vertex[COLUMNS + 1];
};

static void start_row(struct row *row, size_t number)
{
    row->number = number;
    for (size_t i = 0; i <= COLUMNS; i++)
        row->vertex[i] = NOT_MADE;
}

static uint32_t corner(struct mesh *mesh, struct row *row, size_t column)
{
    if (row->vertex[column] == NOT_MADE)
        row->vertex[column] = mesh_vertex(mesh, sheet_point(column, row->number));
    return row->vertex[column];
}

static void add_cells(struct mesh *mesh, struct row *near_side, struct row *far_side)
{
    static const char *const names[BANDS] = {"water_0", "water_1", "water_2", "water_3", "water_4",
                                             "water_5", "water_6", "water_7", "water_8", "water_9"};
    for (size_t i = 0; i < COLUMNS; i++) {
        if (!is_wet(i, near_side->number)) continue;
        mesh_use(mesh, names[band_at(sheet_point(i, near_side->number))]);
        uint32_t a = corner(mesh, near_side, i), b = corner(mesh, near_side, i + 1);
        uint32_t c = corner(mesh, far_side, i + 1), d = corner(mesh, far_side, i);
        mesh_quad(mesh, a, b, c, d);
    }
}

void add_water(struct mesh *mesh)
{
    struct mesh_mark part = mesh_mark(mesh);
    struct row rows[2];
    start_row(&rows[0], 0);
    for (size_t i = 0; i < ROWS; i++) {
        struct row *near_side = &rows[i % 2], *far_side = &rows[(i + 1) % 2];
        start_row(far_side, i + 1);
        add_cells(mesh, near_side, far_side);
    }
    mesh_smooth(mesh, part, 180);
}
