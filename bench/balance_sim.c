#include "bench/balance_sim.h"

#include <math.h>
#include <stdlib.h>

#include "bench/balance_sim_state.h"
#include "common/message.h"
#include "common/nap.h"

/* ---- clocks ---- */

double next_look(const struct sim *sim, double idle_since, double nap, double calm_until,
                 double time)
{
    double overshoot = sim->machine->messages.nap_s, look = idle_since, waited = 0;
    if (overshoot < 0) return fmax(time, idle_since);
    while (look < time && nap < NAP_SELDOM) {
        double calm = nap_calm(calm_until - look);
        if (calm > nap) {
            look += calm + overshoot;
            continue;
        }
        look += nap + overshoot;
        waited += nap;
        nap = nap_after(waited, nap);
    }
    if (look >= time) return look;
    return look + ceil((time - look) / (nap + overshoot)) * (nap + overshoot);
}

double sim_woken(const struct sim *sim)
{
    return sim->now + fmax(sim->machine->messages.nap_s, 0);
}

void sim_at(struct sim *sim, double time, uint32_t kind, uint32_t who, void *what)
{
    struct event event = {.time = time, .kind = kind, .who = who, .what = what};
    events_add(&sim->wall, &event);
}

/* ---- the run ---- */

static void lot_arrives(struct sim *sim, const struct event *event)
{
    struct renderer *renderer = &sim->renderers[event->who];
    double look = sim->now;
    double spun = renderer->idle_since + NAP_SPIN;
    if (renderer->working == 0 && sim->now > spun)
        look =
            sim->machine->rings ? sim_woken(sim) : next_look(sim, spun, NAP_SHORTEST, 0, sim->now);
    sim_at(sim, look, EVENT_SEEN, event->who, event->what);
}

/* All tiles are in: plans the next pass, which all cores of the node take part in; returns whether there is one. */
static bool plan_pass(struct sim *sim)
{
    const struct machine *machine = sim->machine;
    double plan_s;
    if (sim->plans) return true;
    if (!machine->passes || !sim_passes_plan(machine->passes, &plan_s)) return false;
    plan_s /= machine->renderers;
    sim->plans = true;
    sim->outcome->plans_s += plan_s;
    sim_at(sim, sim->now + plan_s, EVENT_PASS, 0, NULL);
    return true;
}

static void begin_pass(struct sim *sim)
{
    sim->plans = false;
    sim_passes_add(sim->machine->passes);
    if (sim->machine->master_renders) take_own(sim);
    hand_out_to(sim, true);
}

static void happen(struct sim *sim, const struct event *event)
{
    switch (event->kind) {
    case EVENT_READY:
        sim_ready(sim, event->who);
        break;
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
        sim_hold(sim, event->who, event->what);
        break;
    case EVENT_TELL:
        sim_tell(sim, event->who, event->number);
        break;
    case EVENT_DROP:
        sim_drop(sim, event->who, event->number);
        break;
    case EVENT_GIVE_UP:
        sim_give_up(sim, event->who, event->number);
        break;
    case EVENT_CHECK:
        sim_check(sim);
        break;
    case EVENT_LOOK:
        sim_look(sim);
        break;
    case EVENT_PASS:
        begin_pass(sim);
        break;
    case EVENT_CORE:
        cores_look(sim, event->who, event->number);
        break;
    default:
        take_own(sim);
    }
}

static bool step(struct sim *sim)
{
    if (queue_complete(sim->queue) && !plan_pass(sim)) return false;
    const struct event *done = events_first(&sim->done), *next = events_first(&sim->wall);
    if (!done && !next) return false;
    if (next && (!done || next->time <= done->time)) {
        struct event event = events_take(&sim->wall);
        sim->now = event.time;
        happen(sim, &event);
        return true;
    }
    struct event event = events_take(&sim->done);
    sim->now = event.time;
    if (!pays_debt(sim, &event)) finish_part(sim, event.who, event.what);
    return true;
}

/* Gives up what is under way when the last tile comes in, and frees all. */
static void give_up(struct sim *sim)
{
    for (uint32_t i = 0; i < sim->machine->renderers; i++)
        sim_stop(sim, i);
    for (struct lot *lot = sim->lots, *after; lot; lot = after) {
        after = lot->after;
        free(lot);
    }
    events_free(&sim->done);
    events_free(&sim->wall);
    free(sim->letters);
    free(sim->kept);
    free(sim->renderers);
    cores_free(sim);
}

/* Starts the simulation; rank 0's renderer takes its lots before the others. */
static void begin(struct sim *sim)
{
    const struct machine *machine = sim->machine;
    for (uint32_t i = 0; i < machine->renderers; i++)
        if (machine->starts)
            sim_at(sim, machine->starts[i], EVENT_READY, i, NULL);
        else
            sim->renderers[i].ready = true;
    if (machine->starts) return;
    if (machine->master_renders) take_own(sim);
    hand_out_to(sim, true);
}

void simulate(const struct machine *machine, struct queue *queue, const struct picture_costs *costs,
              struct sim_outcome *outcome)
{
    struct sim sim = {.machine = machine,
                      .queue = queue,
                      .costs = costs,
                      .outcome = outcome,
                      .own_nap = {.seconds = NAP_SHORTEST},
                      .nap = {.seconds = NAP_SHORTEST},
                      .check = HUGE_VAL,
                      .look = HUGE_VAL,
                      .news = queue_news(queue)};
    *outcome = (struct sim_outcome){0};
    outcome->renderers = allocate_zeroed(machine->renderers, sizeof *outcome->renderers);
    sim.renderers = allocate_zeroed(machine->renderers, sizeof *sim.renderers);
    cores_init(&sim);
    begin(&sim);
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

double sim_efficiency(const struct sim_outcome *outcome, uint32_t processors)
{
    return outcome->useful_s / (processors * outcome->render_s);
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
