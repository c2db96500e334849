/* Reads the materials of Wavefront MTL files, which an OBJ file's usemtl refers to by name. */
#ifndef FARM_MASTER_LOAD_MTL_H
#define FARM_MASTER_LOAD_MTL_H

#include <stdbool.h>

#include "common/scene.h"
#include "master/nearest_name.h"

#define MATERIAL_NAME_SIZE 1024 /* bytes with the NUL; the rest of a longer name is ignored */

struct material_library;
/* An empty one, to be freed with material_library_destroy(). */
struct material_library *material_library_create(void);
void material_library_destroy(struct material_library *library);

/* Adds the materials of an MTL file; false after reporting an error in it. */
bool material_library_read(struct material_library *library, const char *path);

/* The latest definition of a name, valid until the next file is read; NULL: there is none. */
const struct material *material_library_find(const struct material_library *library,
                                             const char *name);

/* Passes all its names to nearest_name_try(). They are valid until the next file is read. */
void material_library_try(const struct material_library *library, struct nearest_name *search);

#endif
