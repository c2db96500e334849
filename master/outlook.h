/*
 * How much of a run is done, as a share of the seconds that it takes.
 *
 * The error of predictions depends on what is predicted: relative to expensive pixels, cheap ones take several times as
 * long as a single probe of each predicts. So tiles are put into classes by their predicted work per pixel, one for
 * each octave, and the finished tiles of a class show how many seconds its work takes. A share of the predicted work
 * alone would be far too optimistic, as the expensive tiles go first.
 */
#ifndef FARM_MASTER_OUTLOOK_H
#define FARM_MASTER_OUTLOOK_H

#include <stdint.h>

/* Octaves of seconds or samples per pixel: 2^-40 to 2^23. Values beyond either end count with the last octave there. */
#define OUTLOOK_CLASSES 64

/* Sums of the predicted work of the tiles of a class. */
struct outlook_class {
    double left;          /* not finished */
    double skipped;       /* finished by an earlier run */
    double done, seconds; /* finished by this one, and the seconds that it took */
};

/* Before any tile is known: (struct outlook){0}. */
struct outlook {
    struct outlook_class classes[OUTLOOK_CLASSES];
};

/* Adds a tile that is to be rendered, with its predicted work and number of pixels; removes one, because its prediction
 * changes or it is finished. */
void outlook_add(struct outlook *outlook, double work, uint64_t pixels);
void outlook_remove(struct outlook *outlook, double work, uint64_t pixels);

/* Counts a tile as finished in this number of seconds, or as finished by an earlier run. It must not be among the
 * tiles that are added at present. */
void outlook_finish(struct outlook *outlook, double work, uint64_t pixels, double seconds);
void outlook_skip(struct outlook *outlook, double work, uint64_t pixels);

/* Shares of the seconds of the whole picture, 0..1. */
struct outlook_share {
    double finished; /* by this run or an earlier one */
    double skipped;  /* by an earlier run; part of finished */
    /* Seconds, no share: what this run takes in all; of use when some of it is finished. */
    double seconds;
};
struct outlook_share outlook_share(const struct outlook *outlook);

#endif
