/*
 * A renderer's side of the farm. In worker/, MPI is called only by work.c, receive.c, send.c, node.c,
 * node_scene.c and collective.c.
 */
#ifndef FARM_WORKER_WORK_H
#define FARM_WORKER_WORK_H

#include <stdbool.h>

struct cpu_time;
struct node_scene;
struct refinement;
struct renderer;
struct result_header;
struct tile;

/*
 * Renders a valid tile, or probes it (TILE_PROBE), after cpu_time_begin(). Fills in what a result has of it
 * (common/protocol.h): its floats, aligned, and the header; start_s there is a time of clock_wall(). refinements: of
 * its pixels; NULL: it is not refined. false: it was given up, and counts as dropped.
 */
bool work_on_tile(struct renderer *renderer, const struct tile *tile,
                  const struct refinement *refinements, struct cpu_time *time, float *floats,
                  struct result_header *header);

/*
 * Renders tiles for the master until it says STOP. Every rank but 0 calls this, while rank 0 is inside
 * serve(). renderer: as for renderer_task().
 */
void work(struct renderer *renderer, const struct node_scene *shared);

#endif
