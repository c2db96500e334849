#include "master/pass_tiles.h"

#include <math.h>

#include "common/whole.h"

/* Largest edge of the tiles of a later pass. A few of its pixels get as many samples in a late pass as a small
 * tile gets in pass 0, and rays are faster the more of them are traced together. */
#define PASS_EDGE 128u

/* What all tiles of a pass have in common. */
struct pass_tiles {
    struct queue *queue;
    const struct adaptive *adaptive;
    double work_per_second; /* the queue's work, which is that of pass 0, per CPU second */
};

/* Adds a tile, unless no pixel of it gets samples. */
static void add_tile(const struct pass_tiles *it, const struct tile *tile)
{
    struct adaptive_work work = adaptive_work(it->adaptive, tile);
    if (work.samples == 0) return;
    double cost = adaptive_work_seconds(it->adaptive, tile) * it->work_per_second;
    /* Where no time was measured: from what all of the tile's pixels cost in pass 0. */
    if (!(cost > 0 && cost < HUGE_VAL))
        cost = queue_work(it->queue, tile) * work.samples /
               ((double)tile_pixels(tile) * adaptive_first_samples(it->adaptive));
    /* How much first samples lower the error is not known: expensive ones go first, as in pass 0. */
    double priority =
        adaptive_is_first(it->adaptive) ? cost / work.samples : work.removed / fmax(cost, 1e-300);
    queue_add(it->queue, tile, cost, priority);
}

static double work_in(const void *adaptive, const struct tile *part)
{
    return adaptive_work_seconds(adaptive, part);
}

void pass_tiles_add(struct queue *queue, struct adaptive *adaptive)
{
    adaptive_predict_work(adaptive);
    queue_set_part_work(queue, work_in, adaptive);
    const struct tile all = adaptive_whole(adaptive);
    const struct pass_tiles it = {
        .queue = queue,
        .adaptive = adaptive,
        .work_per_second = queue_work(queue, &all) / adaptive_first_seconds(adaptive),
    };
    uint32_t edge = PASS_EDGE, largest = queue_largest_lot(queue);
    while (edge * edge > largest)
        edge /= 2;
    struct tile tile = {.step = 1, .pass = adaptive_passes(adaptive) - 1};
    for (tile.y = 0; tile.y < all.h; tile.y += edge) {
        for (tile.x = 0; tile.x < all.w; tile.x += edge) {
            tile.w = smaller(all.w - tile.x, edge);
            tile.h = smaller(all.h - tile.y, edge);
            add_tile(&it, &tile);
        }
    }
}
