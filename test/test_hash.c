/* Tests XXH64 with values of the reference implementation (xxhsum -H1) for every path through the code. */
#include <string.h>

#include "common/hash.h"
#include "test/unit.h"

static void fill(unsigned char *bytes, unsigned count)
{
    for (unsigned i = 0; i < count; i++)
        bytes[i] = (unsigned char)(i * i * 7 + i * 31 + 3);
}

static void test_known_values(void **state)
{
    static const struct {
        size_t count;
        uint64_t hash;
    } known[] = {
        {1, UINT64_C(0x1f25c8d0bc1f4bb6)},   {3, UINT64_C(0x0107a193c179cd6e)},
        {4, UINT64_C(0x364725615c839dcf)},   {7, UINT64_C(0x51ee29f6a62a4641)},
        {8, UINT64_C(0xc7f6f39a4d33bc1a)},   {12, UINT64_C(0x417a093a2ab87411)},
        {31, UINT64_C(0x90144f91fc96d3cb)},  {32, UINT64_C(0x4839271f616ef7af)},
        {33, UINT64_C(0xfea670889655ee2e)},  {63, UINT64_C(0xa1b59f267d566a99)},
        {64, UINT64_C(0x2e7d4f3e9aafe19e)},  {100, UINT64_C(0xebf293e0b26d57e6)},
        {255, UINT64_C(0x8c086bb7269dba32)}, {300, UINT64_C(0xa2d45cca797c2fe6)},
    };
    unsigned char bytes[300];
    fill(bytes, sizeof bytes);
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        assert_true(hash64(bytes, known[i].count, 0) == known[i].hash);
    assert_true(hash64("", 0, 0) == UINT64_C(0xef46db3751d8e999));
    assert_true(hash64("abc", 3, 0) == UINT64_C(0x44bc2cf5ad770999));
}

/* The hash does not depend on the alignment or on other bytes. */
static void test_place_in_memory(void **state)
{
    unsigned char bytes[100], moved[120];
    fill(bytes, sizeof bytes);
    for (size_t shift = 0; shift < 16; shift++) {
        memset(moved, (int)shift, sizeof moved);
        memcpy(moved + shift, bytes, sizeof bytes);
        assert_true(hash64(moved + shift, sizeof bytes, 5) == hash64(bytes, sizeof bytes, 5));
    }
}

/* The hash depends on every bit of the bytes, their number and the seed. */
static void test_every_bit_counts(void **state)
{
    unsigned char bytes[77];
    fill(bytes, sizeof bytes);
    uint64_t hash = hash64(bytes, sizeof bytes, 0);
    for (size_t i = 0; i < 8 * sizeof bytes; i++) {
        bytes[i / 8] ^= (unsigned char)(1 << i % 8);
        assert_true(hash64(bytes, sizeof bytes, 0) != hash);
        bytes[i / 8] ^= (unsigned char)(1 << i % 8);
    }
    for (int i = 0; i < 64; i++)
        assert_true(hash64(bytes, sizeof bytes, UINT64_C(1) << i) != hash);
    assert_true(hash64(bytes, sizeof bytes - 1, 0) != hash);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_values),
        cmocka_unit_test(test_place_in_memory),
        cmocka_unit_test(test_every_bit_counts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
