/* Memory that processes of one machine share. It has no name, so that nothing is left of it however they end. */
#ifndef FARM_COMMON_SEGMENT_H
#define FARM_COMMON_SEGMENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* What processes need in common to open each other's segments, and to know each other by their process ids: else
 * Linux forbids it, or the container that they are in means to. */
struct segment_realm {
    char machine[40]; /* as in struct berth */
    uint64_t user;
    uint64_t ids, users, memory; /* namespaces: process ids, users, what processes share (IPC) */
};

/* The same for those who have all of that in common; never 0. */
uint64_t segment_realm_hash(const struct segment_realm *realm);

/* The hash of this process's realm; 0: it is not known, or others may not look into this process. */
uint64_t segment_reach(void);

/* Who has made a segment, and its descriptor there. */
struct segment_address {
    int32_t process, file;
};

/* A segment of no size; its file is -1 where there can be none. */
struct segment_address segment_make(void);

/* By who has made it: of so many bytes (at least 1), all zero, at a multiple of the page size. Ends the program if
 * there is no room for it. */
void *segment_extend(struct segment_address address, size_t bytes);

/* By another process, as soon as there is one: whether that is allowed. Of the same reach it is, unless a security
 * module says otherwise. */
bool segment_opens(struct segment_address address);

/* By another process for which it opens, from segment_extend() to segment_release(); *bytes: its size. Ends the program
 * if it cannot be opened. */
void *segment_open(struct segment_address address, size_t *bytes);

/* By who has made it: nobody else opens it from now on. Who has it keeps it until segment_close(). */
void segment_release(struct segment_address address);
void segment_close(void *segment, size_t bytes);

#endif
