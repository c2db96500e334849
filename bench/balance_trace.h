/*
 * What every tile of one real run took, from its output.trace: the simulated farm can be given the same
 * work that the real one had, at the speed that the machine had at that time.
 */
#ifndef FARM_BENCH_BALANCE_TRACE_H
#define FARM_BENCH_BALANCE_TRACE_H

#include <stddef.h>
#include <stdint.h>

#include "bench/balance_costs.h"
#include "common/tile.h"

enum traced_kind { TRACED_TILE, TRACED_PROBES, TRACED_IN_VAIN };

struct traced {
    struct tile tile; /* place and size; probes without their step */
    enum traced_kind kind;
    uint32_t rank;
    double start_s, busy_s; /* wall seconds, the first since the render phase began */
    double cpu_s;
};

struct trace {
    struct traced *bars;
    size_t count;
};

/* Ends the program when the file cannot be read or has no tiles. */
void trace_read(struct trace *trace, const char *path);
void trace_free(struct trace *trace);

/* CPU seconds of all bars. */
double trace_cpu(const struct trace *trace);

/* Of so many CPU seconds of this rank, what there was beside each of its bars. */
double trace_beside(const struct trace *trace, uint32_t rank, double cpu_s);

/* Of all bars without what was rendered in vain. */
double trace_work(const struct trace *trace);

/* How much of a core this rank had while it worked: CPU seconds per second of its bars. */
double trace_share(const struct trace *trace, uint32_t rank);

/* When each of so many ranks began to work: the start of its first bar; 0 for one that has none. */
void trace_starts(const struct trace *trace, uint32_t ranks, double *starts);

/*
 * The costs of one run. A tile of it costs the CPU seconds that it took there; any other part of the
 * picture has its share in what those tiles took that it lies in, the map saying which pixels are dear.
 */
struct run_costs {
    const struct trace *trace;
    struct tile_costs map; /* base and sums are its own; its levels say nothing */
    uint32_t *owners;      /* per pixel: the bar that it is from */
};

/* `map` is of the same picture and the same samples; it and the trace outlive the costs. The program ends
 * when the run did not render all of the picture. */
void run_costs_init(struct run_costs *costs, const struct trace *trace,
                    const struct tile_costs *map);
void run_costs_free(struct run_costs *costs);

/* CPU seconds of just this tile in the run; negative: it had no such tile. */
double run_costs_of(const struct run_costs *costs, const struct tile *tile);

#endif
