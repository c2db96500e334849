/* Reads whole text files into memory. */
#ifndef FARM_MASTER_TEXT_FILE_H
#define FARM_MASTER_TEXT_FILE_H

#include <stdbool.h>
#include <stddef.h>

struct text_file {
    char *text; /* its bytes, then a NUL; there is no other NUL; owned */
    size_t bytes;
};

/*
 * Reads a regular file of at most max_bytes, and no more than memory holds. A byte order mark is removed; in a file
 * without any LF, each CR is replaced by LF. false after reporting why not.
 */
bool text_file_read(const char *path, size_t max_bytes, struct text_file *file);
void text_file_free(struct text_file *file);

#endif
