/* What ends the job is tried in a child. */
#ifndef FARM_TEST_FATAL_H
#define FARM_TEST_FATAL_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#define FATAL_TEXT 256

/* try(state) ends with status 1; text: what it has said on stderr, of at most FATAL_TEXT - 1 bytes. */
static inline void catch_fatal(void (*try)(void *state), void *state, char text[FATAL_TEXT])
{
    int ends[2], status;
    assert_int_equal(pipe(ends), 0);
    pid_t child = fork();
    if (child == 0) {
        dup2(ends[1], STDERR_FILENO);
        try(state);
        _exit(0);
    }
    close(ends[1]);
    /* It comes in pieces. */
    FILE *said = fdopen(ends[0], "r");
    size_t bytes = fread(text, 1, FATAL_TEXT - 1, said);
    text[bytes] = '\0';
    fclose(said);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 1);
}

/* It says nothing but this. */
static inline void assert_fatal(void (*try)(void *state), void *state, const char *expected)
{
    char text[FATAL_TEXT];
    catch_fatal(try, state, text);
    assert_string_equal(text, expected);
}

#endif
