#include "master/nearest_file.h"

#include <dirent.h>
#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "common/message.h"
#include "master/nearest_name.h"
#include "master/path.h"

/* Considers a name if it ends with the extension, which is cut off. */
static void try_file(struct nearest_name *search, char *name, const char *extension)
{
    size_t length = strlen(name), tail = strlen(extension);
    if (length <= tail || strcmp(name + length - tail, extension) != 0) return;
    name[length - tail] = '\0';
    nearest_name_try(search, name);
}

char *nearest_file(const char *path)
{
    struct stat status;
    /* A link that leads nowhere has the right name, and so may a file in a folder that must not be searched. */
    if (lstat(path, &status) == 0 || errno != ENOENT) return NULL;
    char *folder = path_folder(path), *directory = path_directory(path), *stem = path_stem(path);
    const char *extension = path_name(path) + strlen(stem);
    struct nearest_name search = {.name = stem};
    struct dirent **entries = NULL;
    int count = scandir(directory, &entries, NULL, alphasort);
    for (int i = 0; i < count; i++)
        if (entries[i]->d_type != DT_DIR) try_file(&search, entries[i]->d_name, extension);
    /* Folders have many files of short names: a third of the letters must not be exceeded, not even by rounding. */
    bool is_near = search.best && search.errors <= strlen(stem) / 3;
    char *near = is_near ? format_text("%s%s%s", folder, search.best, extension) : NULL;
    for (int i = 0; i < count; i++)
        free(entries[i]);
    free(entries);
    free(stem);
    free(directory);
    free(folder);
    return near;
}
