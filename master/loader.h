/*
 * Between the loaders of the file formats: what they load into, and the parts a scene is made of.
 * A part is a file with a placement; an included part lies in the one that includes it and sees its
 * materials.
 */
#ifndef FARM_MASTER_LOADER_H
#define FARM_MASTER_LOADER_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "common/settings.h"
#include "master/builder.h"
#include "master/ini_source.h"
#include "master/load.h"
#include "master/nearest_name.h"
#include "master/placement.h"

/* Scene files may be large, but not larger than this. */
#define SCENE_MAX_BYTES   ((size_t)64 << 30)
#define INCLUDE_MAX_DEPTH 16
/* Files that include each other twice and more make their number grow with the power of the depth.
 */
#define INCLUDE_MAX_COUNT 65536

/* Where a value was set; file NULL: nowhere, it is the default. */
struct origin {
    const char *file;
    long line; /* 0 for an argument */
};

/* A file that the scene is read from, told by what it is, not by its name: links lead to it, too. */
struct source {
    const char *path;
    dev_t device;
    ino_t inode;
};

/* A section that has been put into the scene: all primitives up to these counts that earlier ones have not. */
struct loaded_section {
    const char *file;
    long line; /* 0: of an argument, or CONFIG is the file itself */
    uint32_t end[PRIMITIVE_KINDS];
};

struct loader {
    struct builder *builder;
    struct settings *settings;
    enum reach reach;
    struct origin origins[SETTINGS_KEYS];
    bool background_set;       /* by any of its keys, or by an NFF file */
    bool has_default_material; /* default_material is in the builder */
    uint32_t default_material;
    uint32_t include_count; /* files included so far */
    /* Materials of MTL files, with what arguments have set of them; the job's. */
    struct ini amended;
    struct source *sources; /* owned */
    size_t source_count;
    struct loaded_section *sections; /* in the order that they were loaded in; owned */
    size_t section_count;
    char **paths; /* of files that origins and sources name; owned */
    size_t path_count;
};

struct named_material {
    char *name; /* owned */
    uint32_t index;
};

struct part {
    struct loader *loader;
    const struct part *outer; /* NULL: CONFIG itself */
    const char *path;         /* for messages */
    char *real_path;          /* resolved, to know a file again; owned */
    char *root;               /* resolved folder that what it names has to lie in; owned */
    struct placement placement;
    struct named_material *materials; /* sorted by name; owned */
    size_t material_count;
};

/* Whether the part or mesh may read path; root as of a part. */
bool may_read(const struct loader *loader, const char *path, const char *root);

/* The end of a message about a file that may not be read: takes the file and the root. */
#define LIES_OUTSIDE                                                                               \
    "'%s' lies outside of the scene's folder %s, expected a file in it "                           \
    "(farm --allow-outside reads any)"

/* The folder that path lies in, resolved; the caller frees it. */
char *root_of(const char *path);

/* The index of a key in settings_keys; a key that does not exist ends the job. */
size_t setting_index(const char *section, const char *name);

/* Where a setting was set; file NULL: nowhere. */
const struct origin *setting_origin(const struct loader *loader, const char *section,
                                    const char *name);

bool setting_is_set(const struct loader *loader, const char *section, const char *name);

/* Reads the settings sections of CONFIG; false after saying so when one is wrong. */
bool read_settings(struct loader *loader, const struct ini *ini);

/* The arguments "section.key=value", in their order: settings, or entries of the document's scene
 * sections. */
bool apply_overrides(struct loader *loader, struct ini *ini, char *const *overrides, size_t count);

/* Of all settings, names of outputs included, what has to fit together; config is for messages. */
bool check_settings(const struct loader *loader, const char *config);

/* Keeps a copy of path until the loader ends. */
const char *keep_path(struct loader *loader, const char *path);

/* The scene is read from this file: no output may take its place. */
void note_source(struct loader *loader, const char *path);

/* Frees what the loader owns; settings and builder are others'. */
void loader_free(struct loader *loader);

/* For objects without a material. */
uint32_t default_material(struct loader *loader);

/* Looks in the part and those around it. */
bool find_material(const struct part *part, const char *name, uint32_t *index);

/* The names of all that it finds as candidates. */
void try_materials(const struct part *part, struct nearest_name *search);

/* Tell of a material that gives off more light than it gets; whether it is one. */
bool warn_of_gain(const struct material *material, const char *file, long line);
bool warn_of_bright_color(const struct material *material, const char *file, long line);

/* A material of an MTL file, of which arguments may have set some keys: their section gets the others, and is
 * what the material is read from. false after saying what is wrong. */
bool amend_material(const struct loader *loader, const char *name, struct material *material);

/* A mesh in an OBJ file. */
struct mesh {
    const char *path;
    const char *root; /* as of a part */
    struct placement placement;
    uint32_t material; /* where the file names none that is known */
    double crease;     /* degrees; 0: flat always; < 0: as the file says */
};
#define CREASE_OF_FILE (-1.0)

bool load_obj(const struct part *part, const struct mesh *mesh);

/* Objects, lights, and (where nothing else sets them) view and background. */
bool load_nff(const struct part *part);

/* The scene sections of an INI document whose settings are dealt with. */
bool load_scene_sections(struct part *part, const struct ini *ini);

/* Whether an INI section of this kind is part of a scene, or holds settings. */
bool is_scene_section(const char *kind);
bool is_settings_section(const char *kind);

/* The end of a message about a section of neither kind: what may have been meant. The caller frees
 * it. */
char *section_hint(const char *kind);

/* Frees what the part owns. */
void part_free(struct part *part);

#endif
