#include "common/nap.h"

#include <sys/prctl.h>

/* Nanoseconds: small beside the usual lateness of a wake-up (common/nap.h). */
#define TIMER_SLACK 500ul

void nap_sharpen(void)
{
    prctl(PR_SET_TIMERSLACK, TIMER_SLACK);
}
