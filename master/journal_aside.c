#include "master/journal_aside.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/message.h"
#include "master/journal_file.h"
#include "master/journal_scan.h"
#include "master/path.h"

/* rename() that never replaces another file, where the file system supports that. */
static bool rename_to_new(const char *from, const char *to)
{
    struct stat status;
    if (renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE) == 0) return true;
    if (errno != EINVAL && errno != ENOSYS) return false;
    if (lstat(to, &status) == 0) {
        errno = EEXIST;
        return false;
    }
    return rename(from, to) == 0;
}

bool journal_set_aside(const char *path, const char *why)
{
    for (unsigned number = 1; number != 0; number++) {
        char *name = format_text("%s.%u", path, number);
        bool done = rename_to_new(path, name);
        int error = errno;
        if (done) user_warning(path, 0, "%s, it is now called %s", why, name);
        free(name);
        if (done) return true;
        if (error != EEXIST) return journal_refuse(path, "renamed", error);
    }
    return false;
}

/* Opens and locks the file at this path; -1: it is of no use, or another run has it open. */
static int open_alone(const char *path)
{
    int file = open(path, O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (file < 0) return -1;
    if (journal_lock(file) && journal_is_at(path, file)) return file;
    close(file);
    return -1;
}

/* Whether the name is `of` followed by a dot and a number. */
static bool is_numbered(const char *name, const char *of)
{
    size_t length = strlen(of);
    if (strncmp(name, of, length) != 0 || name[length] != '.') return false;
    const char *number = name + length + 1;
    return *number && strspn(number, "0123456789") == strlen(number);
}

/* The length of the file if it begins with the header and has more after it; otherwise 0, as for any that is no regular
 * file or not open. */
static off_t length_behind(int file, const void *header, size_t bytes)
{
    unsigned char begin[64];
    struct stat status;
    bool fits = bytes <= sizeof begin && fstat(file, &status) == 0 &&
                (size_t)status.st_size > bytes && read_at(file, begin, bytes, 0) &&
                memcmp(begin, header, bytes) == 0;
    return fits ? status.st_size : 0;
}

/* A renamed journal, locked while it is open. */
struct aside {
    char *path; /* owned; NULL: none */
    int file;   /* -1: not open */
    off_t length;
};

static void leave(struct aside *aside)
{
    if (aside->file >= 0) close(aside->file);
    free(aside->path);
}

static struct aside find_longest(const char *path, const void *header, size_t bytes)
{
    struct aside longest = {NULL, -1, 0};
    char *folder = path_folder(path), *directory = path_directory(path);
    DIR *names = opendir(directory);
    for (struct dirent *entry; names && (entry = readdir(names)) != NULL;) {
        if (!is_numbered(entry->d_name, path_name(path))) continue;
        struct aside next = {path_in(folder, entry->d_name), -1, 0};
        next.file = open_alone(next.path);
        next.length = length_behind(next.file, header, bytes);
        struct aside other = next.length > longest.length ? longest : next;
        if (next.length > longest.length) longest = next;
        leave(&other);
    }
    if (names) closedir(names);
    free(directory);
    free(folder);
    return longest;
}

uint64_t journal_aside_bytes(const char *path, const void *header, size_t bytes)
{
    struct aside aside = find_longest(path, header, bytes);
    leave(&aside);
    return (uint64_t)aside.length;
}

bool journal_take_back(const char *path, const void *header, size_t bytes)
{
    struct aside aside = find_longest(path, header, bytes);
    bool done = aside.path && rename(aside.path, path) == 0;
    if (done) user_note("%s is this picture's, it is called %s again", aside.path, path);
    leave(&aside);
    return done;
}
