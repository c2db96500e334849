/*
 * Tests every kind of file with the same hostile bytes: each must be refused with one line or read as what it is, and
 * none may take long.
 */
#include "test/random.h"
#include "test/scratch.h"

#define INI   "[light]\nposition = 0 0 9\n[sphere]\ncenter = 0 0 0\nradius = 1\n"
#define NFF   "l 0 0 9\ns 0 0 0 1\n"
#define OBJ   "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"
#define MTL   "newmtl red\nKd 1 0 0\nNs 5\n"
#define FILES 4

/* The damaged file, and CONFIG, which is this file or refers to it. */
static const struct {
    const char *name, *config, *text;
} files[FILES] = {
    {"a.ini", "a.ini", INI},
    {"a.nff", "a.nff", NFF},
    {"a.obj", "a.obj", OBJ},
    {"a.mtl", "a.obj", MTL},
};

static void write_good_files(void)
{
    for (int i = 0; i < FILES; i++)
        write_text(files[i].name, files[i].text);
}

static bool loads(struct scratch *s, const char *config)
{
    struct job job;
    bool good = scratch_load(s, config, NULL, &job);
    if (good) job_free(&job);
    return good;
}

/* Checks that the file was refused with one line, which names the file and, where there is one, the line in it. */
static void check_refused(struct scratch *s, int i, const char *start)
{
    assert_false(loads(s, files[i].config));
    const char *last = s->said, *end = s->said + strlen(s->said) - 1;
    for (const char *at = s->said; at < end; at++)
        if (*at == '\n') last = at + 1;
    assert_true(*end == '\n' && strncmp(last, start, strlen(start)) == 0);
    /* Only warnings may precede the error. */
    for (const char *line = s->said; line < last; line = strchr(line, '\n') + 1)
        assert_true(strstr(line, "warning: ") && strstr(line, "warning: ") < strchr(line, '\n'));
}

/* Byte order marks and line ends of other systems' editors. */
static void test_marks_and_line_ends(void **state)
{
    struct scratch *s = *state;
    for (int i = 0; i < FILES; i++) {
        char text[256] = "\xef\xbb\xbf";
        size_t length = 3;
        write_good_files();
        for (const char *at = files[i].text; *at; at++) {
            if (*at == '\n') text[length++] = '\r';
            text[length++] = *at;
        }
        text[length - 2] = '\0'; /* the last line has no end */
        write_text(files[i].name, text);
        if (!loads(s, files[i].config)) fail_msg("%s", s->said);
        assert_string_equal(s->said, "");
    }
}

static void test_nul(void **state)
{
    struct scratch *s = *state;
    for (int i = 0; i < FILES; i++) {
        size_t size = strlen(files[i].text);
        char text[256], expected[64];
        long line = 1;
        for (size_t at = 0; at < size; at++) {
            write_good_files();
            memcpy(text, files[i].text, size);
            text[at] = '\0';
            write_bytes(files[i].name, text, size);
            snprintf(expected, sizeof expected, "%s:%ld: a NUL byte, expected plain text\n",
                     files[i].name, line);
            check_refused(s, i, expected);
            line += files[i].text[at] == '\n';
        }
    }
}

/* Random bytes, the same in every run, so that a failure can be reproduced. */
static void test_noise(void **state)
{
    struct scratch *s = *state;
    uint64_t random = 1;
    for (int run = 0; run < 200; run++) {
        char noise[700];
        write_good_files();
        for (size_t i = 0; i < sizeof noise; i++) {
            noise[i] = (char)random_below(&random, 256);
            if (!noise[i]) noise[i] = '\n';
        }
        write_bytes(files[run % 3].name, noise, sizeof noise);
        check_refused(s, run % 3, files[run % 3].name);
    }
}

/* Endless words, numbers and lines must be read in linear time. */
static void test_endless(void **state)
{
    static const char *const starts[FILES] = {"[sphere]\nradius = 1", "s 0 0 0 1",
                                              "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 1",
                                              "newmtl red\nKd 1"};
    struct scratch *s = *state;
    size_t size = (size_t)4 << 20;
    char *text = allocate(size, 1);
    for (int i = 0; i < FILES; i++) {
        write_good_files();
        size_t length = strlen(starts[i]);
        memcpy(text, starts[i], length);
        memset(text + length, '0', size - length);
        write_bytes(files[i].name, text, size);
        check_refused(s, i, files[i].name);
        memset(text + length, '\n', size - length);
        write_bytes(files[i].name, text, size);
        loads(s, files[i].config);
        memset(text + length, '[', size - length);
        write_bytes(files[i].name, text, size);
        check_refused(s, i, files[i].name);
    }
    free(text);
}

/* Counts of more items than there are. */
static void test_huge_counts(void **state)
{
    static const struct {
        int file;
        const char *text, *line;
    } cases[] = {
        {0, "[image]\nwidth = 4294967296\n",
         "a.ini:2: width = 4294967296 in [image], expected a whole number from 1 to 65535; "},
        {0, "[image]\nwidth = 65535\nheight = 65535\n" INI,
         "a.ini:2: the picture has 4294836225 pixels, expected width x height <= 2^28\n"},
        {0, "[sampling]\nsamples = 99999999999\n",
         "a.ini:2: samples = 99999999999 in [sampling], expected a whole number from 1 to 65536; "},
        {1, "p 4294967295\n0 0 0\n",
         "a.nff:1: '4294967295' in place of a polygon's number of corners, expected 3 to 20000\n"},
        {1, "pp 18446744073709551615\n",
         "a.nff:1: '18446744073709551615' in place of a polygon's number of corners, expected 3 to "
         "20000\n"},
        {1, "v\nresolution 4294967295 4294967295\n",
         "a.nff:2: 'resolution' needs two whole numbers from 1 to 65535\n"},
        {2, "v 0 0 0\nf 1 1 4294967297\n",
         "a.obj:2: '4294967297' names a vertex that is not there"},
        {2, "v 0 0 0\nf 1 1 -18446744073709551615\n",
         "a.obj:2: '-18446744073709551615' names a vertex that is not there"},
        {2, "v 0 0 0\nf 1//1 1 1\n", "a.obj:2: '1//1' names a normal that is not there"},
    };
    struct scratch *s = *state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_good_files();
        write_text(files[cases[i].file].name, cases[i].text);
        check_refused(s, cases[i].file, cases[i].line);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_marks_and_line_ends),
        cmocka_unit_test(test_nul),
        cmocka_unit_test(test_noise),
        cmocka_unit_test(test_endless),
        cmocka_unit_test(test_huge_counts),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
