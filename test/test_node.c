/* Tests of which ranks share memory. */

#include "test/unit.h"
#include "worker/node.h"

#define RANKS 8

static void check(const uint64_t *realm, int isolated, const struct node_place *expected)
{
    struct node_sign signs[RANKS];
    struct node_place places[RANKS];
    for (uint64_t rank = 0; rank < RANKS; rank++)
        signs[rank] = (struct node_sign){realm[rank], {100 + (int)rank, 200 + (int)rank}};
    node_places(signs, RANKS, places);
    for (int rank = 0; rank < RANKS; rank++) {
        assert_int_equal(places[rank].first, expected[rank].first);
        assert_int_equal(places[rank].segment.process, 100 + expected[rank].first);
        assert_int_equal(places[rank].segment.file, 200 + expected[rank].first);
        assert_int_equal(places[rank].index, expected[rank].index);
        assert_int_equal(places[rank].size, expected[rank].size);
        assert_int_equal(places[rank].nodes, expected[rank].nodes);
        assert_int_equal(places[rank].isolated, isolated);
    }
}

#define PLACE(first_, index_, size_, nodes_)                                                       \
    {                                                                                              \
        .first = (first_), .index = (index_), .size = (size_), .nodes = (nodes_)                   \
    }

static void test_places(void **state)
{
    check((uint64_t[RANKS]){7, 7, 7, 7, 7, 7, 7, 7}, 0,
          (struct node_place[RANKS]){PLACE(0, 0, 8, 1), PLACE(0, 1, 8, 1), PLACE(0, 2, 8, 1),
                                     PLACE(0, 3, 8, 1), PLACE(0, 4, 8, 1), PLACE(0, 5, 8, 1),
                                     PLACE(0, 6, 8, 1), PLACE(0, 7, 8, 1)});
    /* Three nodes in mixed order, and two ranks whose node is unknown. */
    check((uint64_t[RANKS]){9, 3, 0, UINT64_MAX, 3, 9, 0, 3}, 2,
          (struct node_place[RANKS]){PLACE(0, 0, 2, 5), PLACE(1, 0, 3, 5), PLACE(2, 0, 1, 5),
                                     PLACE(3, 0, 1, 5), PLACE(1, 1, 3, 5), PLACE(0, 1, 2, 5),
                                     PLACE(6, 0, 1, 5), PLACE(1, 2, 3, 5)});
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_places)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
