#include "master/promise.h"

#include <math.h>

/* A pass that promised to leave a share s of the squared error left s^exponent. The exponent was 0.90 to 1.12 for the
 * first pass after pass 0 in 14 runs of seven scenes; in each run that of the later passes, which are smaller, was
 * within 0.1 of it. A pass of few pixels tells hardly anything about the exponent. So the sums begin as if an earlier
 * pass had promised to leave a quarter and had kept this promise: PROMISE_BEFORE is the logarithm of that share. */
#define PROMISE_BEFORE (-1.3862943611198906)

void promise_make(struct promise *promise, double before, double left)
{
    promise->promised = before > 0 ? left / before : 0;
    promise->before = before;
}

void promise_settle(struct promise *promise, double squares)
{
    if (!(promise->promised > 0 && promise->promised < 1 && squares > 0)) return;
    promise->log_promised += log(promise->promised);
    promise->log_kept += log(squares / promise->before);
    promise->promised = 0;
}

double promise_exponent(const struct promise *promise)
{
    return (promise->log_kept + PROMISE_BEFORE) / (promise->log_promised + PROMISE_BEFORE);
}
