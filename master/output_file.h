/*
 * Files that a run writes.
 *
 * A file appears whole or not at all: it is written under a temporary name beside its place, synced
 * and renamed. A symbolic link stays and what it points at is replaced; a file that is replaced
 * hands its permissions on. What is no regular file (/dev/stdout, a FIFO) is written to directly.
 * Messages go through common/message.h.
 */
#ifndef FARM_MASTER_OUTPUT_FILE_H
#define FARM_MASTER_OUTPUT_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

/*
 * Whether a file could be put at path, tried before rendering: the folder exists and can be written
 * to, path is no folder, a file that stands there is writable. Leaves nothing behind and does not
 * touch what stands there. key ("output.image") is named in the message. On failure says why
 * (user_error) and returns false.
 */
bool output_writable(const char *path, const char *key);

/* Says that nothing can be written to path, for this errno; key as above. false always. */
bool output_refused(const char *path, const char *key, int error);

/* For writing as what is written comes; errno says why not. The caller closes it. */
FILE *open_in_place(const char *path);

/* Writes text, such as the report; key as above. false, after saying why (disk full, ...), when that could not
 * be done. */
bool text_write(const char *key, const char *path, const char *text, size_t bytes);

/* The same for what is better put out bit by bit: put leaves its errors in the file. */
typedef void text_writer(void *context, FILE *file);
bool text_write_by(const char *key, const char *path, text_writer *put, void *context);

/*
 * A file on its way, byte by byte: written at temporary, to be renamed to target; both NULL: in place. It is
 * made when there is something to put into it: who is killed while he encodes a large picture leaves no
 * empty one. Begins with its path alone.
 */
struct output {
    const char *path; /* that was asked for */
    char *target, *temporary;
    FILE *file;
    int error; /* errno of the first failure, 0 when all is well */
};

void output_put(struct output *output, const void *data, size_t bytes);

/* Puts the file in its place, or takes all traces of it away. Returns errno, 0 when it is there. */
int output_close(struct output *output);

#endif
