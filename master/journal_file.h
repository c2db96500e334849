/* What is to be known of a journal's file before anything is read from it. */
#ifndef FARM_MASTER_JOURNAL_FILE_H
#define FARM_MASTER_JOURNAL_FILE_H

#include <stdbool.h>

/* Locks an open file for this run: the lock goes with the open file, however the process ends. A file system without
 * locks has none. false: another run has it. */
bool journal_lock(int file);

/* Whether the open file stands at this path: another run may rename or remove it between its opening and locking. */
bool journal_is_at(const char *path, int file);

/* Says that the journal cannot be "opened", "renamed", ..., for this errno. false always. */
bool journal_refuse(const char *path, const char *what, int error);

#endif
