/* The work queue under all schedules: tiles that wait, are out with renderers, and come back. */
#include <assert.h>
#include <math.h>
#include <string.h>

#include "common/message.h"
#include "common/prefetch.h"
#include "master/queue_parts.h"

/* ---- tiles that wait ---- */

struct tile queue_tile_of(const struct queue *queue, uint32_t id)
{
    if (queue->is_static) return share_tile(&queue->shares, id);
    struct tile tile;
    const struct item *item = &queue->items[id];
    if (item->pass == TILE_PROBE)
        tile = cost_probe(&queue->map, id - queue->first_probe);
    else
        tile = item_tile(item);
    tile.id = id;
    return tile;
}

void queue_count_waiting(struct queue *queue, uint32_t id)
{
    queue->waiting_work += (double)queue->items[id].work;
    queue->waiting_pixels += area(&queue->items[id]);
}

void queue_uncount_waiting(struct queue *queue, uint32_t id)
{
    queue->waiting_work -= (double)queue->items[id].work;
    queue->waiting_pixels -= area(&queue->items[id]);
}

void queue_set_waiting(struct queue *queue, uint32_t id)
{
    heap_put(&queue->waiting, id, queue->items[id].priority);
    queue_count_waiting(queue, id);
}

void queue_unset_waiting(struct queue *queue, uint32_t id)
{
    heap_remove(&queue->waiting, id);
    queue_uncount_waiting(queue, id);
    if (queue->waiting.count == 0) queue->waiting_work = 0;
}

void queue_reserve(struct queue *queue, uint32_t room)
{
    queue->items = reallocate(queue->items, room, sizeof *queue->items);
    memset(queue->items + queue->item_room, 0, (room - queue->item_room) * sizeof *queue->items);
    heap_reserve(&queue->waiting, room);
    queue->item_room = room;
}

uint32_t queue_new_item(struct queue *queue, const struct item *item)
{
    if (queue->item_count == queue->item_room) queue_reserve(queue, 2 * queue->item_room);
    uint32_t id = queue->item_count++;
    queue->items[id] = *item;
    queue->items[id].hold = HOLD_NONE;
    queue_count_outlook(queue, id);
    return id;
}

void queue_count_outlook(struct queue *queue, uint32_t id)
{
    const struct item *item = &queue->items[id];
    double work = (double)item->work;
    if (!is_of_picture(item)) return;
    if (item->skipped)
        outlook_skip(&queue->outlook, work, area(item));
    else if (item->finished)
        outlook_finish(&queue->outlook, work, area(item), (double)item->seconds);
    else
        outlook_add(&queue->outlook, work, area(item));
}

void queue_uncount_outlook(struct queue *queue, uint32_t id)
{
    const struct item *item = &queue->items[id];
    outlook_remove(&queue->outlook, (double)item->work, area(item));
}

/* ---- handing out ---- */

void queue_give(struct queue *queue, uint32_t renderer, uint32_t id, double work)
{
    bool may_pass = queue->is_dynamic && queue->items[id].pass != TILE_PROBE;
    struct item *item = queue->is_static ? NULL : &queue->items[id];
    queue->groups_counted = false;
    uint32_t hold = holdings_give(&queue->holdings, renderer, id, work, may_pass,
                                  item ? item->hold : HOLD_NONE);
    if (!item) return;
    item->copies++;
    item->hold = hold;
}

/* Takes the tile from the renderer; returns the hold that it had. */
static struct hold take_back(struct queue *queue, uint32_t renderer, uint32_t id)
{
    struct hold hold = holdings_take(&queue->holdings, renderer, id);
    queue->groups_counted = false;
    if (queue->is_static) return hold;
    queue->items[id].copies--;
    queue->items[id].hold = hold.other;
    return hold;
}

void queue_expect(const struct queue *queue, uint32_t renderer)
{
    if (!queue->is_dynamic || queue->waiting.count == 0) return;
    prefetch_block(&queue->holdings.holders[renderer], sizeof *queue->holdings.holders);
    prefetch_block(&queue->pace.renderers[renderer], sizeof *queue->pace.renderers);
    heap_expect(&queue->waiting);
    prefetch_block(&queue->items[heap_top(&queue->waiting)], sizeof *queue->items);
}

uint32_t queue_next(struct queue *queue, uint32_t renderer, double now,
                    struct tile tiles[LOT_TILES])
{
    assert(renderer < queue->config.renderers);
    if (queue->stopped) return 0;
    uint32_t count = queue->is_dynamic ? dynamic_next(queue, renderer, now, tiles)
                                       : plain_next(queue, renderer, tiles);
    if (count > 0) holdings_end_lot(&queue->holdings, renderer);
    return count;
}

/* ---- what comes back ---- */

bool queue_is_full(const struct queue *queue, uint32_t renderer)
{
    return queue->holdings.holders[renderer].lots == LOTS_UNDER_WAY;
}

uint32_t queue_tile_count(const struct queue *queue, uint32_t renderer)
{
    assert(renderer < queue->config.renderers);
    return queue->holdings.holders[renderer].count;
}

bool queue_find_held(const struct queue *queue, uint32_t renderer, uint32_t id, struct tile *tile)
{
    assert(renderer < queue->config.renderers);
    if (!holdings_find(&queue->holdings, renderer, id)) return false;
    *tile = queue_tile_of(queue, id);
    return true;
}

bool queue_probed(struct queue *queue, const struct tile *probe, const float *seconds)
{
    return cost_put(&queue->map, probe, seconds);
}

void queue_set_finished(struct queue *queue, uint32_t id, double seconds)
{
    queue_uncount_outlook(queue, id);
    queue->items[id].finished = true;
    queue->items[id].seconds = (float)seconds;
    queue_count_outlook(queue, id);
}

/* Returns what becomes of an answer, and marks the tile as finished; under fixed shares share_finish() does that.
 * seconds: what it took. */
static enum answer mark_finished(struct queue *queue, uint32_t id, double seconds)
{
    if (queue_is_finished(queue, id)) return ANSWER_IN_VAIN;
    if (queue->is_static) return ANSWER_COUNTS;
    struct item *item = &queue->items[id];
    queue_tell_finished(queue, id);
    pieces_drop(queue, id);
    if (!item->is_piece) {
        queue_set_finished(queue, id, seconds);
        return ANSWER_COUNTS;
    }
    item->finished = true;
    item->seconds = (float)seconds;
    pieces_keep(queue, id);
    return ANSWER_KEPT;
}

enum answer queue_finish(struct queue *queue, uint32_t renderer, uint32_t id, double now,
                         double seconds)
{
    struct tile tile = queue_tile_of(queue, id);
    struct hold hold = take_back(queue, renderer, id);
    bool holds = queue->holdings.holders[renderer].count > 0;
    if (tile.pass == TILE_PROBE) {
        /* If the last tile that it held was a probe, the renderer may be late by now. Nothing else would tell
         * that it has answered. */
        if (!holds) pace_dropped(&queue->pace, renderer, now, 0, false);
        dynamic_probed(queue, now);
        return ANSWER_IN_VAIN;
    }
    if (queue->is_dynamic) {
        predictions_learn(queue, renderer, &tile, seconds, hold.work);
        pace_answered(&queue->pace, renderer, now, hold.work, seconds, holds);
    }
    enum answer answer = mark_finished(queue, id, seconds);
    if (answer == ANSWER_IN_VAIN) queue->count.wasted_s += seconds;
    if (answer != ANSWER_COUNTS) return answer;
    queue->count.finished++;
    queue->count.pixels_finished += tile_pixels(&tile);
    if (queue->is_static) share_finish(&queue->shares, &tile, now, seconds);
    return answer;
}

void queue_tell(struct queue *queue, struct hold *hold, bool finished)
{
    if (!hold->recalled) holdings_recall(&queue->holdings, hold);
    queue->recalls = grow(queue->recalls, queue->recall_count, sizeof *queue->recalls);
    queue->recalls[queue->recall_count++] = (struct recall){hold->renderer, hold->id, finished};
}

void queue_tell_finished(struct queue *queue, uint32_t id)
{
    uint32_t first = queue->items[id].hold, i = first;
    if (first == HOLD_NONE) return;
    do {
        struct hold *hold = &queue->holdings.holds[i];
        if (hold->may_pass) queue_tell(queue, hold, true);
        i = hold->other;
    } while (i != first);
}

bool queue_next_recall(struct queue *queue, struct recall *recall)
{
    while (queue->recall_count > 0) {
        *recall = queue->recalls[--queue->recall_count];
        /* The tile may have come back in the meantime. */
        if (holdings_find(&queue->holdings, recall->renderer, recall->id)) return true;
    }
    return false;
}

bool queue_has_recalls(const struct queue *queue)
{
    return queue->recall_count > 0;
}

bool queue_is_recalled(const struct queue *queue, uint32_t renderer, uint32_t id)
{
    const struct hold *hold = holdings_find(&queue->holdings, renderer, id);
    return hold && hold->recalled;
}

void queue_drop(struct queue *queue, uint32_t renderer, uint32_t id, double now, double seconds)
{
    struct hold hold = take_back(queue, renderer, id);
    assert(hold.recalled);
    queue->count.wasted_s += seconds;
    if (!queue->is_dynamic) return;
    withdraw_dropped(queue, id);
    pace_dropped(&queue->pace, renderer, now, hold.work,
                 queue->holdings.holders[renderer].count > 0);
}

double queue_answer_after(const struct queue *queue)
{
    if (!queue->is_dynamic) return HUGE_VAL;
    return pace_answer_after(&queue->pace);
}

uint32_t queue_report_times(const struct queue *queue, uint32_t renderer, const struct tile *tiles,
                            uint32_t count, float report_s[LOT_TILES])
{
    /* Where renderers share cores, wall time says little about a tile, and nothing is done twice. */
    if (!queue->is_dynamic || queue->groups) return 0;
    if (count == 0 || tiles[0].pass == TILE_PROBE) return 0;
    double least = pace_report_after(&queue->pace, renderer, 0);
    double each = pace_report_after(&queue->pace, renderer, 1) - least;
    for (uint32_t i = 0; i < count; i++) {
        double work = queue->settled ? (double)queue->items[tiles[i].id].work : 0;
        report_s[i] = (float)(least + each * work);
    }
    return count;
}

double queue_lot_seconds(const struct queue *queue, uint32_t renderer, const struct tile *tiles,
                         uint32_t count)
{
    double work = 0;
    if (!queue->is_dynamic || !queue->settled) return 0;
    for (uint32_t i = 0; i < count; i++)
        work += (double)queue->items[tiles[i].id].work;
    return pace_seconds(&queue->pace, renderer, work);
}

void queue_served(struct queue *queue, double seconds, double pixels)
{
    if (queue->is_dynamic) pace_served(&queue->pace, seconds, pixels);
}

/* ---- from outside ---- */

void queue_add(struct queue *queue, const struct tile *tile, double work, double priority)
{
    struct item item = {.x = tile->x,
                        .y = tile->y,
                        .w = tile->w,
                        .h = tile->h,
                        .pass = tile->pass,
                        .work = (float)work,
                        .priority = priority};
    assert(queue->is_dynamic && tile->pass != TILE_PROBE);
    assert(area(&item) <= queue_largest_lot(queue));
    queue->needs_no_probes = queue->withdraws = false;
    queue_set_waiting(queue, queue_new_item(queue, &item));
    queue->pace.total += work;
    queue->count.tiles++;
    queue->news++;
}

void queue_set_part_work(struct queue *queue, queue_part_work *part_work, const void *state)
{
    queue->part_work = part_work;
    queue->part_state = state;
}

double queue_work(const struct queue *queue, const struct tile *tile)
{
    if (!queue->settled) return (double)tile->w * tile->h;
    return cost_predict(&queue->map, tile->x, tile->y, tile->w, tile->h).work;
}

double queue_ends(const struct queue *queue, double now)
{
    if (!queue->is_dynamic || !queue->settled) return 0;
    struct outlook_share share = outlook_share(&queue->outlook);
    uint32_t at_work = queue->config.renderers - queue->pace.overdue_count;
    if (!(share.finished > share.skipped) || at_work == 0) return 0;
    return now + share.seconds * (1 - share.finished) / (1 - share.skipped) / at_work;
}

bool queue_is_untouched(const struct queue *queue, uint32_t id)
{
    return heap_has(&queue->waiting, id) && !queue->items[id].is_piece;
}

void queue_look(struct queue *queue, double now)
{
    if (queue->is_dynamic) dynamic_check_late(queue, now);
    if (now >= queue->retry) queue->retry = HUGE_VAL;
}

void queue_stop(struct queue *queue)
{
    queue->stopped = true;
}

bool queue_complete(const struct queue *queue)
{
    return queue->count.finished == queue->count.tiles;
}

bool queue_over(struct queue *queue, uint32_t renderer)
{
    /* Until the queue is complete, a renderer may fall silent and leave its tiles to this one. */
    return queue->stopped ? queue_tile_count(queue, renderer) == 0 : queue_complete(queue);
}

uint64_t queue_news(const struct queue *queue)
{
    return queue->news;
}

double queue_wake(struct queue *queue)
{
    if (!queue->is_dynamic || queue->stopped) return HUGE_VAL;
    return fmin(pace_next_late(&queue->pace), queue->retry);
}

double queue_calm(struct queue *queue, double now)
{
    if (!queue->is_dynamic || queue->stopped) return 0;
    /* Renderers without work wait for any answer, and for what rank 0's own renderer does. For those that hold
     * nothing but probes it is not known when they will be done. */
    pace_place(&queue->pace);
    if (queue->pace.soon.count + queue->pace.overdue_count < queue->config.renderers) return 0;
    return pace_calm(&queue->pace, now);
}

struct queue_count queue_count(const struct queue *queue)
{
    struct queue_count count = queue->count;
    double pixels = (double)queue->config.width * queue->config.height;
    struct outlook_share share = {.finished = (double)count.pixels_finished / pixels,
                                  .skipped = (double)queue->pixels_skipped / pixels};
    if (queue->is_static) share = share_outlook(&queue->shares);
    if (queue->is_dynamic) share = outlook_share(&queue->outlook);
    count.share_finished = queue_complete(queue) ? 1 : fmin(share.finished, 1);
    count.share_skipped = fmin(share.skipped, 1);
    return count;
}

bool queue_unfinished(const struct queue *queue, uint32_t *next, struct tile *tile)
{
    uint32_t ids = queue->is_static ? (uint32_t)queue->shares.ids : queue->item_count;
    while (*next < ids) {
        uint32_t id = (*next)++;
        *tile = queue_tile_of(queue, id);
        bool is_one = queue->is_static ? share_has_pixels(tile) : tile->pass != TILE_PROBE;
        if (is_one && !queue_is_finished(queue, id)) return true;
    }
    return false;
}

uint32_t queue_largest_lot(const struct queue *queue)
{
    if (!queue->is_dynamic) return queue->largest;
    uint64_t picture = (uint64_t)queue->config.width * queue->config.height;
    uint32_t lot = picture < LOT_PIXELS ? (uint32_t)picture : LOT_PIXELS;
    return lot > queue->largest ? lot : queue->largest;
}
