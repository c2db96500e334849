/* Functions on paths of files. */
#ifndef FARM_MASTER_PATH_H
#define FARM_MASTER_PATH_H

#include <stdbool.h>

/*
 * The path of name relative to folder, where "" is the current folder and any other ends with '/'; an absolute name
 * stays as it is. The caller frees it.
 */
char *path_in(const char *folder, const char *name);

/* The folder that path is in, in the form that path_in() takes. The caller frees it. */
char *path_folder(const char *path);

/* The same in the form that system calls take: "." is the current folder. The caller frees it. */
char *path_directory(const char *path);

/* The last component, as a pointer into path: "lantern.ini" of "config/lantern.ini". */
const char *path_name(const char *path);

/* The same without its extension: "lantern". The caller frees it. */
char *path_stem(const char *path);

/* The absolute path, with links resolved if the file exists. The caller frees it. */
char *path_absolute(const char *path);

/* The absolute path with links not resolved: a link keeps its name and folder. Without "." and ".." if its folder
 * exists, whose links are resolved then. The caller frees it. */
char *path_unresolved(const char *path);

/* Whether path, with all links followed, is in the folder or below it. folder must be resolved; all files are in "/".
 */
bool path_is_within(const char *path, const char *folder);

/* The same for a file that does not exist, by its folder; true if that does not exist either. */
bool path_would_be_within(const char *path, const char *folder);

/* The path of the file that writing to path would write: behind all symbolic links, whether it exists or not. The
 * caller frees it; NULL: the links form a cycle. */
char *path_behind_links(const char *path);

/* Whether path ends with this extension (".nff"), upper or lower case. */
bool path_has_extension(const char *path, const char *extension);

/* The descriptor of this process that path names, perhaps by links: /dev/stdout, /dev/stderr, /dev/fd/N and the like.
 * -1: none. Output is appended there, be it a terminal, a pipe or a file. */
int path_stream(const char *path);

bool path_is_folder(const char *path);

/* Whether path is something other than a regular file or a folder, such as a FIFO. */
bool path_is_device(const char *path);

/* Whether output to path takes the place of no file: it is such a thing or names a descriptor. */
bool path_is_written_in_place(const char *path);

#endif
