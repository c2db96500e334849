/* Texts that are settings, and assertions that one that was printed or written contains a part. */
#ifndef FARM_TEST_TEXT_H
#define FARM_TEST_TEXT_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "test/unit.h"

/* Replaces a setting. */
static inline void set_text(char **setting, const char *text)
{
    free(*setting);
    *setting = copy_text(text);
}

static inline void assert_has(const char *text, const char *part)
{
    if (strstr(text, part)) return;
    fprintf(stderr, "missing: %s\nin: %s\n", part, text); /* print_error() truncates */
    fail();
}

#endif
