/* How tiles are given to renderers: see master/queue.h. */
#ifndef FARM_COMMON_SCHEDULE_H
#define FARM_COMMON_SCHEDULE_H

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

#endif
