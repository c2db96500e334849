/*
 * The kernel, which is compiled once for every level of processor (common/processor.h). Its files are those
 * of KERNEL in the Makefile. The objects of each level are linked into one, of which only the table below is
 * visible. The sources do not depend on the level, except for worker/quad.h, lanes.h, floats.h and wave.h.
 */
#ifndef FARM_WORKER_KERNEL_H
#define FARM_WORKER_KERNEL_H

#include "common/processor.h"
#include "worker/nearest.h"
#include "worker/render.h"

/*
 * The functions that are called from outside of the kernel's files; all but the last are called by tests and
 * benches only. For each, worker/kernel.c has a function of the same name, which calls that of the level that
 * the scene asks for.
 */
struct kernel {
    __typeof__(nearest) *nearest;
    __typeof__(nearest_rough) *nearest_rough;
    __typeof__(occluded) *occluded;
    __typeof__(surface_at) *surface_at;
    __typeof__(renderer_task) *renderer_task;
};

/* The table of a level that this processor supports. */
const struct kernel *kernel_at(enum processor_level level);

#endif
