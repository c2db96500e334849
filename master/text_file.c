#include "master/text_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/message.h"

/* O_NONBLOCK: opening a pipe without a writer must not wait for one. */
static int open_regular(const char *path, size_t *bytes)
{
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat status;
    if (file < 0 || fstat(file, &status) != 0) {
        user_error(path, 0, "cannot be opened: %s", strerror(errno));
    } else if (S_ISDIR(status.st_mode)) {
        user_error(path, 0, "is a folder, expected a file");
    } else if (!S_ISREG(status.st_mode)) {
        user_error(path, 0, "is not a regular file, expected one");
    } else {
        *bytes = (size_t)status.st_size;
        return file;
    }
    if (file >= 0) close(file);
    return -1;
}

/* Reads until the end or size bytes; the number read, or -1. */
static ssize_t read_all(int file, char *text, size_t size)
{
    size_t done = 0;
    while (done < size) {
        ssize_t got = read(file, text + done, size - done);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return -1;
        if (got == 0) break;
        done += (size_t)got;
    }
    return (ssize_t)done;
}

static long line_of(const char *text, const char *at)
{
    long line = 1;
    for (; text < at; text++)
        line += *text == '\n';
    return line;
}

static bool read_open(const char *path, int descriptor, size_t size, struct text_file *file)
{
    char *text = allocate(size + 1, 1);
    ssize_t got = read_all(descriptor, text, size);
    if (got < 0) {
        user_error(path, 0, "cannot be read: %s", strerror(errno));
        free(text);
        return false;
    }
    text[got] = '\0';
    const char *nul = memchr(text, '\0', (size_t)got);
    if (nul) {
        user_error(path, line_of(text, nul), "a NUL byte, expected plain text");
        free(text);
        return false;
    }
    *file = (struct text_file){text, (size_t)got};
    return true;
}

bool text_file_read(const char *path, size_t max_bytes, struct text_file *file)
{
    size_t size;
    int descriptor = open_regular(path, &size);
    if (descriptor < 0) return false;
    bool good = size <= max_bytes;
    if (good)
        good = read_open(path, descriptor, size, file);
    else
        user_error(path, 0, "has %zu bytes, expected at most %zu", size, max_bytes);
    close(descriptor);
    return good;
}

void text_file_free(struct text_file *file)
{
    free(file->text);
    *file = (struct text_file){0};
}

char *path_in(const char *folder, const char *name)
{
    return format_text("%s%s", *name == '/' ? "" : folder, name);
}

char *path_folder(const char *path)
{
    const char *slash = strrchr(path, '/');
    int length = slash ? (int)(slash + 1 - path) : 0;
    return format_text("%.*s", length, path);
}

char *path_stem(const char *path)
{
    const char *slash = strrchr(path, '/');
    const char *name = slash ? slash + 1 : path;
    const char *dot = strrchr(name, '.');
    int length = dot && dot > name ? (int)(dot - name) : (int)strlen(name);
    return format_text("%.*s", length, name);
}

char *path_absolute(const char *path)
{
    char *resolved = realpath(path, NULL);
    if (resolved) return resolved;
    char *here = *path == '/' ? NULL : get_current_dir_name();
    char *absolute = here ? format_text("%s/%s", here, path) : copy_text(path);
    free(here);
    return absolute;
}

bool path_has_extension(const char *path, const char *extension)
{
    size_t length = strlen(path), tail = strlen(extension);
    return length > tail && strcasecmp(path + length - tail, extension) == 0;
}

bool path_is_device(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
}
