/*
 * Japanese stone lanterns (toro). Two styles:
 *
 *   kasuga  tall: base (kiso) with turned-down lotus petals, round shaft (sao) with rings, platform
 *           (chudai) on turned-up petals, hexagonal fire box (hibukuro), roof (kasa) with scrolls
 *           (warabide) at its corners, jewel (hoju)
 *   yukimi  low, "for looking at snow": the fire box on a slab with curved legs under a wide roof
 *
 * Materials used: granite, granite_light, granite_dark (mottled), moss, pane (the windows), jewel, brass (rings, lamp),
 * lattice, flame. The panes and the jewel are closed meshes and can be refractive.
 */
#ifndef FARM_CONFIG_MODELS_LANTERN_H
#define FARM_CONFIG_MODELS_LANTERN_H

#include "config/models/mesh.h"

enum lantern_style { LANTERN_KASUGA, LANTERN_YUKIMI };

struct lantern {
    enum lantern_style style;
    double detail;     /* 0.85: some 250,000 triangles; their number grows with its square */
    double roof_width; /* factor; 1: the usual width */
    double moss;       /* 0: none, 1: all over the upper sides */
    bool lamp;         /* panes, lattices, lamp and flame in the fire box */
    bool glass_jewel;  /* else the jewel is of stone */
    uint32_t seed;     /* of the grain of the stone */
};

/* The lantern of config/lantern.ini, in this style. */
struct lantern lantern_default(enum lantern_style style);

/* Adds the lantern, its foot on y = 0 about the origin, some 2.4 m (yukimi: 1.4 m) high, moved by
 * t. A face with an arched window looks along z. */
void lantern_add(struct mesh *mesh, const struct lantern *lantern, const struct mesh_transform *t);

#endif
