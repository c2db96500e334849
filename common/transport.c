#include "common/transport.h"

#include <stdlib.h>

/* Ten thousand pixels, or half as many of adaptive sampling. From about 150 KB on what is sent eagerly took the receiver as long as what it
 * fetched, or longer, and it moves on only while both sides are in MPI. */
#define RENDEZVOUS_FROM "128k"

void transport_prefer_eager(void)
{
    setenv("UCX_RNDV_THRESH", RENDEZVOUS_FROM, 0);
}
