#include "master/post.h"

#include <mpi.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/nap.h"

/* Buffers are so far apart that no two share a cache line, but for the ends of a small block. */
#define BUFFER_ALIGN ((size_t)64)

struct post {
    size_t largest;
    int receives;
    MPI_Request incoming[POST_RECEIVES];
    char *block; /* of all buffers */
    char *buffers[POST_RECEIVES];
    uint64_t turns[POST_RECEIVES]; /* the number of the receive: they are met in this order */
    uint64_t posted;

    /* Sent, not yet taken by its receiver. */
    int sends, room;
    MPI_Request *outgoing;
    char **copies;
};

int post_ranks(void)
{
    int ranks;
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    return ranks;
}

static void post_receive(struct post *post, int slot)
{
    post->turns[slot] = post->posted++;
    MPI_Irecv(post->buffers[slot], (int)post->largest, MPI_BYTE, MPI_ANY_SOURCE, MPI_ANY_TAG,
              MPI_COMM_WORLD, &post->incoming[slot]);
}

struct post *post_open(size_t largest)
{
    struct post *post = allocate_zeroed(1, sizeof *post);
    int others = post_ranks() - 1;
    post->largest = largest;
    post->receives = others < POST_RECEIVES ? others : POST_RECEIVES;
    /* Of a long message's pages each is a page fault the first time: huge ones make them few. */
    size_t stride = (largest + BUFFER_ALIGN - 1) / BUFFER_ALIGN * BUFFER_ALIGN;
    post->block = allocate_large((size_t)post->receives * stride);
    for (int i = 0; i < post->receives; i++) {
        post->buffers[i] = post->block + (size_t)i * stride;
        post_receive(post, i);
    }
    return post;
}

/* ---- sending ---- */

static void keep_sending(struct post *post, MPI_Request request, char *copy)
{
    if (post->sends == post->room) {
        post->room = post->room ? 2 * post->room : 16;
        post->outgoing = reallocate(post->outgoing, (size_t)post->room, sizeof *post->outgoing);
        post->copies = reallocate(post->copies, (size_t)post->room, sizeof *post->copies);
    }
    post->outgoing[post->sends] = request;
    post->copies[post->sends++] = copy;
}

void post_send(struct post *post, int rank, enum message_tag tag, const void *bytes, size_t size)
{
    MPI_Request request;
    int done;
    char *copy = size ? allocate(size, 1) : NULL;
    if (copy) memcpy(copy, bytes, size);
    MPI_Isend(copy, (int)size, MPI_BYTE, rank, tag, MPI_COMM_WORLD, &request);
    /* As good as always: a short message is on its way as soon as it is sent. */
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done)
        free(copy);
    else
        keep_sending(post, request, copy);
}

/* Gives back the memory of what has been taken meanwhile. */
static void look_after_sends(struct post *post)
{
    if (post->sends == 0) return;
    int done, kept = 0;
    for (int i = 0; i < post->sends; i++) {
        MPI_Test(&post->outgoing[i], &done, MPI_STATUS_IGNORE);
        if (done) {
            free(post->copies[i]);
            continue;
        }
        post->outgoing[kept] = post->outgoing[i];
        post->copies[kept++] = post->copies[i];
    }
    post->sends = kept;
}

/* ---- receiving ---- */

/* MPI tells what has come in the order of slots. In that of the receives, messages of one rank are in
 * the order in which it sent them. */
static void sort_letters(const struct post *post, struct letter *letters, int count)
{
    for (int i = 1; i < count; i++) {
        struct letter letter = letters[i];
        int at = i;
        for (; at > 0 && post->turns[letters[at - 1].slot] > post->turns[letter.slot]; at--)
            letters[at] = letters[at - 1];
        letters[at] = letter;
    }
}

int post_collect(struct post *post, struct letter letters[POST_RECEIVES])
{
    int slots[POST_RECEIVES], count = 0;
    MPI_Status statuses[POST_RECEIVES];
    look_after_sends(post);
    if (post->receives == 0) return 0;
    MPI_Testsome(post->receives, post->incoming, &count, slots, statuses);
    for (int i = 0; i < count; i++) {
        int bytes;
        MPI_Get_count(&statuses[i], MPI_BYTE, &bytes);
        if (bytes < 0) fatal("rank %d sent a message of no length", statuses[i].MPI_SOURCE);
        letters[i] = (struct letter){.rank = statuses[i].MPI_SOURCE,
                                     .tag = statuses[i].MPI_TAG,
                                     .slot = slots[i],
                                     .size = (size_t)bytes,
                                     .bytes = post->buffers[slots[i]]};
    }
    sort_letters(post, letters, count);
    return count < 0 ? 0 : count; /* MPI_UNDEFINED is negative */
}

void post_release(struct post *post, const struct letter *letter)
{
    post_receive(post, letter->slot);
}

void post_close(struct post *post, bool all_left)
{
    if (!all_left) return;
    struct nap nap = {0};
    for (look_after_sends(post); post->sends > 0; look_after_sends(post))
        nap_take(&nap);
    for (int i = 0; i < post->receives; i++) {
        MPI_Cancel(&post->incoming[i]);
        MPI_Wait(&post->incoming[i], MPI_STATUS_IGNORE);
    }
    free(post->block);
    free(post->outgoing);
    free(post->copies);
    free(post);
}
