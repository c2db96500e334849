/* How large tiles have to be for the master to keep up with them. */
#include "master/queue_parts.h"

/* A tile takes the master SERVICE_S at least, however short an answer is (service_tile_s in bench/balance_messages.c).
 * Work, the seconds of samples on their own, takes SCALE of that time within a tile: 0.24 to 0.73 in eleven scenes. */
#define SERVICE_S 0.24e-6
#define SCALE     0.45

double queue_served_work(const struct queue *queue, double part)
{
    double samples = larger(queue->config.samples, 1);
    return queue_processors(queue) * SERVICE_S / part / (samples * SCALE);
}
