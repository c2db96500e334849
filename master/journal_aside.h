/* Journals that made room for another picture's: path.1, path.2, ... */
#ifndef FARM_MASTER_JOURNAL_ASIDE_H
#define FARM_MASTER_JOURNAL_ASIDE_H

#include <stdbool.h>
#include <stddef.h>

/* Renames the file at path, which the caller holds the lock of, to the first of these names that is free, with a
 * warning that tells why. false after user_error(). */
bool journal_set_aside(const char *path, const char *why);

/*
 * Brings one of them back to path, with a note: the longest that begins with this header, has more behind it, and is at
 * work for nobody. What stands at path is lost. false: there is none, or it cannot be renamed; then nothing is changed.
 */
bool journal_take_back(const char *path, const void *header, size_t bytes);

#endif
