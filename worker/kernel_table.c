/* The Makefile defines KERNEL_TABLE as kernel_portable, kernel_avx2, ... */
#include "worker/kernel.h"

extern const struct kernel KERNEL_TABLE;

const struct kernel KERNEL_TABLE = {
    .nearest = nearest,
    .nearest_rough = nearest_rough,
    .occluded = occluded,
    .surface_at = surface_at,
    .renderer_task = renderer_task,
};
