#include "common/nap.h"

#ifdef __linux__
#include <sys/prctl.h>
#endif

/* ns; a wake-up itself takes some microseconds. */
#define TIMER_SLACK 500ul

void nap_sharpen(void)
{
#ifdef __linux__
    prctl(PR_SET_TIMERSLACK, TIMER_SLACK);
#endif
}
