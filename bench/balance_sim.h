/*
 * The farm in virtual time: the real work queue (master/queue.h) handing out lots of tiles to
 * processors that take as long as a cost map says, with messages and naps as long as they were
 * measured.
 *
 * A renderer does what worker/work.c does: it works through the lots that it holds, sends each result, and
 * naps between looks while it holds none, or is woken. The master does what master/serve.c does: one
 * message at a time, looking for more with growing naps when there are none, or woken by who has nothing in
 * reserve. Its own renderer takes lots from the queue without a message, hands in every tile, and loses the
 * time that serving takes.
 */
#ifndef FARM_BENCH_BALANCE_SIM_H
#define FARM_BENCH_BALANCE_SIM_H

#include <stdbool.h>
#include <stdint.h>

#include "bench/balance_costs.h"
#include "master/queue.h"

/* What messages cost, seconds: see bench/balance_messages.c. */
struct message_costs {
    double latency_s, byte_s;
    double service_s, service_tile_s, service_pixel_s;
    double fetch_s; /* of the master beside that for a message of more than RESULT_SHORT bytes */
    double tray_s, tray_pixel_s; /* in place of service_s and service_pixel_s, through a tray */
    double send_s;
    double tile_s; /* of a renderer for every tile, beside rendering it */
    double looks;  /* of the master in looking for messages: part of a core, all the time */
    double nap_s;  /* by how much a nap is too long; negative: nobody naps, all look all the time */
};

struct machine {
    uint32_t renderers;
    uint32_t node_cores;  /* of each renderer, which is a node when there are several */
    const double *speeds; /* per renderer, of each of its cores, 1: as measured; NULL: all 1 */
    uint32_t cores;       /* that the renderers share; 0: one for each, or node_cores */
    double slice_s;       /* for so long a core goes on with one when others wait for it; > 0 */
    bool master_renders;  /* renderer 0 is rank 0's own */
    bool rings;           /* all are on rank 0's machine, wake the master and are woken by it
                           * (common/bell.h), and have trays (common/tray.h) */
    const double *starts; /* per renderer, when it reports for work; NULL: all at once */
    struct message_costs messages;
};

struct sim_renderer {
    uint32_t tiles;
    uint64_t pixels;
    double busy_s;   /* wall seconds of rendering and probing */
    double finish_s; /* when it rendered for the last time, in vain or not */
    double send_s;   /* in sending its results: to the last byte at the master */
};

struct sim_outcome {
    double render_s;                /* until the last tile is in the picture */
    double useful_s;                /* of the tiles that count, by a processor of speed 1 */
    double master_s;                /* seconds that the master was serving */
    uint64_t messages;              /* results that came by message */
    uint32_t tiles, repeated;       /* see struct queue_count */
    struct sim_renderer *renderers; /* owned */
};

/* queue: fresh, with machine->renderers renderers; it is worked off. */
void simulate(const struct machine *machine, struct queue *queue, const struct picture_costs *costs,
              struct sim_outcome *outcome);
void sim_outcome_free(struct sim_outcome *outcome);

/*
 * The part of the processors' time, all of them of speed 1, that went into tiles that count: without
 * probes, what is rendered in vain, what renderers spend beside tiles, serving and waiting.
 */
double sim_efficiency(const struct sim_outcome *outcome, uint32_t processors);

/* Between the first and the last renderer to finish, seconds. */
double sim_tail(const struct sim_outcome *outcome, uint32_t renderers);

#endif
