/* Shared by the files of the INI loader: load_ini.c, load_materials.c and load_objects.c. */
#ifndef FARM_MASTER_LOAD_OBJECTS_H
#define FARM_MASTER_LOAD_OBJECTS_H

#include "master/loader.h"
#include "master/scene_sections.h"

/* The section being loaded. */
struct reading {
    struct part *part;     /* that it becomes a piece of */
    const struct ini *ini; /* that it stands in */
    const struct ini_section *section;
};

/* Reports an error, `why`, at the line of the key, or of the section if it has no such key. Always returns false. */
bool refuse_section_key(const struct reading *at, const char *key, const char *why);

/* Reports an error that the builder has returned in `why`. Returns whether there was none (NULL). */
bool accept_section(const struct reading *at, const char *why);

/* Sets *index to that of the material that an object names, or of the default one; false after reporting that no
 * material has this name. */
bool resolve_material(const struct reading *at, const struct object *object, uint32_t *index);

/* Loads all materials of a file, before its objects, so that a material may be defined after its use. */
bool load_materials(struct part *part, const struct ini *ini);

/* Each adds the section to the scene, placed as the part is. data: the section's structure of scene_sections.h, which
 * has been read. false after reporting an error. */
bool load_light(const struct reading *at, void *data);
bool load_sphere(const struct reading *at, void *data);
bool load_plane(const struct reading *at, void *data);
bool load_disc(const struct reading *at, void *data);
bool load_triangle(const struct reading *at, void *data);
bool load_box(const struct reading *at, void *data);
bool load_cylinder(const struct reading *at, void *data);
bool load_cone(const struct reading *at, void *data);

#endif
