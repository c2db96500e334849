#include "bench/balance_schedules.h"

#include <assert.h>
#include <stdlib.h>

#include "common/cores.h"
#include "common/message.h"

const enum schedule compared[SCHEDULES] = {SCHEDULE_STRIPS, SCHEDULE_CYCLIC, SCHEDULE_CYCLIC_ROWS,
                                           SCHEDULE_TILES, SCHEDULE_DYNAMIC};

/* The crowd of the renderers, for machines whose cores they share. */
static void share_cores(struct crowd *crowd, const struct machine *machine)
{
    struct affinity *affinities = allocate(machine->renderers, sizeof *affinities);
    struct affinity affinity = {.machine = "simulated"};
    assert(machine->cores <= CPU_SETSIZE);
    for (uint32_t i = 0; i < machine->cores; i++)
        CPU_SET(i, &affinity.cores);
    for (uint32_t i = 0; i < machine->renderers; i++)
        affinities[i] = affinity;
    crowd_init(crowd, affinities, machine->renderers);
    free(affinities);
}

/* A new queue, as the farm creates it. */
static struct queue *schedule_queue(enum schedule schedule, uint32_t width, uint32_t height,
                                    uint32_t samples, const struct machine *machine,
                                    const struct crowd *crowd)
{
    struct queue_config config = {.schedule = schedule,
                                  .width = width,
                                  .height = height,
                                  .renderers = machine->renderers,
                                  .master_renders = machine->master_renders,
                                  .crowd = crowd,
                                  .samples = samples};
    uint32_t processors = crowd ? crowd->processors : machine->renderers * machine->node_cores;
    if (!schedule_is_static(schedule))
        config.tile_edge = queue_auto_edge(schedule, width, height, samples, processors);
    config.probe_edge = queue_auto_probe_edge(width, height, samples);
    struct queue *queue = queue_create(&config);
    if (!queue) fatal("the picture has too many tiles");
    return queue;
}

void schedule_simulate(enum schedule schedule, const struct machine *machine,
                       const struct picture_costs *costs, struct sim_outcome *outcome)
{
    struct crowd crowd = {0};
    bool shares = machine->cores > 0;
    if (shares) share_cores(&crowd, machine);
    struct queue *queue = schedule_queue(schedule, costs_width(costs), costs_height(costs),
                                         costs->samples, machine, shares ? &crowd : NULL);
    struct picture_costs own = *costs;
    own.apart_ratio = costs_apart_ratio(costs->map, schedule, machine->renderers);
    struct machine with_passes = *machine;
    if (costs->record) with_passes.passes = sim_passes_begin(costs->record, queue);
    simulate(&with_passes, queue, &own, outcome);
    if (costs->record) sim_passes_end(with_passes.passes);
    queue_destroy(queue);
    crowd_free(&crowd);
}

struct machine apart_machines(uint32_t processors)
{
    return (struct machine){.renderers = processors,
                            .node_cores = 1,
                            .master_renders = true,
                            .messages = kept_messages()};
}

void scale_serving(struct message_costs *costs, double factor)
{
    costs->service_s *= factor;
    costs->service_tile_s *= factor;
    costs->service_pixel_s *= factor;
    costs->fetch_s *= factor;
    costs->tray_s *= factor;
    costs->tray_pixel_s *= factor;
}

struct machine one_machine(uint32_t processors, double serving)
{
    struct machine machine = apart_machines(processors);
    machine.rings = true;
    scale_serving(&machine.messages, serving);
    return machine;
}

struct picture_costs scene_costs(const struct bench_scene *scene, uint32_t samples)
{
    return (struct picture_costs){
        .map = kept_costs(scene, PAPER_WIDTH, PAPER_HEIGHT, samples),
        .single = kept_costs(scene, PAPER_WIDTH, PAPER_HEIGHT, 1),
        .scale = 1,
        .samples = samples,
    };
}

double serial_seconds(const struct picture_costs *costs)
{
    struct machine machine = one_machine(1, 1);
    struct sim_outcome outcome;
    schedule_simulate(SCHEDULE_DYNAMIC, &machine, costs, &outcome);
    double seconds = outcome.render_s;
    sim_outcome_free(&outcome);
    return seconds;
}
