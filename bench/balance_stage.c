#include "bench/balance_stage.h"

#include <stdlib.h>
#include <string.h>

#include "bench/scenes.h"
#include "common/message.h"
#include "test/renderer_fixture.h"

void stage_open(struct stage *stage, const char *config, uint32_t width, uint32_t height,
                const char *const settings[], size_t count)
{
    const char **overrides = allocate_zeroed(count + 3, sizeof *overrides);
    char *across = format_text("image.width=%u", width),
         *down = format_text("image.height=%u", height);
    overrides[0] = across;
    overrides[1] = down;
    memcpy(overrides + 2, settings, count * sizeof *settings);
    stage->scene = scene_load(config, overrides, REACH_FOLDER);
    if (!stage->scene) fatal("cannot load %s", config);
    free(down);
    free(across);
    free(overrides);
    stage->bvh = scene_tree(stage->scene);
    stage->renderer = renderer_create(stage->scene, stage->bvh);
}

void stage_close(struct stage *stage)
{
    renderer_destroy(stage->renderer);
    free(stage->bvh);
    free(stage->scene);
}
