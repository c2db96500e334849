/*
 * The parts of the garden: the shape of its ground, and for each part a function that adds it to a mesh.
 *
 * x points to the right, y up and z towards the viewer, who stands at about (0, 1.8, 9) and looks along -z. Lengths are
 * in metres. The surface of the pond is at y = 0.
 */
#ifndef FARM_CONFIG_MODELS_GARDEN_H
#define FARM_CONFIG_MODELS_GARDEN_H

#include "config/models/mesh.h"

/* ---- the ground (terrain.c) ---- */

/* Approximate distance to the shore: > 0 on land, < 0 in the pond. */
double pond_distance(double x, double z);

/* The height of the ground; below 0 it is the bed of the pond. */
double ground_height(double x, double z);

/* The point of the ground at (x, z), lifted by up. */
struct vec3 ground_point(double x, double z, double up);

void add_ground(struct mesh *mesh);
void add_hills(struct mesh *mesh);

/* ---- water.c ---- */
void add_water(struct mesh *mesh);

/* ---- stones.c ---- */
void add_stones(struct mesh *mesh);
void add_pebbles(struct mesh *mesh);

/* ---- pine.c ---- */
void add_pine(struct mesh *mesh);

/* ---- trees.c ---- */
void add_maple(struct mesh *mesh);
void add_shrubs(struct mesh *mesh);
void add_forest(struct mesh *mesh);

/* ---- waterside.c ---- */
void add_irises(struct mesh *mesh);
void add_lilies(struct mesh *mesh);
void add_grass(struct mesh *mesh);

/* ---- bridge.c ---- */
void add_bridge(struct mesh *mesh);

/* ---- garden_lanterns.c ---- */
void add_lanterns(struct mesh *mesh);

/* ---- animals.c ---- */
void add_koi(struct mesh *mesh);
void add_geese(struct mesh *mesh);

#endif
