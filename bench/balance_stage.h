/* A scene with a renderer in this process, to time its tiles. */
#ifndef FARM_BENCH_BALANCE_STAGE_H
#define FARM_BENCH_BALANCE_STAGE_H

#include <stddef.h>
#include <stdint.h>

#include "common/scene.h"
#include "worker/render.h"

struct stage {
    struct scene *scene;
    void *bvh;
    struct renderer *renderer;
};

/* Loads config at this size, with these further settings: `count` texts such as "sampling.samples=4". Ends the program
 * when that fails. stage_close() frees all. */
void stage_open(struct stage *stage, const char *config, uint32_t width, uint32_t height,
                const char *const settings[], size_t count);
void stage_close(struct stage *stage);

#endif
