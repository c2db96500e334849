/*
 * The kinds of INI section that make up a scene: the structures that they are read into
 * (master/sections.h), and the keys of each.
 */
#ifndef FARM_MASTER_SCENE_SECTIONS_H
#define FARM_MASTER_SCENE_SECTIONS_H

#include <stddef.h>

#include "common/scene.h"
#include "master/key.h"

enum scene_section {
    SECTION_LIGHT,
    SECTION_MATERIAL,
    SECTION_SPHERE,
    SECTION_PLANE,
    SECTION_DISC,
    SECTION_TRIANGLE,
    SECTION_BOX,
    SECTION_CYLINDER,
    SECTION_CONE,
    SECTION_MESH,
    SECTION_INCLUDE,
    SCENE_SECTIONS
};

/* Objects begin with the name of their material, so that one function resolves it. */
struct object {
    char *material; /* NULL: the default */
};

struct sphere_section {
    struct object object;
    struct sphere sphere;
};

struct plane_section {
    struct object object;
    struct plane plane;
};

struct disc_section {
    struct object object;
    struct disc disc;
};

struct triangle_section {
    struct object object;
    struct vec3 corner[3];
};

struct box_section {
    struct object object;
    struct box box;
};

struct cylinder_section {
    struct object object;
    struct vec3 base, apex;
    double radius;
};

struct cone_section {
    struct object object;
    struct cone cone;
};

struct mesh_section {
    struct object object;
    char *file;
    struct vec3 translate, rotate;
    double scale, crease;
};

struct include_section {
    char *file;
    struct vec3 translate, rotate;
    double scale;
};

/* Large enough for what any section is read into. */
union section_data {
    struct light light;
    struct material material;
    struct sphere_section sphere;
    struct plane_section plane;
    struct disc_section disc;
    struct triangle_section triangle;
    struct box_section box;
    struct cylinder_section cylinder;
    struct cone_section cone;
    struct mesh_section mesh;
    struct include_section include;
};

struct section_kind {
    const char *name;
    const struct key *keys;
    size_t count;
};

/* The i-th kind; NULL after the last one. */
const struct section_kind *scene_section_kind(size_t i);

/* The kind of this name; SCENE_SECTIONS: there is none. */
enum scene_section scene_section_of(const char *name);

#endif
