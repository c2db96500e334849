/* The text of --help. */
#ifndef FARM_MASTER_HELP_H
#define FARM_MASTER_HELP_H

#include <stdio.h>

/* Prints it in lines of at most `columns` characters, if that leaves room for texts beside the names of keys. columns
 * 0: lines are not broken, for a pipe or a file. */
void print_help(FILE *out, int columns);

#endif
