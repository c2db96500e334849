/* Journals that were renamed to path.1, path.2, ... to make room for that of another picture. */
#ifndef FARM_MASTER_JOURNAL_ASIDE_H
#define FARM_MASTER_JOURNAL_ASIDE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Renames the file at path, whose lock the caller holds, to the first of these names that is free, with a
 * warning that says why. false after user_error(). */
bool journal_set_aside(const char *path, const char *why);

/*
 * Renames one of them back to path, with a note: the longest one that begins with this header, has more after
 * it, and is not open in another run. A file at path is lost. false: there is none, or it cannot be renamed;
 * then nothing is changed.
 */
bool journal_take_back(const char *path, const void *header, size_t bytes);

/* Bytes of the journal that journal_take_back() would find; 0: none. */
uint64_t journal_aside_bytes(const char *path, const void *header, size_t bytes);

#endif
