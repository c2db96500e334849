/* The text of --help. */
#ifndef FARM_MASTER_HELP_H
#define FARM_MASTER_HELP_H

#include <stdio.h>

/* In lines of at most so many columns, where that leaves room for what keys mean beside their names; 0: as long as they
 * are, for a pipe or a file. */
void print_help(FILE *out, int columns);

#endif
