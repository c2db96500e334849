/*
 * What somebody has goes to others a second time: what a late one has not begun while others still have work, then what
 * the idle can be done with before those who have it.
 */
#include <math.h>

#include "master/queue_parts.h"

/*
 * The last tile in the renderer's list that nobody has finished, that has not been handed on and that
 * the asker (HOLD_NONE: whoever has nothing) does not hold himself: of all that it holds the least
 * likely to be begun. With spare the first one, which it has begun if any, is left to it.
 */
static struct hold *last_to_pass_on(struct queue *queue, uint32_t renderer, uint32_t asker,
                                    bool spare)
{
    struct holdings *holdings = &queue->holdings;
    struct hold *found = NULL;
    uint32_t first = holdings->holders[renderer].first, i = first;
    while (i != HOLD_NONE) {
        struct hold *hold = &holdings->holds[i];
        bool open = hold->may_pass && !hold->passed_on && !(spare && i == first);
        i = hold->next;
        if (!open || queue->items[hold->id].finished) continue;
        if (asker == HOLD_NONE || !holdings_find(holdings, asker, hold->id)) found = hold;
    }
    return found;
}

/* The renderer on top of the heap that has something to pass on, whoever asks; those that have not are
 * taken off. */
static uint32_t top_of(struct queue *queue, struct heap *heap, bool spare)
{
    uint32_t renderer;
    while ((renderer = heap_top(heap)) != HEAP_ABSENT &&
           !last_to_pass_on(queue, renderer, HOLD_NONE, spare))
        heap_remove(heap, renderer);
    return renderer;
}

/* Who has the tile hears that he may leave it to others. */
static void recall(struct queue *queue, struct hold *hold)
{
    queue_tell(queue, hold, false);
    queue->count.repeated++;
}

/* The tile is part of this lot, too. */
static void pass_on(struct queue *queue, struct draft *draft, struct hold *hold)
{
    uint32_t id = hold->id;
    double work = hold->work;
    recall(queue, hold);
    lot_add(queue, draft, id, work);
    queue_give(queue, draft->renderer, id, work);
}

/* Of a tile: more than one of 32 x 32 has pixels would be of no use. */
#define PIECES_MOST 1024

/*
 * What a late one has not begun waits in pieces if it is too dear for another one: it was given out before anything was
 * known of it. 16 samples of the lantern on 36 to 52 processors are 1.1 % faster than with it passed on as a whole; and
 * one of 44 that is four times slower, at each of their places, costs more than 2 % beside its missing share in 4 of
 * 100 runs, not in 14.
 */
static bool break_dear(struct queue *queue, struct hold *hold)
{
    uint32_t parts = smaller(split_dear_parts(queue, hold->id), PIECES_MOST);
    if (parts == 0 || !pieces_make(queue, hold->id, parts, 0)) return false;
    recall(queue, hold);
    return true;
}

/* It is behind what was dearer than predicted. Its work is what it was when it was given out first, which the answer
 * takes off. */
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

/* Pieces of a tile that has taken long: if the whole takes as long again, each takes a least lot at most. */
static uint32_t pieces_wanted(const struct queue *queue, uint32_t renderer, double seconds)
{
    return (uint32_t)fmax(2, fmin(2 * seconds / pace_least(&queue->pace, renderer), PIECES_MOST));
}

/*
 * What takes a renderer far longer than predicted may do so for as long again: a tile that has taken E
 * seconds beyond what was predicted is taken to be back within R more with a chance of R / E. Broken up
 * in vain it wastes E for one of P renderers, on average R / P of the time of all. When that is less than
 * this part of E, R being the rest of the run, a tile is broken into pieces while others still have work,
 * and not when all stand idle, when its dearest pixel would begin last. Of simulated runs of lantern and
 * garden on 2 to 44 processors: with a larger part, few processors lose up to 3 % by what is broken up
 * in vain.
 */
#define BREAK_LOSS (1.0 / 700)

void repeat_overdue(struct queue *queue, uint32_t asker, double now)
{
    struct pace *pace = &queue->pace;
    uint32_t renderer = top_of(queue, &pace->lost, false);
    if (renderer == HEAP_ABSENT) return;
    struct hold *hold = last_to_pass_on(queue, renderer, asker, false);
    if (!hold) return;
    double overdue = now - pace->renderers[renderer].free_at;
    double loss = pace_even_end(pace, now, queue->waiting_work) / queue_processors(queue);
    if (loss > BREAK_LOSS * overdue) return;
    double known = overdue / pace_seconds(pace, renderer, 1);
    if (!pieces_make(queue, hold->id, pieces_wanted(queue, renderer, overdue), known)) return;
    recall(queue, hold);
}

/*
 * Half of the tiles that whoever has most has not begun, whatever is predicted of them: the asker has
 * nothing, and nothing else to do. So what was predicted far too low does not stay with the one who happened to
 * get it (R. Blumofe & C. Leiserson, Scheduling multithreaded computations by work stealing, J. ACM
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

/* What of the work in a tile the renderer is known to have done. */
static double known_work(const struct queue *queue, uint32_t renderer, uint32_t id)
{
    double unit = pace_seconds(&queue->pace, renderer, 1);
    return unit > 0 ? (double)queue->items[id].seconds / unit : 0;
}

/* Whether it pays that the asker does so much of what this renderer has, too: it is expected to be done
 * before, or nobody knows what to expect, because the renderer is overdue. */
static bool repeat_pays(const struct queue *queue, uint32_t renderer, uint32_t asker, double now,
                        double work)
{
    const struct pace *pace = &queue->pace;
    const struct pace_renderer *r = &pace->renderers[renderer];
    double least = pace_least(pace, renderer);
    return r->lost || now > r->free_at + least ||
           now + pace_seconds(pace, asker, work) + least < r->free_at;
}

/* Pieces for each idle renderer: they may be unlike each other, and smaller ones end more evenly. */
#define PIECES_EACH 2

/*
 * Pieces of so many seconds of work for so many who stand idle. n of them are rendered in seconds / n, and the master
 * takes them in one after the other, in n times what an answer takes it. From where both are the same, sqrt(seconds /
 * answer), more pieces only keep all waiting for the master. Single samples on 36 to 52 processors: two of eight scenes
 * are 1 % faster than with pieces for all who are idle, the others up to 0.4 %.
 */
static uint32_t pieces_worth(const struct queue *queue, double seconds, uint32_t idle)
{
    double most = smaller(PIECES_EACH * idle, PIECES_MOST);
    return (uint32_t)fmax(2, fmin(sqrt(seconds / queue->pace.service_s), most));
}

/* What the renderer's tile of so much work is expected to take another one: by so much longer than predicted as it has
 * taken longer already. HUGE_VAL: nothing is predicted yet. */
static double expected_seconds(const struct queue *queue, uint32_t renderer, uint32_t asker,
                               double now, double work)
{
    const struct pace *pace = &queue->pace;
    if (!(pace->scale > 0)) return HUGE_VAL;
    return pace_seconds(pace, asker, work) + fmax(now - pace->renderers[renderer].free_at, 0);
}

/* Whether somebody else can be given this, which the renderer has begun: in pieces; or whole, if nobody else has been
 * yet, or nobody counts on the renderer. */
static bool can_repeat(const struct queue *queue, uint32_t renderer, const struct hold *hold)
{
    const struct item *item = &queue->items[hold->id];
    bool can_break = item->pieces == 0 && area(item) > 1;
    return can_break || item->copies <= 1 || queue->pace.renderers[renderer].lost;
}

/* What the first one in the heap, *renderer, has begun and others can be given; those before it are taken off, or the
 * idle would wait behind a single pixel for all that comes after it. NULL: nothing. */
static struct hold *top_to_repeat(struct queue *queue, struct heap *heap, uint32_t asker,
                                  uint32_t *renderer)
{
    while ((*renderer = top_of(queue, heap, false)) != HEAP_ABSENT) {
        struct hold *hold = last_to_pass_on(queue, *renderer, asker, false);
        if (!hold || can_repeat(queue, *renderer, hold)) return hold;
        heap_remove(heap, *renderer);
    }
    return NULL;
}

/*
 * What the first one in the heap has begun: in pieces if two or more stand idle, who are done sooner than
 * somebody who has taken long already is expected to be. One alone does all of it, unless somebody else is to
 * be idle soon.
 */
static uint32_t take_begun(struct queue *queue, struct heap *heap, uint32_t asker, double now,
                           struct tile *tiles)
{
    uint32_t renderer;
    struct hold *hold = top_to_repeat(queue, heap, asker, &renderer);
    if (!hold) return 0;
    bool lost = queue->pace.renderers[renderer].lost;
    uint32_t idle = queue_idle_cores(queue);
    /* Before a first answer nobody is given up for late: no use waiting for that. */
    bool known = queue->pace.scale > 0;
    if (known && idle < 2 && queue->pace.holders > (lost ? 0 : 1)) return 0;
    double work = hold->work;
    if (!repeat_pays(queue, renderer, asker, now, work / idle)) {
        double overdue =
            queue->pace.renderers[renderer].free_at + pace_least(&queue->pace, renderer);
        queue->retry = fmin(queue->retry, nextafter(overdue, HUGE_VAL));
        return 0;
    }
    struct draft draft = {.renderer = asker, .tiles = tiles};
    double done = known_work(queue, renderer, hold->id);
    double seconds = expected_seconds(queue, renderer, asker, now, fmax(work, done));
    if (idle >= 2 && pieces_make(queue, hold->id, pieces_worth(queue, seconds, idle), done)) {
        recall(queue, hold);
        return lot_fill(queue, &draft, now, pace_lot(&queue->pace, asker, now, work));
    }
    if (!lost && queue->items[hold->id].copies > 1) return 0;
    pass_on(queue, &draft, hold);
    return lot_give(queue, &draft, now);
}

uint32_t repeat_next(struct queue *queue, uint32_t renderer, double now,
                     struct tile tiles[LOT_TILES])
{
    struct pace *pace = &queue->pace;
    if (queue->holdings.holders[renderer].count > 0 || !queue_has_core(queue, renderer)) return 0;
    uint32_t count = take_unbegun(queue, renderer, now, tiles);
    pace_place(pace);
    if (count == 0) count = take_begun(queue, &pace->lost, renderer, now, tiles);
    if (count == 0) count = take_begun(queue, &pace->soon, renderer, now, tiles);
    if (count == 0) count = take_begun(queue, &pace->last, renderer, now, tiles);
    return count;
}
