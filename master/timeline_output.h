/* Writes the files that show a timeline: output.trace, output.heatmap, output.ranks. */
#ifndef FARM_MASTER_TIMELINE_OUTPUT_H
#define FARM_MASTER_TIMELINE_OUTPUT_H

#include <stdbool.h>

#include "master/report.h"
#include "master/settings.h"
#include "master/timeline.h"

/* Whether the settings name a file that the timeline is written to. */
bool timeline_wanted(const struct settings *settings);

/* Whether all that are wanted could be written, tested before rendering; says why not. */
bool timeline_writable(const struct settings *settings);

/*
 * Writes the files that are wanted. report gives the size, the renderers and the time, and receives the range of
 * the heat map. Returns false, after saying why, if a file could not be written; the others are.
 */
bool timeline_write(const struct timeline *timeline, const struct settings *settings,
                    struct report *report);

#endif
