/* Whole text files in memory. */
#ifndef FARM_MASTER_TEXT_FILE_H
#define FARM_MASTER_TEXT_FILE_H

#include <stdbool.h>
#include <stddef.h>

struct text_file {
    char *text; /* bytes of it, then a NUL; there is no other NUL */
    size_t bytes;
};

/*
 * Reads a regular file of at most max_bytes, and no more than memory holds, without a byte order mark; where all
 * lines end by CR alone, LF stands in its place. false after saying why not (user_error).
 */
bool text_file_read(const char *path, size_t max_bytes, struct text_file *file);
void text_file_free(struct text_file *file);

#endif
