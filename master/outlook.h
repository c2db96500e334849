/*
 * How much of a run is done, as a share of the seconds that it takes. Predictions are off in ways that
 * have to do with what is predicted: cheap pixels take several times longer, measured by dear ones, than
 * a single probe of each says. So tiles are told apart by their predicted work per pixel, octave by
 * octave; those that are finished tell how many seconds their octave takes for its work. As the dear
 * tiles go first, a share of the predicted work alone would be far too optimistic.
 */
#ifndef FARM_MASTER_OUTLOOK_H
#define FARM_MASTER_OUTLOOK_H

#include <stdint.h>

/* Octaves of seconds or samples per pixel: 2^-40 to 2^23. What lies beyond counts with the ends. */
#define OUTLOOK_CLASSES 64

/* Predicted work of tiles that are alike, all sums. */
struct outlook_class {
    double left;          /* not finished */
    double skipped;       /* finished by an earlier run */
    double done, seconds; /* finished by this one, and what it took */
};

/* Nothing is known: (struct outlook){0}. */
struct outlook {
    struct outlook_class classes[OUTLOOK_CLASSES];
};

/* A tile of so much predicted work and so many pixels is to be rendered; or not, for its prediction
 * changes. */
void outlook_add(struct outlook *outlook, double work, uint64_t pixels);
void outlook_remove(struct outlook *outlook, double work, uint64_t pixels);

/* One that is finished, in so many seconds, or that an earlier run has finished; it is not among those
 * that were added. */
void outlook_finish(struct outlook *outlook, double work, uint64_t pixels, double seconds);
void outlook_skip(struct outlook *outlook, double work, uint64_t pixels);

/* Shares of all, 0..1. */
struct outlook_share {
    double finished; /* by whomever */
    double skipped;  /* of that: by an earlier run */
    double seconds;  /* that what this run has to do takes; of use when some of it is finished */
};
struct outlook_share outlook_share(const struct outlook *outlook);

#endif
