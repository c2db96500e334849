/* Between the INI loader's files: a section with its place in the scene, materials and objects. */
#ifndef FARM_MASTER_LOAD_OBJECTS_H
#define FARM_MASTER_LOAD_OBJECTS_H

#include "master/loader.h"
#include "master/scene_sections.h"

/* A section on its way into the scene. */
struct reading {
    struct part *part;
    const struct ini *ini;
    const struct ini_section *section;
};

/* Says why, at the place of the key, or of the section where it has no such key; false always. */
bool refuse_section_key(const struct reading *at, const char *key, const char *why);

/* Tells of a builder's complaint, if it is one (NULL: none), and whether it is none. */
bool accept_object(const struct reading *at, const char *why);

/* The index of the material that an object names, or of the default one; false after saying that
 * there is none of this name. */
bool resolve_material(const struct reading *at, const struct object *object, uint32_t *index);

/* All materials of a file first, so that they may stand after their use. */
bool load_materials(struct part *part, const struct ini *ini);

/* Put the section, read into data (a structure of scene_sections.h), into the scene. */
bool load_light(const struct reading *at, void *data);
bool load_sphere(const struct reading *at, void *data);
bool load_plane(const struct reading *at, void *data);
bool load_disc(const struct reading *at, void *data);
bool load_triangle(const struct reading *at, void *data);
bool load_box(const struct reading *at, void *data);
bool load_cylinder(const struct reading *at, void *data);
bool load_cone(const struct reading *at, void *data);

#endif
