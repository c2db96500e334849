/* The files that show a timeline: output.trace, output.heatmap, output.ranks. */
#ifndef FARM_MASTER_TIMELINE_OUTPUT_H
#define FARM_MASTER_TIMELINE_OUTPUT_H

#include <stdbool.h>

#include "common/settings.h"
#include "master/report.h"
#include "master/timeline.h"

/* Whether any of them is asked for. */
bool timeline_wanted(const struct settings *settings);

/* Whether all that are asked for could be written, tried before rendering; says why not. */
bool timeline_writable(const struct settings *settings);

/*
 * Writes what is asked for; report tells the size, the renderers and the time, and gets the range of
 * the heat map. false, after saying why, when a file could not be written; the others are.
 */
bool timeline_write(const struct timeline *timeline, const struct settings *settings,
                    struct report *report);

#endif
