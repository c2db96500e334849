/*
 * Predicts what the parts of a later pass of adaptive sampling will take: the rays that the pass asks for in each part
 * of the picture, times the CPU seconds that a ray has taken there so far. Predictions decide who renders what, and
 * when; the picture does not depend on them.
 */
#ifndef FARM_MASTER_PASS_COST_H
#define FARM_MASTER_PASS_COST_H

#include <stddef.h>
#include <stdint.h>

#include "common/thread_pool.h"
#include "common/tile.h"
#include "master/statistics.h"

struct pass_cost;

/* Bytes of memory kept for each pixel, rounded up. */
size_t pass_cost_pixel_bytes(void);

/* For a picture of width x height pixels. Freed by pass_cost_destroy(), which accepts NULL. */
struct pass_cost *pass_cost_create(uint32_t width, uint32_t height);
void pass_cost_destroy(struct pass_cost *cost);

/* A tile (step 1) of the present pass has come in; it took so many CPU seconds, >= 0. */
void pass_cost_took(struct pass_cost *cost, const struct tile *tile, double seconds);

/* Predicts the pass that brings each pixel to its level in `next`. All pixels must have samples. The pool must be idle;
 * NULL: the caller works alone. */
void pass_cost_predict(struct pass_cost *cost, const struct statistics *statistics,
                       const uint8_t *next, struct thread_pool *pool);

/* The CPU seconds that the last predicted pass takes in this tile (step 1); 0: none, or nothing is predicted. Takes as
 * long for a tile of any size. */
double pass_cost_of(const struct pass_cost *cost, const struct tile *tile);

#endif
