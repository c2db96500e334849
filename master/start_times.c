#include "master/start_times.h"

#include <stdlib.h>

#include "common/message.h"

/* At most this many phases are named, as more would make the message long. What takes less than a hundredth of the
 * total explains nothing. */
#define TOLD_MOST 3
#define TOLD_FROM 0.01

void start_phases(const struct run_times *time, struct start_phase phases[START_PHASES])
{
    phases[START_MPI] = (struct start_phase){"starting MPI", time->init};
    phases[START_LOAD] = (struct start_phase){"loading", time->load};
    phases[START_ROOM] = (struct start_phase){"picture memory", time->room};
    phases[START_JOURNAL] = (struct start_phase){"opening journal", time->resume};
    phases[START_SHARE] = (struct start_phase){"sharing scene", time->broadcast};
    phases[START_BUILD] = (struct start_phase){"building the BVH", time->build};
}

static int longest_first(const void *left, const void *right)
{
    const struct start_phase *a = left, *b = right;
    return (a->seconds < b->seconds) - (a->seconds > b->seconds);
}

char *start_times_text(const struct run_times *time)
{
    struct start_phase phases[START_PHASES];
    double sum = 0;
    start_phases(time, phases);
    for (unsigned i = 0; i < START_PHASES; i++)
        sum += phases[i].seconds;
    qsort(phases, START_PHASES, sizeof *phases, longest_first);
    char *text = format_text("%s %.3g s", phases[0].name, phases[0].seconds);
    for (unsigned i = 1; i < TOLD_MOST && phases[i].seconds >= TOLD_FROM * sum; i++) {
        char *longer = format_text("%s, %s %.3g s", text, phases[i].name, phases[i].seconds);
        free(text);
        text = longer;
    }
    return text;
}
