/*
 * Memory shared by processes of one machine. A segment has no name (it is a memfd), so that nothing is left
 * of it however the processes end.
 */
#ifndef FARM_WORKER_SEGMENT_H
#define FARM_WORKER_SEGMENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * What two processes must have in common to open each other's segments and to use each other's process ids.
 * Otherwise Linux forbids it, or a container is meant to prevent it.
 */
struct segment_realm {
    char machine[40]; /* as in struct affinity */
    uint64_t user;
    uint64_t ids, users, memory; /* namespaces of process ids, of users and of IPC */
};

/* A hash of the realm, never 0. */
uint64_t segment_realm_hash(const struct segment_realm *realm);

/* The hash of this process's realm; 0 if it is not known or if other processes may not open this one's files
 * in /proc. */
uint64_t segment_own_realm(void);

/* The process that has made a segment, and its file descriptor there. */
struct segment_address {
    int32_t process, file;
};

/* Makes a segment of size 0; its file is -1 if the system cannot. */
struct segment_address segment_make(void);

/*
 * Called by the process that made the segment: gives it its size, at least 1 byte, and maps it. Returns the
 * memory, zeroed and page-aligned. Ends the program if there is no room for it.
 */
void *segment_extend(struct segment_address address, size_t bytes);

/*
 * Called by another process once the segment is made: whether it may open the segment. Processes with the
 * same segment_own_realm() may, unless a security module forbids it.
 */
bool segment_opens(struct segment_address address);

/*
 * Called by another process for which segment_opens() is true, between segment_extend() and
 * segment_release(): maps the segment. *bytes receives its size. Ends the program if it cannot be opened.
 */
void *segment_open(struct segment_address address, size_t *bytes);

/* Called by the process that made the segment: nobody can open it afterwards. Mappings stay valid until
 * segment_close(). */
void segment_release(struct segment_address address);
void segment_close(void *segment, size_t bytes);

#endif
