/*
 * Messages to and from the renderers on other ranks: the only MPI in master/ besides start and end in
 * main. Nothing here waits for anybody: a renderer that answers no more holds nobody up.
 *
 * Main thread only.
 */
#ifndef FARM_MASTER_POST_H
#define FARM_MASTER_POST_H

#include <stdbool.h>
#include <stddef.h>

#include "common/protocol.h"

/* Receives posted ahead, so that results land without waiting for us and little piles up in MPI's queue
 * of unexpected messages. */
#define POST_RECEIVES 16

struct post;

/* A message that has come. */
struct letter {
    int rank; /* who sent it */
    int tag;  /* enum message_tag, or anything */
    int slot; /* the post's own */
    size_t size;
    const char *bytes; /* aligned for all types; of use until post_release() */
};

/* All ranks there are, this one included. */
int post_ranks(void);

/* For messages of up to so many bytes from the other ranks. */
struct post *post_open(size_t largest);

/*
 * Sends a copy of so many bytes, at once or as soon as the rank takes them. The caller sees to it that
 * a rank that answers no more is not sent more and more: protocol.h tells how much there may be.
 */
void post_send(struct post *post, int rank, enum message_tag tag, const void *bytes, size_t size);

/* Whether MPI has nothing more to do for what was sent. */
bool post_is_settled(const struct post *post);

/* What has come meanwhile; returns how many messages. Each is to be given back. */
int post_collect(struct post *post, struct letter letters[POST_RECEIVES]);
void post_release(struct post *post, const struct letter *letter);

/*
 * all_left: every rank has taken all that was sent to it, and sends nothing more. Otherwise there may be
 * half of a message that never ends, for which MPI and its memory would wait: they are left as they are,
 * for the job is about to end.
 */
void post_close(struct post *post, bool all_left);

#endif
