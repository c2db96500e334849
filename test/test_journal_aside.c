/* Journals of other pictures: set aside under another name, and taken back for their own picture. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "test/journal_fixture.h"
#include "test/unit.h"

/* The error of renaming without replacing; 0: none. */
static int rename_error;

int renameat2(int from_folder, const char *from, int to_folder, const char *to, unsigned flags)
{
    errno = rename_error;
    return rename_error ? -1 : (int)syscall(SYS_renameat2, from_folder, from, to_folder, to, flags);
}

/* The error of other renaming; 0: none. */
static int back_error;

int rename(const char *from, const char *to)
{
    errno = back_error;
    return back_error ? -1 : (int)syscall(SYS_rename, from, to);
}

/* A file that may be no journal is not overwritten, but set aside for its owner. */
static void test_nothing_whole(void **state)
{
    struct scratch *s = *state;
    enum { SIZE = HEADER + RECORD };
    char bytes[SIZE];
    struct seen seen;
    write_journal(s, 1);
    assert_int_equal(read_file(PATH, bytes, sizeof bytes), SIZE);
    bytes[3] ^= 1;
    bytes[SIZE - 1] ^= 1;
    struct journal *journal = open_damaged(s, bytes, SIZE, &seen);
    assert_int_equal(seen.records, 0);
    assert_string_equal(s->said, PATH ": warning: this is no journal, or its first bytes are "
                                      "damaged, it is now called " PATH ".1\n");
    journal_remove(journal);
    assert_int_equal(unlink(PATH ".1"), 0);
}

/* The first four records tell whose journal it is, whatever stands before a good one of them; they are enough. */
static void test_nothing_whole_at_first(void **state)
{
    struct scratch *s = *state;
    enum { RECORDS = 5, SIZE = HEADER + RECORDS * RECORD };
    char bytes[SIZE];
    struct seen seen;
    write_journal(s, RECORDS);
    assert_int_equal(read_file(PATH, bytes, sizeof bytes), SIZE);
    bytes[3] ^= 1;
    for (size_t i = 0; i < 4; i++) {
        struct journal *journal = open_damaged(s, bytes, SIZE, &seen);
        assert_int_equal(seen.records, RECORDS - i);
        journal_remove(journal);
        bytes[HEADER + i * RECORD] ^= 1;
    }
    struct journal *journal = open_damaged(s, bytes, SIZE, &seen);
    assert_true(seen.records == 0 && strstr(s->said, "this is no journal"));
    journal_remove(journal);
    assert_int_equal(unlink(PATH ".1"), 0);
}

static void test_other_pictures(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 3);
    struct journal *journal = open_as(s, PICTURE + 1, &seen);
    assert_true(journal && seen.records == 0);
    assert_string_equal(s->said, PATH ": warning: the journal holds another picture or other "
                                      "settings, it is now called " PATH ".1\n");
    append(journal, 0);
    journal_close(journal);
    journal = open_as(s, PICTURE + 2, &seen);
    assert_true(journal && seen.records == 0 && strstr(s->said, PATH ".2"));
    journal_close(journal);
    write_text(PATH, "[sphere]\nsomething else, of more bytes than a header\n");
    journal = open_as(s, PICTURE + 2, &seen);
    assert_non_null(journal);
    assert_string_equal(s->said, PATH ": warning: this is no journal, or its first bytes are "
                                      "damaged, it is now called " PATH ".3\n");
    journal_remove(journal);
    assert_int_equal(unlink(PATH ".1") + unlink(PATH ".2") + unlink(PATH ".3"), 0);
}

/* A journal that was set aside is taken back for its own picture, whether another journal has its place now or none
 * has. */
static void test_back_again(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    for (uint64_t i = 0; i < 3; i++) {
        struct journal *journal = open_as(s, PICTURE + i, &seen);
        for (uint32_t k = 0; k <= i; k++)
            append(journal, k);
        journal_close(journal);
    }
    struct journal *journal = open_as(s, PICTURE + 1, &seen);
    assert_int_equal(seen.records, 2);
    assert_string_equal(s->said, PATH ": warning: the journal holds another picture or other "
                                      "settings, it is now called " PATH ".3\nfarm: " PATH
                                      ".2 is this picture's, it is called " PATH " again\n");
    journal_remove(journal);
    journal = open_as(s, PICTURE, &seen);
    assert_int_equal(seen.records, 1);
    journal_close(journal);
    assert_int_equal(access(PATH ".1", F_OK), -1);
    check_resume(s, 1, 0, 2);
    journal = open_as(s, PICTURE + 2, &seen);
    assert_int_equal(seen.records, 3);
    journal_remove(journal);
    assert_int_equal(access(PATH ".2", F_OK) + access(PATH ".3", F_OK), -2);
    assert_int_equal(unlink(PATH ".1"), 0);
}

/* Of several journals of the picture the longest is taken back, also where one without records has its place. */
static void test_longest_back_again(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    static const char *const apart[] = {"first", "second", "third"};
    static const char *const names[] = {PATH ".1", PATH ".12", PATH ".7"};
    for (uint32_t longest = 0; longest < 3; longest++) { /* a folder may list it first or last */
        for (uint32_t i = 0; i < 3; i++) {
            write_journal(s, i == longest ? 5 : 2);
            assert_int_equal(rename(PATH, apart[i]), 0);
        }
        write_journal(s, 0);
        for (uint32_t i = 0; i < 3; i++)
            assert_int_equal(rename(apart[i], names[i]), 0);
        struct journal *journal = open_as(s, PICTURE, &seen);
        assert_int_equal(seen.records, 5);
        journal_remove(journal);
        for (uint32_t i = 0; i < 3; i++)
            assert_int_equal(unlink(names[i]), i == longest ? -1 : 0);
    }
}

/* Nothing is taken back under a name that is only similar, or through a symbolic link. */
static void test_similar_names(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    static const char *const names[] = {PATH ".x", PATH ".1x", PATH ".",
                                        PATH "12", PATH "x1",  "b" PATH ".1"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        write_journal(s, 2);
        assert_int_equal(rename(PATH, names[i]), 0);
        if (i == 0) assert_int_equal(symlink(names[i], PATH ".1"), 0);
        struct journal *journal = open_as(s, PICTURE, &seen);
        assert_true(journal && seen.records == 0 && !*s->said);
        journal_remove(journal);
        assert_int_equal(unlink(names[i]), 0);
        unlink(PATH ".1");
    }
}

/* No journal is taken back that another run has open. */
static void test_not_back_again(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 0);
    assert_int_equal(rename(PATH, PATH ".2"), 0);
    write_journal(s, 2);
    assert_int_equal(rename(PATH, PATH ".1"), 0);
    struct journal_reader reader = {take, &seen, PAYLOAD, 0};
    struct journal *other = journal_open(PATH ".1", PICTURE, &reader);
    struct journal *journal = open_as(s, PICTURE, &seen);
    assert_true(journal && seen.records == 0 && !*s->said && journal_was_empty(journal));
    journal_close(other);
    journal_remove(journal);
    assert_int_equal(unlink(PATH ".1") + unlink(PATH ".2"), 0);
}

/* Another picture's journal without any tile is overwritten, as there is nothing to lose. */
static void test_other_picture_without_tiles(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 0);
    struct journal *journal = open_as(s, PICTURE + 1, &seen);
    assert_true(journal && seen.records == 0 && !*s->said && journal_was_empty(journal));
    append(journal, 0);
    journal_close(journal);
    assert_int_equal(access(PATH ".1", F_OK), -1);
    journal = open_as(s, PICTURE + 1, &seen);
    assert_true(seen.records == 1 && !*s->said && !journal_was_empty(journal));
    journal_remove(journal);
}

/* On file systems that cannot rename without replacing, nothing is replaced either, not even a link to nowhere. */
static void test_plain_rename(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    static const int errors[] = {EINVAL, ENOSYS};
    for (size_t i = 0; i < 2; i++) {
        write_journal(s, 1);
        assert_int_equal(symlink("nowhere", PATH ".1"), 0);
        rename_error = errors[i];
        struct journal *journal = open_as(s, PICTURE + 1, &seen);
        rename_error = 0;
        assert_true(journal && strstr(s->said, "it is now called " PATH ".2\n"));
        journal_remove(journal);
        assert_int_equal(unlink(PATH ".1") + rename(PATH ".2", PATH), 0);
        check_resume(s, 1, 0, 1);
    }
}

/* Where it cannot be renamed, it stays. */
static void test_no_rename(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 1);
    rename_error = EACCES;
    assert_null(open_as(s, PICTURE + 1, &seen));
    rename_error = 0;
    assert_string_equal(s->said, PATH ": the journal cannot be renamed: Permission denied, choose "
                                      "another place with output.journal=FILE\n");
    check_resume(s, 1, 0, 1);
}

/* A journal that cannot be taken back stays, and a new one takes its place. */
static void test_not_renamed_back(void **state)
{
    struct scratch *s = *state;
    struct seen seen;
    write_journal(s, 1);
    assert_int_equal(rename(PATH, PATH ".1"), 0);
    back_error = EACCES;
    struct journal *journal = open_as(s, PICTURE, &seen);
    back_error = 0;
    assert_true(journal && seen.records == 0 && !*s->said);
    journal_remove(journal);
    assert_int_equal(rename(PATH ".1", PATH), 0);
    check_resume(s, 1, 0, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nothing_whole),
        cmocka_unit_test(test_nothing_whole_at_first),
        cmocka_unit_test(test_other_pictures),
        cmocka_unit_test(test_back_again),
        cmocka_unit_test(test_longest_back_again),
        cmocka_unit_test(test_not_back_again),
        cmocka_unit_test(test_similar_names),
        cmocka_unit_test(test_not_renamed_back),
        cmocka_unit_test(test_other_picture_without_tiles),
        cmocka_unit_test(test_plain_rename),
        cmocka_unit_test(test_no_rename),
        cmocka_unit_test(test_no_file_stays_open),
    };
    return cmocka_run_group_tests(tests, journal_tests_open, scratch_close);
}
