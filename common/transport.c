#include "common/transport.h"

#include <stdlib.h>

/* From 1 MB on: a lot of 32,768 pixels (master/queue_parts.h) has 0.9 MB when all of adaptive sampling's seven
 * floats travel. */
#define RENDEZVOUS_FROM "1m"

void transport_prefer_eager(void)
{
    setenv("UCX_RNDV_THRESH", RENDEZVOUS_FROM, 0);
}
