/* The tiles of a later pass of adaptive sampling. */
#ifndef FARM_MASTER_PASS_TILES_H
#define FARM_MASTER_PASS_TILES_H

#include "master/adaptive.h"
#include "master/queue.h"

/* Adds all tiles to the queue in which the present pass of `adaptive` asks for samples; it must not be pass 0. Those
 * that are expected to remove most error per second have the highest priority. `adaptive` must stay valid as long as
 * the queue hands out tiles: it tells how their work is spread. */
void pass_tiles_add(struct queue *queue, struct adaptive *adaptive);

#endif
