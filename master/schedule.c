#include "master/schedule.h"

#include <stddef.h>

const char *const schedule_names[SCHEDULES + 1] = {
    [SCHEDULE_DYNAMIC] = "dynamic",         [SCHEDULE_TILES] = "tiles",
    [SCHEDULE_STRIPS] = "strips",           [SCHEDULE_CYCLIC] = "cyclic",
    [SCHEDULE_CYCLIC_ROWS] = "cyclic-rows", [SCHEDULES] = NULL,
};
