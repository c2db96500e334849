#include "worker/kernel.h"

/* One for each of the Makefile's levels. */
extern const struct kernel kernel_portable, kernel_avx2, kernel_avx512;

const struct kernel *kernel_at(enum processor_level level)
{
#ifdef KERNEL_AVX512
    if (level == PROCESSOR_AVX512) return &kernel_avx512;
#endif
#ifdef __x86_64__
    if (level == PROCESSOR_AVX2) return &kernel_avx2;
#else
    (void)level;
#endif
    return &kernel_portable;
}

static const struct kernel *kernel_of(const struct scene *scene)
{
    return kernel_at(processor_resolve(scene->view.processor));
}

void nearest(const struct scene *scene, const struct bvh *bvh, const struct ray *rays, size_t count,
             struct hit *hits, uint64_t *exact_fallbacks)
{
    kernel_of(scene)->nearest(scene, bvh, rays, count, hits, exact_fallbacks);
}

void nearest_rough(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                   size_t count, struct hit *hits, uint64_t *exact_fallbacks)
{
    kernel_of(scene)->nearest_rough(scene, bvh, rays, count, hits, exact_fallbacks);
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

bool renderer_task(struct renderer *renderer, const struct task *task, struct render_counts *counts)
{
    const struct scene *scene = renderer_scene(renderer);
    return kernel_of(scene)->renderer_task(renderer, task, counts);
}
