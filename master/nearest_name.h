/* "did you mean ...?" */
#ifndef FARM_MASTER_NEAREST_NAME_H
#define FARM_MASTER_NEAREST_NAME_H

#include <stddef.h>

/* The candidate that takes the fewest typing errors to become name; best is kept over the calls. */
struct nearest_name {
    const char *name; /* looked for */
    const char *best; /* NULL: none is near enough */
    size_t errors;
};

void nearest_name_try(struct nearest_name *search, const char *candidate);

/* ", did you mean 'best'?" or "", as text that the caller frees. */
char *nearest_name_hint(const struct nearest_name *search);

#endif
