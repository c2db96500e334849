/* First samples of pixels that pass 0 did not get to, in passes for a lattice of pixels each (master/lattice.h). */
#include <assert.h>
#include <math.h>

#include "master/adaptive_state.h"
#include "master/lattice.h"

void adaptive_cut(struct adaptive *adaptive, double seconds)
{
    struct pass *pass = &adaptive->pass;
    const struct statistics *statistics = &adaptive->statistics;
    if (pass->count > 1 || statistics->unsampled == 0) return;
    size_t pixels = canvas_pixels(statistics->canvas);
    for (size_t i = 0; i < pixels; i++)
        pass->next[i] = statistics->level[i];
    pass->missing = pass->asked = 0;
    uint64_t sampled = pixels - statistics->unsampled;
    if (seconds > 0)
        adaptive->unsampled_s = seconds / (double)statistics->unsampled;
    else if (sampled > 0)
        adaptive->unsampled_s = adaptive->effort.on_first.seconds / (double)sampled;
}

/* Counts the pixels of a lattice that have no samples. Where next is not NULL, they are to get some in the next pass.
 */
static uint64_t find_unsampled(const struct statistics *statistics, uint32_t lattice, uint8_t *next)
{
    const struct canvas *canvas = statistics->canvas;
    uint32_t step = lattice_step(lattice);
    uint64_t count = 0;
    for (uint32_t y = 0; y < canvas->height; y += lattice_row_step(lattice))
        for (uint32_t x = lattice_first(lattice, y); x < canvas->width; x += step) {
            size_t i = (size_t)y * canvas->width + x;
            if (statistics->level[i] > 0) continue;
            if (next) next[i] = 1;
            count++;
        }
    return count;
}

/* The finest lattice for which there is time; where there is time for none, the coarsest one that has a pixel without
 * samples. */
static uint32_t lattice_within(const struct adaptive *adaptive, double seconds)
{
    uint32_t lattice = LATTICE_COARSEST;
    bool any = find_unsampled(&adaptive->statistics, lattice, NULL) > 0;
    while (lattice > 0) {
        uint64_t finer = find_unsampled(&adaptive->statistics, lattice - 1, NULL);
        bool fits = adaptive->unsampled_s > 0 ? (double)finer * adaptive->unsampled_s <= seconds
                                              : seconds == HUGE_VAL;
        if (any && !fits) break;
        any = finer > 0;
        lattice--;
    }
    return lattice;
}

/* Updates what a pixel's first samples take, from those of the last pass. */
static void learn_first(struct adaptive *adaptive)
{
    if (adaptive->pass.asked == 0) return;
    adaptive->unsampled_s = (adaptive->effort.on_first.seconds - adaptive->first_before_s) /
                            (double)adaptive->pass.asked;
}

/* Plans a pass for a lattice that has pixels without samples. All pixels of the last pass must be in. */
static void plan_lattice(struct adaptive *adaptive, uint32_t lattice)
{
    assert(adaptive->pass.missing == 0);
    uint64_t pixels = find_unsampled(&adaptive->statistics, lattice, adaptive->pass.next);
    assert(pixels > 0);
    adaptive->first_before_s = adaptive->effort.on_first.seconds;
    pass_begin(&adaptive->pass, true, -1 - (double)lattice, pixels);
}

void adaptive_plan_first(struct adaptive *adaptive, double seconds)
{
    learn_first(adaptive);
    plan_lattice(adaptive, lattice_within(adaptive, seconds));
}

/* A pass 0 that lacks pixels is cut off only when it is known that the earlier run had a lattice's pass after it. */
bool adaptive_replan_first(struct adaptive *adaptive, double limit)
{
    double lattice = -1 - limit;
    bool is_one = lattice >= 0 && lattice <= LATTICE_COARSEST && lattice == floor(lattice);
    if (!is_one || find_unsampled(&adaptive->statistics, (uint32_t)lattice, NULL) == 0)
        return false;
    adaptive_cut(adaptive, 0);
    plan_lattice(adaptive, (uint32_t)lattice);
    return true;
}
