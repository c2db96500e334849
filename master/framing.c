#include "master/framing.h"

#include <math.h>

#include "master/view.h"

/* The picture is so many times as wide as what is in it: a twentieth stays free on either side. */
#define MARGIN 1.1

struct frame {
    struct vec3 right, up, back; /* orthonormal; back points from the scene to the eye */
};

/* Any direction that is not along the unit vector. */
static struct vec3 across(struct vec3 unit)
{
    return fabs(unit.x) < 0.6 ? vec3(1, 0, 0) : vec3(0, 1, 0);
}

static struct frame frame_of(struct vec3 back, struct vec3 up)
{
    struct frame frame;
    frame.back = vec_normalize(back);
    struct vec3 right = vec_cross(up, frame.back);
    if (vec_is_zero(right)) right = vec_cross(across(frame.back), frame.back);
    frame.right = vec_normalize(right);
    frame.up = vec_cross(frame.back, frame.right);
    return frame;
}

/* The direction to an eye in front, 30 degrees to the right and 20 degrees above. */
static struct vec3 three_quarter_view(struct vec3 up)
{
    struct vec3 vertical =
        vec_is_zero(up) || !vec_is_finite(up) ? vec3(0, 1, 0) : vec_normalize(up);
    /* "In front" is z where up is y, and -y where up is z. */
    struct vec3 ahead = fabs(vertical.z) > 0.7 ? vec3(0, -1, 0) : vec3(0, 0, 1);
    struct frame ground = frame_of(ahead, vertical);
    struct vec3 level = vec_add_scaled(vec_scale(vec_cross(ground.right, vertical), cos(M_PI / 6)),
                                       ground.right, sin(M_PI / 6));
    return vec_add_scaled(vec_scale(level, cos(M_PI / 9)), vertical, sin(M_PI / 9));
}

/*
 * Half of the view in one direction (unit, a is its slope: tan of the angle from the middle to the edge of the
 * picture), with x along it and z towards the eye: a point is in the picture if |x - eye_x| <= a (eye_z - z). So with
 * A = max(x + a z) and B = max(-x + a z) over all points eye_x = (A - B) / 2 and eye_z = (A + B) / (2 a) show all of
 * them, from as near as that goes, as far from one edge as from the other.
 */
struct span {
    double eye_x, eye_z;
};

/* centred: eye_x is 0. */
static struct span fit(double slope, const double reach[2], bool centred)
{
    if (centred) return (struct span){0, fmax(reach[0], reach[1]) / slope};
    return (struct span){(reach[0] - reach[1]) / 2, (reach[0] / 2 + reach[1] / 2) / slope};
}

void frame_scene(const struct builder *builder, struct settings *settings, bool has_eye,
                 bool has_look_at)
{
    if (has_eye && has_look_at) return;
    struct vec3 min, max;
    bool any = builder_bounds(builder, &min, &max);
    struct vec3 middle = any ? vec_add(vec_scale(min, 0.5), vec_scale(max, 0.5)) : vec3(0, 0, 0);
    if (!has_look_at) settings->camera.look_at = middle;
    if (has_eye) return;

    struct frame frame = frame_of(three_quarter_view(settings->camera.up), settings->camera.up);
    double slope_y = view_half_height(settings->camera.fov) / MARGIN;
    double slope_x = slope_y * settings->image.width / settings->image.height;
    double reach[4] = {1, 1, 1, 1};
    const struct vec3 directions[4] = {
        vec_add_scaled(frame.right, frame.back, slope_x),
        vec_add_scaled(vec_scale(frame.right, -1), frame.back, slope_x),
        vec_add_scaled(frame.up, frame.back, slope_y),
        vec_add_scaled(vec_scale(frame.up, -1), frame.back, slope_y),
    };
    if (any) builder_reach(builder, settings->camera.look_at, 4, directions, reach);
    struct span wide = fit(slope_x, reach, has_look_at);
    struct span high = fit(slope_y, reach + 2, has_look_at);
    struct vec3 aside = vec_add_scaled(vec_scale(frame.right, wide.eye_x), frame.up, high.eye_x);
    settings->camera.look_at = vec_add(settings->camera.look_at, aside);
    double distance = fmax(wide.eye_z, high.eye_z);
    /* A single point, and what is behind a look_at that was set, is seen from a distance of 1. */
    if (distance <= 0) distance = 1;
    settings->camera.eye = vec_add_scaled(settings->camera.look_at, frame.back, distance);
}

void shoulder_lights(const struct settings *settings, struct light lights[2])
{
    struct vec3 eye = settings->camera.eye;
    struct vec3 back = vec_sub(eye, settings->camera.look_at);
    struct frame frame = frame_of(back, settings->camera.up);
    double distance = vec_length(back);
    struct vec3 key = vec_add_scaled(eye, frame.right, 0.6 * distance);
    struct vec3 fill = vec_add_scaled(eye, frame.right, -1.2 * distance);
    lights[0] = (struct light){vec_add_scaled(key, frame.up, 0.9 * distance), vec3(1.2, 1.17, 1.1)};
    lights[1] =
        (struct light){vec_add_scaled(fill, frame.up, 0.2 * distance), vec3(0.45, 0.5, 0.58)};
}
