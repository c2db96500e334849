#include "master/pace.h"

#include <math.h>
#include <stdlib.h>

#include "common/extremes.h"
#include "common/message.h"

/*
 * A lot is this part of an even share of all that waits. Factoring (Hummel, Schonberg & Flynn 1992) takes a
 * half: a lot may then take twice as long as predicted and still end with the others. It is a quarter, as a
 * renderer has two lots.
 */
#define SHARE_PART (1.0 / 4)

/* The shortest lot, as a part of the whole time: the times at which renderers finish may differ by that. Where
 * renderers share cores, it is longer by the number of renderers per core; and by LEAST_SHARED, as renderers
 * that take turns finish at about the same time. With 44 on two cores a LEAST_SHARED of 3 makes a tenth fewer
 * answers, which take the master as long. */
#define LEAST_PART   0.003
#define LEAST_SHARED 2

/* The part of the master's time that answers take when all lots are of the least length: N s / L with N
 * renderers, s seconds per answer and L per lot. It is more where short results come in parts
 * (common/protocol.h). The first lots are long, so that the average is far lower. */
#define SERVICE_MOST 0.4

/* The worst case of a lot, that all its tiles are as expensive as they may be, is at most WORST_PART of an even
 * share, or WORST_LEAST shortest lots. In simulated runs of lantern and garden on 36 to 52 processors a
 * WORST_PART of a quarter makes 6 to 22 % more messages, and none of them faster; with three eighths single
 * samples of the garden are slower. With a WORST_LEAST of 2, 16 renderers one of which is slow lose another 1.5 %
 * (test/test_queue_efficiency.c). */
#define WORST_PART  (1.0 / 3)
#define WORST_LEAST 1.5

/* A renderer is late when what it holds takes LATE_FACTOR times as long as predicted, and a shortest lot more.
 * In simulated runs of the lantern on 44 processors, one of them four times slower, the worst place for that one
 * loses 5 %; with three times and two shortest lots 7 %. Nothing else is slower. */
#define LATE_FACTOR 2

/* A renderer reports a tile that takes TELL_FACTOR times as long as predicted, and a shortest lot more. With
 * twice there are a tenth more messages, and single samples of the lantern on 36 to 52 processors take as long. */
#define TELL_FACTOR 3

/* The longest time slice, in seconds, that a process has a core while others wait for it: systems are at 3 to 10
 * ms. */
#define TURN_S 0.01

/* The longest lot, seconds: so progress shows several times a second, and little is lost with a lot. It is
 * longer where answers would otherwise take more than the part SERVICE_EASY of the master's time. */
#define LONGEST_S    0.25
#define SERVICE_EASY 0.01

/* The master's seconds per answer until they are measured: some MPICH messages and a copy. */
#define SERVICE_GUESS_S 5e-6

/* The part of the master's time that may go into partial answers to lots, nearly all of which bring no news: half of
 * the hundredth of a core that the master is to take. */
#define SERVICE_PARTIAL 0.005

/* The weight of a new measurement in the estimate of the master's seconds per answer; and the least part of an
 * answer's time that is taken to be independent of its pixels: measurements are rough. */
#define SERVICE_NEW  0.05
#define SERVICE_PART (1.0 / 8)

/* When less than this part of a lot would be left after a lot, the rest is added to it; and a renderer that has
 * work gets no lot that is smaller than this part. */
#define REST_PART 0.5

/* The least sum of speeds, for when all renderers are overdue. */
#define LEAST_SPEED 1e-3

/* The size of a lot before there are useful predictions: this part of an even share. Two such lots are to last
 * until the master has heard from all renderers, which takes longer the more there are: BLIND_EACH for each
 * renderer, at most BLIND_PART. */
#define BLIND_PART (1.0 / 14)
#define BLIND_EACH (1.0 / 616)

#define NOBODY HEAP_ABSENT

void pace_init(struct pace *pace, uint32_t renderers)
{
    *pace = (struct pace){
        .count = renderers, .speed = renderers, .service_s = SERVICE_GUESS_S, .unplaced = NOBODY};
    pace->renderers = allocate_zeroed(renderers, sizeof *pace->renderers);
    for (uint32_t i = 0; i < renderers; i++)
        pace->renderers[i].speed = pace->renderers[i].stretch = 1;
    heap_reserve(&pace->last, renderers);
    heap_reserve(&pace->soon, renderers);
    heap_reserve(&pace->late, renderers);
    heap_reserve(&pace->overdue, renderers);
    heap_reserve(&pace->spare, renderers);
}

void pace_free(struct pace *pace)
{
    free(pace->renderers);
    heap_free(&pace->last);
    heap_free(&pace->soon);
    heap_free(&pace->late);
    heap_free(&pace->overdue);
    heap_free(&pace->spare);
}

double pace_seconds(const struct pace *pace, uint32_t renderer, double work)
{
    return work * pace->scale / pace->renderers[renderer].speed;
}

/* When a renderer that holds work will be given up for late. */
static double late_at(const struct pace *pace, uint32_t renderer)
{
    const struct pace_renderer *r = &pace->renderers[renderer];
    double longer = (LATE_FACTOR - 1) * pace_seconds(pace, renderer, r->held);
    return r->free_at + longer + pace_least(pace, renderer) + (r->stretch - 1) * TURN_S;
}

void pace_place(struct pace *pace)
{
    uint32_t renderer = pace->unplaced;
    if (renderer == NOBODY) return;
    double free_at = pace->renderers[renderer].free_at;
    pace->unplaced = NOBODY;
    heap_put(&pace->last, renderer, free_at);
    heap_put(&pace->soon, renderer, -free_at);
    heap_put(&pace->late, renderer, -late_at(pace, renderer));
}

/* Subtracts the renderer from the sums over renderers, before it changes. */
static void withdraw(struct pace *pace, const struct pace_renderer *r)
{
    if (pace->unplaced != (uint32_t)(r - pace->renderers)) pace_place(pace);
    if (r->is_overdue) return;
    pace->speed -= r->speed;
    if (!r->holds) return;
    pace->holders--;
    pace->holding -= r->speed;
    pace->holding_until -= r->speed * r->free_at;
}

/* Removes the renderer from all heaps, until it is given more work. */
static void overlook(struct pace *pace, uint32_t renderer)
{
    if (pace->unplaced == renderer) pace->unplaced = NOBODY;
    heap_remove(&pace->last, renderer);
    heap_remove(&pace->soon, renderer);
    heap_remove(&pace->late, renderer);
    heap_remove(&pace->overdue, renderer);
    heap_remove(&pace->spare, renderer);
}

/* Adds the renderer, which has changed and is no longer overdue, to the sums again. Its places in the heaps are
 * updated later, as the next one to change may be the same. */
static void enter(struct pace *pace, uint32_t renderer)
{
    struct pace_renderer *r = &pace->renderers[renderer];
    if (r->is_overdue) {
        pace->overdue_count--;
        r->is_overdue = false;
        heap_remove(&pace->overdue, renderer);
        heap_remove(&pace->spare, renderer);
    }
    pace->speed += r->speed;
    if (!r->holds) {
        overlook(pace, renderer);
        return;
    }
    pace->holders++;
    pace->holding += r->speed;
    pace->holding_until += r->speed * r->free_at;
    pace->unplaced = renderer;
}

void pace_restart(struct pace *pace)
{
    for (uint32_t i = 0; i < pace->count; i++) {
        struct pace_renderer *r = &pace->renderers[i];
        overlook(pace, i);
        *r = (struct pace_renderer){.speed = r->speed, .stretch = r->stretch};
    }
    pace->speed = pace->holding = pace->holding_until = 0;
    pace->holders = pace->overdue_count = 0;
    for (uint32_t i = 0; i < pace->count; i++)
        enter(pace, i);
    pace->work = pace->busy = pace->given = pace->lots = pace->scale = 0;
}

/* After the first answer, from which the scale is known: all that renderers hold counts as begun now. */
static void date_unknown(struct pace *pace, double now)
{
    for (uint32_t i = 0; i < pace->count; i++) {
        struct pace_renderer *r = &pace->renderers[i];
        if (!r->holds) continue;
        withdraw(pace, r);
        r->free_at = now + pace_seconds(pace, i, r->held);
        enter(pace, i);
    }
}

double pace_calm(struct pace *pace, double now)
{
    pace_place(pace);
    if (!pace->soon.count || !(pace->scale > 0)) return 0;
    double known = pace->busy / pace->count;
    return larger_number(smaller_number(-pace->soon.entries[0].key - now, known), 0);
}

double pace_next_late(struct pace *pace)
{
    pace_place(pace);
    return pace->late.count && pace->scale > 0 ? -pace->late.entries[0].key : HUGE_VAL;
}

void pace_late(struct pace *pace, uint32_t renderer, double due)
{
    struct pace_renderer *r = &pace->renderers[renderer];
    withdraw(pace, r);
    pace->overdue_count += !r->is_overdue;
    r->is_overdue = true;
    r->free_at = due;
    overlook(pace, renderer);
    heap_put(&pace->overdue, renderer, -due);
    heap_put(&pace->spare, renderer, -due);
}

bool pace_check(struct pace *pace, double now)
{
    bool any = false;
    uint32_t unplaced = pace->unplaced;
    if (unplaced != NOBODY && pace->renderers[unplaced].free_at < now) pace_place(pace);
    while (pace->scale > 0 && pace->late.count > 0 && -pace->late.entries[0].key < now) {
        uint32_t renderer = heap_top(&pace->late);
        if (renderer == pace->unplaced) {
            pace_place(pace);
            continue;
        }
        pace_late(pace, renderer, pace->renderers[renderer].free_at);
        any = true;
    }
    return any;
}

void pace_given(struct pace *pace, uint32_t renderer, double now, double work)
{
    struct pace_renderer *r = &pace->renderers[renderer];
    withdraw(pace, r);
    double start = r->holds ? larger_number(r->free_at, now) : now;
    r->holds = true;
    r->held += work;
    r->free_at = start + pace_seconds(pace, renderer, work);
    pace->given += work;
    pace->lots++;
    enter(pace, renderer);
}

/* The speed of a renderer: predicted over measured time, as if it had answered one average lot at speed 1
 * before. Answers older than about half of the time so far are forgotten. */
static void measure_speed(const struct pace *pace, struct pace_renderer *r, double now, double work,
                          double busy)
{
    double kept = now > 0 ? exp(-2 * busy / now) : 1;
    r->work = r->work * kept + work;
    r->busy = r->busy * kept + busy;
    double lot = pace->given / pace->lots * pace->scale;
    if (lot > 0) r->speed = (lot + r->work * pace->scale) / (lot + r->busy);
}

/* The renderer, which is not in the sums, holds this work no more; holds: it still holds other work. Adds it to the
 * sums again. */
static void take_back(struct pace *pace, uint32_t renderer, double now, double work, bool holds)
{
    struct pace_renderer *r = &pace->renderers[renderer];
    r->held = larger_number(r->held - work, 0);
    r->holds = holds;
    r->free_at = now + pace_seconds(pace, renderer, r->held);
    enter(pace, renderer);
}

void pace_answered(struct pace *pace, uint32_t renderer, double now, double work, double busy,
                   bool holds)
{
    struct pace_renderer *r = &pace->renderers[renderer];
    bool first = !(pace->scale > 0);
    withdraw(pace, r);
    pace->work += work;
    pace->busy += busy;
    if (pace->work > 0) pace->scale = pace->busy / pace->work;
    measure_speed(pace, r, now, work, busy);
    take_back(pace, renderer, now, work, holds);
    if (first && pace->scale > 0) date_unknown(pace, now);
}

void pace_dropped(struct pace *pace, uint32_t renderer, double now, double work, bool holds)
{
    struct pace_renderer *r = &pace->renderers[renderer];
    withdraw(pace, r);
    take_back(pace, renderer, now, work, holds);
}

/*
 * The number of pixels of the picture does not depend on the lots in which they come. So only the fixed part of
 * an answer's time bounds how short lots may be. This is the intercept of the least-squares line of time over
 * pixels through the last answers.
 */
void pace_served(struct pace *pace, double seconds, double pixels)
{
    pace_place(pace); /* with the estimates so far */
    struct pace_service *service = &pace->service;
    double part = larger_number(SERVICE_NEW, 1 / ++service->answers);
    double more_s = seconds - service->seconds, more = pixels - service->pixels;
    service->seconds += part * more_s;
    service->pixels += part * more;
    service->covariance = (1 - part) * (service->covariance + part * more * more_s);
    service->variance = (1 - part) * (service->variance + part * more * more);
    double slope = service->variance > 0 ? service->covariance / service->variance : 0;
    double begin = service->seconds - larger_number(slope, 0) * service->pixels;
    pace->service_s = larger_number(begin, SERVICE_PART * service->seconds);
}

double pace_even_end(const struct pace *pace, double now, double waiting)
{
    double out = larger_number(pace->holding_until - now * pace->holding, 0);
    return (waiting * pace->scale + out) / larger_number(pace->speed, LEAST_SPEED);
}

double pace_answer_after(const struct pace *pace)
{
    return larger_number(LONGEST_S, pace->count * pace->service_s / SERVICE_PARTIAL);
}

double pace_report_after(const struct pace *pace, uint32_t renderer, double work)
{
    return TELL_FACTOR * pace_seconds(pace, renderer, work) + pace_least(pace, renderer);
}

double pace_least(const struct pace *pace, uint32_t renderer)
{
    double stretch = pace->renderers[renderer].stretch;
    double part = LEAST_PART * stretch * (stretch > 1 ? LEAST_SHARED : 1);
    double whole = pace->total * pace->scale / larger_number(pace->speed, LEAST_SPEED);
    return larger_number(pace->count * pace->service_s / SERVICE_MOST, part * whole);
}

struct pace_lot pace_lot(const struct pace *pace, uint32_t renderer, double now, double waiting)
{
    const struct pace_renderer *r = &pace->renderers[renderer];
    const struct pace_lot none = {0, 0};
    double share = waiting / larger_number(pace->speed, LEAST_SPEED) * r->speed;
    if (pace->blind || !(pace->scale > 0)) {
        double part = share * smaller_number(BLIND_PART, BLIND_EACH * pace->count);
        return (struct pace_lot){part, part};
    }
    double unit = r->speed / pace->scale; /* work per second */
    double seconds = share / unit, least = pace_least(pace, renderer);
    double longest = larger_number(LONGEST_S, pace->count * pace->service_s / SERVICE_EASY);
    double lot = larger_number(smaller_number(seconds * SHARE_PART, longest), least);
    double ahead = r->holds ? larger_number(r->free_at - now, 0) : 0;
    double until_end = pace_even_end(pace, now, waiting) - ahead;
    if (r->holds && until_end < lot * REST_PART) return none;
    if (until_end < lot * (1 + REST_PART)) lot = larger_number(until_end, least * REST_PART);
    double worst = larger_number(WORST_LEAST * least * unit, share * r->stretch * WORST_PART);
    worst = larger_number(lot * unit, worst);
    return (struct pace_lot){lot * unit, worst};
}
