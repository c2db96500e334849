/* The master of the simulated farm: serves results, one at a time, and hands out lots. */
#include <math.h>
#include <stdlib.h>

#include "bench/balance_sim_state.h"
#include "common/message.h"
#include "common/nap.h"

static double pixels_of(const struct part *parts)
{
    double pixels = 0;
    for (const struct part *part = parts; part; part = part->next)
        if (!part->dropped) pixels += part->pixels;
    return pixels;
}

double put_seconds(const struct sim *sim, const struct part *part)
{
    const struct sim_passes *passes = sim->machine->passes;
    if (!passes || part->dropped || part->tile.pass == TILE_PROBE) return 0;
    return sim_passes_record(passes)->put_s[part->tile.pass > 0] * part->pixels;
}

/* The master's seconds for a result; its event says whether it is in a tray. */
static double service_time(const struct sim *sim, const struct event *letter)
{
    const struct message_costs *costs = &sim->machine->messages;
    const struct part *parts = letter->what;
    bool in_tray = letter->number;
    double span = in_tray ? costs->tray_s + pixels_of(parts) * costs->tray_pixel_s
                          : costs->service_s + pixels_of(parts) * costs->service_pixel_s;
    for (const struct part *part = parts; part; part = part->next)
        span += costs->service_tile_s + put_seconds(sim, part);
    if (!in_tray && bytes_of(sim, parts) > RESULT_SHORT) span += costs->fetch_s;
    return span;
}

static void serve(struct sim *sim, double span)
{
    sim->outcome->master_s += span;
    if (sim->machine->cores > 0)
        cores_serve(sim, span);
    else if (sim->machine->master_renders && sim->renderers[0].count > 0)
        sim->renderers[0].debt_s += span;
}

/* Rank 0's own renderer checks tiles that it has not begun by itself. */
void sim_tell_recalls(struct sim *sim, double time)
{
    struct recall recall;
    while (queue_next_recall(sim->queue, &recall)) {
        bool own = is_own(sim, recall.renderer);
        struct event drop = {.time = time + (own ? 0 : sim->machine->messages.latency_s),
                             .kind = recall.finished ? EVENT_GIVE_UP : EVENT_DROP,
                             .who = recall.renderer,
                             .number = recall.id};
        if (!own || recall.finished) events_add(&sim->wall, &drop);
    }
}

/* Hands out lots to the renderer; returns whether it got any. */
static bool hand_out(struct sim *sim, uint32_t who, double time)
{
    const struct message_costs *costs = &sim->machine->messages;
    double arrival = time + costs->latency_s; /* messages do not overtake each other */
    bool any = false;
    for (struct lot *lot; (lot = next_lot(sim, who)); any = true) {
        arrival += lot->count * sizeof(struct tile) * costs->byte_s;
        sim_at(sim, arrival, EVENT_LOT, who, lot);
    }
    sim->renderers[who].asks = queue_tile_count(sim->queue, who) == 0;
    sim_tell_recalls(sim, time);
    return any;
}

/* The master has nothing to do from this time on. */
static void begin_idling(struct sim *sim, double time)
{
    sim->idle_since = time;
    sim->calm_until = time + queue_calm(sim->queue, time);
}

void hand_out_to(struct sim *sim, bool all)
{
    const struct message_costs *costs = &sim->machine->messages;
    double time = sim->now, each = sim->machine->rings ? costs->tray_s : costs->service_s;
    for (uint32_t who = sim->machine->master_renders; who < sim->machine->renderers; who++)
        if (sim->renderers[who].ready && (all || sim->renderers[who].asks) &&
            hand_out(sim, who, time))
            time += each / 2;
    serve(sim, time - sim->now);
    begin_idling(sim, time);
}

void sim_ready(struct sim *sim, uint32_t who)
{
    sim->renderers[who].ready = true;
    sim->renderers[who].idle_since = sim->now;
    if (is_own(sim, who)) {
        take_own(sim);
        return;
    }
    nap_heard(&sim->nap, sim->now);
    hand_out(sim, who, sim->now);
    begin_idling(sim, sim->now);
}

/* What the master does after each look for messages. */
static void hand_out_to_idle(struct sim *sim)
{
    uint64_t news = queue_news(sim->queue);
    bool all = news != sim->news;
    bool late = sim->now >= queue_wake(sim->queue);
    if (late) queue_look(sim->queue, sim->now);
    if (all || late) hand_out_to(sim, all);
    sim->news = news;
    /* A wake-up that changed nothing is repeated after the longest nap. */
    double wake = queue_wake(sim->queue);
    if (wake <= sim->now) wake = sim->now + NAP_LONGEST;
    if (wake < sim->check) sim_at(sim, sim->check = wake, EVENT_CHECK, 0, NULL);
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
    double span = service_time(sim, &sim->letters[sim->first]);
    sim->serving = true;
    sim->look = HUGE_VAL;
    serve(sim, span);
    sim_at(sim, from + span, EVENT_SERVED, 0, NULL);
}

/* When the master next looks for messages if it is not woken. If it can be woken, it sleeps long from the start. */
static double looks(const struct sim *sim)
{
    double nap = sim->machine->rings ? NAP_SELDOM : sim->nap.seconds;
    return next_look(sim, sim->idle_since, nap, sim->calm_until, sim->now);
}

double sim_master_hears(const struct sim *sim)
{
    if (sim->serving) return sim->now;
    return sim->machine->rings ? sim_woken(sim) : looks(sim);
}

static void look_at(struct sim *sim, double time)
{
    if (time < sim->look) sim_at(sim, sim->look = time, EVENT_LOOK, 0, NULL);
}

void sim_ring(struct sim *sim)
{
    if (sim->machine->rings && !sim->serving && sim->letter_count > 0) look_at(sim, sim_woken(sim));
}

/* Events of a look that was replaced by an earlier one are void. */
void sim_look(struct sim *sim)
{
    if (!sim->serving && sim->now >= sim->look) serve_next(sim, sim->now);
}

/* Whether the sender has rung the bell after this result: because it reports that a tile takes long, has nothing
 * left, or has called for more. */
static bool has_rung(const struct renderer *renderer, const struct part *parts)
{
    for (; parts; parts = parts->next)
        if (parts->unfinished) return true;
    return renderer->count == 0 || (renderer->count == 1 && renderer->held[0]->has_called);
}

void result_arrives(struct sim *sim, const struct event *letter)
{
    keep_letter(sim, letter);
    sim->outcome->messages++;
    if (sim->serving) return;
    look_at(sim, looks(sim));
    if (has_rung(&sim->renderers[letter->who], letter->what)) sim_ring(sim);
}

void result_served(struct sim *sim)
{
    struct event letter = sim->letters[sim->first];
    struct part *next = letter.what;
    sim->first = (sim->first + 1) % sim->letter_room;
    sim->letter_count--;
    queue_served(sim->queue, service_time(sim, &letter), pixels_of(next));
    sim->renderers[letter.who].full -= letter.number;
    for (struct part *part; (part = next);) {
        next = part->next;
        accept_part(sim, letter.who, part);
        if (!part->unfinished) forget_part(sim, part->lot);
    }
    sim->serving = false;
    nap_heard(&sim->nap, sim->now);
    if (!queue_over(sim->queue, letter.who)) hand_out(sim, letter.who, sim->now);
    sim_tell_recalls(sim, sim->now);
    begin_idling(sim, sim->now);
    hand_out_to_idle(sim);
    if (sim->letter_count > 0) serve_next(sim, sim->now);
}

void sim_check(struct sim *sim)
{
    sim->check = HUGE_VAL;
    if (!sim->serving) hand_out_to_idle(sim);
}
