/* Whole text files in memory, and their paths. */
#ifndef FARM_MASTER_TEXT_FILE_H
#define FARM_MASTER_TEXT_FILE_H

#include <stdbool.h>
#include <stddef.h>

struct text_file {
    char *text; /* bytes of it, then a NUL; there is no other NUL */
    size_t bytes;
};

/*
 * Reads a regular file of at most max_bytes, and no more than memory holds, without a byte order mark; false after saying why not
 * (user_error).
 */
bool text_file_read(const char *path, size_t max_bytes, struct text_file *file);
void text_file_free(struct text_file *file);

/*
 * The path of name as seen from folder ("" is the current one, otherwise it ends with '/'); an
 * absolute name stays as it is. The caller frees it.
 */
char *path_in(const char *folder, const char *name);

/* The folder that path lies in, as path_in() takes it. The caller frees it. */
char *path_folder(const char *path);

/* The last component without its extension: "lantern" of "config/lantern.ini". */
char *path_stem(const char *path);

/* The same path from the root, resolved if the file exists. The caller frees it. */
char *path_absolute(const char *path);

/* Whether path, with all links followed, lies in the folder, which is resolved; "/" holds all. */
bool path_is_within(const char *path, const char *folder);

/* Whether path ends with this extension (".nff"), in any case. */
bool path_has_extension(const char *path, const char *extension);

/* What is put there comes behind what was, whether that is a terminal, a pipe or a file. */
bool path_is_stdout(const char *path);

/* Whether something other than a regular file or a folder stands there: a FIFO; or /dev/stdout. */
bool path_is_device(const char *path);

#endif
