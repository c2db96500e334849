/* The text of --help. */
#ifndef FARM_MASTER_HELP_H
#define FARM_MASTER_HELP_H

#include <stdio.h>

/* Prints it in lines of at most `columns` characters, but for examples, which can be copied. columns 0: they are not
 * known, for a pipe or a file. */
void print_help(FILE *out, int columns);

#endif
