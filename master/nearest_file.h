/* A hint for messages about a file that is missing. */
#ifndef FARM_MASTER_NEAREST_FILE_H
#define FARM_MASTER_NEAREST_FILE_H

/* The path of the file that may have been meant: it is in the same folder, has the same extension, and its name differs
 * by few typing errors (master/nearest_name.h). The caller frees it; NULL: there is none, or the name is not what is
 * wrong: path exists, perhaps as a link that leads nowhere, or its folder must not be searched. */
char *nearest_file(const char *path);

#endif
