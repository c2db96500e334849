/*
 * The main program of `make bench-balance`: how evenly the work is distributed, in real runs and in virtual
 * time.
 *
 *   balance [--only SECTION[,SECTION...]] [--rounds N]
 *   balance --scene FILE [--samples N] [--rounds N]
 *
 * Sections that are not run again keep their last results, and the measured costs; a run of all sections discards
 * them. --scene only simulates how another scene would be distributed. --rounds: how often every tile is timed for its
 * cost (3). Exit status 1: a picture of many ranks differed from that of one.
 */
#include <stdlib.h>
#include <string.h>

#include "bench/balance.h"
#include "bench/outside.h"
#include "common/message.h"
#include "master/number.h"

static void put_usage(FILE *out)
{
    fputs("usage: balance [--only SECTION[,SECTION...]] [--rounds N]\n"
          "       balance --scene FILE [--samples N] [--rounds N]\n"
          "  --only       these sections alone; the others keep what they said the last time\n"
          "  --scene      how another scene would be shared out, simulated, and nothing else\n"
          "  --samples N  of each of its pixels (1)\n"
          "  --rounds N   how often every tile is timed for its cost (3)\n"
          "sections:\n",
          out);
    sections_list(out);
}

static _Noreturn void refuse(const char *argument)
{
    fprintf(stderr, "balance: %s is no option, or has no value, or a wrong one\n", argument);
    put_usage(stderr);
    exit(2);
}

static _Noreturn void end_with(const char *why)
{
    fprintf(stderr, "balance: %s\n", why);
    exit(2);
}

static bool is_count(const char *text, uint32_t *count)
{
    return number_parse_unsigned(text, count) && *count > 0;
}

/* Whether pictures were the same wherever they were compared. */
static bool pictures_are_same(void)
{
    bool same = true;
    for (unsigned s = 0; s < SCENES; s++)
        for (unsigned ranks = 2; ranks <= PAPER_PROCESSORS; ranks += PAPER_PROCESSORS - 2)
            same = same && value_get("%s.real.same.%u", bench_scenes[s].name, ranks) != 0;
    return same;
}

int main(int argc, char **argv)
{
    const char *only = NULL, *scene = NULL;
    uint32_t samples = 0;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            put_usage(stdout);
            return 0;
        } else if (strcmp(argv[i], "--only") == 0 && i + 1 < argc && sections_known(argv[i + 1]))
            only = argv[++i];
        else if (strcmp(argv[i], "--scene") == 0 && i + 1 < argc)
            scene = argv[++i];
        else if (strcmp(argv[i], "--samples") == 0 && i + 1 < argc &&
                 is_count(argv[i + 1], &samples))
            i++;
        else if (strcmp(argv[i], "--rounds") == 0 && i + 1 < argc &&
                 is_count(argv[i + 1], &bench_rounds))
            i++;
        else
            refuse(argv[i]);
    }
    if (scene && only) end_with("--scene goes without --only");
    if (samples > 0 && !scene) end_with("--samples is for --scene alone");
    if (run_shell("mkdir -p " OUT_FOLDER " " KEPT_FOLDER) != 0) fatal("cannot make " OUT_FOLDER);
    if (scene) {
        values_read();
        compare_schedules(scene, samples > 0 ? samples : 1);
        values_write();
        return 0;
    }
    if (!only && run_shell("rm -f " KEPT_FOLDER "/*") != 0) fatal("cannot empty " KEPT_FOLDER);
    values_read();
    sections_run(only);
    return pictures_are_same() ? 0 : 1;
}
