#include "common/orphan.h"

#include <unistd.h>

#include "common/message.h"

static pid_t parent; /* 0: not known */

void orphan_watch(void)
{
    parent = getppid();
}

void orphan_leave(double silence, double patience)
{
    if (silence <= patience || parent == 0 || getppid() == parent) return;
    fatal("nothing has come for %.0f s, and what had started this rank is gone", silence);
}
