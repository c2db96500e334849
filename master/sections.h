/* Reading the entries of an INI section by its table of keys (master/key.h). */
#ifndef FARM_MASTER_SECTIONS_H
#define FARM_MASTER_SECTIONS_H

#include "master/ini_source.h"
#include "master/key.h"

/* "[sphere ball]" or "[image]", as text that the caller frees. */
char *section_title(const struct ini_section *section);

/* The key that an entry of the section sets, of the section's table; NULL after reporting that there is none, and which
 * one may have been meant. */
const struct key *key_of_entry(const struct ini_section *section, const struct ini_entry *entry,
                               const struct key *keys, size_t count);

/* A hint for a message about a value that seems to include what was meant as a comment; else "". */
const char *comment_hint(const char *value);

/* Whether it begins or ends like text within quotes, which other languages need and INI files do not have; the end of a
 * message for a name that does. */
bool is_quoted(const char *value);
#define QUOTES_HINT "; a name stands without quotes"

/* Stores one entry's value into the structure at base; false after reporting an error. */
bool read_entry(const struct ini_section *section, const struct ini_entry *entry,
                const struct key *key, void *base);

/*
 * Reads a section into the structure at base, which is all zero bytes: defaults first, then the entries. false after
 * reporting an unknown key, a bad value or a missing key that is required. In either case the caller frees what
 * VALUE_TEXT keys own (keys_free()).
 */
bool read_section(const struct ini *ini, const struct ini_section *section, const struct key *keys,
                  size_t count, void *base);

/* Where the entry of a key stands in the section, or the section itself when the key is not set. */
struct ini_place ini_place_of(const struct ini *ini, const struct ini_section *section,
                              const char *key);

#endif
