/* Tests the command that continues a run: a shell must split it into the original arguments. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/command_line.h"
#include "test/unit.h"

static void test_plain(void **state)
{
    char *arguments[] = {"./farm", "a/b.ini", "image.width=9", NULL};
    char *text = command_line(arguments, 1, NULL);
    assert_string_equal(text, "./farm a/b.ini image.width=9");
    free(text);
    text = command_line(arguments, 3, "output.journal=/tmp/x");
    assert_string_equal(text, "mpiexec -n 3 ./farm a/b.ini image.width=9 output.journal=/tmp/x");
    free(text);
}

static void test_shell_gives_it_back(void **state)
{
    const char *odd[] = {"",
                         "a b",
                         "it's",
                         "light sun.color=1 0 0",
                         "$HOME",
                         "`false`",
                         "a;b",
                         "*",
                         "\"",
                         "~",
                         "a\\b",
                         "é",
                         "#",
                         "a\nb",
                         "!",
                         "'",
                         "''",
                         "a'b'c",
                         "{x,y}",
                         "a&b",
                         "a\33]0;b\7c",
                         "\x9b",
                         "\xc2\x9bé",
                         "\x7f"};
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
        char *arguments[] = {"printf", "%s.", (char *)(uintptr_t)odd[i], NULL};
        char *command = command_line(arguments, 1, NULL), got[64] = "";
        FILE *shell = popen(command, "r");
        assert_non_null(shell);
        for (const char *c = command; *c; c += *c == '\n' ? 1 : printable_bytes(c))
            assert_true(*c == '\n' || printable_bytes(c) > 0);
        size_t bytes = fread(got, 1, sizeof got - 1, shell);
        pclose(shell);
        assert_int_equal(bytes, strlen(odd[i]) + 1);
        assert_memory_equal(got, odd[i], strlen(odd[i]));
        free(command);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_plain),
        cmocka_unit_test(test_shell_gives_it_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
