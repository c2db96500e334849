/* A renderer's side of the farm: MPI is called here, in hear.c, send.c, node.c, node_scene.c and collective.c,
 * and nowhere else in worker/. */
#ifndef FARM_WORKER_WORK_H
#define FARM_WORKER_WORK_H

#include <mpi.h>

struct node_scene;
struct renderer;

/*
 * Renders tiles for the master until it says stop. Rank 0 is inside serve() meanwhile, every other
 * rank in here; renderer as for renderer_task().
 */
void work(MPI_Comm comm, struct renderer *renderer, const struct node_scene *shared);

#endif
