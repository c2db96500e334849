/*
 * Handing out a second time what a renderer already holds: what late renderers have not begun, while others
 * still have work; then, to idle renderers, what they are likely to finish before those that hold it.
 */
#include <math.h>

#include "master/queue_parts.h"

/* Whether the tile can be given to another renderer: it has not been passed on before, and is not finished, of which
 * its holder would have been told. */
static bool is_open(const struct hold *hold)
{
    return hold->may_pass && !hold->recalled;
}

/*
 * Of the tiles that the renderer holds, the last one in its list, which is the least likely to be begun, that is
 * not finished, has not been passed on and is not held by the asker, too (HOLD_NONE: any asker). If `spare`, its
 * first tile, which it has begun if any, is left to it. NULL: there is none.
 */
static struct hold *last_to_pass_on(struct queue *queue, uint32_t renderer, uint32_t asker,
                                    bool spare)
{
    struct holdings *holdings = &queue->holdings;
    struct hold *found = NULL;
    uint32_t first = holdings->holders[renderer].first, i = first;
    while (i != HOLD_NONE) {
        struct hold *hold = &holdings->holds[i];
        bool spared = spare && i == first;
        i = hold->next;
        if (spared || !is_open(hold)) continue;
        if (asker == HOLD_NONE || !holdings_find(holdings, asker, hold->id)) found = hold;
    }
    return found;
}

/* The first renderer of the heap that has something to pass on to any asker; those before it, which have not,
 * are removed from the heap. */
static uint32_t top_of(struct queue *queue, struct heap *heap, bool spare)
{
    uint32_t renderer;
    while ((renderer = heap_top(heap)) != HEAP_ABSENT &&
           !last_to_pass_on(queue, renderer, HOLD_NONE, spare))
        heap_remove(heap, renderer);
    return renderer;
}

/* Tells the holder of the tile that it need not render it. */
static void recall(struct queue *queue, struct hold *hold)
{
    queue_tell(queue, hold, false);
    queue->count.repeated++;
}

/* Adds another renderer's tile to this lot, too. */
static void pass_on(struct queue *queue, struct draft *draft, struct hold *hold)
{
    uint32_t id = hold->id;
    double work = hold->work;
    recall(queue, hold);
    lot_add(queue, draft, id, work);
    queue_give(queue, draft->renderer, id, work);
}

/* The most pieces of a tile. More than the pixels of a tile of 32 x 32 would be of no use. */
#define PIECES_MOST 1024

/*
 * Breaks a tile that its holder has not begun, or was given before anything was known of it, into pieces, which
 * wait, if it is too expensive for a single renderer. 16 samples of the lantern on 36 to 52 processors are 1.1 %
 * faster than with the tiles of late renderers passed on as a whole. One of 44 processors that is four times slower,
 * tried at each of the 44 places, costs more than 2 % beyond its missing share in 4 of 100 runs, instead of in 14.
 */
static bool break_dear(struct queue *queue, struct hold *hold)
{
    uint32_t parts = smaller(split_dear_parts(queue, hold->id), PIECES_MOST);
    if (!pieces_make(queue, hold->id, parts, 0)) return false;
    recall(queue, hold);
    return true;
}

/*
 * A tile of more than an even share of all work would be finished long after all others, and would have to be
 * broken up when these are idle and more time has gone into it. On 10,000 processors 5 % more goes into tiles that
 * count with 1024 samples of the lantern, and 0.5 % more with 4096. With half of an even share these gain another 2.5
 * %, 1024 samples nothing, and 16 renderers of the same speed lose 2 % by what is given up half done
 * (test/test_queue_efficiency.c).
 *
 * Where renderers share cores, there is no idle core for the pieces.
 */
void repeat_blind(struct queue *queue)
{
    if (queue->groups) return;
    struct holdings *holdings = &queue->holdings;
    double share = queue->pace.total / queue_processors(queue);
    for (uint32_t renderer = 0; renderer < queue->config.renderers; renderer++) {
        uint32_t i = holdings->holders[renderer].first;
        while (i != HOLD_NONE) {
            struct hold *hold = &holdings->holds[i];
            i = hold->next;
            if (is_open(hold) && hold->work > share) break_dear(queue, hold);
        }
    }
}

/* These tiles are queued behind one that was more expensive than predicted. Their work is passed on as it was
 * when they were first handed out, since that is what the answer subtracts. */
void repeat_late(struct queue *queue, struct draft *draft, struct pace_lot lot)
{
    while (draft->count < LOT_TILES) {
        uint32_t renderer = top_of(queue, &queue->pace.spare, true);
        if (renderer == HEAP_ABSENT) return;
        struct hold *hold = last_to_pass_on(queue, renderer, draft->renderer, true);
        if (hold && break_dear(queue, hold)) continue;
        if (!hold || (draft->count > 0 && !lot_has_room(queue, draft, hold->id, lot))) return;
        pass_on(queue, draft, hold);
    }
}

/* The number of pieces of a tile that has taken this time: if the whole takes as long again, each piece takes a
 * shortest lot at most. */
static uint32_t pieces_wanted(const struct queue *queue, uint32_t renderer, double seconds)
{
    return (uint32_t)fmax(2, fmin(2 * seconds / pace_least(&queue->pace, renderer), PIECES_MOST));
}

/*
 * When to break up a tile that is overdue while others still have work. A tile that takes far longer than
 * predicted may do so for as long again: one that has taken E seconds beyond what was predicted is assumed to be
 * back within R more seconds with a probability of R / E. If it is broken up in vain, E seconds of one of P
 * renderers are wasted; on average that is R / P of the time of all. Let R be the rest of the run. When R / P is
 * less than BREAK_LOSS times E, the tile is broken into pieces while others still have work. If it were broken
 * up only when all are idle, its most expensive pixel would begin last. In simulated runs of lantern and garden
 * on 2 to 44 processors a larger BREAK_LOSS costs few processors up to 3 %, by what is broken up in vain.
 */
#define BREAK_LOSS (1.0 / 700)

/*
 * A tile of few pixels is broken up while the rest of the run is at least as long as its most expensive pixel may take,
 * which is assumed to be BREAK_PIXEL times the mean: at most BREAK_MOST of the time by which the tile is overdue, or
 * many would soon have been back. The slowest sixth of runs with 256 samples of the lantern, on 38 to 50 processors
 * whose speeds differ by 1 %, is 0.3 to 0.7 % faster, all runs on 100 and 128 0.2 to 0.5 %. One of 44 processors that
 * is four times slower, tried at each of the 44 places, costs more than 2 % beyond its missing share in 9 of 220 runs
 * with 16 and 256 samples, instead of in 17. If tiles of all sizes were broken up at a tenth of that time, 16 samples
 * would be 0.15 % slower. In later passes of adaptive sampling a tile's pixels count whether they get samples or not.
 */
#define BREAK_PIXEL 3
#define BREAK_MOST  0.15

/* Whether it pays to break up a tile that has been overdue for this time. */
static bool break_pays(const struct queue *queue, const struct hold *hold, double now,
                       double overdue)
{
    const struct pace *pace = &queue->pace;
    double rest = pace_even_end(pace, now, queue->waiting_work);
    double pixel = fmin(BREAK_PIXEL / (double)area(&queue->items[hold->id]), BREAK_MOST);
    return rest <= pixel * overdue * pace->renderers[hold->renderer].speed ||
           rest / queue_processors(queue) <= BREAK_LOSS * overdue;
}

void repeat_overdue(struct queue *queue, uint32_t asker, double now)
{
    struct pace *pace = &queue->pace;
    uint32_t renderer = top_of(queue, &pace->overdue, false);
    if (renderer == HEAP_ABSENT) return;
    struct hold *hold = last_to_pass_on(queue, renderer, asker, false);
    if (!hold) return;
    double overdue = now - pace->renderers[renderer].free_at;
    if (!break_pays(queue, hold, now, overdue)) return;
    double known = overdue / pace_seconds(pace, renderer, 1);
    if (!pieces_make(queue, hold->id, pieces_wanted(queue, renderer, overdue), known)) return;
    recall(queue, hold);
}

/*
 * Takes over half of the tiles that the renderer with most of them has not begun, whatever their predicted work:
 * the asker has nothing else to do. So work that was predicted far too low does not stay with the renderer that
 * happened to get it (R. Blumofe & C. Leiserson, Scheduling multithreaded computations by work stealing, J. ACM
 * 46, 1999).
 */
static uint32_t take_unbegun(struct queue *queue, uint32_t asker, double now, struct tile *tiles)
{
    const struct pace_lot any = {HUGE_VAL, HUGE_VAL};
    struct holdings *holdings = &queue->holdings;
    uint32_t renderer = holdings_most_open(holdings);
    if (renderer == HEAP_ABSENT) return 0;
    uint32_t most = smaller(holdings->holders[renderer].open / 2, LOT_TILES);
    struct draft draft = {.renderer = asker, .tiles = tiles};
    while (draft.count < most) {
        struct hold *hold = last_to_pass_on(queue, renderer, HOLD_NONE, true);
        if (!hold || (draft.count > 0 && !lot_has_room(queue, &draft, hold->id, any))) break;
        pass_on(queue, &draft, hold);
    }
    return lot_give(queue, &draft, now);
}

static double known_work(const struct queue *queue, uint32_t renderer, uint32_t id)
{
    double unit = pace_seconds(&queue->pace, renderer, 1);
    return unit > 0 ? (double)queue->items[id].seconds / unit : 0;
}

/* Whether it pays that the asker, too, does this part of the work that the renderer holds: it is expected to
 * finish first, or the renderer is overdue, so that its end cannot be predicted. */
static bool repeat_pays(const struct queue *queue, uint32_t renderer, uint32_t asker, double now,
                        double work)
{
    const struct pace *pace = &queue->pace;
    const struct pace_renderer *r = &pace->renderers[renderer];
    double least = pace_least(pace, renderer);
    return r->is_overdue || now > r->free_at + least ||
           now + pace_seconds(pace, asker, work) + least < r->free_at;
}

/* Pieces per idle renderer: their costs may differ, and smaller ones end more evenly. */
#define PIECES_EACH 2

/*
 * The number of pieces into which to break a tile for `idle` idle renderers; seconds: what the tile takes. n
 * pieces are rendered in seconds / n at best, and the master takes them in one after the other, in n times what
 * an answer takes it. More pieces than where both are equal, sqrt(seconds / answer), only keep all waiting for
 * the master. Single samples on 36 to 52 processors: two of eight scenes are 1 % faster than with pieces for all
 * that are idle, the others up to 0.4 %.
 */
static uint32_t pieces_worth(const struct queue *queue, double seconds, uint32_t idle)
{
    double most = smaller(PIECES_EACH * idle, PIECES_MOST);
    return (uint32_t)fmax(2, fmin(sqrt(seconds / queue->pace.service_s), most));
}

/* The seconds that a tile of the renderer, of this predicted work, is expected to take another one: the
 * predicted time, plus what the renderer has taken beyond it so far. HUGE_VAL: nothing is predicted yet. */
static double expected_seconds(const struct queue *queue, uint32_t renderer, uint32_t asker,
                               double now, double work)
{
    const struct pace *pace = &queue->pace;
    if (!(pace->scale > 0)) return HUGE_VAL;
    return pace_seconds(pace, asker, work) + fmax(now - pace->renderers[renderer].free_at, 0);
}

/* Whether this tile, which the renderer has begun, can be given to others: in pieces; or whole, if no other one
 * has it yet, or the renderer is given up for late. */
static bool can_repeat(const struct queue *queue, uint32_t renderer, const struct hold *hold)
{
    const struct item *item = &queue->items[hold->id];
    return area(item) > 1 || item->copies <= 1 || queue->pace.renderers[renderer].is_overdue;
}

/* The tile that the first renderer in the heap has begun and that can be given to others. Renderers whose tile cannot
 * are removed from the heap, or idle ones would wait behind a single pixel for all that comes after it. NULL: there is
 * none. */
static struct hold *top_to_repeat(struct queue *queue, struct heap *heap, uint32_t asker)
{
    uint32_t renderer;
    while ((renderer = top_of(queue, heap, false)) != HEAP_ABSENT) {
        struct hold *hold = last_to_pass_on(queue, renderer, asker, false);
        if (!hold || can_repeat(queue, renderer, hold)) return hold;
        heap_remove(heap, renderer);
    }
    return NULL;
}

/* The tile with which the asker is to help its holder, the first renderer in the heap. NULL: there is none now; where
 * it may pay later, idle renderers ask again then. */
static struct hold *whom_to_help(struct queue *queue, struct heap *heap, uint32_t asker, double now)
{
    struct pace *pace = &queue->pace;
    struct hold *hold = top_to_repeat(queue, heap, asker);
    if (!hold) return NULL;
    const struct pace_renderer *holder = &pace->renderers[hold->renderer];
    uint32_t idle = queue_idle_cores(queue);
    /* Before the first answer no renderer is given up for late: it would be no use to wait for that. */
    bool known = pace->scale > 0;
    if (known && idle < 2 && pace->holders > (holder->is_overdue ? 0 : 1)) return NULL;
    if (repeat_pays(queue, hold->renderer, asker, now, hold->work / idle)) return hold;
    double overdue = holder->free_at + pace_least(pace, hold->renderer);
    queue->retry = fmin(queue->retry, nextafter(overdue, HUGE_VAL));
    return NULL;
}

/*
 * Hands out a tile that another renderer has begun. If two or more are idle, it is broken into pieces, which they
 * finish sooner than a renderer that has taken long already is expected to. A single idle renderer gets the whole,
 * unless another one is going to be idle soon.
 */
static uint32_t help(struct queue *queue, struct hold *hold, uint32_t asker, double now,
                     struct tile *tiles)
{
    double work = hold->work, done = known_work(queue, hold->renderer, hold->id);
    double seconds = expected_seconds(queue, hold->renderer, asker, now, fmax(work, done));
    uint32_t idle = queue_idle_cores(queue);
    struct draft draft = {.renderer = asker, .tiles = tiles};
    if (idle >= 2 && pieces_make(queue, hold->id, pieces_worth(queue, seconds, idle), done)) {
        recall(queue, hold);
        return lot_fill(queue, &draft, now, pace_lot(&queue->pace, asker, now, work));
    }
    if (!queue->pace.renderers[hold->renderer].is_overdue && queue->items[hold->id].copies > 1)
        return 0;
    pass_on(queue, &draft, hold);
    return lot_give(queue, &draft, now);
}

static uint32_t take_begun(struct queue *queue, struct heap *heap, uint32_t asker, double now,
                           struct tile *tiles)
{
    struct hold *hold = whom_to_help(queue, heap, asker, now);
    return hold ? help(queue, hold, asker, now, tiles) : 0;
}

uint32_t repeat_next(struct queue *queue, uint32_t renderer, double now,
                     struct tile tiles[LOT_TILES])
{
    struct pace *pace = &queue->pace;
    if (queue->holdings.holders[renderer].count > 0 || !queue_has_core(queue, renderer)) return 0;
    uint32_t count = take_unbegun(queue, renderer, now, tiles);
    pace_place(pace);
    if (count == 0) count = take_begun(queue, &pace->overdue, renderer, now, tiles);
    if (count == 0) count = take_begun(queue, &pace->soon, renderer, now, tiles);
    if (count == 0) count = take_begun(queue, &pace->last, renderer, now, tiles);
    return count;
}
