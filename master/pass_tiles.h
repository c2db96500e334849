/* The tiles of a later pass of adaptive sampling. */
#ifndef FARM_MASTER_PASS_TILES_H
#define FARM_MASTER_PASS_TILES_H

#include "master/adaptive.h"
#include "master/queue.h"

/* Adds all tiles to the queue in which the present pass of `adaptive` asks for samples; it must not be pass 0. Those
 * that are expected to remove most error per second have the highest priority. min_samples: of a pixel in pass 0. */
void pass_tiles_add(struct queue *queue, struct adaptive *adaptive, uint32_t min_samples);

/* Lets the queue know how the work of such tiles is spread over their pixels. adaptive must stay valid as long as the
 * queue hands out tiles. */
void pass_tiles_tell_work(struct queue *queue, const struct adaptive *adaptive);

#endif
