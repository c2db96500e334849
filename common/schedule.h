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

/* "dynamic", "tiles", ... */
const char *schedule_name(enum schedule schedule);

#endif
