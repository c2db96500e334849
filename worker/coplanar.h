/* Whether two surfaces lie in one plane: whether rays meet them at the same distance. */
#ifndef FARM_WORKER_COPLANAR_H
#define FARM_WORKER_COPLANAR_H

#include <stdbool.h>
#include <stdint.h>

#include "common/scene.h"

/* Of two primitives, or those of their parts (as in struct hit) that are flat; without rounding. What
 * is round is in no plane. */
bool are_coplanar(const struct scene *scene, uint32_t a, uint32_t part_of_a, uint32_t b,
                  uint32_t part_of_b);

#endif
