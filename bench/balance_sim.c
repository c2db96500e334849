#include "bench/balance_sim.h"

#include <math.h>
#include <stdlib.h>

#include "bench/balance_events.h"
#include "common/message.h"
#include "common/nap.h"
#include "common/protocol.h"

/* More lots than the queue lets a renderer hold. */
#define HELD 4

enum { EVENT_RESULT, EVENT_SERVED, EVENT_LOT, EVENT_SEEN, EVENT_DROP, EVENT_CHECK, EVENT_OWN };

struct part {
    struct tile tile;
    struct lot *lot;
    struct part *next;       /* of those that go into the same answer */
    double begun_s, seconds; /* when it was begun, and what it took */
    bool dropped;            /* others have it now */
};

struct lot {
    struct lot *before, *after;      /* all lots that there are */
    uint32_t count, begun, finished; /* parts */
    uint32_t accepted;               /* parts, by the master */
    double answer_s, answered;       /* when an answer is due, and when the last one was given */
    struct part *ready, **last;      /* what goes into the next one */
    struct part parts[];             /* [count] */
};

/* A rank, or a node whose first rank hands out to the others. */
struct renderer {
    struct lot *held[HELD];
    unsigned count;
    uint32_t working; /* of its cores */
    double idle_since;
    double debt_s; /* rank 0: what serving has taken from the tile in work */
    bool asks;     /* the master has found nothing for it */
};

struct sim {
    const struct machine *machine;
    struct queue *queue;
    const struct picture_costs *costs;
    struct sim_outcome *outcome;
    struct renderer *renderers;
    double now;

    /* Renderers that share cores advance at the same rate: the moment at which each is done is known
     * on a clock of its own, which runs at that rate. */
    double shared_now;
    uint32_t working;
    struct events done; /* times on that clock */

    struct events wall; /* everything else */
    double own_nap;     /* of rank 0's renderer, the next one */
    struct lot *lots;   /* all that are not accepted yet */

    /* The master. */
    bool serving;
    double idle_since;
    uint64_t news;
    double check;          /* when the next EVENT_CHECK comes; HUGE_VAL: none */
    struct event *letters; /* results that have arrived and wait, a ring */
    size_t first, letter_count, letter_room;
};

/* ---- clocks ---- */

static double shared_rate(const struct sim *sim)
{
    uint32_t cores = sim->machine->cores;
    return cores && sim->working > cores ? (double)cores / sim->working : 1;
}

/* When somebody who has nothing to do since then looks again, at `time` or behind it. */
static double next_look(const struct sim *sim, double idle_since, double time)
{
    double overshoot = sim->machine->messages.nap_s, nap = NAP_SHORTEST, look = idle_since;
    if (overshoot < 0) return fmax(time, idle_since);
    while (look < time && nap < NAP_LONGEST) {
        look += nap + overshoot;
        nap = 2 * nap < NAP_LONGEST ? 2 * nap : NAP_LONGEST;
    }
    if (look >= time) return look;
    return look + ceil((time - look) / (nap + overshoot)) * (nap + overshoot);
}

static void at(struct sim *sim, double time, uint32_t kind, uint32_t who, void *what)
{
    struct event event = {.time = time, .kind = kind, .who = who, .what = what};
    events_add(&sim->wall, &event);
}

/* ---- a renderer ---- */

static double speed_of(const struct sim *sim, uint32_t who)
{
    return sim->machine->speeds ? sim->machine->speeds[who] : 1;
}

static bool is_own(const struct sim *sim, uint32_t who)
{
    return who == 0 && sim->machine->master_renders;
}

static void begin_part(struct sim *sim, uint32_t who, struct part *part)
{
    double cost = costs_of(sim->costs, &part->tile);
    struct event done = {
        .time = sim->shared_now + cost / speed_of(sim, who), .who = who, .what = part};
    sim->outcome->work_s += cost;
    if (part->tile.pass == TILE_PROBE) sim->outcome->probe_s += cost;
    part->begun_s = sim->now;
    sim->renderers[who].working++;
    sim->working++;
    events_add(&sim->done, &done);
}

static void end_part(struct sim *sim, uint32_t who, struct part *part);

/* The next part of a lot is begun, unless others have it now. */
static void begin_next(struct sim *sim, uint32_t who, struct lot *lot)
{
    struct part *part = &lot->parts[lot->begun];
    if (lot->begun++ == 0) lot->answered = sim->now;
    if (is_own(sim, who)) part->dropped = queue_recalled(sim->queue, who, part->tile.id);
    if (part->dropped)
        end_part(sim, who, part);
    else
        begin_part(sim, who, part);
}

/* The oldest lot of which something is left to begin. */
static struct lot *lot_to_go_on(const struct renderer *renderer)
{
    for (unsigned i = 0; i < renderer->count; i++)
        if (renderer->held[i]->begun < renderer->held[i]->count) return renderer->held[i];
    return NULL;
}

/* Its idle cores begin what it holds. */
static void go_on(struct sim *sim, uint32_t who)
{
    struct renderer *renderer = &sim->renderers[who];
    struct lot *lot;
    while (renderer->working < sim->machine->node_cores && (lot = lot_to_go_on(renderer)))
        begin_next(sim, who, lot);
}

static void hold(struct sim *sim, uint32_t who, struct lot *lot)
{
    struct renderer *renderer = &sim->renderers[who];
    if (renderer->count == HELD) fatal("the queue gives a renderer more than %d lots", HELD);
    renderer->held[renderer->count++] = lot;
    go_on(sim, who);
}

/* The next lot of the queue; NULL: nothing now. */
static struct lot *next_lot(struct sim *sim, uint32_t who)
{
    struct tile tiles[LOT_TILES];
    uint32_t count = queue_next(sim->queue, who, sim->now, tiles);
    if (count == 0) return NULL;
    struct lot *lot = allocate(1, sizeof *lot + count * sizeof *lot->parts);
    *lot = (struct lot){
        .after = sim->lots, .count = count, .answer_s = queue_answer_after(sim->queue)};
    if (sim->lots) sim->lots->before = lot;
    sim->lots = lot;
    lot->last = &lot->ready;
    for (uint32_t i = 0; i < count; i++)
        lot->parts[i] = (struct part){.tile = tiles[i], .lot = lot};
    return lot;
}

/* A part has been accepted; with the last one the lot is gone. */
static void forget_part(struct sim *sim, struct lot *lot)
{
    if (++lot->accepted < lot->count) return;
    if (lot->before)
        lot->before->after = lot->after;
    else
        sim->lots = lot->after;
    if (lot->after) lot->after->before = lot->before;
    free(lot);
}

/* The second thread of rank 0: straight from the queue, with naps while there is nothing. */
static void take_own(struct sim *sim)
{
    if (sim->renderers[0].count > 0) return;
    struct lot *lot = next_lot(sim, 0);
    if (lot) {
        sim->own_nap = NAP_SHORTEST;
        hold(sim, 0, lot);
    } else if (!queue_over(sim->queue, 0)) {
        at(sim, sim->now + sim->own_nap + fmax(0, sim->machine->messages.nap_s), EVENT_OWN, 0,
           NULL);
        sim->own_nap = fmin(2 * sim->own_nap, NAP_LONGEST);
    }
}

static void tell_probes(struct sim *sim, const struct tile *tile)
{
    uint32_t pixels = tile_pixels(tile);
    float *seconds = allocate(pixels, sizeof *seconds);
    for (uint32_t k = 0; k < pixels; k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        seconds[k] = (float)costs_of_probe(sim->costs, x, y);
    }
    queue_probed(sim->queue, tile, seconds);
    free(seconds);
}

static void accept_part(struct sim *sim, uint32_t who, struct part *part)
{
    bool probes = part->tile.pass == TILE_PROBE;
    if (part->dropped) {
        queue_drop(sim->queue, who, part->tile.id, sim->now);
        return;
    }
    if (probes) tell_probes(sim, &part->tile);
    /* A node of many cores is a renderer of many times the speed. */
    double seconds = part->seconds / sim->machine->node_cores;
    bool first = queue_finish(sim->queue, who, part->tile.id, sim->now, seconds);
    if (first) sim->outcome->render_s = sim->now;
    if (!first && !probes) sim->outcome->wasted_s += part->seconds * speed_of(sim, who);
}

static size_t part_bytes(const struct part *part)
{
    return part->dropped ? sizeof(struct result_header)
                         : result_bytes(&part->tile, tile_pixels(&part->tile), false);
}

/* What is ready of a lot. */
static void send_result(struct sim *sim, uint32_t who, struct lot *lot)
{
    const struct message_costs *costs = &sim->machine->messages;
    double bytes = 0;
    for (const struct part *part = lot->ready; part; part = part->next)
        bytes += (double)part_bytes(part);
    double span = costs->send_s + costs->latency_s + bytes * costs->byte_s;
    sim->outcome->renderers[who].send_s += span;
    at(sim, sim->now + span, EVENT_RESULT, who, lot->ready);
    lot->ready = NULL;
    lot->last = &lot->ready;
    lot->answered = sim->now;
}

static void account(struct sim *sim, uint32_t who, struct part *part)
{
    struct sim_renderer *sum = &sim->outcome->renderers[who];
    part->seconds = sim->now - part->begun_s;
    sum->busy_s += part->seconds;
    if (part->tile.pass == TILE_PROBE) return;
    sum->tiles++;
    sum->pixels += tile_pixels(&part->tile);
    sum->finish_s = sim->now;
}

/* Nothing more is to be done for a lot that the renderer holds. */
static void put_away(struct renderer *renderer, const struct lot *lot)
{
    unsigned i = 0;
    while (renderer->held[i] != lot)
        i++;
    for (renderer->count--; i < renderer->count; i++)
        renderer->held[i] = renderer->held[i + 1];
}

/* A part is finished, or dropped. Rank 0's are handed in one by one. */
static void end_part(struct sim *sim, uint32_t who, struct part *part)
{
    struct lot *lot = part->lot;
    bool all = ++lot->finished == lot->count;
    if (all) put_away(&sim->renderers[who], lot);
    if (is_own(sim, who)) {
        accept_part(sim, who, part);
        forget_part(sim, lot);
        return;
    }
    *lot->last = part;
    lot->last = &part->next;
    if (all || sim->now >= lot->answered + lot->answer_s) send_result(sim, who, lot);
}

static void finish_part(struct sim *sim, uint32_t who, struct part *part)
{
    struct renderer *renderer = &sim->renderers[who];
    sim->working--;
    renderer->working--;
    account(sim, who, part);
    end_part(sim, who, part);
    go_on(sim, who);
    if (renderer->working == 0) renderer->idle_since = sim->now;
    if (is_own(sim, who)) take_own(sim);
}

/* Others have a tile that the renderer may not have begun. */
static void drop(struct sim *sim, uint32_t who, uint32_t id)
{
    struct renderer *renderer = &sim->renderers[who];
    for (unsigned i = 0; i < renderer->count; i++) {
        struct lot *lot = renderer->held[i];
        for (uint32_t k = lot->begun; k < lot->count; k++)
            if (lot->parts[k].tile.id == id) lot->parts[k].dropped = true;
    }
}

/* Serving has taken time from the tile that rank 0 renders. */
static bool pays_debt(struct sim *sim, const struct event *done)
{
    struct renderer *renderer = &sim->renderers[done->who];
    if (renderer->debt_s <= 0) return false;
    struct event later = *done;
    later.time += renderer->debt_s;
    renderer->debt_s = 0;
    events_add(&sim->done, &later);
    return true;
}

/* ---- the master ---- */

static double service_time(const struct sim *sim, const struct part *parts)
{
    const struct message_costs *costs = &sim->machine->messages;
    double span = costs->service_s;
    for (const struct part *part = parts; part; part = part->next)
        span += costs->service_tile_s +
                (part->dropped ? 0 : tile_pixels(&part->tile) * costs->service_pixel_s);
    return span;
}

static void serve(struct sim *sim, double span)
{
    sim->outcome->master_s += span;
    if (sim->machine->master_renders && !sim->machine->cores && sim->renderers[0].count > 0)
        sim->renderers[0].debt_s += span;
}

/* Renderers hear what others have taken from them; rank 0's own looks itself. */
static void tell_recalls(struct sim *sim, double time)
{
    uint32_t renderer, id;
    while (queue_recall(sim->queue, &renderer, &id)) {
        struct event drop = {.time = time + sim->machine->messages.latency_s,
                             .kind = EVENT_DROP,
                             .who = renderer,
                             .number = id};
        if (!is_own(sim, renderer)) events_add(&sim->wall, &drop);
    }
}

/* Whether the renderer got anything. Messages do not overtake each other. */
static bool hand_out(struct sim *sim, uint32_t who, double time)
{
    const struct message_costs *costs = &sim->machine->messages;
    double arrival = time + costs->latency_s;
    bool any = false;
    for (struct lot *lot; (lot = next_lot(sim, who)); any = true) {
        arrival += lot->count * sizeof(struct tile) * costs->byte_s;
        at(sim, arrival, EVENT_LOT, who, lot);
    }
    sim->renderers[who].asks = queue_holds(sim->queue, who) == 0;
    tell_recalls(sim, time);
    return any;
}

/* To each that got something it takes half of what a result and its answer take. */
static void hand_out_to(struct sim *sim, bool all)
{
    const struct message_costs *costs = &sim->machine->messages;
    double time = sim->now;
    for (uint32_t who = sim->machine->master_renders; who < sim->machine->renderers; who++)
        if ((all || sim->renderers[who].asks) && hand_out(sim, who, time))
            time += costs->service_s / 2;
    serve(sim, time - sim->now);
    sim->idle_since = time;
}

/* As the master does whenever it has looked for messages. */
static void hand_out_to_idle(struct sim *sim)
{
    uint64_t news = queue_news(sim->queue);
    bool all = news != sim->news;
    bool late = sim->now >= queue_wake(sim->queue);
    if (late) queue_look(sim->queue, sim->now);
    if (all || late) hand_out_to(sim, all);
    sim->news = news;
    /* A wake-up that changed nothing comes again with the next long nap. */
    double wake = queue_wake(sim->queue);
    if (wake <= sim->now) wake = sim->now + NAP_LONGEST;
    if (wake < sim->check) at(sim, sim->check = wake, EVENT_CHECK, 0, NULL);
}

static void keep_letter(struct sim *sim, const struct event *letter)
{
    if (sim->letter_count == sim->letter_room) {
        size_t room = sim->letter_room ? 2 * sim->letter_room : 64;
        struct event *letters = allocate(room, sizeof *letters);
        for (size_t i = 0; i < sim->letter_count; i++)
            letters[i] = sim->letters[(sim->first + i) % sim->letter_room];
        free(sim->letters);
        sim->letters = letters, sim->letter_room = room, sim->first = 0;
    }
    sim->letters[(sim->first + sim->letter_count++) % sim->letter_room] = *letter;
}

static void serve_next(struct sim *sim, double from)
{
    double span = service_time(sim, sim->letters[sim->first].what);
    sim->serving = true;
    serve(sim, span);
    at(sim, from + span, EVENT_SERVED, 0, NULL);
}

static void result_arrives(struct sim *sim, const struct event *letter)
{
    keep_letter(sim, letter);
    sim->outcome->messages++;
    if (!sim->serving) serve_next(sim, next_look(sim, sim->idle_since, sim->now));
}

static void result_served(struct sim *sim)
{
    struct event letter = sim->letters[sim->first];
    struct part *next = letter.what;
    sim->first = (sim->first + 1) % sim->letter_room;
    sim->letter_count--;
    queue_served(sim->queue, service_time(sim, next));
    for (struct part *part; (part = next);) {
        next = part->next;
        accept_part(sim, letter.who, part);
        forget_part(sim, part->lot);
    }
    sim->serving = false;
    sim->idle_since = sim->now;
    if (!queue_over(sim->queue, letter.who)) hand_out(sim, letter.who, sim->now);
    hand_out_to_idle(sim);
    if (sim->letter_count > 0) serve_next(sim, sim->now);
}

static void check(struct sim *sim)
{
    sim->check = HUGE_VAL;
    if (!sim->serving) hand_out_to_idle(sim);
}

/* ---- the run ---- */

static void lot_arrives(struct sim *sim, const struct event *event)
{
    struct renderer *renderer = &sim->renderers[event->who];
    double look = sim->now;
    if (renderer->working == 0) look = next_look(sim, renderer->idle_since, sim->now);
    at(sim, look, EVENT_SEEN, event->who, event->what);
}

static void advance(struct sim *sim, double time)
{
    sim->shared_now += (time - sim->now) * shared_rate(sim);
    sim->now = time;
}

static void happen(struct sim *sim, const struct event *event)
{
    switch (event->kind) {
    case EVENT_RESULT:
        result_arrives(sim, event);
        break;
    case EVENT_SERVED:
        result_served(sim);
        break;
    case EVENT_LOT:
        lot_arrives(sim, event);
        break;
    case EVENT_SEEN:
        hold(sim, event->who, event->what);
        break;
    case EVENT_DROP:
        drop(sim, event->who, event->number);
        break;
    case EVENT_CHECK:
        check(sim);
        break;
    default:
        take_own(sim);
    }
}

static bool step(struct sim *sim)
{
    const struct event *done = events_first(&sim->done), *next = events_first(&sim->wall);
    if ((!done && !next) || queue_complete(sim->queue)) return false;
    double ready = HUGE_VAL;
    if (done) ready = sim->now + fmax(0, done->time - sim->shared_now) / shared_rate(sim);
    if (next && next->time <= ready) {
        struct event event = events_take(&sim->wall);
        advance(sim, event.time);
        happen(sim, &event);
        return true;
    }
    struct event event = events_take(&sim->done);
    advance(sim, ready);
    sim->shared_now = event.time; /* without rounding */
    if (!pays_debt(sim, &event)) finish_part(sim, event.who, event.what);
    return true;
}

/* What was under way when the last tile came in. */
static void give_up(struct sim *sim)
{
    for (struct lot *lot = sim->lots, *after; lot; lot = after) {
        after = lot->after;
        free(lot);
    }
    events_free(&sim->done);
    events_free(&sim->wall);
    free(sim->letters);
    free(sim->renderers);
}

void simulate(const struct machine *machine, struct queue *queue, const struct picture_costs *costs,
              struct sim_outcome *outcome)
{
    struct sim sim = {.machine = machine,
                      .queue = queue,
                      .costs = costs,
                      .outcome = outcome,
                      .own_nap = NAP_SHORTEST,
                      .check = HUGE_VAL,
                      .news = queue_news(queue)};
    *outcome = (struct sim_outcome){0};
    outcome->renderers = allocate_zeroed(machine->renderers, sizeof *outcome->renderers);
    sim.renderers = allocate_zeroed(machine->renderers, sizeof *sim.renderers);
    if (machine->master_renders) take_own(&sim);
    hand_out_to(&sim, true);
    while (step(&sim))
        ;
    if (!queue_complete(queue)) fatal("the simulated farm got stuck");
    struct queue_count count = queue_count(queue);
    outcome->tiles = count.tiles;
    outcome->repeated = count.repeated;
    give_up(&sim);
}

void sim_outcome_free(struct sim_outcome *outcome)
{
    free(outcome->renderers);
    *outcome = (struct sim_outcome){0};
}

double sim_tail(const struct sim_outcome *outcome, uint32_t renderers)
{
    double first = HUGE_VAL, last = 0;
    for (uint32_t i = 0; i < renderers; i++) {
        first = fmin(first, outcome->renderers[i].finish_s);
        last = fmax(last, outcome->renderers[i].finish_s);
    }
    return renderers > 0 ? last - first : 0;
}
