#include "worker/kernel.h"

static const struct kernel *kernel_of(const struct scene *scene)
{
#ifdef __x86_64__
    switch (processor_resolve(scene->view.processor)) {
    case PROCESSOR_AVX512:
        return &kernel_avx512;
    case PROCESSOR_AVX2:
        return &kernel_avx2;
    case PROCESSOR_AUTO:
    case PROCESSOR_PORTABLE:
    case PROCESSOR_LEVELS:
        break;
    }
#else
    (void)scene;
#endif
    return &kernel_portable;
}

void nearest(const struct scene *scene, const struct bvh *bvh, const struct ray *rays, size_t count,
             struct hit *hits, uint64_t *exact_fallbacks)
{
    kernel_of(scene)->nearest(scene, bvh, rays, count, hits, exact_fallbacks);
}

void occluded(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
              size_t count, struct vec3 *transmittance, uint64_t *exact_fallbacks)
{
    kernel_of(scene)->occluded(scene, bvh, rays, count, transmittance, exact_fallbacks);
}

void surface_at(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                struct surface *surface)
{
    kernel_of(scene)->surface_at(scene, ray, hit, surface);
}

bool renderer_tile(struct renderer *renderer, const struct tile *tile, float *rgb,
                   struct render_counts *counts)
{
    const struct scene *scene = renderer_scene(renderer);
    return kernel_of(scene)->renderer_tile(renderer, tile, rgb, counts);
}
