/* Reading the entries of an INI section by its table of keys (common/key.h). */
#ifndef FARM_MASTER_SECTIONS_H
#define FARM_MASTER_SECTIONS_H

#include "common/key.h"
#include "master/ini_source.h"

/* "[sphere ball]" or "[image]", as text that the caller frees. */
char *section_title(const struct ini_section *section);

/* Says that the section has no such key, and which one was likely meant. */
void refuse_key(const struct ini_section *section, const struct ini_entry *entry,
                const struct key *keys, size_t count);

/* What is to be said of a value that was to be followed by a comment, as it seems; or nothing. */
const char *comment_hint(const char *value);

/* Stores one entry's value into the structure at base; false after saying why not. */
bool read_entry(const struct ini_section *section, const struct ini_entry *entry,
                const struct key *key, void *base);

/*
 * Reads a section into the structure at base, which is all zero bytes: defaults first, then the
 * entries. Unknown keys, bad values and missing required keys are told, and false returned; what
 * VALUE_TEXT keys own is the caller's to free (keys_free()) in either case.
 */
bool read_section(const struct ini *ini, const struct ini_section *section, const struct key *keys,
                  size_t count, void *base);

/* Where an entry of the section stands, or the section itself when the key is not set. */
struct ini_place {
    const char *file;
    long line;
};
struct ini_place place_of(const struct ini *ini, const struct ini_section *section,
                          const char *key);

/* The key of this name in a table, or NULL. */
const struct key *find_key(const struct key *keys, size_t count, const char *name);

#endif
