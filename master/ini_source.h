/*
 * An INI file as sections with entries, each with the line it stands on. The file is read by inih,
 * which is fed line by line: it joins indented lines to the one before, cuts long names and lines
 * without a word and does not tell line numbers, so what it is fed is trimmed and checked before.
 * Lines may have 4096 bytes, names of sections and of keys 49.
 */
#ifndef FARM_MASTER_INI_SOURCE_H
#define FARM_MASTER_INI_SOURCE_H

#include <stdbool.h>
#include <stddef.h>

struct ini_entry {
    char *key, *value;  /* owned */
    const char *file;   /* what messages name: the INI file, or an argument */
    long line;          /* 0 for an argument */
    const char *folder; /* what a path in the value is relative to */
};

struct ini_section {
    char *kind; /* "sphere" of [sphere ball]; owned */
    char *name; /* "ball", "" without a name; owned */
    long line;
    struct ini_entry *entries;
    size_t count;
};

struct ini {
    char *file;   /* path, as messages name it */
    char *folder; /* that it lies in */
    struct ini_section *sections;
    size_t count;
};

/*
 * Reads and checks the form only: no meaning of sections and keys. A key twice in a section, or two
 * sections of the same kind and name, are errors. false after saying why.
 */
bool ini_load(const char *path, struct ini *ini);

/* A document without a file, for a start; path is what messages name. */
void ini_create(const char *path, struct ini *ini);
void ini_free(struct ini *ini);

/* The section is valid until the next one is added. */
struct ini_section *ini_add_section(struct ini *ini, const char *kind, const char *name, long line);

/* Sets or replaces; file and folder are kept as they are, key and value are copied. */
void ini_set(struct ini_section *section, const char *key, const char *value,
             const struct ini_entry *origin);

/* The entry of a key, or NULL. */
const struct ini_entry *ini_entry(const struct ini_section *section, const char *key);

/* Whether a line "[kind name]" in a file is read back as this section. */
bool ini_can_name(const char *kind, const char *name);

/* Whether a line "key = value" in a file is read back as this value. */
bool ini_can_hold(const char *key, const char *value);

#endif
