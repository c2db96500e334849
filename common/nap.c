#include "common/nap.h"

#ifdef __linux__
#include <sys/prctl.h>
#endif

/* ns: little beside what a wake-up is late by anyhow (common/nap.h). */
#define TIMER_SLACK 500ul

void nap_sharpen(void)
{
#ifdef __linux__
    prctl(PR_SET_TIMERSLACK, TIMER_SLACK);
#endif
}
