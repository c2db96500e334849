/* Joining cheap tiles. Where many renderers share few pixels, tiles are smaller than is best for most of them,
 * for the sake of the expensive ones. Adjacent cheap tiles are joined, so that the fixed costs of a tile for the
 * master and for a renderer are paid less often. */
#include <math.h>

#include "common/extremes.h"
#include "master/queue_parts.h"

/*
 * The most work that a joined tile may be predicted to be: this part of an even share, and this part of all
 * work. These are a few shortest lots; at the end it is split again into such. Its worst case may be
 * JOINED_WORST times as much.
 *
 * With a fifth of JOINED_OF_SHARE, single samples on 36 to 52 processors of a scene that is cheap all over
 * (config/hello.ini) are 10 % slower, because the master is busy with tiles for most of the time, those of a
 * scene of leaves 3 % slower, and those of the garden, in whose small tiles rays find more in the cache, 1 %
 * faster. Farms of hundreds of renderers have larger pictures: as large a part of a share would cost 10,000
 * renderers 2 % at the end.
 */
#define JOINED_OF_SHARE 0.05
#define JOINED_OF_ALL   (JOINED_OF_SHARE / 44)

/* The part of an even share goes down with the number of renderers: from JOINED_OF_SHARE at 100 of them to this
 * one at 500 and more. */
#define JOINED_MANY  100.0
#define JOINED_LEAST 0.01

#define JOINED_WORST 2

/*
 * More than that where the master would otherwise not keep up: if tiles take each renderer so long that the master
 * spends JOINED_SERVED of its time on them, there is no need to join more. A joined tile is JOINED_HURRIED of a share
 * at most.
 *
 * Single samples of cheap scenes with 640 x 480 pixels on 56 to 128 processors are 0.5 to 7 % faster, 16 samples of
 * 1920 x 1440 pixels on 1,000 a tenth and more; where there is more work, nothing changes. With half of JOINED_SERVED
 * the former are 9 to 14 % faster, but 16 samples of the lantern on 300 to 700 take 2 % longer. With half of
 * JOINED_HURRIED the gains are less than 3 %.
 */
#define JOINED_SERVED  0.4
#define JOINED_HURRIED 0.1

/* The most work that two tiles may be predicted to be together if they are to be joined. */
static double joined_most(const struct queue *queue)
{
    double all = queue->pace.total, renderers = queue_processors(queue), share = all / renderers;
    double part = fmax(JOINED_LEAST, JOINED_OF_SHARE * fmin(1, JOINED_MANY / renderers));
    double usual = fmin(JOINED_OF_ALL * all, part * share);
    return fmax(usual, fmin(queue_served_work(queue, JOINED_SERVED), JOINED_HURRIED * share));
}

/* Whether the tile has never been handed out, and has this size. */
static bool is_whole(const struct queue *queue, uint32_t id, uint32_t w, uint32_t h)
{
    const struct item *item = &queue->items[id];
    return queue_is_untouched(queue, id) && item->w == w && item->h == h;
}

/* Makes the second tile, beside the first one or below it, part of the first one. */
static void join(struct queue *queue, uint32_t id, uint32_t other)
{
    struct item *whole = &queue->items[id], *part = &queue->items[other];
    queue_uncount_waiting(queue, id);
    queue_unset_waiting(queue, other);
    if (part->y == whole->y)
        whole->w += part->w;
    else
        whole->h += part->h;
    whole->work += part->work;
    whole->worst += part->worst;
    whole->priority = larger_number(whole->priority, part->priority);
    part->finished = part->replaced = true;
    queue->count.tiles--;
    queue_count_waiting(queue, id);
    heap_change(&queue->waiting, id, whole->priority);
}

/* Joins two tiles of this size if they are cheap: `most` work together at most. */
static void join_cheap(struct queue *queue, uint32_t id, uint32_t other, uint32_t w, uint32_t h,
                       double most)
{
    if (!is_whole(queue, id, w, h) || !is_whole(queue, other, w, h)) return;
    const struct item *a = &queue->items[id], *b = &queue->items[other];
    bool cheap = (double)a->work + (double)b->work <= most &&
                 (double)a->worst + (double)b->worst <= JOINED_WORST * most;
    if (cheap) join(queue, id, other);
}

void queue_join(struct queue *queue)
{
    uint32_t edge = queue->config.tile_edge, columns = divide_up(queue->config.width, edge);
    uint32_t rows = divide_up(queue->config.height, edge);
    if (2 * edge > DYNAMIC_EDGE) return;
    double most = joined_most(queue);
    for (uint32_t y = 0; y < rows; y++)
        for (uint32_t x = 0; x + 1 < columns; x += 2)
            join_cheap(queue, y * columns + x, y * columns + x + 1, edge, edge, most);
    for (uint32_t y = 0; y + 1 < rows; y += 2)
        for (uint32_t x = 0; x < columns; x += 2)
            join_cheap(queue, y * columns + x, (y + 1) * columns + x, 2 * edge, edge, most);
}
