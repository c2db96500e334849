/*
 * A renderer's side of the farm. In worker/, MPI is called only by work.c, receive.c, send.c, node.c,
 * node_scene.c and collective.c.
 */
#ifndef FARM_WORKER_WORK_H
#define FARM_WORKER_WORK_H

struct node_scene;
struct renderer;

/*
 * Renders tiles for the master until it says STOP. Every rank but 0 calls this, while rank 0 is inside
 * serve(). renderer: as for renderer_task().
 */
void work(struct renderer *renderer, const struct node_scene *shared);

#endif
