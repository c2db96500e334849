/*
 * Tables of the keys of an INI section. One table serves for reading the section, for its defaults, for
 * printing it and for the help text.
 */
#ifndef FARM_MASTER_KEY_H
#define FARM_MASTER_KEY_H

#include <stdbool.h>
#include <stddef.h>

#include "common/vec.h"

enum value_type {
    VALUE_UNSIGNED, /* uint32_t, min..max */
    VALUE_NUMBER,   /* double, min..max */
    VALUE_VECTOR,   /* struct vec3, any finite numbers */
    VALUE_COLOR,    /* struct vec3, each number >= 0 */
    VALUE_COLORS,   /* two struct vec3 that get the same colour */
    VALUE_BOOLEAN,  /* bool */
    VALUE_CHOICE,   /* uint32_t: an index into choices */
    VALUE_AUTO,     /* uint32_t: "auto" is 0, else min..max */
    VALUE_REGION,   /* uint32_t[4]: x y w h */
    VALUE_CREASE,   /* double: "no" is 0, "yes" is 60, else degrees min..max */
    VALUE_TEXT,     /* char *, owned */
};

/* Flags for bounds that do not belong to the range. */
enum { KEY_ABOVE_MIN = 1, KEY_BELOW_MAX = 2 };

struct key {
    const char *section;
    const char *name;
    enum value_type type;
    size_t offset; /* bytes from the start of the structure that the section is read into */
    double min, max;
    unsigned flags;
    bool required;
    const char *fallback;       /* the default, as text; NULL: none, or computed */
    const char *const *choices; /* of VALUE_CHOICE, NULL-terminated */
    const char *help;           /* one line */
};

/*
 * Parses text and stores the value into the structure at base. Returns false and stores nothing if text is
 * not what key_expected() describes.
 */
bool key_parse(const struct key *key, const char *text, void *base);

/* Describes the values that the key accepts, such as "a number > 0"; the caller frees the text. */
char *key_expected(const struct key *key);

/* The value in the structure at base, as text that key_parse() accepts; the caller frees it. */
char *key_format(const struct key *key, const void *base);

/* "x y z"; the caller frees the text. */
char *format_vector(struct vec3 v);

/* Stores the fallbacks of all keys that have one. */
void keys_set_fallbacks(const struct key *keys, size_t count, void *base);

/* Frees what VALUE_TEXT keys own. */
void keys_free(const struct key *keys, size_t count, void *base);

#endif
