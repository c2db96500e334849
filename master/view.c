#include "master/view.h"

#include <math.h>

double view_half_height(double fov)
{
    return tan(fov * (M_PI / 360));
}

static struct camera camera_of(const struct settings *settings)
{
    struct camera camera = {.eye = settings->camera.eye};
    double half_height = view_half_height(settings->camera.fov);
    camera.forward = vec_normalize(vec_sub(settings->camera.look_at, settings->camera.eye));
    struct vec3 up = vec_normalize(settings->camera.up);
    struct vec3 right = vec_normalize(vec_cross(camera.forward, up));
    camera.right = vec_scale(right, half_height);
    camera.down = vec_scale(vec_normalize(vec_cross(camera.forward, right)), half_height);
    return camera;
}

struct view settings_view(const struct settings *settings)
{
    const uint32_t *region = settings->image.region;
    struct view view = {
        .camera = camera_of(settings),
        .background_bottom = settings->background.bottom,
        .background_top = settings->background.top,
        .background_up = vec_normalize(settings->camera.up),
        .cutoff = settings->render.cutoff,
        .width = settings->image.width,
        .height = settings->image.height,
        .region_x = region[0],
        .region_y = region[1],
        .region_w = region[2] ? region[2] : settings->image.width,
        .region_h = region[2] ? region[3] : settings->image.height,
        .max_depth = settings->render.max_depth,
        .shadows = settings->render.shadows,
        .min_samples = settings_adaptive(settings) ? settings->sampling.min_samples
                                                   : settings->sampling.samples,
        .max_samples = settings_adaptive(settings) ? settings->sampling.max_samples
                                                   : settings->sampling.samples,
        .formulas = settings->render.formulas,
        .processor = settings->farm.kernel,
        .variant = settings->farm.variant,
    };
    return view;
}
