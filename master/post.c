#include "master/post.h"

#include <mpi.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/nap.h"
#include "common/whole.h"

/* The distance between buffers is a multiple of this, the size of a cache line. As the block is aligned by
 * malloc() alone, neighbours may share the line at their border. */
#define BUFFER_ALIGN ((size_t)64)

struct post {
    size_t largest;
    char *block; /* memory of all buffers */
    char *buffers[POST_RECEIVES];
    /* Number of the receive in the order of posting, in which they match messages. */
    uint64_t turns[POST_RECEIVES];
    uint64_t posted;

    /* The requests: first the receives, then the sends that are not known to be complete. So one call of MPI
     * tests all of them. */
    int receives, sends, room; /* room: capacity for sends */
    MPI_Request *requests;
    int *slots; /* indices of requests that are complete */
    MPI_Status *statuses;
    char **copies; /* per send: its bytes; owned */
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
              MPI_COMM_WORLD, &post->requests[slot]);
}

static void reserve_sends(struct post *post, int room)
{
    size_t requests = (size_t)post->receives + (size_t)room;
    post->room = room;
    post->requests = reallocate(post->requests, requests, sizeof *post->requests);
    post->slots = reallocate(post->slots, requests, sizeof *post->slots);
    post->statuses = reallocate(post->statuses, requests, sizeof *post->statuses);
    post->copies = reallocate(post->copies, (size_t)room, sizeof *post->copies);
}

struct post *post_open(size_t largest)
{
    struct post *post = allocate_zeroed(1, sizeof *post);
    int others = post_ranks() - 1;
    post->largest = largest;
    post->receives = others < POST_RECEIVES ? others : POST_RECEIVES;
    reserve_sends(post, 2 * POST_RECEIVES);
    /* Each buffer has room for the longest message; of most buffers only the first few pages are used. Clearing
     * huge ones took a fifth of the master's time with 44 ranks. */
    size_t stride = round_up_to(largest, BUFFER_ALIGN);
    post->block = allocate((size_t)post->receives, stride);
    for (int i = 0; i < post->receives; i++) {
        post->buffers[i] = post->block + (size_t)i * stride;
        post_receive(post, i);
    }
    return post;
}

/* ---- sending ---- */

void post_send(struct post *post, int rank, enum message_tag tag, const void *bytes, size_t size)
{
    if (post->sends == post->room) reserve_sends(post, 2 * post->room);
    char *copy = size ? allocate(size, 1) : NULL;
    if (copy) memcpy(copy, bytes, size);
    MPI_Isend(copy, (int)size, MPI_BYTE, rank, (int)tag, MPI_COMM_WORLD,
              &post->requests[post->receives + post->sends]);
    post->copies[post->sends++] = copy;
}

/* Removes complete sends and frees their memory. */
static void forget_sends(struct post *post)
{
    MPI_Request *requests = post->requests + post->receives;
    int kept = 0;
    for (int i = 0; i < post->sends; i++) {
        if (requests[i] == MPI_REQUEST_NULL) {
            free(post->copies[i]);
            continue;
        }
        requests[kept] = requests[i];
        post->copies[kept++] = post->copies[i];
    }
    post->sends = kept;
}

bool post_is_settled(const struct post *post)
{
    return post->sends == 0;
}

/* ---- receiving ---- */

/* Sorts messages by the order in which their receives were posted: in this order messages of one rank are as it
 * sent them. MPI reports them in the order of slots. */
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
    int done = 0, count = 0;
    if (post->receives + post->sends == 0) return 0;
    MPI_Testsome(post->receives + post->sends, post->requests, &done, post->slots, post->statuses);
    /* done is MPI_UNDEFINED, which is negative, if no request is active */
    for (int i = 0; i < done; i++) {
        int bytes, slot = post->slots[i];
        const MPI_Status *status = &post->statuses[i];
        if (slot >= post->receives) continue;
        MPI_Get_count(status, MPI_BYTE, &bytes);
        if (bytes < 0) fatal("rank %d sent a message of no length", status->MPI_SOURCE);
        letters[count++] = (struct letter){.rank = status->MPI_SOURCE,
                                           .tag = status->MPI_TAG,
                                           .slot = slot,
                                           .size = (size_t)bytes,
                                           .bytes = post->buffers[slot]};
    }
    if (done > count) forget_sends(post);
    sort_letters(post, letters, count);
    return count;
}

void post_release(struct post *post, const struct letter *letter)
{
    post_receive(post, letter->slot);
}

/* Waits until all sends are complete. */
static void wait_for_sends(struct post *post)
{
    struct nap nap = {0};
    for (;;) {
        int done;
        MPI_Testall(post->sends, post->requests + post->receives, &done, post->statuses);
        if (done) break;
        nap_take(&nap);
    }
    forget_sends(post);
}

void post_close(struct post *post, bool all_left)
{
    if (!all_left) return;
    wait_for_sends(post);
    for (int i = 0; i < post->receives; i++) {
        MPI_Cancel(&post->requests[i]);
        MPI_Wait(&post->requests[i], MPI_STATUS_IGNORE);
    }
    free(post->block);
    free(post->requests);
    free(post->slots);
    free(post->statuses);
    free(post->copies);
    free(post);
}
