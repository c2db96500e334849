/* Whoever asks gets work: what, how much, and what a second time. */
#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "common/extremes.h"
#include "common/message.h"
#include "master/octave.h"
#include "master/queue_parts.h"

/* A tile is split when it is predicted to take so many times the lot that it is to be; one of no more than
 * DEAR_PIXELS later, for its parts cost more than it does. Single samples of the lantern on 36 to 52 processors are
 * 2 % faster than with one figure for both, those of seven other scenes as fast. With more than so many samples in it
 * its parts cost the same, and it may be most of an even share: of 4096 samples of the lantern on 10,000 processors
 * 8 % more goes into tiles that count. From 64 to 1024 make no difference there. */
#define SPLIT_FROM    1.5
#define SPLIT_SMALL   3
#define SMALL_SAMPLES 256

/* A side of so many pixels is not split. */
#define SPLIT_EDGE 3

/* When all probes but those of four renderers are back, and this part of them at least, one who has been
 * given so many lots is not kept waiting for the others: a renderer may be slow, or stopped. More than the
 * second part is not waited for. Who comes last is often in the dearest part of the picture: single samples
 * of the lantern on 36 to 52 processors are 3 % faster when 90 % are waited for in place of 75 %. */
#define PROBES_LEAST 0.75
#define PROBES_MOST  0.9
#define PROBES_OF    4
#define BLIND_LOTS   4

/* Where renderers share cores, so many for each core share the probes: with fewer of them all are back the
 * sooner, and one who has stopped must have less than what is not waited for. */
#define PROBE_SHARES 4

/* Where so few pixels come to each processor, a tile whose worst is this part of an even share of all is
 * split in any case, down to so many pixels. Neither probes nor its neighbours tell what a tile in the dear
 * parts of a picture takes, up to ten times what is predicted, and there a tile of 4 x 4 pixels costs hardly
 * more than the same part of a larger one, for its rays go many ways: 1 % in tiles of the lantern of 200 us and
 * more, of 2 x 2 pixels 15 %. Single samples of it on 36 to 52 processors are 4 % faster. How few: 200 of the
 * smallest tiles, see queue_auto_edge(); with more of them there is time to break up what takes long. A part of 0.07
 * makes 16 samples of eight scenes up to 0.2 % faster, and single ones 0.5 to 3 % slower. */
#define FEW_PIXELS  (200 * 8 * 8)
#define DEAR_PART   0.1
#define DEAR_PIXELS 16

/* ---- lots ---- */

/* Tiles of like cost keep the order of the picture, in which neighbours are near each other: steps
 * of half an octave. */
static double priority_of(const struct item *item, struct cost cost)
{
    return half_octave_below(cost.worst / (double)area(item));
}

/* A renderer gets its share of the probes, and when it has had so many lots, share by share of what nobody has
 * had: without that, what is left when enough are back would never be known. */
static uint32_t next_probes(struct queue *queue, uint32_t renderer, struct tile *tiles)
{
    uint32_t sharers = PROBE_SHARES * queue_processors(queue), count = 0;
    if (sharers > queue->config.renderers) sharers = queue->config.renderers;
    uint32_t share = divide_up(queue->probes, sharers), *given = &queue->probes_given[renderer];
    uint32_t most =
        queue->holdings.holders[renderer].lots_given >= BLIND_LOTS ? *given + share : share;
    while (*given < most && count < LOT_TILES && queue->next_probe < queue->probes) {
        uint64_t i = (uint64_t)queue->next_probe++ * queue->probe_stride % queue->probes;
        uint32_t id = queue->first_probe + (uint32_t)i;
        tiles[count++] = queue_tile_of(queue, id);
        queue_give(queue, renderer, id, 0);
        ++*given;
    }
    return count;
}

void dynamic_split(struct queue *queue, uint32_t id)
{
    struct item half = queue->items[id], rest = half;
    if (half.w >= half.h) {
        half.w /= 2;
        rest.x += half.w;
        rest.w -= half.w;
    } else {
        half.h /= 2;
        rest.y += half.h;
        rest.h -= half.h;
    }
    double a = cost_predict(&queue->map, half.x, half.y, half.w, half.h).work;
    double b = cost_predict(&queue->map, rest.x, rest.y, rest.w, rest.h).work;
    double part = a + b > 0 ? a / (a + b) : 0.5;
    queue_uncount_waiting(queue, id);
    queue_unforesee(queue, id);
    rest.worst = (float)((double)half.worst * (1 - part));
    half.worst = (float)((double)half.worst * part);
    rest.work = (float)((double)half.work * (1 - part));
    half.work = (float)((double)half.work * part);
    half.rest = queue->item_count;
    queue->items[id] = half;
    queue_foresee(queue, id);
    queue_count_waiting(queue, id);
    queue_set_waiting(queue, queue_new_item(queue, &rest));
    queue->count.tiles++;
}

bool dynamic_can_split(const struct queue *queue, uint32_t id)
{
    const struct item *item = &queue->items[id];
    if (item->is_piece) return false; /* its whole knows how many there are */
    return (item->w > SPLIT_EDGE || item->h > SPLIT_EDGE) && queue->count.tiles < QUEUE_MAX_TILES;
}

/* A lot as it grows. */
struct draft {
    uint32_t renderer;
    struct tile *tiles;
    uint32_t count;
    uint64_t pixels;
    double work, worst;
};

static bool has_room(const struct queue *queue, const struct draft *draft, uint32_t id,
                     struct pace_lot lot)
{
    const struct item *item = &queue->items[id];
    return draft->work + (double)item->work <= lot.work &&
           draft->worst + (double)item->worst <= lot.worst &&
           draft->pixels + area(item) <= LOT_PIXELS;
}

/* The tile, of so much work, is part of the lot. */
static void note_taken(const struct queue *queue, struct draft *draft, uint32_t id, double work)
{
    const struct item *item = &queue->items[id];
    draft->work += work;
    draft->worst += (double)item->worst;
    draft->pixels += area(item);
}

static void take_tile(struct queue *queue, struct draft *draft, uint32_t id)
{
    const struct item *item = &queue->items[id];
    note_taken(queue, draft, id, (double)item->work);
    queue_unset_waiting(queue, id);
    draft->tiles[draft->count++] = queue_tile_of(queue, id);
    queue_give(queue, draft->renderer, id, (double)item->work);
}

/* Whether what the tile takes at worst is more than DEAR_PART of an even share of all work: too much for one
 * renderer to begin at all. Only where few pixels come to each processor, when there are predictions, and of
 * more than DEAR_PIXELS. */
static bool is_dear(const struct queue *queue, const struct item *item)
{
    uint64_t pixels = (uint64_t)queue->config.width * queue->config.height;
    double processors = queue_processors(queue);
    bool few = (double)pixels < FEW_PIXELS * processors;
    if (!queue->settled || !few || area(item) <= DEAR_PIXELS) return false;
    return (double)item->worst * processors > DEAR_PART * queue->pace.total;
}

/* Whether parts of the tile cost more than the same pixels in it do. */
static bool is_small(const struct queue *queue, const struct item *item)
{
    uint32_t samples = queue->config.samples > 0 ? queue->config.samples : 1;
    return area(item) <= DEAR_PIXELS && (uint64_t)area(item) * samples <= SMALL_SAMPLES;
}

/* If all pixels of a tile cost what the dearest around does, it may take so many times as long: with a time limit a
 * 16th of that. Ordinary tiles, which are far below the one, are far below the other, too. */
#define WORST_MOST 4

/* Whether the tile is to be split as it may take too long for any renderer. */
static bool is_too_long(const struct queue *queue, const struct item *item)
{
    double most = queue->config.most_work;
    return queue->settled && most > 0 &&
           ((double)item->work > most || (double)item->worst > WORST_MOST * most);
}

/* Whether the tile that would be the next one of the lot is to be split before. */
static bool is_too_large(const struct queue *queue, const struct draft *draft, uint32_t id,
                         struct pace_lot lot)
{
    const struct item *item = &queue->items[id];
    double from = is_small(queue, item) ? SPLIT_SMALL : SPLIT_FROM;
    bool large = (double)item->work > from * lot.work || (double)item->worst > from * lot.worst;
    return ((draft->count == 0 && large) || is_dear(queue, item) || is_too_long(queue, item)) &&
           dynamic_can_split(queue, id);
}

/* The dearest tiles, so many that they make up a lot. */
static void take_dear(struct queue *queue, struct draft *draft, struct pace_lot lot)
{
    while (draft->count < LOT_TILES && queue->waiting.count > 0) {
        uint32_t id = agenda_first(&queue->waiting);
        if (is_too_large(queue, draft, id, lot)) {
            dynamic_split(queue, id);
            continue;
        }
        if (draft->count > 0 && !has_room(queue, draft, id, lot)) break;
        take_tile(queue, draft, id);
    }
}

/*
 * Pixels cost the master the same whatever is in them. If the cheap ones all came last, they would come
 * faster than it can take them in: so with each part of the work that is left goes this much of the same
 * part of the pixels. With the last 5 % of the work come sqrt(0.05) = 22 % of the pixels: cheap tiles to
 * end evenly with. For them a lot may be longer by the second factor. Found in simulated runs of lantern
 * and garden; 0.65 in place of 0.5 is 1.5 % faster for the lantern's single samples on 44 processors, with
 * longer tails.
 */
#define CHEAP_PART 0.5
#define CHEAP_OVER 1.25

/* The next tile in the order of the picture that waits and is not dearer than this, per pixel, or
 * AGENDA_NONE. None of adaptive passes, which send sampled pixels alone, most useful ones first. */
static uint32_t next_cheap(struct queue *queue, double density)
{
    for (; queue->next_cheap < queue->item_count; queue->next_cheap++) {
        uint32_t id = queue->next_cheap;
        const struct item *item = &queue->items[id];
        if (!agenda_has(&queue->waiting, id) || item->pass != 0) continue;
        if ((double)item->work <= density * (double)area(item)) return id;
    }
    return AGENDA_NONE;
}

/* Cheap tiles join those that were taken. */
static void take_cheap(struct queue *queue, struct draft *draft, struct pace_lot lot, double pixels,
                       double density)
{
    struct pace_lot longer = {CHEAP_OVER * lot.work, CHEAP_OVER * lot.worst};
    while (draft->count < LOT_TILES && (double)draft->pixels < pixels) {
        uint32_t id = next_cheap(queue, density);
        if (id == AGENDA_NONE || !has_room(queue, draft, id, longer)) break;
        take_tile(queue, draft, id);
    }
}

/* What waits, behind what the draft has; returns how many tiles the lot has, which is given out. */
static uint32_t take_tiles(struct queue *queue, struct draft *draft, double now,
                           struct pace_lot lot)
{
    double waiting = (double)queue->waiting_pixels, work = queue->waiting_work;
    uint32_t before = draft->count;
    if (lot.work > 0) take_dear(queue, draft, lot);
    if (draft->count > before && queue->settled)
        take_cheap(queue, draft, lot, CHEAP_PART * waiting * lot.work / work, work / waiting);
    if (draft->count > 0) pace_given(&queue->pace, draft->renderer, now, draft->work);
    return draft->count;
}

/* ---- a second time ---- */

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

/* The tile goes to the asker, too. */
static struct tile pass_on(struct queue *queue, uint32_t asker, struct hold *hold)
{
    uint32_t id = hold->id;
    double work = hold->work;
    recall(queue, hold);
    queue_give(queue, asker, id, work);
    return queue_tile_of(queue, id);
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
    const struct item *item = &queue->items[hold->id];
    if (!is_dear(queue, item)) return false;
    double wanted = (double)item->worst * queue_processors(queue) / (DEAR_PART * queue->pace.total);
    double most = fmin((double)area(item) / DEAR_PIXELS, PIECES_MOST);
    if (!pieces_make(queue, hold->id, (uint32_t)ceil(fmin(wanted, most)), 0)) return false;
    recall(queue, hold);
    return true;
}

/* What the one who is longest overdue has not begun, before all that waits: it is behind what was dearer
 * than predicted. At least a tile, and not more than a lot. Its work is what it was when it was given
 * out first, which the answer takes off. */
static void take_from_late(struct queue *queue, struct draft *draft, struct pace_lot lot)
{
    while (draft->count < LOT_TILES) {
        uint32_t renderer = top_of(queue, &queue->pace.spare, true);
        if (renderer == HEAP_ABSENT) return;
        struct hold *hold = last_to_pass_on(queue, renderer, draft->renderer, true);
        if (hold && break_dear(queue, hold)) continue;
        if (!hold || (draft->count > 0 && !has_room(queue, draft, hold->id, lot))) return;
        note_taken(queue, draft, hold->id, hold->work);
        draft->tiles[draft->count++] = pass_on(queue, draft->renderer, hold);
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

/* The one that is longest overdue has begun all that take_from_late() leaves to it. */
static void break_overdue(struct queue *queue, uint32_t asker, double now)
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
    struct holdings *holdings = &queue->holdings;
    uint32_t renderer = holdings_most_open(holdings), count = 0;
    if (renderer == HEAP_ABSENT) return 0;
    uint32_t most = holdings->holders[renderer].open / 2;
    uint64_t pixels = 0;
    double sum = 0;
    while (count < most && count < LOT_TILES) {
        struct hold *hold = last_to_pass_on(queue, renderer, HOLD_NONE, true);
        if (!hold) break;
        pixels += area(&queue->items[hold->id]);
        if (count > 0 && pixels > LOT_PIXELS) break;
        sum += hold->work;
        tiles[count++] = pass_on(queue, asker, hold);
    }
    if (count > 0) pace_given(&queue->pace, asker, now, sum);
    return count;
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
    double done = known_work(queue, renderer, hold->id);
    double seconds = expected_seconds(queue, renderer, asker, now, fmax(work, done));
    if (idle >= 2 && pieces_make(queue, hold->id, pieces_worth(queue, seconds, idle), done)) {
        recall(queue, hold);
        struct draft draft = {.renderer = asker, .tiles = tiles};
        return take_tiles(queue, &draft, now, pace_lot(&queue->pace, asker, now, work));
    }
    if (!lost && queue->items[hold->id].copies > 1) return 0;
    tiles[0] = pass_on(queue, asker, hold);
    pace_given(&queue->pace, asker, now, work);
    return 1;
}

/* What others have, when nothing waits, if the renderer had better do that. */
static uint32_t next_repeat(struct queue *queue, uint32_t renderer, double now, struct tile *tiles)
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

/* ---- dynamic ---- */

/* What of its work does not depend on the map, which says 1 for every pixel until it is settled. */
static double work_ratio(const struct queue *queue, const struct item *item)
{
    if (!queue->settled) return (double)item->work / (double)area(item);
    return (double)item->work / cost_predict(&queue->map, item->x, item->y, item->w, item->h).work;
}

/* The caller sorts what waits, and counts it in the outlook. */
static void predict(struct queue *queue, uint32_t id, double ratio)
{
    struct item *item = &queue->items[id];
    struct cost cost = cost_predict(&queue->map, item->x, item->y, item->w, item->h);
    item->work = (float)fmin(cost.work * ratio, WORK_MOST);
    item->worst = (float)fmin(larger_number(cost.worst, cost.work) * ratio, WORK_MOST);
    if (is_of_picture(item) && !item->skipped) queue->pace.total += (double)item->work;
    /* In later passes it is the one that it was added with, once that was told by what is known. */
    if (item->pass == 0 || !queue->settled) item->priority = priority_of(item, cost);
    if (!agenda_has(&queue->waiting, id)) return;
    queue->waiting_work += (double)item->work;
    agenda_change(&queue->waiting, id, item->priority);
}

/* The work that renderers have was told in another unit. */
static void predict_held(struct queue *queue, double now)
{
    pace_restart(&queue->pace);
    queue->counted = false;
    for (uint32_t renderer = 0; renderer < queue->config.renderers; renderer++) {
        double held = 0;
        uint32_t i = queue->holdings.holders[renderer].first;
        while (i != HOLD_NONE) {
            struct hold *hold = &queue->holdings.holds[i];
            const struct item *item = &queue->items[hold->id];
            hold->work = item->pass == TILE_PROBE ? 0 : (double)item->work;
            held += hold->work;
            i = hold->next;
        }
        if (held > 0) pace_has(&queue->pace, renderer, now, held);
    }
}

void dynamic_settle(struct queue *queue, double now)
{
    float *ratios = allocate(queue->item_count, sizeof *ratios);
    for (uint32_t id = 0; id < queue->item_count; id++)
        if (queue->items[id].pass != TILE_PROBE)
            ratios[id] = (float)work_ratio(queue, &queue->items[id]);
    cost_settle(&queue->map);
    queue->pace.total = queue->waiting_work = 0;
    queue->outlook = (struct outlook){0};
    agenda_unsort(&queue->waiting);
    for (uint32_t id = 0; id < queue->item_count; id++)
        if (queue->items[id].pass != TILE_PROBE) predict(queue, id, (double)ratios[id]);
    free(ratios);
    if (!queue->settled) predict_held(queue, now);
    /* Whether all probes are back, or one is missing for long: cheap pictures have so many tiles that the master
     * does not get through them otherwise, and rank 0's own renderer, whom it keeps from rendering, has
     * probes, too. Single samples of two such scenes on 36 to 52 processors are half as fast again and more. */
    queue_join(queue);
    agenda_sort(&queue->waiting);
    for (uint32_t id = 0; id < queue->item_count; id++)
        queue_foresee(queue, id);
    queue->settled = true;
    queue->next_cheap = 0;
    queue->pace.blind = false;
    queue->news++;
}

/* So many answers of each of the others are the end of a run: all have short lots then. From 5 to 12 make no difference
 * to single samples on 44 processors, up to 2.5 no gain; with 12 16 samples of the lantern are 0.1 % slower. */
#define END_ANSWERS 8

/*
 * Whether the renderer is the master's own and leaves what waits to the others. It would get a part of its core, down
 * to a fifth, and be the last one: with single samples on 44 processors it was that in most runs of two scenes of
 * three. These are 0.5 % faster without, others up to 0.1 %.
 */
static bool leaves_the_end(const struct queue *queue, uint32_t renderer, double now)
{
    const struct pace *pace = &queue->pace;
    if (!queue->config.master_renders || renderer != 0 || pace->holders == 0) return false;
    if (!queue->settled || !(pace->scale > 0)) return false;
    double serving = END_ANSWERS * (pace->count - 1) * pace->service_s;
    return pace_even_end(pace, now, queue->waiting_work) < serving;
}

/* Whether the renderer had better not wait for the rest of the probes. */
static bool settles(const struct queue *queue, uint32_t renderer)
{
    double others = 1 - (double)PROBES_OF / queue_processors(queue);
    double enough = fmax(PROBES_LEAST, fmin(others, PROBES_MOST));
    return queue->map.blocks_known > 0 && queue->probes_back >= enough * queue->probes &&
           queue->holdings.holders[renderer].lots_given >= BLIND_LOTS;
}

uint32_t dynamic_next(struct queue *queue, uint32_t renderer, double now,
                      struct tile tiles[LOT_TILES])
{
    if (queue_is_full(queue, renderer)) return 0;
    if (!queue->settled && !queue->needs_no_probes) {
        uint32_t probes = next_probes(queue, renderer, tiles);
        if (probes > 0) return probes;
        if (settles(queue, renderer)) dynamic_settle(queue, now);
    }
    /* Who asked before, and got nothing, may get what a late one has. */
    if (queue_check_late(queue, now)) queue->news++;
    /* It may have stopped: messages to it would pile up. */
    if (queue->pace.renderers[renderer].lost) return 0;
    struct pace_lot lot = pace_lot(&queue->pace, renderer, now, queue->waiting_work);
    if (queue->waiting.count == 0) return next_repeat(queue, renderer, now, tiles);
    if (leaves_the_end(queue, renderer, now)) return 0;
    struct draft draft = {.renderer = renderer, .tiles = tiles};
    take_from_late(queue, &draft, lot);
    if (draft.count == 0) break_overdue(queue, renderer, now);
    return take_tiles(queue, &draft, now, lot);
}

/* ---- what comes back ---- */

void dynamic_probed(struct queue *queue, double now)
{
    queue->probes_back++;
    bool first_behind_end = queue->probes_ended && !queue->settled;
    if (first_behind_end || queue->probes_back == queue->probes) dynamic_settle(queue, now);
}

/* What costs so many times what was predicted is news about its neighbours. */
#define SURPRISE 2

/* What waits may be so dear per pixel, and is taken to be half as dear. */
static void warn_of(struct queue *queue, uint32_t id, double density)
{
    struct item *item = &queue->items[id];
    double dear = density * (double)area(item);
    if (!agenda_has(&queue->waiting, id) || (double)item->worst >= dear) return;
    queue_unset_waiting(queue, id);
    queue_unforesee(queue, id);
    pace_place(&queue->pace); /* by what was known */
    queue->pace.total -= (double)item->work;
    item->worst = (float)dear;
    item->work = fmaxf(item->work, (float)(dear / 2));
    item->priority = fmax(item->priority, density);
    queue->pace.total += (double)item->work;
    queue_foresee(queue, id);
    queue_set_waiting(queue, id);
}

/* A tile of pass 0 was dearer than predicted: those around it, and what was split off them or it; of one that was
 * joined, around its first part. */
static void warn_neighbours(struct queue *queue, const struct tile *tile, double work)
{
    uint32_t edge = queue->config.tile_edge, columns = divide_up(queue->config.width, edge);
    uint32_t column = tile->x / edge, row = tile->y / edge;
    uint32_t rows = divide_up(queue->config.height, edge);
    double density = work / tile_pixels(tile);
    for (uint32_t y = row - (row > 0); y <= row + 1 && y < rows; y++) {
        for (uint32_t x = column - (column > 0); x <= column + 1 && x < columns; x++) {
            uint32_t id = y * columns + x;
            do
                warn_of(queue, id, density);
            while ((id = queue->items[id].rest) != 0);
        }
    }
}

void dynamic_learn(struct queue *queue, uint32_t renderer, const struct tile *tile, double seconds,
                   double predicted)
{
    double unit = pace_seconds(&queue->pace, renderer, 1);
    if (!queue->settled || unit <= 0 || seconds <= SURPRISE * predicted * unit) return;
    if (tile->pass > 0) return; /* those of pass 0 around it are finished */
    if (seconds < pace_least(&queue->pace, renderer)) return;
    warn_neighbours(queue, tile, fmin(seconds / unit, WORK_MOST));
}

/* Of the rest of the run: what is in work is expected to take as long again, and when that and what its
 * renderer has behind it ends later, it is time for others to take over. Earlier only the unbegun tiles
 * would change hands: the garden with 16 samples on 44 processors is 2 % slower. Twice as late makes no
 * difference. */
#define LATE_PART 0.5

void dynamic_takes_long(struct queue *queue, uint32_t renderer, uint32_t id, double now,
                        double seconds)
{
    struct pace *pace = &queue->pace;
    const struct hold *hold = holdings_find(&queue->holdings, renderer, id);
    struct tile tile = queue_tile_of(queue, id);
    if (!queue->settled || !(pace->scale > 0) || tile.pass == TILE_PROBE) return;
    dynamic_learn(queue, renderer, &tile, seconds, hold->work);
    queue->items[id].seconds = fmaxf(queue->items[id].seconds, (float)seconds);
    double predicted = pace_seconds(pace, renderer, hold->work);
    double behind = pace_seconds(pace, renderer, pace->renderers[renderer].held) - predicted;
    if (seconds + behind < LATE_PART * pace_even_end(pace, now, queue->waiting_work)) return;
    pace_late(pace, renderer, now - seconds + predicted);
    queue->counted = false;
    queue->news++;
}
