#include "master/placement.h"

#include <math.h>

const struct placement placement_identity = {
    .rotation = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .scale = 1, .translate = {0, 0, 0}};

static void sine_and_cosine(double degrees, double *sine, double *cosine)
{
    static const double quarter_sines[] = {0, 1, 0, -1};
    double turned = fmod(degrees, 360);
    if (fmod(turned, 90) == 0) {
        int quarter = ((int)(turned / 90) + 4) % 4;
        *sine = quarter_sines[quarter];
        *cosine = quarter_sines[(quarter + 1) % 4];
    } else {
        *sine = sin(turned * (M_PI / 180));
        *cosine = cos(turned * (M_PI / 180));
    }
}

static void multiply(const double left[3][3], const double right[3][3], double product[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            product[i][j] =
                left[i][0] * right[0][j] + left[i][1] * right[1][j] + left[i][2] * right[2][j];
}

struct placement placement_make(struct vec3 degrees, double scale, struct vec3 translate)
{
    double s, c;
    sine_and_cosine(degrees.x, &s, &c);
    const double about_x[3][3] = {{1, 0, 0}, {0, c, -s}, {0, s, c}};
    sine_and_cosine(degrees.y, &s, &c);
    const double about_y[3][3] = {{c, 0, s}, {0, 1, 0}, {-s, 0, c}};
    sine_and_cosine(degrees.z, &s, &c);
    const double about_z[3][3] = {{c, -s, 0}, {s, c, 0}, {0, 0, 1}};
    double yx[3][3];
    struct placement placement = {.scale = scale, .translate = translate};
    multiply(about_y, about_x, yx);
    multiply(about_z, yx, placement.rotation);
    return placement;
}

struct vec3 placement_direction(const struct placement *placement, struct vec3 d)
{
    const double(*r)[3] = placement->rotation;
    return vec3(r[0][0] * d.x + r[0][1] * d.y + r[0][2] * d.z,
                r[1][0] * d.x + r[1][1] * d.y + r[1][2] * d.z,
                r[2][0] * d.x + r[2][1] * d.y + r[2][2] * d.z);
}

struct vec3 placement_point(const struct placement *placement, struct vec3 point)
{
    return vec_add_scaled(placement->translate, placement_direction(placement, point),
                          placement->scale);
}

struct placement placement_compose(const struct placement *outer, const struct placement *inner)
{
    struct placement both = {.scale = outer->scale * inner->scale,
                             .translate = placement_point(outer, inner->translate)};
    multiply(outer->rotation, inner->rotation, both.rotation);
    return both;
}

bool placement_keeps_axes(const struct placement *placement)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double r = fabs(placement->rotation[i][j]);
            if (r != 0 && r != 1) return false;
        }
    return true;
}
