/* Hints for messages about an unknown name or a missing file: "did you mean ...?", or the list of possible names. */
#ifndef FARM_MASTER_NEAREST_NAME_H
#define FARM_MASTER_NEAREST_NAME_H

#include <stddef.h>

/* Most names that a hint lists. */
#define NAMES_LISTED 12

/* The state of a search for the candidate that differs from `name` by the fewest typing errors. Begin with name
 * alone. */
struct nearest_name {
    const char *name; /* looked for */
    const char *best; /* NULL: none is near enough */
    size_t errors;
    const char *tried[NAMES_LISTED]; /* the first candidates, without repetitions */
    size_t count;                    /* number of candidates; those in tried count once */
};

/* Considers a candidate, which must stay valid until the hint is made. An empty one is ignored. */
void nearest_name_try(struct nearest_name *search, const char *candidate);

/* ", did you mean 'best'?", or ", expected one of a b c", or "" if there are no candidates or too many to list. The
 * caller frees the text. */
char *nearest_name_hint(const struct nearest_name *search);

/* The path of the file that may have been meant: it is in the same folder, has the same extension, and its name differs
 * by few typing errors. The caller frees it; NULL: there is none, or the name is not what is wrong, as path exists, if
 * only as a link that leads nowhere, or its folder must not be searched. */
char *nearest_file(const char *path);

#endif
