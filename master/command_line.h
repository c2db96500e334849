/* Makes the command that continues a run, for the user to copy. */
#ifndef FARM_MASTER_COMMAND_LINE_H
#define FARM_MASTER_COMMAND_LINE_H

/*
 * The program's arguments (NULL-terminated) as one line: quoted for a shell where they need it, without control
 * characters other than newlines, after "mpiexec -n N" if there is more than one process. extra: a further argument at
 * the end, or NULL. The caller frees the text.
 */
char *command_line(char *const *arguments, int processes, const char *extra);

#endif
