/*
 * Simulates cores that renderers share, scheduled as by an operating system: round-robin, each renderer for a
 * time slice or until it has nothing to do. A renderer that becomes ready waits behind all others; one that
 * finishes a part continues with the next one on the same core.
 */
#include <math.h>
#include <stdlib.h>

#include "bench/balance_sim_state.h"
#include "common/message.h"

void cores_init(struct sim *sim)
{
    uint32_t count = sim->machine->cores;
    sim->front = sim->back = NOBODY;
    for (uint32_t i = 0; i < sim->machine->renderers; i++)
        sim->renderers[i].core = NO_CORE, sim->renderers[i].behind = NOBODY;
    if (count == 0) return;
    if (sim->machine->node_cores != 1 || !(sim->machine->slice_s > 0))
        fatal("shared cores are for single renderers, in slices of some time");
    sim->cores = allocate_zeroed(count, sizeof *sim->cores);
    for (uint32_t i = 0; i < count; i++)
        sim->cores[i].who = NOBODY;
}

void cores_free(struct sim *sim)
{
    free(sim->cores);
    sim->cores = NULL;
}

/* ---- who waits ---- */

static void wait_last(struct sim *sim, uint32_t who)
{
    sim->renderers[who].behind = NOBODY;
    if (sim->front == NOBODY)
        sim->front = who;
    else
        sim->renderers[sim->back].behind = who;
    sim->back = who;
}

static void wait_first(struct sim *sim, uint32_t who)
{
    sim->renderers[who].behind = sim->front;
    sim->front = who;
    if (sim->back == NOBODY) sim->back = who;
}

/* Removes the renderer after `before` from the queue; NOBODY: the first one. */
static void take_out(struct sim *sim, uint32_t before)
{
    uint32_t *link = before == NOBODY ? &sim->front : &sim->renderers[before].behind;
    uint32_t who = *link;
    *link = sim->renderers[who].behind;
    if (sim->back == who) sim->back = before;
}

static void stop_waiting(struct sim *sim, uint32_t who)
{
    uint32_t before = NOBODY;
    for (uint32_t i = sim->front; i != who; i = sim->renderers[i].behind)
        before = i;
    take_out(sim, before);
}

/* ---- who works ---- */

static bool all_busy(const struct sim *sim)
{
    for (uint32_t i = 0; i < sim->machine->cores; i++)
        if (sim->cores[i].who == NOBODY) return false;
    return true;
}

/* Subtracts what the renderer has done since the last time from what is left of its part. */
static void account_for(struct sim *sim, struct core *core)
{
    sim->renderers[core->who].part->left_s -= (sim->now - core->since) * core->rate;
    core->since = sim->now;
}

/* Continues with the part until it is done, or until the time slice is over. What the master uses for looking
 * for messages is taken from all cores equally, if none is idle. */
static void go_on_with(struct sim *sim, uint32_t index)
{
    struct core *core = &sim->cores[index];
    struct part *part = sim->renderers[core->who].part;
    if (isnan(part->begun_s)) part->begun_s = sim->now;
    core->since = sim->now;
    core->rate = all_busy(sim)
                     ? fmax(0.5, 1 - sim->machine->messages.looking_share / sim->machine->cores)
                     : 1;
    double end = fmin(core->until, sim->now + fmax(0, part->left_s) / core->rate);
    struct event look = {.time = end, .kind = EVENT_CORE, .who = index, .number = ++core->turn};
    events_add(&sim->wall, &look);
}

static void start(struct sim *sim, uint32_t index, uint32_t who)
{
    struct core *core = &sim->cores[index];
    core->who = who;
    core->until = sim->now + sim->machine->slice_s;
    sim->renderers[who].core = index;
    go_on_with(sim, index);
}

/* Gives an idle core to the first renderer that waits, if one does. */
static void start_next(struct sim *sim, uint32_t index)
{
    uint32_t next = sim->front;
    if (next == NOBODY) return;
    take_out(sim, NOBODY);
    start(sim, index, next);
}

/* Frees the core for the next renderer. */
static void leave(struct sim *sim, uint32_t index)
{
    struct core *core = &sim->cores[index];
    sim->renderers[core->who].core = NO_CORE;
    core->who = NOBODY;
    core->turn++;
    start_next(sim, index);
}

void cores_account(struct sim *sim, uint32_t who)
{
    if (sim->renderers[who].core != NO_CORE)
        account_for(sim, &sim->cores[sim->renderers[who].core]);
}

void cores_begin(struct sim *sim, uint32_t who, struct part *part, bool first)
{
    sim->renderers[who].part = part;
    if (sim->renderers[who].core != NO_CORE) return; /* see cores_ended() */
    if (first)
        wait_first(sim, who);
    else
        wait_last(sim, who);
    for (uint32_t i = 0; i < sim->machine->cores; i++)
        if (sim->cores[i].who == NOBODY) start_next(sim, i);
}

void cores_ended(struct sim *sim, uint32_t who)
{
    struct renderer *renderer = &sim->renderers[who];
    bool works = renderer->working > 0;
    if (renderer->core == NO_CORE) {
        if (!works) stop_waiting(sim, who);
    } else if (works) {
        go_on_with(sim, renderer->core);
    } else {
        leave(sim, renderer->core);
    }
}

void cores_look(struct sim *sim, uint32_t index, uint32_t turn)
{
    struct core *core = &sim->cores[index];
    if (turn != core->turn) return;
    uint32_t who = core->who;
    account_for(sim, core);
    struct part *part = sim->renderers[who].part;
    if (part->left_s <= GRAIN) {
        finish_part(sim, who, part);
    } else if (sim->now < core->until - GRAIN) {
        go_on_with(sim, index);
    } else if (sim->front == NOBODY) {
        start(sim, index, who);
    } else {
        leave(sim, index);
        wait_last(sim, who);
    }
}

void cores_serve(struct sim *sim, double span)
{
    if (!all_busy(sim)) return;
    for (uint32_t i = 0; i < sim->machine->cores; i++)
        sim->renderers[sim->cores[i].who].part->left_s += span / sim->machine->cores;
}
