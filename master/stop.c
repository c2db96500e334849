#include "master/stop.h"

#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "common/clock.h"
#include "common/nap.h"

/* Seconds. Exiting takes milliseconds; on a node that pages heavily, or with hundreds of ranks, some seconds. */
#define LONGEST_END 5

/* Milliseconds. A signal that comes sooner after the first one counts as the same: timeout(1) signals the
 * process and then the process's group. Nobody presses a key twice in that time. */
#define SAME_SIGNAL 100

static atomic_int noted;
static atomic_llong noted_at; /* milliseconds() at the first signal; 0: there was none */
static atomic_bool is_served;
static volatile sig_atomic_t final_status;
static const char *_Atomic useless; /* a file to remove; NULL: none */
static int launcher = -1;           /* file descriptor of the pipe to Hydra; -1: there is none */

/* clock_wall() in milliseconds, but never 0. Async-signal-safe. */
static long long milliseconds(void)
{
    return 1 + (long long)(1e3 * clock_wall());
}

static void act(int number, void (*handler)(int), int flags)
{
    struct sigaction action = {.sa_flags = SA_RESTART | flags};
    action.sa_handler = handler;
    sigaction(number, &action, NULL);
}

/* The same for all signals that end a run in order. */
static void act_on_stops(void (*handler)(int))
{
    act(SIGINT, handler, 0);
    act(SIGTERM, handler, 0);
    act(SIGUSR1, handler, 0);
}

static void remove_useless(void)
{
    const char *path = useless;
    if (path) (void)unlink(path);
}

static void note_signal(int number)
{
    static const char message[] = "farm: stopped before rendering had begun: nothing is lost; the "
                                  "same command begins again\n";
    long long now = milliseconds(), first = 0;
    if (!atomic_compare_exchange_strong(&noted_at, &first, now)) {
        if (now - first < SAME_SIGNAL) return;
        act(number, SIG_DFL, 0);
        /* When a signal ends a rank and mpiexec has received that signal, too, mpiexec often returns 0 (MPICH
         * 4.0.2). */
        if (launcher >= 0) stop_job(128 + number, NULL);
        raise(number); /* acts when this handler returns */
        return;
    }
    if (is_served) {
        noted = number;
        return;
    }
    ssize_t unused = write(STDERR_FILENO, message, sizeof message - 1);
    (void)unused;
    remove_useless();
    stop_job(STATUS_RESUMABLE, NULL); /* nothing is lost: the same command begins again */
}

/* Finds the pipe to Hydra: PMI 1 over a file descriptor. */
static void find_launcher_pipe(void)
{
    const char *line = getenv("PMI_FD");
    if (line && getenv("HYDI_CONTROL_FD")) launcher = (int)strtol(line, NULL, 10);
}

void stop_ignore_file_limit(void)
{
    act(SIGXFSZ, SIG_IGN, 0);
}

static void mask_usr1(int how)
{
    sigset_t usr1;
    sigemptyset(&usr1);
    sigaddset(&usr1, SIGUSR1);
    pthread_sigmask(how, &usr1, NULL);
}

void stop_hold_signal(void)
{
    mask_usr1(SIG_BLOCK);
}

void stop_install(int rank)
{
    find_launcher_pipe();
    act_on_stops(rank == 0 ? note_signal : SIG_IGN);
    /* A terminal or the reader of a pipe may go away. UCX would otherwise make a hangup a matter for its
     * debugger. */
    act(SIGHUP, SIG_IGN, 0);
    act(SIGPIPE, SIG_IGN, 0);
    mask_usr1(SIG_UNBLOCK);
}

void stop_defer(void)
{
    is_served = true;
}

void stop_removes(const char *path)
{
    useless = path;
}

const atomic_int *stop_signal(void)
{
    return &noted;
}

const char *signal_name(int number)
{
    if (number == SIGINT) return "Ctrl-C (SIGINT)";
    return number == SIGTERM ? "SIGTERM" : "SIGUSR1";
}

/* Writes a line of text without stdio, which a signal may have interrupted. */
static void say(int out, const char *text, unsigned number, const char *rest)
{
    char line[256], digits[12];
    size_t length = 0, first = sizeof digits;
    do
        digits[--first] = (char)('0' + number % 10);
    while (number /= 10);
    const char *parts[] = {text, digits + first, rest};
    size_t lengths[] = {strlen(text), sizeof digits - first, strlen(rest)};
    for (int i = 0; i < 3; i++) {
        memcpy(line + length, parts[i], lengths[i]);
        length += lengths[i];
    }
    ssize_t unused = write(out, line, length);
    (void)unused;
}

bool stop_has_launcher(void)
{
    return launcher >= 0;
}

/* The last messages are on their way through another pipe, which the launcher does not empty once it has been
 * told to end. So it is told only after a quarter of a second: many time slices even for a launcher that shares
 * its core with ten others, and little compared with the run. */
static const struct timespec last_words = {.tv_nsec = 250000000};

void stop_job(int status, void (*end)(int status))
{
    if (launcher >= 0) {
        (void)nanosleep(&last_words, NULL);
        say(launcher, "cmd=abort exitcode=", (unsigned)status, "\n");
        sleep(LONGEST_END); /* to be ended */
    } else if (end) {
        end(status);
    }
    _exit(status);
}

static void leave(int number)
{
    (void)number;
    stop_job(final_status, NULL);
}

/* ---- the start ---- */

static volatile sig_atomic_t start_limit;

static void give_up_the_start(int number)
{
    (void)number;
    say(STDERR_FILENO, "farm: not all processes have come to the start within ",
        (unsigned)start_limit,
        " s: one is stopped or hangs. Nothing is lost, the same command begins again\n");
    remove_useless();
    stop_job(STATUS_RESUMABLE, NULL);
}

void stop_watch_the_start(unsigned seconds)
{
    find_launcher_pipe();
    start_limit = (sig_atomic_t)seconds;
    act(SIGALRM, give_up_the_start, (int)SA_RESETHAND);
    alarm(seconds);
}

void stop_unwatch_the_start(void)
{
    alarm(0);
}

void stop_watch_the_end(int status)
{
    final_status = status;
    act_on_stops(SIG_IGN);
    act(SIGALRM, leave, (int)SA_RESETHAND);
    alarm(LONGEST_END);
}

/* ---- the other ranks ---- */

/* Whether the process runs this program: its id may have been reused. */
static bool is_ours(int process)
{
    char path[64];
    struct stat own, other;
    snprintf(path, sizeof path, "/proc/%d/exe", process);
    return stat("/proc/self/exe", &own) == 0 && stat(path, &other) == 0 &&
           own.st_dev == other.st_dev && own.st_ino == other.st_ino;
}

/* The state in /proc/PID/stat: R, S, D, T (stopped), Z (zombie); 0: there is no such process. */
static char state_of(int process)
{
    char path[64], text[256], state = 0;
    snprintf(path, sizeof path, "/proc/%d/stat", process);
    FILE *file = fopen(path, "r");
    if (!file) return 0;
    size_t length = fread(text, 1, sizeof text - 1, file);
    text[length] = '\0';
    const char *name_end = strrchr(text, ')');
    if (name_end && name_end[1] == ' ') state = name_end[2];
    fclose(file);
    return state;
}

/* Whether the process has not exited yet; continues it if it is stopped. */
static bool lingers(int process)
{
    char state = state_of(process);
    if (process == (int)getpid() || state == 0 || state == 'Z' || state == 'X') return false;
    if (!is_ours(process)) return false;
    if (state == 'T') kill(process, SIGCONT);
    return true;
}

void stop_wait_for_exits(const int *processes, int count)
{
    double until = clock_wall() + LONGEST_END;
    for (int i = 0; i < count; i++) {
        struct nap nap = {0};
        while (lingers(processes[i]) && clock_wall() < until)
            nap_take(&nap);
    }
}
