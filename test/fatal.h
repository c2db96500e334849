/* Tests of code that ends the job: it runs in a child process. */
#ifndef FARM_TEST_FATAL_H
#define FARM_TEST_FATAL_H

#include <stdio.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test/unit.h"

/* Asserts that try(state) ends the process with status 1, and prints exactly `expected` on stderr, at most 255
 * bytes. */
static inline void assert_fatal(void (*try)(void *state), void *state, const char *expected)
{
    int ends[2], status;
    char text[256] = "";
    assert_int_equal(pipe(ends), 0);
    pid_t child = fork();
    if (child == 0) {
        dup2(ends[1], STDERR_FILENO);
        try(state);
        _exit(0);
    }
    close(ends[1]);
    /* A stream, as a single read() may return only a part of the text. */
    FILE *said = fdopen(ends[0], "r");
    size_t bytes = fread(text, 1, sizeof text - 1, said);
    text[bytes] = '\0';
    fclose(said);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 1);
    assert_string_equal(text, expected);
}

#endif
