/* How tiles are assigned to renderers: see master/queue.h. */
#ifndef FARM_MASTER_SCHEDULE_H
#define FARM_MASTER_SCHEDULE_H

#include <stdbool.h>

enum schedule {
    SCHEDULE_DYNAMIC,
    SCHEDULE_TILES,
    SCHEDULE_STRIPS,
    SCHEDULE_CYCLIC,
    SCHEDULE_CYCLIC_ROWS,
    SCHEDULES
};

/* "dynamic", "tiles", ..., then NULL, as struct key wants it. */
extern const char *const schedule_names[SCHEDULES + 1];

/* Whether each renderer's share is fixed before it begins. */
static inline bool schedule_is_static(enum schedule schedule)
{
    return schedule != SCHEDULE_DYNAMIC && schedule != SCHEDULE_TILES;
}

#endif
