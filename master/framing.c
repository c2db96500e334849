#include "master/framing.h"

#include <math.h>

#include "master/outline.h"
#include "master/view.h"

/* The ratio of the picture's width to that of the scene in it: a twentieth stays free on either side. */
#define MARGIN 1.1

struct frame {
    struct vec3 right, up, back; /* orthonormal; back points from the scene to the eye */
};

/* The direction that is up, as a unit vector of which no product overflows or loses digits. 0 is refused later
 * (master/load_checks.c), until then it stands for y. */
static struct vec3 upward(const struct settings *settings)
{
    struct vec3 up = settings->camera.up;
    return vec_is_zero(up) ? vec3(0, 1, 0) : vec_normalize(up);
}

/* up: a unit vector that is not along back. */
static struct frame frame_of(struct vec3 back, struct vec3 up)
{
    struct frame frame;
    frame.back = vec_normalize(back);
    frame.right = vec_normalize(vec_cross(up, frame.back));
    frame.up = vec_cross(frame.back, frame.right);
    return frame;
}

/* The direction to an eye in front, 30 degrees to the right and 20 degrees above. up: a unit vector. */
static struct vec3 three_quarter_view(struct vec3 up)
{
    /* "In front" is z where up is y, and -y where up is z. */
    struct vec3 ahead = fabs(up.z) > 0.7 ? vec3(0, -1, 0) : vec3(0, 0, 1);
    struct frame ground = frame_of(ahead, up);
    struct vec3 level = vec_add_scaled(vec_scale(vec_cross(ground.right, up), cos(M_PI / 6)),
                                       ground.right, sin(M_PI / 6));
    return vec_add_scaled(vec_scale(level, cos(M_PI / 9)), up, sin(M_PI / 9));
}

/* The scene, and the direction that it is seen from. */
struct subject {
    const struct outline *outline;
    struct vec3 middle, back;
    bool is_aimed_at; /* look_at is set: the eye looks at `middle` */
};

/*
 * Fits the view along one axis of the picture (a unit vector). slope: tan of the angle from the middle to the
 * edge of the picture. With x along the axis and z towards the eye, a point is in the picture if |x - eye_x| <=
 * slope (eye_z - z). With A = max(x + slope z) and B = max(-x + slope z) over all points, eye_x = (A - B) / 2
 * and eye_z = (A + B) / (2 slope) show all points, from as near as possible, and equally far from both edges.
 */
struct span {
    double eye_x;
    double half; /* slope eye_z */
};

static struct span span_of(const struct subject *subject, struct vec3 axis, double slope)
{
    double support[2];
    const struct vec3 sides[2] = {vec_add_scaled(axis, subject->back, slope),
                                  vec_add_scaled(vec_scale(axis, -1), subject->back, slope)};
    if (!outline_support(subject->outline, subject->middle, 2, sides, support))
        return (struct span){0, 1};
    if (subject->is_aimed_at) return (struct span){0, fmax(support[0], support[1])};
    return (struct span){(support[0] - support[1]) / 2, support[0] / 2 + support[1] / 2};
}

/* How far the scene reaches towards the eye. */
static double front_of(const struct subject *subject)
{
    double support = 0;
    outline_support(subject->outline, subject->middle, 1, &subject->back, &support);
    return support;
}

/* The scene is centred when the margins to its left and right differ by less than this part of its width in the
 * picture. */
#define OFF_CENTRE 1e-4

/* The least depth of the nearest point, as a part of the eye's distance. Where one point decides how near the eye may
 * come, the eye is in it, but for rounding. With this the slopes' differences are still far above rounding. */
#define NEAREST_LEAST 1e-9

/* Finding a slope between two: at the lower one half is larger than slope distance, at the higher one smaller. */
struct search {
    double low, above;  /* a slope; half - slope distance there */
    double high, below; /* a slope; slope distance - half there */
    bool was_high;      /* which of the two was found last */
};

static double next_slope(const struct search *it)
{
    return it->low + (it->high - it->low) * (it->above / (it->above + it->below));
}

/* The Illinois method (M. Dowell and P. Jarratt, "A Modified Regula Falsi Method", BIT 11, 1971): where the same end is
 * found twice, the other end's value is halved, as that end would hardly move otherwise. off: slope distance - half. */
static void search_on(struct search *it, double slope, double off)
{
    bool is_high = off > 0, again = is_high == it->was_high;
    if (is_high) {
        it->high = slope, it->below = off;
        if (again) it->above /= 2;
    } else {
        it->low = slope, it->above = -off;
        if (again) it->below /= 2;
    }
    it->was_high = is_high;
}

/*
 * The eye_x at which the scene is centred as seen from this distance, which is more than the slope asks for
 * where the picture is filled along its other axis. The scene then fills a picture of a smaller slope, for which
 * half = slope distance. Half is convex in the slope, so there is one such slope. What a slope is off by is seen
 * at the depth of some point, which is at least that of the nearest one.
 */
static double centred(const struct subject *subject, struct vec3 axis, double slope,
                      struct span span, double distance)
{
    double nearest = fmax(distance - front_of(subject), NEAREST_LEAST * distance);
    double enough = OFF_CENTRE * nearest;
    struct search search = {.high = slope, .below = slope * distance - span.half};
    if (!(search.below > enough * slope)) return span.eye_x;
    search.above = span_of(subject, axis, 0).half;
    for (int i = 0; i < 40; i++) {
        slope = next_slope(&search);
        span = span_of(subject, axis, slope);
        double off = slope * distance - span.half;
        if (fabs(off) <= enough * slope) break;
        search_on(&search, slope, off);
    }
    return span.eye_x;
}

/* Places the camera as near as shows the whole scene, and with the scene in the middle of the picture unless
 * look_at is set. */
static void place_camera(const struct subject *subject, const struct frame *frame,
                         struct settings *settings)
{
    double slope_y = view_half_height(settings->camera.fov) / MARGIN;
    double slope_x = slope_y * settings->image.width / settings->image.height;
    struct span wide = span_of(subject, frame->right, slope_x);
    struct span high = span_of(subject, frame->up, slope_y);
    double distance = fmax(wide.half / slope_x, high.half / slope_y);
    /* A single point, and a scene behind a look_at that was set, are seen from a distance of 1. */
    if (distance <= 0) distance = 1;
    struct vec3 *look_at = &settings->camera.look_at;
    if (!subject->is_aimed_at) {
        double right = centred(subject, frame->right, slope_x, wide, distance);
        double up = centred(subject, frame->up, slope_y, high, distance);
        *look_at = vec_add(*look_at, vec_add_scaled(vec_scale(frame->right, right), frame->up, up));
    }
    settings->camera.eye = vec_add_scaled(*look_at, frame->back, distance);
}

static void frame_outline(const struct outline *outline, struct settings *settings, bool has_eye,
                          bool has_look_at)
{
    struct vec3 min, max;
    bool any = outline_bounds(outline, &min, &max);
    struct vec3 middle = any ? vec_add(vec_scale(min, 0.5), vec_scale(max, 0.5)) : vec3(0, 0, 0);
    if (!has_look_at) settings->camera.look_at = middle;
    if (has_eye) return;
    struct vec3 up = upward(settings);
    struct frame frame = frame_of(three_quarter_view(up), up);
    struct subject subject = {outline, settings->camera.look_at, frame.back, has_look_at};
    place_camera(&subject, &frame, settings);
}

void frame_scene(const struct builder *builder, struct settings *settings, bool has_eye,
                 bool has_look_at)
{
    if (has_eye && has_look_at) return;
    struct outline *outline = outline_create(builder);
    frame_outline(outline, settings, has_eye, has_look_at);
    outline_destroy(outline);
}

void shoulder_lights(const struct settings *settings, struct light lights[2])
{
    struct vec3 eye = settings->camera.eye;
    struct vec3 back = vec_sub(eye, settings->camera.look_at);
    struct frame frame = frame_of(back, upward(settings));
    double distance = vec_length(back);
    struct vec3 key = vec_add_scaled(eye, frame.right, 0.6 * distance);
    struct vec3 fill = vec_add_scaled(eye, frame.right, -1.2 * distance);
    lights[0] = (struct light){vec_add_scaled(key, frame.up, 0.9 * distance), vec3(1.2, 1.17, 1.1)};
    lights[1] =
        (struct light){vec_add_scaled(fill, frame.up, 0.2 * distance), vec3(0.45, 0.5, 0.58)};
}
