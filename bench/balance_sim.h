/*
 * Simulates the farm in virtual time: the real work queue (master/queue.h) hands out lots of tiles to processors
 * that take as long as a cost map says, with the measured costs of messages and naps.
 *
 * A renderer does what worker/work.c does: it works through the lots that it holds and sends each result; while
 * it holds none, it naps between looks, or is woken. The master does what master/serve.c does: it handles one
 * message at a time, and looks for more with growing naps when there are none, or is woken by a renderer that
 * has nothing in reserve. Its own renderer takes lots from the queue without a message, hands in every tile, and
 * loses the time that serving takes.
 */
#ifndef FARM_BENCH_BALANCE_SIM_H
#define FARM_BENCH_BALANCE_SIM_H

#include <stdbool.h>
#include <stdint.h>

#include "bench/balance_costs.h"
#include "bench/balance_passes.h"
#include "master/queue.h"

/* Costs of messages, in seconds: see bench/balance_messages.c. */
struct message_costs {
    double latency_s, byte_s;
    double service_s, service_tile_s, service_pixel_s;
    double service_tile_large_s; /* in place of service_tile_s, with 7680 x 4320 pixels */
    /* The master's additional cost of a message of more than RESULT_SHORT bytes. */
    double fetch_s;
    double tray_s, tray_pixel_s; /* replace service_s and service_pixel_s for results in a tray */
    double send_s;
    double tile_s; /* a renderer's cost per tile besides rendering it */
    double
        looking_share; /* the part of a core that the master always uses for looking for messages */
    double nap_s;      /* by how much a nap is too long; negative: all poll without napping */
};

struct machine {
    uint32_t renderers;
    uint32_t node_cores; /* of each renderer, which stands for a node if there are several */
    /* Per renderer: speed of each of its cores, 1: as measured; NULL: all 1. */
    const double *speeds;
    uint32_t cores;      /* that all renderers share; 0: each has its own, or node_cores */
    double slice_s;      /* time slice of a core that others wait for; > 0 */
    bool master_renders; /* renderer 0 is rank 0's own */
    /* All renderers are on rank 0's machine: they wake the master and are woken by it (common/bell.h), and have
     * trays (common/tray.h). */
    bool rings;
    const double *starts; /* per renderer: when it reports for work; NULL: all at the start */
    struct message_costs messages;
    struct sim_passes *passes; /* of an adaptive run; NULL: of another one */
};

struct sim_renderer {
    uint64_t pixels; /* that it has rendered */
    double busy_s;   /* wall seconds of rendering and probing */
    double finish_s; /* when it last stopped rendering, whether the result counts or not */
    double send_s;   /* from when it sends a result until the last byte is at the master */
};

struct sim_outcome {
    double render_s;                /* until the last tile is in the picture */
    double useful_s;                /* seconds of the tiles that count on a processor of speed 1 */
    double master_s;                /* seconds that the master was serving */
    uint64_t messages;              /* results that came in MPI messages */
    double plans_s;                 /* wall seconds in which passes were planned */
    uint32_t tiles, repeated;       /* see struct queue_count */
    struct sim_renderer *renderers; /* owned */
};

/* Runs the simulation. queue: new, with machine->renderers renderers; it is worked off. */
void simulate(const struct machine *machine, struct queue *queue, const struct picture_costs *costs,
              struct sim_outcome *outcome);
void sim_outcome_free(struct sim_outcome *outcome);

/*
 * The efficiency: the part of the time of the processors, which all have speed 1, that goes into tiles that
 * count. The rest are probes, tiles rendered in vain, what renderers spend besides tiles, serving and waiting.
 */
double sim_efficiency(const struct sim_outcome *outcome, uint32_t processors);

/* Seconds between the first and the last renderer to finish. */
double sim_tail(const struct sim_outcome *outcome, uint32_t renderers);

#endif
