/* The section "marks": the requirements of issue and paper, line by line, with what was measured. */
#include <math.h>

#include "bench/balance.h"

struct mark {
    const char *what, *how;
    const char *value; /* its name, %s: the scene's */
    double bound;
    bool at_least; /* the bound is a lower one */
};

static const struct mark scene_marks[] = {
    {"speed-up on 44, 16 samples", "simulated", "%s.16.dynamic.speedup.44", 43, true},
    {"speed-up on 44, 1 sample", "simulated", "%s.1.dynamic.speedup.44", 41, true},
    {"efficiency on 44, 16 samples", "simulated", "%s.16.dynamic.efficiency.44", 0.98, true},
    {"efficiency on 44, 1 sample", "simulated", "%s.1.dynamic.efficiency.44",
     41.0 / PAPER_PROCESSORS, true},
    {"-n 1 / -n 2, render wall time", "measured, median of pairs", "%s.real.speedup.2", 1.95, true},
    {"tail / render time on 44, 16 samples", "simulated", "%s.16.dynamic.tail.44", 0.01, false},
    {"master at 44 ranks, of a core", "measured", "%s.real.master.44", 0.01, false},
    {"more time than its missing share, one of 44 four times slower", "simulated", "%s.slow.44",
     0.02, false},
    {"the same, rank 1 of 2 beside -n 2 at full speed", "measured", "%s.real.slow", 0.02, false},
    {"efficiency of 10,000 renderers, 7680 x 4320, 4096 samples, 10 us", "simulated",
     "plan.%s.10000.4096.10", 0.9, true},
    {"-n 2 has the bits of -n 1", "measured", "%s.real.same.2", 1, true},
    {"-n 44 has the bits of -n 1", "measured", "%s.real.same.44", 1, true},
};

static const struct mark marks[] = {
    {"a rank that waits, of a core", "measured", "waiting", 0.01, false},
    {"simulated against measured, -n 1, 2, 4, 8, 44: off by", "both, worst median of 5",
     "model.worst", 0.03, false},
    {"garden: 10,000 renderers, speeds uneven by 4, 100 us", "simulated",
     "plan.uneven.garden.10000.4096.100", 0.9, true},
};

static unsigned missed, unknown;

/* Prints a line of the table; at_least: the mark is a lower bound. */
static void put_mark(FILE *out, const char *scene, const struct mark *mark)
{
    double value = value_get(mark->value, scene), bound = mark->bound;
    bool known = !isnan(value), good = mark->at_least ? value >= bound : value <= bound;
    unknown += !known;
    missed += known && !good;
    fprintf(out, "| %s%s%s | %s | %s %.4g | ", scene, *scene ? ": " : "", mark->what, mark->how,
            mark->at_least ? ">=" : "<=", bound);
    if (known)
        fprintf(out, "%.4g | %s |\n", value, good ? "yes" : "**no**");
    else
        fputs("| not measured |\n", out);
}

void section_marks(FILE *out)
{
    fprintf(out, "| | how | mark | value | reached |\n|---|---|---|---|---|\n");
    missed = unknown = 0;
    for (unsigned s = 0; s < SCENES; s++)
        for (size_t i = 0; i < sizeof scene_marks / sizeof *scene_marks; i++)
            put_mark(out, bench_scenes[s].name, &scene_marks[i]);
    for (size_t i = 0; i < sizeof marks / sizeof *marks; i++)
        put_mark(out, "", &marks[i]);
    fprintf(out,
            "\nSpeed-up is that of the render phase, pre-pass included, against -n 1 with the "
            "same kernel; whole runs are below (real runs). Efficiency on 44 is the part of the "
            "processors' time that went into tiles that count: what tiles of other sizes than "
            "those of -n 1 cost more or less is in speed-up, not in it.\n");
    printf("%u marks missed, %u not measured\n", missed, unknown);
}
