/*
 * Reads an INI file into sections with entries, each with its line number. The file is parsed by inih, which is fed
 * line by line. inih joins indented lines to the one before, truncates long names and lines silently, and does not
 * report line numbers; so each line is trimmed and checked before inih gets it. Lines may have 4096 bytes, names of
 * sections and of keys 49.
 */
#ifndef FARM_MASTER_INI_SOURCE_H
#define FARM_MASTER_INI_SOURCE_H

#include <stdbool.h>
#include <stddef.h>

struct ini_entry {
    char *key, *value;  /* owned */
    const char *file;   /* for messages: the INI file, or an argument */
    long line;          /* 0 for an argument */
    const char *folder; /* the folder that a path in the value is relative to */
};

struct ini_section {
    char *kind; /* "sphere" of [sphere ball]; owned */
    char *name; /* "ball", "" without a name; owned */
    long line;
    struct ini_entry *entries;
    size_t count;
};

struct ini {
    char *file;   /* path, for messages; owned */
    char *folder; /* the folder that it is in; owned */
    struct ini_section *sections;
    size_t count;
};

/* A line of a file; the name is valid as long as the struct ini is. */
struct ini_place {
    const char *file;
    long line; /* 0 for an argument */
};

/*
 * Reads a file and checks its form, not the meaning of sections and keys. A key that is twice in a section, or two
 * sections of the same kind and name, are errors. false after reporting why.
 */
bool ini_load(const char *path, struct ini *ini);

/* Creates a document without sections and without reading a file; path is for messages. */
void ini_create(const char *path, struct ini *ini);
void ini_free(struct ini *ini);

/* Adds a section, which is valid until the next one is added. */
struct ini_section *ini_add_section(struct ini *ini, const char *kind, const char *name, long line);

/* Sets or replaces an entry. Key and value are copied; file, line and folder are those of origin, pointers included. */
void ini_set(struct ini_section *section, const char *key, const char *value,
             const struct ini_entry *origin);

/* The entry of a key; NULL: there is none. */
const struct ini_entry *ini_entry(const struct ini_section *section, const char *key);

/* Whether a line "[kind name]" would be read back from a file as this section. */
bool ini_can_name(const char *kind, const char *name);

/* Whether a line "key = value" would be read back from a file as this value. */
bool ini_can_hold(const char *key, const char *value);

#endif
