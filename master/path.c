#include "master/path.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/message.h"

char *path_in(const char *folder, const char *name)
{
    return format_text("%s%s", *name == '/' ? "" : folder, name);
}

const char *path_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

char *path_folder(const char *path)
{
    return format_text("%.*s", (int)(path_name(path) - path), path);
}

char *path_directory(const char *path)
{
    int length = (int)(path_name(path) - path);
    return length > 0 ? format_text("%.*s", length, path) : copy_text(".");
}

char *path_stem(const char *path)
{
    const char *name = path_name(path);
    const char *dot = strrchr(name, '.');
    int length = dot && dot > name ? (int)(dot - name) : (int)strlen(name);
    return format_text("%.*s", length, name);
}

char *path_absolute(const char *path)
{
    char *resolved = realpath(path, NULL);
    return resolved ? resolved : path_unresolved(path);
}

/* Whether a component of the folder of an absolute path is "." or "..". */
static bool has_dots(const char *path)
{
    const char *name = path_name(path), *dot = strstr(path, "/./"), *dots = strstr(path, "/../");
    return (dot && dot < name) || (dots && dots < name);
}

char *path_unresolved(const char *path)
{
    char *here = *path == '/' ? NULL : get_current_dir_name();
    char *absolute = here ? format_text("%s/%s", here, path) : copy_text(path);
    free(here);
    if (!has_dots(absolute)) return absolute;
    char *directory = path_directory(absolute), *folder = realpath(directory, NULL);
    if (folder) {
        const char *slash = strcmp(folder, "/") == 0 ? "" : "/";
        char *plain = format_text("%s%s%s", folder, slash, path_name(absolute));
        free(absolute);
        absolute = plain;
    }
    free(folder);
    free(directory);
    return absolute;
}

/* The part of a resolved path below the folder: "/a.obj", or "" if it is the folder; NULL: it is not in it. */
static const char *behind_folder(const char *resolved, const char *folder)
{
    size_t length = strlen(folder);
    if (length && folder[length - 1] == '/') length--;
    const char *rest = strncmp(resolved, folder, length) == 0 ? resolved + length : NULL;
    return rest && (*rest == '/' || *rest == '\0') ? rest : NULL;
}

bool path_is_within(const char *path, const char *folder)
{
    char *resolved = realpath(path, NULL);
    const char *rest = resolved ? behind_folder(resolved, folder) : NULL;
    bool within = rest && *rest == '/';
    free(resolved);
    return within;
}

bool path_would_be_within(const char *path, const char *folder)
{
    char *directory = path_directory(path), *resolved = realpath(directory, NULL);
    bool within = !resolved || behind_folder(resolved, folder);
    free(resolved);
    free(directory);
    return within;
}

/* What a symbolic link at path points at; NULL when there is none. */
static char *link_target(const char *path)
{
    char text[PATH_MAX];
    ssize_t length = readlink(path, text, sizeof text - 1);
    if (length < 0) return NULL;
    text[length] = '\0';
    char *folder = path_folder(path), *target = path_in(folder, text);
    free(folder);
    return target;
}

#define MAX_LINKS 40 /* as many as the kernel follows */

/* realpath() would not do, because the last link may point at a file that does not exist yet. */
char *path_behind_links(const char *path)
{
    char *place = copy_text(path);
    for (int links = 0; links < MAX_LINKS; links++) {
        char *next = link_target(place);
        if (!next) return place;
        free(place);
        place = next;
    }
    free(place);
    return NULL;
}

bool path_has_extension(const char *path, const char *extension)
{
    size_t length = strlen(path), tail = strlen(extension);
    return length > tail && strcasecmp(path + length - tail, extension) == 0;
}

/* Whether both folders exist and are the same. */
static bool same_folder(const char *a, const char *b)
{
    char *first = realpath(a, NULL), *second = realpath(b, NULL);
    bool same = first && second && strcmp(first, second) == 0;
    free(first);
    free(second);
    return same;
}

/* The descriptor that path names without a link at its end: of "/dev/fd/3" it is 3. -1: none. The names of stdout
 * and stderr hold without /proc, too. */
static int named_stream(const char *path)
{
    if (!strcmp(path, "/dev/stdout")) return STDOUT_FILENO;
    if (!strcmp(path, "/dev/stderr")) return STDERR_FILENO;
    const char *name = path_name(path);
    size_t digits = strspn(name, "0123456789");
    if (digits == 0 || digits > 9 || name[digits]) return -1;
    char *directory = path_directory(path);
    int stream = same_folder(directory, "/proc/self/fd") ? (int)strtol(name, NULL, 10) : -1;
    free(directory);
    return stream;
}

/* Link by link: the last link leads from the descriptor's name to the file that is open there. */
int path_stream(const char *path)
{
    char *place = copy_text(path);
    int stream = -1;
    for (int links = 0; place && links < MAX_LINKS; links++) {
        stream = named_stream(place);
        char *next = stream < 0 ? link_target(place) : NULL;
        free(place);
        place = next;
    }
    free(place);
    return stream;
}

bool path_is_written_in_place(const char *path)
{
    return path_stream(path) >= 0 || path_is_device(path);
}

bool path_is_folder(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

bool path_is_device(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
}
