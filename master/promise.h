/* What the plans of passes promise to leave of the error, and what came of it: how far to trust the next one. */
#ifndef FARM_MASTER_PROMISE_H
#define FARM_MASTER_PROMISE_H

/* Of squared errors, summed over the picture, as halves tell them. */
struct promise {
    double before;   /* when the last pass was planned */
    double promised; /* of that, the share that is to be left; 0: no pass is to be judged */
    double log_promised, log_kept; /* of these shares and what came of them: sums over passes */
};

/* The plan of a pass promises that of the errors before it so much is left. */
void promise_make(struct promise *promise, double before, double left);

/* The pass has left so much; nothing happens if it has been told already. */
void promise_judge(struct promise *promise, double squares);

/* The power of a promised share that passes so far have left: 1 where they have kept what they promised. */
double promise_exponent(const struct promise *promise);

#endif
