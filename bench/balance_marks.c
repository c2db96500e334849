/* The section "marks": what issue and paper ask for, line by line, with what was measured. */
#include <math.h>
#include <stdlib.h>

#include "bench/balance.h"
#include "common/message.h"

static FILE *out;
static unsigned missed, unknown;

/* A line of the table; at_least: the mark is a lower bound. */
static void mark(const char *what, const char *how, double value, double bound, bool at_least)
{
    bool known = !isnan(value), good = at_least ? value >= bound : value <= bound;
    unknown += !known;
    missed += known && !good;
    fprintf(out, "| %s | %s | %s %.4g | ", what, how, at_least ? ">=" : "<=", bound);
    if (known)
        fprintf(out, "%.4g | %s |\n", value, good ? "yes" : "**no**");
    else
        fputs("| not measured |\n", out);
}

/* The same for what is told of a scene. */
static void mark_of(const char *name, const char *what, const char *how, double value, double bound,
                    bool at_least)
{
    char *text = format_text("%s: %s", name, what);
    mark(text, how, value, bound, at_least);
    free(text);
}

static void mark_scene(const struct bench_scene *scene)
{
    const char *name = scene->name;
    mark_of(name, "speed-up on 44, 16 samples", "simulated",
            value_get("%s.16.dynamic.speedup.44", name), 43, true);
    mark_of(name, "speed-up on 44, 1 sample", "simulated",
            value_get("%s.1.dynamic.speedup.44", name), 41, true);
    mark_of(name, "efficiency on 44, 16 samples", "simulated",
            value_get("%s.16.dynamic.efficiency.44", name), 0.98, true);
    mark_of(name, "efficiency on 44, 1 sample", "simulated",
            value_get("%s.1.dynamic.efficiency.44", name), 41.0 / PAPER_PROCESSORS, true);
    mark_of(name, "-n 1 / -n 2, render wall time", "measured, median of pairs",
            value_get("%s.real.speedup.2", name), 1.95, true);
    mark_of(name, "tail / render time on 44, 16 samples", "simulated",
            value_get("%s.16.dynamic.tail.44", name), 0.01, false);
    mark_of(name, "master at 44 ranks, of a core", "measured", value_get("%s.real.master.44", name),
            0.01, false);
    mark_of(name, "more time than its missing share, one of 44 four times slower", "simulated",
            value_get("%s.slow.44", name), 0.02, false);
    mark_of(name, "the same, rank 1 of 2 beside -n 2 at full speed", "measured",
            value_get("%s.real.slow", name), 0.02, false);
    mark_of(name, "efficiency of 10,000 renderers, 7680 x 4320, 4096 samples, 10 us", "simulated",
            value_get("plan.%s.10000.4096.10", name), 0.9, true);
    mark_of(name, "-n 2 has the bits of -n 1", "measured", value_get("%s.real.same.2", name), 1,
            true);
    mark_of(name, "-n 44 has the bits of -n 1", "measured", value_get("%s.real.same.44", name), 1,
            true);
}

void section_marks(void)
{
    out = open_section("marks", "The marks");
    fprintf(out, "| | how | mark | value | reached |\n|---|---|---|---|---|\n");
    missed = unknown = 0;
    for (unsigned s = 0; s < SCENES; s++)
        mark_scene(&bench_scenes[s]);
    mark("a rank that waits, of a core", "measured", value_get("waiting"), 0.01, false);
    mark("simulated against measured, -n 1, 2, 4, 8, 44: off by", "both, worst median of 5",
         value_get("model.worst"), 0.03, false);
    mark("garden: 10,000 renderers, speeds uneven by 4, 100 us", "simulated",
         value_get("plan.uneven.garden.10000.4096.100"), 0.9, true);
    fprintf(out,
            "\nSpeed-up is that of the render phase, pre-pass included, against -n 1 with the "
            "same kernel; whole runs are below (real runs). Efficiency on 44 is the part of the "
            "processors' time that went into tiles that count: what tiles of other sizes than "
            "those of -n 1 cost more or less is in speed-up, not in it.\n");
    close_section(out, "marks");
    printf("%u marks missed, %u not measured\n", missed, unknown);
}
