#include "master/text_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/memory.h"
#include "common/message.h"

/* O_NONBLOCK: opening a FIFO without a writer must not wait for one. */
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

/* Bytes that are read at a time and searched for a NUL: a file that is no text ends the reading before it has taken
 * much memory. */
#define CHUNK ((size_t)1 << 20)

static long line_of(const char *text, const char *at)
{
    long line = 1;
    for (; text < at; text++)
        line += *text == '\n';
    return line;
}

/* Reads until the end of the file or size bytes. What was read stays in file also after an error. */
static bool read_open(const char *path, int descriptor, size_t size, struct text_file *file)
{
    file->text = allocate_large(size + 1);
    while (file->bytes < size) {
        size_t left = size - file->bytes, chunk = left < CHUNK ? left : CHUNK;
        char *end = file->text + file->bytes;
        ssize_t got = read(descriptor, end, chunk);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) {
            user_error(path, 0, "cannot be read: %s", strerror(errno));
            return false;
        }
        if (got == 0) break;
        const char *nul = memchr(end, '\0', (size_t)got);
        if (nul) {
            user_error(path, line_of(file->text, nul), "a NUL byte, expected plain text");
            return false;
        }
        file->bytes += (size_t)got;
    }
    file->text[file->bytes] = '\0';
    return true;
}

/* Some editors mark a file as UTF-8 with these bytes at its start. */
static void drop_byte_order_mark(struct text_file *file)
{
    static const char mark[] = "\xef\xbb\xbf";
    if (strncmp(file->text, mark, 3) != 0) return;
    file->bytes -= 3;
    memmove(file->text, file->text + 3, file->bytes + 1);
}

/* Replaces CR by LF in a file without any LF: old programs, mostly of the Macintosh, end lines with CR alone. As CR
 * counts as a blank elsewhere, the whole file would be one line, or one comment if it begins with one. */
static void end_lines(struct text_file *file)
{
    if (memchr(file->text, '\n', file->bytes)) return;
    for (char *at = file->text; (at = strchr(at, '\r'));)
        *at = '\n';
}

bool text_file_read(const char *path, size_t max_bytes, struct text_file *file)
{
    size_t size;
    int descriptor = open_regular(path, &size);
    if (descriptor < 0) return false;
    *file = (struct text_file){0};
    if (!memory_holds(size) && max_bytes > memory_limit()) max_bytes = memory_limit();
    bool good = size <= max_bytes;
    if (good)
        good = read_open(path, descriptor, size, file);
    else
        user_error(path, 0, "has %zu bytes, expected at most %zu", size, max_bytes);
    close(descriptor);
    if (!good) {
        text_file_free(file);
        return false;
    }
    drop_byte_order_mark(file);
    end_lines(file);
    return true;
}

void text_file_free(struct text_file *file)
{
    free(file->text);
    *file = (struct text_file){0};
}
