#include "master/stop.h"

#include <unistd.h>

/* Leaving takes milliseconds; a node that pages heavily, or hundreds of ranks, some seconds. */
#define LONGEST_END 5

static volatile sig_atomic_t noted;
static volatile sig_atomic_t is_served;
static volatile sig_atomic_t final_status;

static void note_signal(int number)
{
    static const char message[] = "farm: stopped before rendering had begun\n";
    noted = number;
    if (is_served) return;
    ssize_t unused = write(STDERR_FILENO, message, sizeof message - 1);
    (void)unused;
    _exit(75); /* nothing is lost: the same command begins again */
}

static void act(int number, void (*handler)(int))
{
    struct sigaction action = {.sa_flags = (int)(SA_RESETHAND | SA_RESTART)};
    action.sa_handler = handler;
    sigaction(number, &action, NULL);
}

void stop_install(int rank)
{
    act(SIGINT, rank == 0 ? note_signal : SIG_IGN);
    act(SIGTERM, rank == 0 ? note_signal : SIG_IGN);
    act(SIGUSR1, rank == 0 ? note_signal : SIG_IGN);
    /* A reader that goes away, or a file grown to its limit. */
    act(SIGPIPE, SIG_IGN);
    act(SIGXFSZ, SIG_IGN);
}

void stop_is_served(void)
{
    is_served = 1;
}

const volatile sig_atomic_t *stop_signal(void)
{
    return &noted;
}

static void leave(int number)
{
    (void)number;
    _exit(final_status);
}

void stop_watch_the_end(int status)
{
    final_status = status;
    act(SIGINT, SIG_DFL);
    act(SIGTERM, SIG_DFL);
    act(SIGUSR1, SIG_IGN);
    act(SIGALRM, leave);
    alarm(LONGEST_END);
}
