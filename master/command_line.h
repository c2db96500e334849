/* The command that goes on with a run, for its user to copy. */
#ifndef FARM_MASTER_COMMAND_LINE_H
#define FARM_MASTER_COMMAND_LINE_H

/*
 * The program's arguments (NULL-terminated), quoted for a shell where they need it, without
 * control characters but newlines, behind
 * "mpiexec -n N" for more than one process, and with extra (may be NULL) as the last one. The caller
 * frees it.
 */
char *command_line(char *const *arguments, int processes, const char *extra);

#endif
