/* "did you mean ...?", or what there is to choose from. */
#ifndef FARM_MASTER_NEAREST_NAME_H
#define FARM_MASTER_NEAREST_NAME_H

#include <stddef.h>

/* A longer list of names would not help. */
#define NAMES_LISTED 12

/* The candidate that takes the fewest typing errors to become name; kept over the calls. */
struct nearest_name {
    const char *name; /* looked for */
    const char *best; /* NULL: none is near enough */
    size_t errors;
    const char *tried[NAMES_LISTED]; /* the first different candidates */
    size_t count;                    /* of candidates, those in tried once */
};

/* The candidate has to live until the hint is made; an empty one is none. */
void nearest_name_try(struct nearest_name *search, const char *candidate);

/* ", did you mean 'best'?", ", expected one of a b c", or "" where there are none or too many to list,
 * as text that the caller frees. */
char *nearest_name_hint(const struct nearest_name *search);

#endif
