/* The dynamic schedule: a renderer that asks gets probes first; then what late renderers hold, what waits, or
 * what other renderers hold. */
#include <math.h>

#include "master/queue_parts.h"

/*
 * The probes that are waited for: all but the shares of PROBES_OF renderers, at least the part PROBES_LEAST and
 * at most the part PROBES_MOST. When these are back, a renderer that has been given BLIND_LOTS lots is not kept
 * waiting for the others: one may be slow, or stopped. Late probes are often those of the most expensive part of
 * the picture: single samples of the lantern on 36 to 52 processors are 3 % faster when 90 % of the probes are
 * waited for in place of 75 %.
 */
#define PROBES_LEAST 0.75
#define PROBES_MOST  0.9
#define PROBES_OF    4
#define BLIND_LOTS   4

/* Where renderers share cores, PROBE_SHARES renderers per core share the probes. With fewer, all probes are back
 * sooner; with too few, the share of one that has stopped would be more than what is not waited for. */
#define PROBE_SHARES 4

/* A renderer gets its share of the probes. When it has had BLIND_LOTS lots, it gets another share whenever it
 * asks, of the probes that were not handed out yet: otherwise those that are left when enough are back would
 * never be known. */
static uint32_t next_probes(struct queue *queue, uint32_t renderer, struct tile *tiles)
{
    uint32_t sharers = PROBE_SHARES * queue_processors(queue), count = 0;
    if (sharers > queue->config.renderers) sharers = queue->config.renderers;
    uint32_t share = divide_up(queue->map.probes, sharers), *given = &queue->probes_given[renderer];
    uint32_t most =
        queue->holdings.holders[renderer].lots_given >= BLIND_LOTS ? *given + share : share;
    while (*given < most && count < LOT_TILES && queue->next_probe < queue->map.probes) {
        uint64_t i = (uint64_t)queue->next_probe++ * queue->probe_stride % queue->map.probes;
        uint32_t id = queue->first_probe + (uint32_t)i;
        tiles[count++] = queue_tile_of(queue, id);
        queue_give(queue, renderer, id, 0);
        ++*given;
    }
    return count;
}

/* The last phase of a run is the time in which the master takes in END_ANSWERS answers of each other renderer:
 * all have short lots then. Values from 5 to 12 make no difference to single samples on 44 processors, up to 2.5
 * there is no gain; with 12, 16 samples of the lantern are 0.1 % slower. */
#define END_ANSWERS 8

/*
 * Whether the renderer is the master's own and leaves what waits to the others. In the last phase it would get
 * only part of its core, down to a fifth, and finish last: with single samples on 44 processors it did so in
 * most runs of two scenes of three. These are 0.5 % faster without it, others up to 0.1 %.
 */
static bool leaves_the_end(const struct queue *queue, uint32_t renderer, double now)
{
    const struct pace *pace = &queue->pace;
    if (!queue->config.master_renders || renderer != 0 || pace->holders == 0) return false;
    if (!queue->settled || !(pace->scale > 0)) return false;
    double serving = END_ANSWERS * (pace->count - 1) * pace->service_s;
    return pace_even_end(pace, now, queue->waiting_work) < serving;
}

/* Whether the renderer is not to wait for the rest of the probes. */
static bool settles(const struct queue *queue, uint32_t renderer)
{
    double others = 1 - (double)PROBES_OF / queue_processors(queue);
    double enough = fmax(PROBES_LEAST, fmin(others, PROBES_MOST));
    return queue->map.blocks_known > 0 && queue->probes_back >= enough * queue->map.probes &&
           queue->holdings.holders[renderer].lots_given >= BLIND_LOTS;
}

bool dynamic_check_late(struct queue *queue, double now)
{
    bool any = pace_check(&queue->pace, now);
    if (any) queue->groups_counted = false;
    withdraw_overdue(queue);
    return any;
}

uint32_t dynamic_next(struct queue *queue, uint32_t renderer, double now,
                      struct tile tiles[LOT_TILES])
{
    if (queue_is_full(queue, renderer)) return 0;
    if (!queue->settled && !queue->needs_no_probes) {
        uint32_t probes = next_probes(queue, renderer, tiles);
        if (probes > 0) return probes;
        if (settles(queue, renderer)) predictions_settle(queue, now);
    }
    /* Renderers that asked before and got nothing may now get tiles of a late one. */
    if (dynamic_check_late(queue, now)) queue->news++;
    /* The renderer may have stopped: messages to it would pile up. */
    if (queue->pace.renderers[renderer].is_overdue) return 0;
    struct pace_lot lot = pace_lot(&queue->pace, renderer, now, queue->waiting_work);
    if (queue->waiting.count == 0) return repeat_next(queue, renderer, now, tiles);
    if (leaves_the_end(queue, renderer, now)) return 0;
    struct draft draft = {.renderer = renderer, .tiles = tiles};
    repeat_late(queue, &draft, lot);
    if (draft.count == 0) repeat_overdue(queue, renderer, now);
    return lot_fill(queue, &draft, now, lot);
}

/* ---- what comes back ---- */

void dynamic_probed(struct queue *queue, double now)
{
    queue->probes_back++;
    bool first_behind_end = queue->probes_ended && !queue->settled;
    if (first_behind_end || queue->probes_back == queue->map.probes) predictions_settle(queue, now);
}

/* A part of the rest of the run. A tile that has been in work for some time is expected to take as long again.
 * When that, and what its renderer has behind it, takes longer than this part, the renderer counts as late and
 * others take over. Earlier, only tiles that are not begun would change hands: the garden with 16 samples on 44
 * processors is 2 % slower. With twice the part there is no difference. */
#define LATE_PART 0.5

void queue_takes_long(struct queue *queue, uint32_t renderer, uint32_t id, double now,
                      double seconds)
{
    if (!queue->is_dynamic || queue->items[id].finished) return;
    struct pace *pace = &queue->pace;
    const struct hold *hold = holdings_find(&queue->holdings, renderer, id);
    struct tile tile = queue_tile_of(queue, id);
    if (!queue->settled || !(pace->scale > 0) || tile.pass == TILE_PROBE) return;
    predictions_learn(queue, renderer, &tile, seconds, hold->work);
    queue->items[id].seconds = fmaxf(queue->items[id].seconds, (float)seconds);
    double predicted = pace_seconds(pace, renderer, hold->work);
    double behind = pace_seconds(pace, renderer, pace->renderers[renderer].held) - predicted;
    if (seconds + behind < LATE_PART * pace_even_end(pace, now, queue->waiting_work)) return;
    pace_late(pace, renderer, now - seconds + predicted);
    queue->groups_counted = false;
    queue->news++;
}
