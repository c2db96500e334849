#include "common/nap.h"

#include <sys/prctl.h>

/* ns: little beside what a wake-up is late by anyhow (common/nap.h). */
#define TIMER_SLACK 500ul

void nap_sharpen(void)
{
    prctl(PR_SET_TIMERSLACK, TIMER_SLACK);
}
