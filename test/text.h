/* Assertions that a printed or written text contains a part. To be included after cmocka.h. */
#ifndef FARM_TEST_TEXT_H
#define FARM_TEST_TEXT_H

#include <stdio.h>
#include <string.h>

static inline void assert_has(const char *text, const char *part)
{
    if (strstr(text, part)) return;
    fprintf(stderr, "missing: %s\nin: %s\n", part, text); /* print_error() truncates */
    fail();
}

#endif
