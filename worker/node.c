#include "worker/node.h"

#include <stdlib.h>

#include "common/message.h"
#include "worker/collective.h"
#include "worker/segment.h"

struct entry {
    uint64_t realm;
    int32_t rank;
};

static int by_realm(const void *first, const void *second)
{
    const struct entry *a = first, *b = second;
    if (a->realm != b->realm) return a->realm < b->realm ? -1 : 1;
    return a->rank < b->rank ? -1 : 1;
}

/* Fills in the places of the ranks of one node, entries begin .. end - 1. */
static void place_node(const struct entry *entries, int begin, int end,
                       const struct node_sign *signs, struct node_place *places)
{
    int32_t first = entries[begin].rank;
    for (int i = begin; i < end; i++)
        places[entries[i].rank] = (struct node_place){.segment = signs[first].segment,
                                                      .first = first,
                                                      .index = i - begin,
                                                      .size = end - begin};
}

void node_places(const struct node_sign *signs, int ranks, struct node_place *places)
{
    struct entry *entries = allocate((size_t)ranks, sizeof *entries);
    int nodes = 0, isolated = 0;
    for (int rank = 0; rank < ranks; rank++) {
        entries[rank] = (struct entry){signs[rank].realm, rank};
        isolated += signs[rank].realm == 0;
    }
    qsort(entries, (size_t)ranks, sizeof *entries, by_realm);
    for (int begin = 0, end; begin < ranks; begin = end, nodes++) {
        end = begin + 1;
        while (entries[begin].realm != 0 && end < ranks &&
               entries[end].realm == entries[begin].realm)
            end++;
        place_node(entries, begin, end, signs, places);
    }
    for (int rank = 0; rank < ranks; rank++) {
        places[rank].nodes = nodes;
        places[rank].isolated = isolated;
    }
    free(entries);
}

/*
 * Rank 0 gathers all signs and sends each rank its place. Returns the array of all places on rank 0, which
 * the caller frees; NULL elsewhere.
 */
static struct node_place *ask_for_place(const struct node_sign *sign, struct node_place *own)
{
    int rank, ranks;
    const int sign_bytes = (int)sizeof *sign, bytes = (int)sizeof *own;
    struct node_sign *signs = NULL;
    struct node_place *places = NULL;
    MPI_Request request;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (rank == 0) signs = allocate((size_t)ranks, sizeof *signs);
    MPI_Igather(sign, sign_bytes, MPI_BYTE, signs, sign_bytes, MPI_BYTE, 0, MPI_COMM_WORLD,
                &request);
    wait_request(&request);
    if (rank == 0) {
        places = allocate((size_t)ranks, sizeof *places);
        node_places(signs, ranks, places);
    }
    MPI_Iscatter(places, bytes, MPI_BYTE, own, bytes, MPI_BYTE, 0, MPI_COMM_WORLD, &request);
    wait_request(&request);
    free(signs);
    return places;
}

/* The same, repeated until all ranks can open the segment of their node. A rank that cannot is put on a node
 * of its own. */
static struct node_place *find_place(struct segment_address segment, struct node_place *own)
{
    struct node_sign sign = {segment.file < 0 ? 0 : segment_own_realm(), segment};
    for (;;) {
        struct node_place *places = ask_for_place(&sign, own);
        bool opens = own->index == 0 || segment_opens(own->segment);
        if (all_agree(opens)) return places;
        free(places);
        if (!opens) sign.realm = 0;
    }
}

/* Makes node->leaders. places: the array on rank 0, NULL elsewhere. */
static void gather_leaders(const struct node_place *places, struct node *node)
{
    int ranks, count = 0;
    MPI_Group all, group;
    int *firsts = allocate((size_t)node->place.nodes, sizeof *firsts);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    for (int rank = 0; places && rank < ranks; rank++)
        if (places[rank].index == 0) firsts[count++] = rank;
    broadcast(MPI_COMM_WORLD, firsts, (size_t)node->place.nodes * sizeof *firsts);
    if (node->place.index == 0) {
        MPI_Comm_group(MPI_COMM_WORLD, &all);
        MPI_Group_incl(all, node->place.nodes, firsts, &group);
        MPI_Comm_create_group(MPI_COMM_WORLD, group, 0, &node->leaders);
        MPI_Group_free(&group);
        MPI_Group_free(&all);
    }
    free(firsts);
}

void node_find(struct segment_address segment, struct node *node)
{
    struct node_place *places = find_place(segment, &node->place);
    int ranks;
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (places && node->place.isolated > 0 && ranks > 1)
        user_note("%d of %d processes can share no memory: each has a scene of its own",
                  node->place.isolated, ranks);
    node->leaders = MPI_COMM_NULL;
    if (node->place.nodes > 1) gather_leaders(places, node);
    free(places);
}
