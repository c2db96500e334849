/* A renderer of the simulated farm: works through its lots and sends results. */
#include <math.h>
#include <stdlib.h>

#include "bench/balance_sim_state.h"
#include "common/message.h"
#include "common/nap.h"
#include "common/protocol.h"

static double speed_of(const struct sim *sim, uint32_t who)
{
    return sim->machine->speeds ? sim->machine->speeds[who] : 1;
}

bool is_own(const struct sim *sim, uint32_t who)
{
    return who == 0 && sim->machine->master_renders;
}

/* Whether the renderer begins its first part. With given start times it has a core then. */
static bool is_just_starting(const struct sim *sim, uint32_t who)
{
    return sim->machine->starts && sim->outcome->renderers[who].busy_s == 0;
}

/* Whether the renderer reports a part that takes long. worker/work.c does so; rank 0's own renderer does not,
 * nor do renderers that share cores. */
static bool tells(const struct sim *sim, uint32_t who, const struct part *part)
{
    bool single = !sim->cores && sim->machine->node_cores == 1;
    return single && !is_own(sim, who) && part->tile.pass != TILE_PROBE;
}

/* Schedules the report of a part, if it will be in work for `seconds`. */
static void tell_after(struct sim *sim, uint32_t who, const struct part *part, double seconds)
{
    struct event tell = {
        .time = part->begun_s + seconds, .kind = EVENT_TELL, .who = who, .number = part->tile.id};
    if (seconds < part->span_s) events_add(&sim->wall, &tell);
}

static void begin_part(struct sim *sim, uint32_t who, struct part *part)
{
    part->cost_s = costs_of(sim->costs, &part->tile);
    double span = (part->cost_s + sim->machine->messages.tile_s) / speed_of(sim, who);
    if (is_own(sim, who)) span += put_seconds(sim, part);
    struct event done = {.time = sim->now + span, .who = who, .what = part};
    part->begun_s = sim->cores ? (double)NAN : sim->now;
    part->working = true;
    part->span_s = part->left_s = span;
    sim->renderers[who].working++;
    if (sim->cores)
        cores_begin(sim, who, part, is_just_starting(sim, who));
    else
        events_add(&sim->done, &done);
    if (tells(sim, who, part)) tell_after(sim, who, part, part->tell_s);
}

static void end_part(struct sim *sim, uint32_t who, struct part *part);

/* Half way through its last lot, the renderer wakes the master: call_for_more() in worker/work.c. */
static void call_for_more(struct sim *sim, uint32_t who, struct lot *lot)
{
    bool due = lot->calls && !lot->has_called && lot->begun >= lot->count / 2;
    if (sim->renderers[who].count > 1 || !due) return;
    lot->has_called = true;
    sim_ring(sim);
}

static size_t part_bytes(const struct sim *sim, const struct part *part)
{
    return part->dropped ? sizeof(struct result_header)
                         : result_bytes(&part->tile, part->pixels, sim->machine->passes != NULL);
}

/* Bytes of the result of all that is left of the lot. */
static size_t whole_bytes(const struct sim *sim, const struct lot *lot)
{
    size_t bytes = 0;
    for (uint32_t i = lot->begun; i < lot->count; i++)
        bytes += part_bytes(sim, &lot->parts[i]);
    return bytes;
}

/* Begins a result for what is left of the lot: in a slot of the tray, if possible. */
static void open_result(struct sim *sim, uint32_t who, struct lot *lot)
{
    lot->opened = true;
    lot->whole = whole_bytes(sim, lot);
    lot->in_tray = sim->machine->rings && lot->whole <= TRAY_RESULT_BYTES &&
                   sim->renderers[who].full < TRAY_SLOTS;
}

/* Begins the next part of a lot, unless others hold it now. */
static void begin_next(struct sim *sim, uint32_t who, struct lot *lot)
{
    struct part *part = &lot->parts[lot->begun];
    if (!lot->opened) open_result(sim, who, lot);
    if (!is_own(sim, who)) call_for_more(sim, who, lot);
    if (lot->begun++ == 0) lot->answered = sim->now;
    if (is_own(sim, who)) part->dropped = queue_is_recalled(sim->queue, who, part->tile.id);
    if (part->dropped)
        end_part(sim, who, part);
    else
        begin_part(sim, who, part);
}

/* The oldest lot with a part that is not begun. */
static struct lot *lot_to_go_on(const struct renderer *renderer)
{
    for (unsigned i = 0; i < renderer->count; i++)
        if (renderer->held[i]->begun < renderer->held[i]->count) return renderer->held[i];
    return NULL;
}

/* The renderer's idle cores begin parts that it holds. */
static void go_on(struct sim *sim, uint32_t who)
{
    struct renderer *renderer = &sim->renderers[who];
    struct lot *lot;
    while (renderer->working < sim->machine->node_cores && (lot = lot_to_go_on(renderer)))
        begin_next(sim, who, lot);
}

void sim_hold(struct sim *sim, uint32_t who, struct lot *lot)
{
    struct renderer *renderer = &sim->renderers[who];
    if (renderer->count == HELD) fatal("the queue gives a renderer more than %d lots", HELD);
    renderer->held[renderer->count++] = lot;
    go_on(sim, who);
}

size_t bytes_of(const struct sim *sim, const struct part *parts)
{
    size_t bytes = 0;
    for (const struct part *part = parts; part; part = part->next)
        bytes += part_bytes(sim, part);
    return bytes;
}

static uint32_t pixels_in(const struct sim *sim, const struct tile *tile)
{
    struct sim_passes *passes = sim->machine->passes;
    return passes && tile->pass != TILE_PROBE ? sim_passes_pixels(passes, tile) : tile_pixels(tile);
}

struct lot *next_lot(struct sim *sim, uint32_t who)
{
    struct tile tiles[LOT_TILES];
    float tell_s[LOT_TILES];
    uint32_t count = queue_next(sim->queue, who, sim->now, tiles);
    if (count == 0) return NULL;
    uint32_t told = queue_report_times(sim->queue, who, tiles, count, tell_s);
    struct lot *lot = allocate(1, sizeof *lot + count * sizeof *lot->parts);
    *lot = (struct lot){.after = sim->lots,
                        .count = count,
                        .answer_s = queue_answer_after(sim->queue),
                        .calls = queue_lot_seconds(sim->queue, who, tiles, count) < NAP_CALL};
    if (sim->lots) sim->lots->before = lot;
    sim->lots = lot;
    lot->last = &lot->ready;
    for (uint32_t i = 0; i < count; i++)
        lot->parts[i] = (struct part){.tile = tiles[i],
                                      .pixels = pixels_in(sim, &tiles[i]),
                                      .lot = lot,
                                      .tell_s = told > 0 ? (double)tell_s[i] : HUGE_VAL};
    return lot;
}

void forget_part(struct sim *sim, struct lot *lot)
{
    if (++lot->accepted < lot->count) return;
    if (lot->before)
        lot->before->after = lot->after;
    else
        sim->lots = lot->after;
    if (lot->after) lot->after->before = lot->before;
    free(lot);
}

void take_own(struct sim *sim)
{
    if (sim->renderers[0].count > 0) return;
    struct lot *lot = next_lot(sim, 0);
    sim_tell_recalls(sim, sim_master_hears(sim));
    if (lot) {
        nap_reset(&sim->own_nap);
        sim_hold(sim, 0, lot);
    } else if (!queue_over(sim->queue, 0)) {
        sim_at(sim, sim->now + sim->own_nap.seconds + fmax(0, sim->machine->messages.nap_s),
               EVENT_OWN, 0, NULL);
        sim->own_nap.waited += sim->own_nap.seconds;
        sim->own_nap.seconds = nap_after(sim->own_nap.waited, sim->own_nap.seconds);
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

static void keep_piece(struct sim *sim, const struct part *part)
{
    uint32_t id = part->tile.id;
    if (id >= sim->kept_room) {
        sim->kept_room = 2 * (id + 1);
        sim->kept = reallocate(sim->kept, sim->kept_room, sizeof *sim->kept);
    }
    sim->kept[id] = (struct kept){part->tile, part->cost_s, part->cpu_s};
}

/* A tile counts. */
static void count_tile(struct sim *sim, const struct kept *it)
{
    sim->outcome->useful_s += it->cost_s;
    if (sim->machine->passes && it->tile.pass != TILE_PROBE)
        sim_passes_put(sim->machine->passes, &it->tile, it->cpu_s);
}

void accept_part(struct sim *sim, uint32_t who, struct part *part)
{
    if (part->unfinished) {
        part->lot->tells = false;
        queue_takes_long(sim->queue, who, part->tile.id, sim->now, part->seconds);
        return;
    }
    bool probes = part->tile.pass == TILE_PROBE;
    /* A node of several cores counts as one renderer of several times the speed. */
    double wall = part->seconds / sim->machine->node_cores;
    double seconds = probes ? wall : queue_seconds(sim->queue, who, wall, part->cpu_s);
    if (part->dropped) {
        queue_drop(sim->queue, who, part->tile.id, sim->now, seconds);
        return;
    }
    if (probes) tell_probes(sim, &part->tile);
    enum answer answer = queue_finish(sim->queue, who, part->tile.id, sim->now, seconds);
    struct fate fate;
    bool any = answer == ANSWER_COUNTS;
    if (any) count_tile(sim, &(struct kept){part->tile, part->cost_s, part->cpu_s});
    if (answer == ANSWER_KEPT) keep_piece(sim, part);
    while (queue_fate(sim->queue, &fate)) {
        if (!fate.counts) continue;
        if (fate.id >= sim->kept_room) fatal("the queue tells of a piece that was never back");
        count_tile(sim, &sim->kept[fate.id]);
        any = true;
    }
    if (any) sim->outcome->render_s = sim->now;
}

/* Sends the parts of a lot that are ready, in a message or in a slot of the tray. */
static void send_ready(struct sim *sim, uint32_t who, struct lot *lot, bool in_tray)
{
    const struct message_costs *costs = &sim->machine->messages;
    double bytes = in_tray ? 0 : (double)bytes_of(sim, lot->ready);
    double span = costs->send_s + costs->latency_s + bytes * costs->byte_s;
    struct renderer *renderer = &sim->renderers[who];
    renderer->arrived_s = fmax(renderer->arrived_s, sim->now + span);
    struct event result = {.time = renderer->arrived_s,
                           .kind = EVENT_RESULT,
                           .who = who,
                           .number = in_tray,
                           .what = lot->ready};
    sim->outcome->renderers[who].send_s += span;
    renderer->full += in_tray;
    events_add(&sim->wall, &result);
    lot->ready = NULL;
    lot->last = &lot->ready;
    lot->answered = sim->now;
}

static void send_result(struct sim *sim, uint32_t who, struct lot *lot)
{
    send_ready(sim, who, lot, lot->in_tray);
    lot->opened = false;
}

static void account(struct sim *sim, uint32_t who, struct part *part)
{
    struct sim_renderer *sum = &sim->outcome->renderers[who];
    part->seconds = isnan(part->begun_s) ? 0 : sim->now - part->begun_s;
    sum->busy_s += part->seconds;
    part->cpu_s = sim->cores ? part->span_s - part->left_s : part->seconds;
    part->working = false;
    if (part->tile.pass == TILE_PROBE) return;
    sum->finish_s = sim->now;
    if (part->dropped) return;
    sum->pixels += tile_pixels(&part->tile);
}

/* Removes a lot from those that the renderer holds: nothing of it is left to do. */
static void put_away(struct renderer *renderer, const struct lot *lot)
{
    unsigned i = 0;
    while (renderer->held[i] != lot)
        i++;
    for (renderer->count--; i < renderer->count; i++)
        renderer->held[i] = renderer->held[i + 1];
}

/* Whether to send what is ready of the lot although something is left of it. */
static bool answers(const struct sim *sim, const struct lot *lot)
{
    if (sim->now >= lot->answered + lot->answer_s) return true;
    size_t ready = bytes_of(sim, lot->ready);
    return lot->begun < lot->count && !lot->in_tray &&
           result_is_full(lot->whole, ready, ready + part_bytes(sim, &lot->parts[lot->begun]));
}

/* Handles a part that is finished or dropped. Rank 0's are handed in one by one. */
static void end_part(struct sim *sim, uint32_t who, struct part *part)
{
    struct lot *lot = part->lot;
    bool all = ++lot->finished == lot->count;
    if (all) put_away(&sim->renderers[who], lot);
    if (is_own(sim, who)) {
        accept_part(sim, who, part);
        sim_tell_recalls(sim, sim_master_hears(sim));
        forget_part(sim, lot);
        return;
    }
    *lot->last = part;
    lot->last = &part->next;
    if (all || part->told || answers(sim, lot)) send_result(sim, who, lot);
}

void finish_part(struct sim *sim, uint32_t who, struct part *part)
{
    struct renderer *renderer = &sim->renderers[who];
    renderer->working--;
    account(sim, who, part);
    end_part(sim, who, part);
    go_on(sim, who);
    if (renderer->working == 0) renderer->idle_since = sim->now;
    if (is_own(sim, who)) take_own(sim);
    if (sim->cores) cores_ended(sim, who);
}

/* The part of this tile that is being rendered; NULL: there is none. */
static struct part *find_working(const struct renderer *renderer, uint32_t id)
{
    for (unsigned i = 0; i < renderer->count; i++) {
        struct lot *lot = renderer->held[i];
        for (uint32_t k = 0; k < lot->begun; k++)
            if (lot->parts[k].working && lot->parts[k].tile.id == id) return &lot->parts[k];
    }
    return NULL;
}

/* Gives up the part: nothing of it is left to do. */
static void give_up(struct sim *sim, uint32_t who, struct part *part)
{
    if (sim->cores) cores_account(sim, who);
    part->dropped = true;
    part->span_s -= part->left_s;
    part->left_s = 0;
}

void sim_drop(struct sim *sim, uint32_t who, uint32_t id)
{
    struct renderer *renderer = &sim->renderers[who];
    struct part *part = find_working(renderer, id);
    if (part && isnan(part->begun_s)) give_up(sim, who, part);
    for (unsigned i = 0; i < renderer->count; i++) {
        struct lot *lot = renderer->held[i];
        for (uint32_t k = lot->begun; k < lot->count; k++)
            if (lot->parts[k].tile.id == id) lot->parts[k].dropped = true;
    }
}

void sim_give_up(struct sim *sim, uint32_t who, uint32_t id)
{
    struct part *part = find_working(&sim->renderers[who], id);
    sim_drop(sim, who, id);
    if (!part) return;
    give_up(sim, who, part);
    /* A renderer that waits for a core cannot notice it yet. */
    if (sim->cores && sim->renderers[who].core == NO_CORE) return;
    if (!sim->cores) events_remove(&sim->done, part);
    finish_part(sim, who, part);
}

void sim_tell(struct sim *sim, uint32_t who, uint32_t id)
{
    struct part *part = find_working(&sim->renderers[who], id);
    if (!part) return;
    struct lot *lot = part->lot;
    double seconds = sim->now - part->begun_s;
    /* The event was for an earlier part with this id. */
    if (seconds + GRAIN < part->tell_s) return;
    part->told = true;
    tell_after(sim, who, part, 2 * seconds);
    if (lot->tells) return;
    lot->notice = (struct part){
        .tile = part->tile, .lot = lot, .seconds = seconds, .dropped = true, .unfinished = true};
    *lot->last = &lot->notice;
    lot->last = &lot->notice.next;
    lot->tells = true;
    send_ready(sim, who, lot, false);
}

void sim_stop(struct sim *sim, uint32_t who)
{
    struct renderer *renderer = &sim->renderers[who];
    for (unsigned i = 0; i < renderer->count; i++) {
        struct lot *lot = renderer->held[i];
        for (uint32_t k = 0; k < lot->begun; k++) {
            struct part *part = &lot->parts[k];
            if (!part->working) continue;
            part->dropped = true;
            account(sim, who, part);
        }
    }
}

bool pays_debt(struct sim *sim, const struct event *done)
{
    struct renderer *renderer = &sim->renderers[done->who];
    if (renderer->debt_s <= 0) return false;
    struct event later = *done;
    later.time += renderer->debt_s;
    renderer->debt_s = 0;
    events_add(&sim->done, &later);
    return true;
}
