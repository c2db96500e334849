/* The materials of Wavefront MTL files: what an OBJ's usemtl can name. */
#ifndef FARM_MASTER_LOAD_MTL_H
#define FARM_MASTER_LOAD_MTL_H

#include <stdbool.h>

#include "common/scene.h"
#include "master/nearest_name.h"

#define MATERIAL_NAME_SIZE 1024 /* bytes; the rest of a longer name is not looked at */

struct material_library;
struct material_library *material_library_create(void);
void material_library_destroy(struct material_library *library);

/* Reads an MTL file; false, after saying so, when it holds mistakes. */
bool material_library_read(struct material_library *library, const char *path);

const struct material *material_library_find(const struct material_library *library,
                                             const char *name);

/* Its names as candidates, which live as long as it is not read into. */
void material_library_try(const struct material_library *library, struct nearest_name *search);

#endif
