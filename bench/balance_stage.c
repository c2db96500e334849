#include "bench/balance_stage.h"

#include <stdlib.h>

#include "common/message.h"
#include "master/load.h"
#include "worker/bvh.h"

/* Sets scene and view. */
static void load(struct stage *stage, const char *config, char *overrides[], size_t count)
{
    struct job job;
    if (!load_job(config, overrides, count, REACH_FOLDER, &job)) fatal("cannot load %s", config);
    stage->view = settings_view(&job.settings);
    stage->scene = builder_finish(job.builder, &stage->view);
    job_free(&job);
}

void stage_open(struct stage *stage, const char *config, uint32_t width, uint32_t height,
                char *const settings[], size_t count)
{
    char **overrides = allocate(count + 2, sizeof *overrides);
    overrides[0] = format_text("image.width=%u", width);
    overrides[1] = format_text("image.height=%u", height);
    for (size_t i = 0; i < count; i++)
        overrides[2 + i] = copy_text(settings[i]);
    load(stage, config, overrides, count + 2);
    for (size_t i = 0; i < count + 2; i++)
        free(overrides[i]);
    free(overrides);
    size_t bytes = bvh_bytes_bound(stage->scene);
    stage->bvh = aligned_alloc(BVH_ALIGNMENT, bytes);
    if (!stage->bvh) fatal("out of memory");
    bvh_build(stage->scene, stage->bvh, 1);
    stage->renderer = renderer_create(stage->scene, stage->bvh);
}

void stage_close(struct stage *stage)
{
    renderer_destroy(stage->renderer);
    free(stage->bvh);
    free(stage->scene);
}
