#include "master/output_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "common/clock.h"
#include "common/message.h"
#include "master/path.h"
#include "master/stop.h"

bool output_refused(const char *path, const char *key, int error)
{
    bool full = error == ENOSPC || error == EDQUOT;
    if (error == EINTR && *stop_signal()) { /* open_pipe() */
        user_error(path, 0, "stopped by %s while waiting for somebody who reads from this pipe",
                   signal_name(*stop_signal()));
        return false;
    }
    user_error(path, 0, "cannot write: %s, %schoose another place with %s=FILE", strerror(error),
               full ? "free some space or " : "", key);
    return false;
}

/* A name beside target; owned by the caller. The name of target is cut, so that one of the greatest length
 * leaves room for the rest. The time is part of it, as a run in another container may have the same process id. */
static char *temporary_name(const char *target)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    char *folder = path_folder(target);
    char *temporary = format_text("%s%.200s.%ld%09ld.tmp", folder, path_name(target),
                                  (long)getpid(), now.tv_nsec);
    free(folder);
    return temporary;
}

/* Creates the file, which must not exist, for writing, with the permissions of any new file; -1 with errno set. */
static int create_temporary(const char *temporary)
{
    return open(temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
}

/* Seconds between checks for a reader. */
#define PIPE_LOOK 0.02

/* Opens a pipe, which means to wait for a reader. Says so, and waits until a signal stops the run at most. -1
 * with errno set. */
static int open_pipe(const char *path)
{
    bool told = false;
    int pipe;
    while ((pipe = open(path, O_WRONLY | O_NONBLOCK | O_CLOEXEC)) < 0 && errno == ENXIO) {
        if (*stop_signal()) {
            errno = EINTR;
            return -1;
        }
        if (!told) user_note("%s is a pipe: waiting for somebody who reads from it", path);
        told = true;
        clock_sleep(PIPE_LOOK);
    }
    if (pipe >= 0) fcntl(pipe, F_SETFL, 0); /* blocking again: writes wait for the reader */
    return pipe;
}

/* A stream for the descriptor, which belongs to the stream, or is closed if there is none. NULL: it failed, or
 * the descriptor is below 0. */
static FILE *stream_of(int descriptor)
{
    FILE *file = descriptor < 0 ? NULL : fdopen(descriptor, "wb");
    if (!file && descriptor >= 0) close(descriptor);
    return file;
}

/* A descriptor such as /dev/stdout is not opened again: if it is a regular file, that would overwrite what is there. */
FILE *open_in_place(const char *path)
{
    struct stat there;
    int stream = path_stream(path);
    if (stream >= 0) {
        fflush(stdout); /* it may be another descriptor of the same file */
        return stream_of(dup(stream));
    }
    if (stat(path, &there) == 0 && S_ISFIFO(there.st_mode)) return stream_of(open_pipe(path));
    return fopen(path, "wb");
}

static FILE *open_beside(struct output *output, const char *path, const struct stat *old)
{
    output->target = path_behind_links(path);
    if (!output->target) {
        errno = ELOOP;
        return NULL;
    }
    output->temporary = temporary_name(output->target);
    int descriptor = create_temporary(output->temporary);
    if (descriptor < 0) return NULL;
    /* A file system without permissions refuses this, which does no harm. */
    if (old && fchmod(descriptor, old->st_mode & 0777)) errno = 0;
    return stream_of(descriptor);
}

static void output_open(struct output *output)
{
    const char *path = output->path;
    struct stat old;
    bool exists = stat(path, &old) == 0;
    if (path_stream(path) >= 0 || (exists && !S_ISREG(old.st_mode)))
        output->file = open_in_place(path);
    else
        output->file = open_beside(output, path, exists ? &old : NULL);
    if (!output->file) output->error = errno;
}

void output_put(struct output *output, const void *data, size_t bytes)
{
    if (!output->file && !output->error) output_open(output);
    if (output->error || fwrite(data, 1, bytes, output->file) == bytes) return;
    output->error = errno ? errno : EIO;
}

static void output_check(struct output *output, int failed)
{
    if (failed && !output->error) output->error = errno ? errno : EIO;
}

void sync_folder_of(const char *path)
{
    char *folder = path_directory(path);
    int descriptor = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor >= 0) {
        fsync(descriptor);
        close(descriptor);
    }
    free(folder);
}

int output_close(struct output *output)
{
    if (output->file) {
        output_check(output, fflush(output->file));
        if (output->temporary) output_check(output, fsync(fileno(output->file)));
        output_check(output, fclose(output->file));
        if (output->temporary && !output->error)
            output_check(output, rename(output->temporary, output->target));
        if (output->temporary && !output->error) sync_folder_of(output->target);
    }
    if (output->temporary && output->error) unlink(output->temporary);
    free(output->target);
    free(output->temporary);
    return output->error;
}

bool text_write(const char *key, const char *path, const char *text)
{
    struct output output = {.path = path};
    output_put(&output, text, strlen(text));
    int error = output_close(&output);
    return error ? output_refused(path, key, error) : true;
}

bool text_write_by(const char *key, const char *path, text_writer *put, void *context)
{
    struct output output = {.path = path};
    output_open(&output);
    if (!output.error) {
        put(context, output.file);
        output_check(&output, ferror(output.file));
    }
    int error = output_close(&output);
    return error ? output_refused(path, key, error) : true;
}

/* ---- tests before rendering ---- */

/* Tries to write a block to a file beside target, which keeps its name only for a moment: syncing may take long,
 * and a run that is stopped meanwhile leaves nothing behind. Returns errno, or 0. */
static int try_folder(const char *target)
{
    static const char block[4096]; /* the allocation unit of most file systems */
    char *temporary = temporary_name(target);
    int descriptor = create_temporary(temporary), error = 0;
    if (descriptor < 0) {
        error = errno;
    } else {
        unlink(temporary);
        errno = 0;
        if (write(descriptor, block, sizeof block) != (ssize_t)sizeof block || fsync(descriptor))
            error = errno ? errno : ENOSPC;
        if (close(descriptor) && !error) error = errno;
    }
    free(temporary);
    return error;
}

/* The errno of why no file can be created in a folder, after ENOENT. Creating a file in /proc also fails with
 * ENOENT; and a folder that a process is still in may have been removed. */
static int folder_error(const char *target)
{
    struct stat status;
    char *folder = path_directory(target);
    int error = stat(folder, &status) != 0 ? ENOENT : status.st_nlink == 0 ? ESTALE : EACCES;
    free(folder);
    return error;
}

static bool only_warns, has_warned;

void output_only_warn(void)
{
    only_warns = true;
}

/* Reports that this user may not write to the file or, with "the folder " as what, beside it. Returns whether that is
 * only warned of, once: other outputs are mostly meant for the same folder. */
static bool closed_spared(const char *path, const char *what, const char *key, int error)
{
    if (!only_warns) {
        user_error(path, 0, "%scannot be written to (%s), choose another place with %s=FILE", what,
                   strerror(error), key);
        return false;
    }
    if (!has_warned)
        user_warning(path, 0,
                     "%scannot be written to (%s): to render, choose another place with %s=FILE",
                     what, strerror(error), key);
    has_warned = true;
    return true;
}

static bool is_closed(int error)
{
    return error == EACCES || error == EROFS;
}

static bool folder_writable(const char *path, const char *key)
{
    char *target = path_behind_links(path);
    if (!target) return output_refused(path, key, ELOOP);
    int error = try_folder(target);
    if (error == ENOENT) error = folder_error(target);
    if (error == ESTALE)
        user_error(path, 0, "its folder has been removed, choose another place with %s=FILE", key);
    else if (error == ENOENT)
        user_error(path, 0,
                   "the folder %.*s does not exist, make it or choose another place with %s=FILE",
                   (int)(path_name(target) - target), target, key);
    else if (error && !is_closed(error))
        output_refused(path, key, error);
    free(target);
    return error == 0 || (is_closed(error) && closed_spared(path, "the folder ", key, error));
}

/* Whether what exists at path is neither a folder nor a block device. */
static bool kind_writable(const char *path, const char *key, mode_t mode)
{
    if (S_ISREG(mode) || S_ISCHR(mode) || S_ISFIFO(mode)) return true;
    user_error(path, 0, "is a %s, expected a file name in %s=FILE",
               S_ISDIR(mode) ? "folder" : "device", key);
    return false;
}

/* Whether that holds, and it is writable. */
static bool old_file_writable(const char *path, const char *key, mode_t mode)
{
    if (!kind_writable(path, key, mode)) return false;
    if (access(path, W_OK) == 0) return true;
    return is_closed(errno) ? closed_spared(path, "", key, errno)
                            : output_refused(path, key, errno);
}

/* Whether the descriptor is open for writing. MPI has some of its own, which are sockets. */
static bool stream_writable(int stream, const char *path, const char *key)
{
    struct stat status;
    int flags = fcntl(stream, F_GETFL);
    if (flags < 0 || (flags & O_ACCMODE) == O_RDONLY) return output_refused(path, key, EBADF);
    return stream <= STDERR_FILENO ||
           (fstat(stream, &status) == 0 && kind_writable(path, key, status.st_mode));
}

bool output_writable(const char *path, const char *key)
{
    struct stat old;
    size_t length = strlen(path);
    int stream = path_stream(path);
    if (length == 0) {
        user_error(NULL, 0, "%s is empty, expected a file name", key);
        return false;
    }
    if (stream >= 0) return stream_writable(stream, path, key);
    if (stat(path, &old) == 0) {
        if (!old_file_writable(path, key, old.st_mode)) return false;
        return S_ISREG(old.st_mode) ? folder_writable(path, key) : true;
    }
    if (errno != ENOENT) return output_refused(path, key, errno);
    if (path[length - 1] == '/') {
        user_error(path, 0, "is the name of a folder, expected a file name in %s=FILE", key);
        return false;
    }
    return folder_writable(path, key);
}
