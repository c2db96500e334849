#include "master/terminal.h"

#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

/*
 * The parent of a process if its name is that of a launcher, otherwise 0. /proc/PID/stat: "PID (NAME) STATE
 * PARENT ..."; the name, cut to 15 characters, may contain ')'.
 */
static long launcher_parent(long pid)
{
    char path[64], text[256];
    snprintf(path, sizeof path, "/proc/%ld/stat", pid);
    FILE *file = fopen(path, "re");
    if (!file) return 0;
    size_t bytes = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    text[bytes] = '\0';
    const char *name = strchr(text, '('), *end = strrchr(text, ')');
    if (!name || !end) return 0;
    name++;
    if (strncmp(name, "hydra_pmi_proxy", 15) && strncmp(name, "mpiexec", 7) &&
        strncmp(name, "mpirun", 6))
        return 0;
    return strlen(end) > 4 ? strtol(end + 4, NULL, 10) : 0;
}

/* The topmost launcher among our ancestors; 0: we were not started by one. */
static long find_launcher(void)
{
    long top = 0, pid = getppid();
    for (int height = 0; height < 16; height++) { /* proxy and mpiexec make two */
        long parent = launcher_parent(pid);
        if (parent <= 0) break;
        top = pid;
        pid = parent;
    }
    return top;
}

/* The terminal that a descriptor of the launcher leads to; -1: there is none. */
static int launcher_terminal(int number)
{
    struct stat file;
    char path[64];
    long launcher = find_launcher();
    if (!launcher) return -1;
    snprintf(path, sizeof path, "/proc/%ld/fd/%d", launcher, number);
    if (stat(path, &file) || !S_ISCHR(file.st_mode)) return -1;
    int descriptor = open(path, O_WRONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (descriptor >= 0 && !isatty(descriptor)) {
        close(descriptor);
        return -1;
    }
    return descriptor;
}

int terminal_open(FILE *out)
{
    struct stat file;
    int descriptor = fileno(out);
    if (descriptor < 0 || fstat(descriptor, &file)) return -1;
    if (isatty(descriptor)) return fcntl(descriptor, F_DUPFD_CLOEXEC, 0);
    /* Only a pipe can end at the launcher: "mpiexec sh -c 'farm ... 2>file'" does not. */
    if (!S_ISFIFO(file.st_mode) && !S_ISSOCK(file.st_mode)) return -1;
    if (!getenv("PMI_RANK") && !getenv("PMI_FD")) return -1;
    return launcher_terminal(descriptor == STDOUT_FILENO ? STDOUT_FILENO : STDERR_FILENO);
}

int terminal_width(int descriptor)
{
    struct winsize size;
    if (ioctl(descriptor, TIOCGWINSZ, &size) || size.ws_col == 0) return 80;
    return size.ws_col;
}

int terminal_columns(FILE *out)
{
    int descriptor = terminal_open(out);
    if (descriptor < 0) return 0;
    int columns = terminal_width(descriptor);
    close(descriptor);
    return columns;
}

bool terminal_draws(void)
{
    const char *kind = getenv("TERM");
    return kind && kind[0] && strcmp(kind, "dumb");
}
