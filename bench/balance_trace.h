/*
 * Reads the cost of every tile of a real run from its output.trace, so that the simulated farm can be given the
 * same work as the real one, at the speed that the machine had at that time.
 */
#ifndef FARM_BENCH_BALANCE_TRACE_H
#define FARM_BENCH_BALANCE_TRACE_H

#include <stddef.h>
#include <stdint.h>

#include "bench/balance_costs.h"
#include "common/tile.h"

enum traced_kind { TRACED_TILE, TRACED_PROBES, TRACED_IN_VAIN };

struct traced {
    struct tile tile; /* place and size; for probes without their step */
    enum traced_kind kind;
    uint32_t rank;
    double start_s, busy_s; /* wall seconds; start_s: since the start of the render phase */
    double cpu_s;
};

struct trace {
    struct traced *bars;
    size_t count;
};

/* Reads a trace; ends the program when the file cannot be read or has no tiles. */
void trace_read(struct trace *trace, const char *path);
void trace_free(struct trace *trace);

/* CPU seconds of all bars. */
double trace_cpu(const struct trace *trace);

/* CPU seconds besides each bar of this rank, on average, if it used cpu_s in all. */
double trace_beside(const struct trace *trace, uint32_t rank, double cpu_s);

/* CPU seconds of all bars that were not rendered in vain. */
double trace_work(const struct trace *trace);

/* The part of a core that this rank had while it worked: CPU seconds per wall second of its bars. */
double trace_share(const struct trace *trace, uint32_t rank);

/* Sets when each of so many ranks began to work: the start of its first bar, or 0 if it has none. */
void trace_starts(const struct trace *trace, uint32_t ranks, double *starts);

/*
 * The costs of one run. A tile of that run costs the CPU seconds that it took there. Any other part of the
 * picture costs its share of the run's tiles that it overlaps, in proportion to the costs of pixels in the map.
 */
struct run_costs {
    const struct trace *trace;
    struct tile_costs map; /* base and sums are of this run; levels are not used */
    uint32_t *owners;      /* per pixel: index of the bar that rendered it */
};

/* Initialises the costs. `map` is of the same picture and the same samples; map and trace outlive the costs.
 * Ends the program when the run did not render the whole picture. */
void run_costs_init(struct run_costs *costs, const struct trace *trace,
                    const struct tile_costs *map);
void run_costs_free(struct run_costs *costs);

/* CPU seconds of exactly this tile in the run; negative: it had no such tile. */
double run_costs_of(const struct run_costs *costs, const struct tile *tile);

#endif
