/*
 * MPI messages to and from the renderers on other ranks: the only use of MPI in master/ besides start and end in
 * main.c. No function here blocks: a renderer that stops answering holds nothing up. Main thread only.
 */
#ifndef FARM_MASTER_POST_H
#define FARM_MASTER_POST_H

#include <stdbool.h>
#include <stddef.h>

#include "common/protocol.h"

/* Receives that are posted ahead, so that results arrive without waiting for the master, and little piles up in
 * MPI's queue of unexpected messages. */
#define POST_RECEIVES 16

struct post;

/* A message that was received. */
struct letter {
    int rank; /* the sender */
    int tag;  /* enum message_tag, or anything */
    int slot; /* for post.c alone */
    size_t size;
    const char *bytes; /* aligned for all types; valid until post_release() */
};

/* The number of ranks, this one included. */
int post_ranks(void);

/* Starts to receive messages of up to `largest` bytes from the other ranks. Freed by post_close(). */
struct post *post_open(size_t largest);

/*
 * Sends a copy of the bytes, at once or as soon as the rank receives them. The caller sees to it that messages
 * to a rank that does not answer any more do not pile up: common/protocol.h tells how many there may be.
 */
void post_send(struct post *post, int rank, enum message_tag tag, const void *bytes, size_t size);

/* Whether all sends are complete. */
bool post_is_settled(const struct post *post);

/* Collects the messages that have arrived, those of each rank in the order of sending; returns how many. Each is
 * to be given back to post_release(). */
int post_collect(struct post *post, struct letter letters[POST_RECEIVES]);
void post_release(struct post *post, const struct letter *letter);

/*
 * Frees the post. all_left: every rank has received all that was sent to it, and sends nothing more. Otherwise
 * there may be half of a message that never ends, for which MPI would wait: requests and memory are then left as
 * they are, as the job is about to end.
 */
void post_close(struct post *post, bool all_left);

#endif
