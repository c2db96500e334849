#include "master/framing.h"

#include <math.h>

/* Empty space around the scene, as a share of the distance. */
#define MARGIN 1.05

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

/* How far from the middle the eye has to be so that this point (relative to it) is in the picture.
 */
static double distance_for(const struct frame *frame, struct vec3 point, double tan_x, double tan_y)
{
    double across_distance = fabs(vec_dot(point, frame->right)) / tan_x;
    double up_distance = fabs(vec_dot(point, frame->up)) / tan_y;
    return vec_dot(point, frame->back) + fmax(across_distance, up_distance);
}

void frame_scene(const struct builder *builder, struct settings *settings, bool has_eye,
                 bool has_look_at)
{
    struct vec3 min, max;
    if (!builder_bounds(builder, &min, &max)) {
        min = vec3(-1, -1, -1);
        max = vec3(1, 1, 1);
    }
    struct vec3 middle = vec_add(vec_scale(min, 0.5), vec_scale(max, 0.5));
    if (!has_look_at) settings->camera.look_at = middle;
    if (has_eye) return;

    struct frame frame = frame_of(three_quarter_view(settings->camera.up), settings->camera.up);
    double tan_y = tan(settings->camera.fov * (M_PI / 360));
    double tan_x = tan_y * settings->image.width / settings->image.height;
    double distance = 0;
    for (int i = 0; i < 8; i++) {
        struct vec3 corner =
            vec3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z);
        struct vec3 from_middle = vec_sub(corner, settings->camera.look_at);
        distance = fmax(distance, distance_for(&frame, from_middle, tan_x, tan_y));
    }
    /* A single point is seen from a distance of 1. */
    if (distance == 0) distance = 1;
    settings->camera.eye = vec_add_scaled(settings->camera.look_at, frame.back, distance * MARGIN);
}

void shoulder_lights(const struct settings *settings, struct light lights[2])
{
    struct vec3 eye = settings->camera.eye;
    struct vec3 back = vec_sub(eye, settings->camera.look_at);
    struct frame frame = frame_of(back, settings->camera.up);
    double distance = vec_length(back);
    struct vec3 key = vec_add_scaled(eye, frame.right, 0.6 * distance);
    struct vec3 fill = vec_add_scaled(eye, frame.right, -1.2 * distance);
    lights[0] =
        (struct light){vec_add_scaled(key, frame.up, 0.9 * distance), vec3(0.9, 0.88, 0.84)};
    lights[1] =
        (struct light){vec_add_scaled(fill, frame.up, 0.2 * distance), vec3(0.3, 0.33, 0.4)};
}
