/* Composing a lot of tiles that wait: the most expensive ones, and cheap ones with them. */
#include "master/queue_parts.h"

bool lot_has_room(const struct queue *queue, const struct draft *draft, uint32_t id,
                  struct pace_lot lot)
{
    const struct item *item = &queue->items[id];
    return draft->work + (double)item->work <= lot.work &&
           draft->worst + (double)item->worst <= lot.worst &&
           draft->pixels + area(item) <= LOT_PIXELS;
}

void lot_add(const struct queue *queue, struct draft *draft, uint32_t id, double work)
{
    const struct item *item = &queue->items[id];
    draft->work += work;
    draft->worst += (double)item->worst;
    draft->pixels += area(item);
    draft->tiles[draft->count++] = queue_tile_of(queue, id);
}

static void take_tile(struct queue *queue, struct draft *draft, uint32_t id)
{
    double work = (double)queue->items[id].work;
    lot_add(queue, draft, id, work);
    queue_unset_waiting(queue, id);
    queue_give(queue, draft->renderer, id, work);
}

/* Takes the most expensive tiles until the lot is full. */
static void take_dear(struct queue *queue, struct draft *draft, struct pace_lot lot)
{
    while (draft->count < LOT_TILES && queue->waiting.count > 0) {
        uint32_t id = heap_top(&queue->waiting);
        if (split_is_due(queue, id, lot, draft->count == 0)) {
            split_tile(queue, id);
            continue;
        }
        if (draft->count > 0 && !lot_has_room(queue, draft, id, lot)) break;
        take_tile(queue, draft, id);
    }
}

/*
 * A pixel costs the master the same whatever is in it. If all cheap pixels came last, they would come faster
 * than the master can take them in. So with each fraction of the remaining work, CHEAP_PART of the same fraction
 * of the remaining pixels is handed out. With the last 5 % of the work come sqrt(0.05) = 22 % of the pixels:
 * cheap tiles, with which renderers finish at about the same time. For cheap tiles a lot may be longer by the
 * factor CHEAP_OVER. Both were found in simulated runs of lantern and garden; a CHEAP_PART of 0.65 in place of
 * 0.5 is 1.5 % faster for the lantern's single samples on 44 processors, with longer tails.
 */
#define CHEAP_PART 0.5
#define CHEAP_OVER 1.25

/* The next tile in the order of the picture that waits and costs no more than this density (work per pixel), or
 * HEAP_ABSENT. Tiles of adaptive passes are left out: they send sampled pixels alone, the most useful ones
 * first. */
static uint32_t next_cheap(struct queue *queue, double density)
{
    for (; queue->next_cheap < queue->item_count; queue->next_cheap++) {
        uint32_t id = queue->next_cheap;
        const struct item *item = &queue->items[id];
        if (!heap_has(&queue->waiting, id) || item->pass != 0) continue;
        if ((double)item->work <= density * (double)area(item)) return id;
    }
    return HEAP_ABSENT;
}

/* Adds cheap tiles to those that were taken, up to this number of pixels in all. */
static void take_cheap(struct queue *queue, struct draft *draft, struct pace_lot lot, double pixels,
                       double density)
{
    struct pace_lot longer = {CHEAP_OVER * lot.work, CHEAP_OVER * lot.worst};
    while (draft->count < LOT_TILES && (double)draft->pixels < pixels) {
        uint32_t id = next_cheap(queue, density);
        if (id == HEAP_ABSENT || !lot_has_room(queue, draft, id, longer)) break;
        take_tile(queue, draft, id);
    }
}

uint32_t lot_give(struct queue *queue, const struct draft *draft, double now)
{
    if (draft->count > 0) pace_given(&queue->pace, draft->renderer, now, draft->work);
    return draft->count;
}

uint32_t lot_fill(struct queue *queue, struct draft *draft, double now, struct pace_lot lot)
{
    double waiting = (double)queue->waiting_pixels, work = queue->waiting_work;
    uint32_t before = draft->count;
    if (lot.work > 0) take_dear(queue, draft, lot);
    if (draft->count > before && queue->settled)
        take_cheap(queue, draft, lot, CHEAP_PART * waiting * lot.work / work, work / waiting);
    return lot_give(queue, draft, now);
}
