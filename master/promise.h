/* How well the plans of passes predict: the share of the error that a plan promises to leave is compared with what its
 * pass has left, to correct later forecasts. */
#ifndef FARM_MASTER_PROMISE_H
#define FARM_MASTER_PROMISE_H

/* Compares sums of squared errors over the picture, estimated from the halves. */
struct promise {
    double before; /* sum when the last pass was planned */
    double
        promised; /* share of it that the pass is to leave; 0: no pass has to be compared with it */
    /* Sums over passes: logarithms of the promised shares, and of those that were left. */
    double log_promised, log_kept;
};

/* A plan promises that its pass leaves the sum `left` of `before`. */
void promise_make(struct promise *promise, double before, double left);

/* The pass is over and has left the sum `squares`: compares that with the promise, once for each pass. */
void promise_settle(struct promise *promise, double squares);

/* The exponent x such that passes which promised a share s have left s^x so far; 1 where they kept their promises. */
double promise_exponent(const struct promise *promise);

#endif
