/* Scenes in this process: loaded, moved, and with a tree. */
#ifndef FARM_BENCH_SCENES_H
#define FARM_BENCH_SCENES_H

#include "common/scene.h"
#include "master/load.h"
#include "worker/bvh.h"

/* Loads the scene of an .ini, .nff or .obj file; overrides as on the command line, ended by NULL. Returns NULL when it
 * cannot be loaded, with a message on stderr. Freed by free(). */
struct scene *scene_load(const char *path, const char *const *overrides, enum reach reach);

/* Multiplies all lengths of the scene, lights and eye included, and moves it by `by`, rounded. */
void scene_move(struct scene *scene, double factor, struct vec3 by);

/* The tree of a scene, built by one thread; freed by free(). */
struct bvh *scene_tree(const struct scene *scene);

#endif
