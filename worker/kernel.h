/*
 * The kernel as it is compiled once for every level of processor (common/processor.h). Its files
 * are those of KERNEL in the Makefile; each level's objects are linked to one, of which only the
 * table below can be seen. So the sources need not know of levels, but for worker/lanes.h.
 */
#ifndef FARM_WORKER_KERNEL_H
#define FARM_WORKER_KERNEL_H

#include "common/processor.h"
#include "worker/nearest.h"
#include "worker/render.h"

/* What is called from outside of the kernel's files, all but the last one by tests and benches alone;
 * worker/kernel.c has a function of the same name for each, which calls that of the level that the scene asks for. */
struct kernel {
    __typeof__(nearest) *nearest;
    __typeof__(nearest_rough) *nearest_rough;
    __typeof__(occluded) *occluded;
    __typeof__(surface_at) *surface_at;
    __typeof__(renderer_task) *renderer_task;
};

/* The one of a level that this processor has. */
const struct kernel *kernel_at(enum processor_level level);

#endif
