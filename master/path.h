/* Names of files. */
#ifndef FARM_MASTER_PATH_H
#define FARM_MASTER_PATH_H

#include <stdbool.h>

/*
 * The path of name as seen from folder ("" is the current one, otherwise it ends with '/'); an
 * absolute name stays as it is. The caller frees it.
 */
char *path_in(const char *folder, const char *name);

/* The folder that path lies in, as path_in() takes it. The caller frees it. */
char *path_folder(const char *path);

/* The same as the system takes it: "." is the current one. The caller frees it. */
char *path_directory(const char *path);

/* The last component, within path: "lantern.ini" of "config/lantern.ini". */
const char *path_name(const char *path);

/* The same without its extension: "lantern". The caller frees it. */
char *path_stem(const char *path);

/* The same path from the root, resolved if the file exists. The caller frees it. */
char *path_absolute(const char *path);

/* The same path from the root as it stands: a link keeps its name and folder. The caller frees it. */
char *path_unresolved(const char *path);

/* Whether path, with all links followed, lies in the folder, which is resolved; "/" holds all. */
bool path_is_within(const char *path, const char *folder);

/* The same of a file that does not exist, by its folder; where there is no such folder either, true. */
bool path_would_be_within(const char *path, const char *folder);

/* Where a file written to path would end up: behind all symbolic links, whether it is there or not. The caller
 * frees it; NULL: they go in circles. */
char *path_behind_links(const char *path);

/* Whether path ends with this extension (".nff"), in any case. */
bool path_has_extension(const char *path, const char *extension);

/* What is put there comes behind what was, whether that is a terminal, a pipe or a file. */
bool path_is_stdout(const char *path);

/* Whether something other than a regular file or a folder stands there: a FIFO; or /dev/stdout. */
bool path_is_device(const char *path);

#endif
