#include "bench/balance_passes.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "master/adaptive.h"
#include "master/pass_tiles.h"

struct sim_passes {
    const struct record *record;
    struct queue *queue;
    struct canvas canvas;
    struct adaptive *adaptive;
};

struct sim_passes *sim_passes_begin(const struct record *record, struct queue *queue)
{
    struct sim_passes *passes = allocate(1, sizeof *passes);
    *passes = (struct sim_passes){.record = record, .queue = queue};
    canvas_init(&passes->canvas, record->view.region_w, record->view.region_h);
    passes->adaptive = adaptive_create(&record->view, &passes->canvas, record->target);
    return passes;
}

void sim_passes_end(struct sim_passes *passes)
{
    adaptive_destroy(passes->adaptive);
    canvas_free(&passes->canvas);
    free(passes);
}

const struct record *sim_passes_record(const struct sim_passes *passes)
{
    return passes->record;
}

uint32_t sim_passes_pixels(const struct sim_passes *passes, const struct tile *tile)
{
    return adaptive_pixels(passes->adaptive, tile);
}

void sim_passes_put(struct sim_passes *passes, const struct tile *tile, double seconds)
{
    uint32_t all = tile_pixels(tile), pixels = adaptive_pixels(passes->adaptive, tile);
    struct refinement *refinements = allocate(all, sizeof *refinements);
    float *part = allocate((size_t)pixels + 1, REFINED_FLOATS * sizeof *part);
    struct pixel_floats to = pixel_floats(part, pixels, true);
    adaptive_refinements(passes->adaptive, tile, refinements);
    record_copy(passes->record, tile, refinements, &to);
    adaptive_put(passes->adaptive, tile, part, seconds);
    free(part);
    free(refinements);
}

bool sim_passes_plan(struct sim_passes *passes, double *plan_s)
{
    unsigned done = adaptive_passes(passes->adaptive);
    *plan_s = passes->record->passes[done - 1].plan_s;
    bool more = adaptive_plan(passes->adaptive, HUGE_VAL);
    /* The same pixels ask for the same passes, whoever rendered them. */
    if (more != (done < passes->record->count))
        fatal("the simulated passes are not the recorded ones");
    return more;
}

void sim_passes_add(struct sim_passes *passes)
{
    pass_tiles_add(passes->queue, passes->adaptive);
}
