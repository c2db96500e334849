/* Collective operations, with a fake MPI in which there is another rank, too. */
#include <stdlib.h>

#include "test/unit.h"
#include "worker/collective.h"

static struct {
    const char *data, *sent; /* what is to be sent; how far it has been */
    int most;                /* bytes of a piece */
    int other;               /* what the other rank says, or sends if this one is not rank 0 */
    int polls;               /* until a request is complete */
    int under_way;           /* requests that are not complete */
} fake;

/* Any that is not MPI_REQUEST_NULL. */
#define REQUEST ((MPI_Request)0x77000001)

static int begin(MPI_Request *request)
{
    *request = REQUEST;
    fake.polls = 3;
    fake.under_way++;
    return MPI_SUCCESS;
}

int MPI_Test(MPI_Request *request, int *done, MPI_Status *status)
{
    (void)status;
    *done = --fake.polls == 0;
    if (!*done) return MPI_SUCCESS;
    assert_true(*request == REQUEST);
    *request = MPI_REQUEST_NULL;
    fake.under_way--;
    return MPI_SUCCESS;
}

int MPI_Ibcast(void *buffer, int count, MPI_Datatype type, int root, MPI_Comm comm,
               MPI_Request *request)
{
    assert_true(type == MPI_BYTE && root == 0 && comm == MPI_COMM_WORLD);
    assert_true(fake.under_way == 0 && count > 0);
    if (fake.data)
        assert_ptr_equal(buffer, fake.sent);
    else
        *(int *)buffer = fake.other;
    fake.sent += fake.data ? count : 0;
    if (count > fake.most) fake.most = count;
    return begin(request);
}

int MPI_Iallreduce(const void *own, void *all, int count, MPI_Datatype type, MPI_Op op,
                   MPI_Comm comm, MPI_Request *request)
{
    assert_true(count == 1 && type == MPI_INT && comm == MPI_COMM_WORLD);
    int mine = *(const int *)own, least = mine < fake.other ? mine : fake.other;
    assert_true(op == MPI_MIN || op == MPI_MAX);
    *(int *)all = op == MPI_MIN ? least : mine + fake.other - least;
    return begin(request);
}

/* Data are sent in pieces, one after the other, which an int can count and of which the last may be short. */
static void test_broadcast(void **state)
{
    const size_t bytes[] = {1, (size_t)64 << 20, ((size_t)200 << 20) + 1};
    for (size_t i = 0; i < sizeof bytes / sizeof *bytes; i++) {
        /* Of this memory nothing is read or written. */
        char *data = malloc(bytes[i]);
        assert_non_null(data);
        fake.data = fake.sent = data;
        fake.most = 0;
        broadcast(MPI_COMM_WORLD, data, bytes[i]);
        assert_true(fake.sent == data + bytes[i] && fake.under_way == 0);
        assert_true(fake.most <= 64 << 20);
        free(data);
    }
    fake.data = NULL;
}

static void test_all_agree(void **state)
{
    for (int other = 0; other <= 1; other++) {
        fake.other = other;
        assert_false(all_agree(false));
        assert_int_equal(all_agree(true), other);
    }
}

/* All ranks end with the status of rank 0. */
static void test_status(void **state)
{
    fake.other = 75;
    assert_int_equal(agree_on_status(1), 75);
    assert_int_equal(fake.under_way, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_broadcast),
        cmocka_unit_test(test_all_agree),
        cmocka_unit_test(test_status),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
