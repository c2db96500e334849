/*
 * The files that a run writes.
 *
 * A file appears complete or not at all: it is written under a temporary name in the same folder, synced and
 * renamed. A symbolic link stays, and what it points at is replaced; a file that is replaced passes its
 * permissions on. What is not a regular file (a FIFO) is written to directly, and so are the descriptors that the
 * program was started with (/dev/stdout, /dev/fd/3, links to these). Messages go through common/message.h.
 */
#ifndef FARM_MASTER_OUTPUT_FILE_H
#define FARM_MASTER_OUTPUT_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

/*
 * Whether a file could be written at path, tested before rendering: the folder exists and is writable, path is
 * no folder, a file that exists there is writable. Leaves nothing behind and does not change an existing file.
 * key ("output.image") is named in the message. Returns false after user_error().
 */
bool output_writable(const char *path, const char *key);

/* For --check, which writes nothing: from now on output_writable() returns true where only the rights of this user are
 * missing, and the first such place brings a warning. */
void output_only_warn(void);

/* Reports that path cannot be written, for this errno; key as above. Returns false. */
bool output_refused(const char *path, const char *key, int error);

/* Makes durable that a file was created at path or renamed to it: without this, the death of the machine may undo it.
 * Some file systems cannot do it; the file itself is written in any case. */
void sync_folder_of(const char *path);

/* Opens a file for writing in place, without a temporary one; NULL with errno set. The caller closes it. */
FILE *open_in_place(const char *path);

/* Writes text, such as the report; key as above. Returns false, after saying why (disk full, ...), if that
 * failed. */
bool text_write(const char *key, const char *path, const char *text);

/* The same for text that is better written piece by piece: put() writes it, and leaves errors to ferror(). */
typedef void text_writer(void *context, FILE *file);
bool text_write_by(const char *key, const char *path, text_writer *put, void *context);

/*
 * A file that is being written: at `temporary`, to be renamed to `target`; both are NULL if it is written in
 * place. It is created with the first bytes, so that a run that is killed while it encodes a large picture
 * leaves no empty file. Initialise with the path alone.
 */
struct output {
    const char *path; /* the path that was asked for */
    char *target, *temporary;
    FILE *file;
    int error; /* errno of the first failure; 0: none */
};

/* Writes the next bytes of the file; nothing after the first failure, which output_close() returns. */
void output_put(struct output *output, const void *data, size_t bytes);

/* Moves the file to its place, or removes all traces of it after a failure. Returns errno, 0 for success. */
int output_close(struct output *output);

#endif
