/* Joining cheap tiles. Where many renderers share few pixels, tiles are smaller than is best for most of them,
 * for the sake of the expensive ones. Adjacent cheap tiles are joined, so that the fixed costs of a tile for the
 * master and for a renderer are paid less often. */
#include <math.h>

#include "common/extremes.h"
#include "master/queue_parts.h"

/*
 * The most work that a joined tile may be predicted to be: this part of all work, and this part of an even share.
 * These are a few shortest lots; at the end it is split again into such. Its worst case may be JOINED_WORST times as
 * much.
 *
 * Where no tiles are joined, four samples of twelve scenes on 32 to 44 processors are 3.5 % slower, of one that is
 * cheap all over (config/hello.ini) 13 %, because the master is busy with tiles for most of the time. With twice
 * JOINED_OF_SHARE four samples of nine scenes on 16 to 128 are 0.5 % faster, but 1024 samples of the lantern with 7680
 * x 4320 pixels on 8,000 to 10,000 0.5 % slower; with half of it the former are 2.3 % slower.
 */
#define JOINED_OF_ALL   0.001
#define JOINED_OF_SHARE 0.1
#define JOINED_WORST    2

/* The most work that two tiles may be predicted to be together if they are to be joined. */
static double joined_most(const struct queue *queue)
{
    double share = queue->pace.total / queue_processors(queue);
    return fmin(JOINED_OF_ALL * queue->pace.total, JOINED_OF_SHARE * share);
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
