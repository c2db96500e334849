#include "master/start_times.h"

#include <stdlib.h>

#include "common/message.h"

/* At most this many phases are named, as more would make the message long. What takes less than a hundredth of the
 * total explains nothing. The names are those of the table of times (master/report_times.c). */
#define TOLD_MOST 3
#define TOLD_FROM 0.01

struct part {
    const char *name;
    double seconds;
};

static int longest_first(const void *left, const void *right)
{
    const struct part *a = left, *b = right;
    return (a->seconds < b->seconds) - (a->seconds > b->seconds);
}

char *start_times_text(const struct run_times *time)
{
    struct part parts[] = {
        {"starting MPI", time->init},       {"loading", time->load},
        {"picture memory", time->room},     {"opening journal", time->resume},
        {"sharing scene", time->broadcast}, {"building the BVH", time->build},
    };
    const size_t count = sizeof parts / sizeof *parts;
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += parts[i].seconds;
    qsort(parts, count, sizeof *parts, longest_first);
    char *text = format_text("%s %.3g s", parts[0].name, parts[0].seconds);
    for (size_t i = 1; i < TOLD_MOST && parts[i].seconds >= TOLD_FROM * sum; i++) {
        char *longer = format_text("%s, %s %.3g s", text, parts[i].name, parts[i].seconds);
        free(text);
        text = longer;
    }
    return text;
}
