/* Locking and checking a journal's file, before anything is read from it. */
#ifndef FARM_MASTER_JOURNAL_FILE_H
#define FARM_MASTER_JOURNAL_FILE_H

#include <stdbool.h>

/* Locks an open file for this run. The lock ends with the open file, however the process ends. On a file system
 * without locks this succeeds without one. false: another run has the lock. */
bool journal_lock(int file);

/* Whether the open file is still the one at this path: another run may rename or remove it between opening and
 * locking. */
bool journal_is_at(const char *path, int file);

/* Reports that the journal cannot be "opened", "renamed", ..., for this errno; returns false. */
bool journal_refuse(const char *path, const char *what, int error);

#endif
