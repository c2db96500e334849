/* The kinds of INI section that make up a scene. */
#ifndef FARM_MASTER_SCENE_SECTIONS_H
#define FARM_MASTER_SCENE_SECTIONS_H

#include "common/key.h"

struct section_kind {
    const char *name;
    const struct key *keys;
    size_t count;
};

/* The i-th kind, NULL behind the last. */
const struct section_kind *scene_section_kind(size_t i);

#endif
