/*
 * Finds the terminal that output ends up on. Under mpiexec, stdout and stderr are pipes to mpiexec, which passes
 * on what arrives: the terminal that mpiexec's own stdout or stderr leads to then counts as ours. In all doubtful cases
 * (other launchers, another machine, redirected output) there is no terminal.
 */
#ifndef FARM_MASTER_TERMINAL_H
#define FARM_MASTER_TERMINAL_H

#include <stdbool.h>
#include <stdio.h>

/* A descriptor of that terminal, for terminal_width(); the caller closes it. -1: there is none. */
int terminal_open(FILE *out);

/* The number of columns, read anew at each call; 80 if the terminal does not know it. */
int terminal_width(int descriptor);

/* The number of columns of the terminal that `out` leads to, be it through mpiexec; 0: there is none. */
int terminal_columns(FILE *out);

/* Whether the terminal understands the sequences that move the cursor and erase. */
bool terminal_draws(void);

#endif
