/*
 * Shared by the loaders of all file formats: what they load into, and the parts that a scene is made of. A part is a
 * file with a placement. An included part is placed within the part that includes it, and can use its materials.
 */
#ifndef FARM_MASTER_LOADER_H
#define FARM_MASTER_LOADER_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "master/builder.h"
#include "master/ini_source.h"
#include "master/load.h"
#include "master/nearest_name.h"
#include "master/placement.h"
#include "master/settings.h"

/* Largest OBJ, MTL or NFF file. */
#define SCENE_MAX_BYTES ((size_t)64 << 30)

/* Where a value was set; file NULL: nowhere, it is the default. */
struct origin {
    const char *file;
    long line; /* 0 for an argument */
};

/* A file that the scene is read from. Device and inode identify it, as links may give it other names. */
struct source {
    const char *path;
    dev_t device;
    ino_t inode;
};

/* A section that has been loaded. Its primitives are those from the end of the section before it to its own end. */
struct loaded_section {
    const char *file;
    long line;                     /* 0: the section stands for CONFIG, which is a scene file */
    uint32_t end[PRIMITIVE_KINDS]; /* primitives of each kind that the builder had after it */
};

struct loader {
    const char *config; /* its path, for messages */
    struct builder *builder;
    struct settings *settings;
    enum reach reach;
    struct origin origins[SETTINGS_KEYS];
    bool background_set;       /* by any of its keys, or by an NFF file */
    bool has_default_material; /* default_material is in the builder */
    uint32_t default_material;
    uint32_t include_count; /* files included so far */
    /* A section for each material of an MTL file of which arguments have set keys. The sections are the job's. */
    struct ini amended;
    struct source *sources; /* owned */
    size_t source_count;
    struct loaded_section *sections; /* in the order of loading; owned */
    size_t section_count;
    char **paths; /* of files that origins and sources name; owned */
    size_t path_count;
};

struct named_material {
    char *name; /* owned */
    uint32_t index;
};

/* The key of a section that places a part or a mesh, and where it is set; key NULL: there is none. */
struct placed {
    const char *key;
    struct ini_place place;
};

struct part {
    struct loader *loader;
    const struct part *outer; /* NULL: CONFIG itself */
    const char *path;         /* for messages */
    char *real_path;          /* resolved, to recognise a file that includes itself; owned */
    char *root;               /* resolved folder that files it names have to lie in; owned */
    struct placement placement;
    struct placed placed;
    struct named_material *materials; /* sorted by name; owned */
    size_t material_count;
};

/* Why an object is refused, with the key that places it, as the object's own file may be right. The caller frees it. */
char *why_placed(const char *why, const struct placed *placed);

/* Whether a part or mesh with this root (as of struct part) may read the file. */
bool may_read(const struct loader *loader, const char *path, const char *root);

/* printf() format of the message about a file that may not be read; arguments: its path and the root. */
#define LIES_OUTSIDE                                                                               \
    "'%s' lies outside of the scene's folder %s, expected a file in it "                           \
    "(farm --allow-outside reads any)"

/* The folder that path lies in, resolved; the caller frees it. */
char *root_of(const char *path);

/* The index of a key in settings_keys. A key that does not exist is a fatal error. */
size_t setting_index(const char *section, const char *name);

/* Where a setting was set; file NULL: nowhere. */
const struct origin *setting_origin(const struct loader *loader, const char *section,
                                    const char *name);

bool setting_is_set(const struct loader *loader, const char *section, const char *name);

/* Reads the settings sections of CONFIG; false after reporting an error. */
bool read_settings(struct loader *loader, const struct ini *ini);

/* Applies the arguments "section.key=value" in their order, to settings or to the scene sections of the document. false
 * after reporting an error. */
bool apply_overrides(struct loader *loader, struct ini *ini, char *const *overrides, size_t count);

/* Checks all settings against each other, including the names of outputs. false after reporting an error. */
bool check_settings(const struct loader *loader);

/* Returns a copy of path that is valid until loader_free(). */
const char *keep_path(struct loader *loader, const char *path);

/* Notes that the scene is read from this file, so that no output may replace it. */
void note_source(struct loader *loader, const char *path);

/* Frees what the loader owns, which settings and builder are not. */
void loader_free(struct loader *loader);

/* The index of the material of objects that name none; it is added to the builder when first asked for. */
uint32_t default_material(struct loader *loader);

/* Looks for a material in the part, then in the parts that include it; false: there is none. */
bool find_material(const struct part *part, const char *name, uint32_t *index);

/* Passes the names of all materials that find_material() can find to nearest_name_try(). */
void try_materials(const struct part *part, struct nearest_name *search);

/* Warn of a material whose reflection and transmission exceed 1 together, or whose color exceeds 1. Return whether it
 * is such a one. others: the end of the message, "" or what it says of other materials. */
bool warn_of_gain(const struct material *material, const char *file, long line, const char *others);
bool warn_of_bright_color(const struct material *material, const char *file, long line,
                          const char *others);

/* Applies what arguments have set of a material of an MTL file: the section that holds these keys gets the other keys
 * from the material, which is then read from the section. false after reporting an error. */
bool amend_material(const struct loader *loader, const char *name, struct material *material);

/* An OBJ file and how it is loaded. */
struct mesh {
    const char *path;
    const char *root; /* as of struct part */
    struct placement placement;
    struct placed placed;
    uint32_t material; /* of faces for which the file names none that is known */
    double crease;     /* degrees; 0: flat, whatever the file says; < 0: the file's normals alone */
};
#define CREASE_OF_FILE (-1.0)

/* Loads the faces of an OBJ file and the materials that it names; false after reporting an error. */
bool load_obj(const struct part *part, const struct mesh *mesh);

/* Loads objects, lights, and (where nothing else sets them) view and background from an NFF file; false after reporting
 * an error. */
bool load_nff(const struct part *part);

/* Loads the scene sections of an INI document; those of settings are skipped in CONFIG and refused elsewhere. */
bool load_scene_sections(struct part *part, const struct ini *ini);

/* Whether an INI section of this kind holds settings. */
bool is_settings_section(const char *kind);

/* The end of the message about an unknown section: which one may have been meant. The caller frees it. */
char *section_hint(const char *kind);

/* Frees what the part owns. */
void part_free(struct part *part);

#endif
