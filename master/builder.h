/*
 * A scene under construction on rank 0: growing arrays that become one scene block in the end.
 *
 * Functions that add check the values (finite, in range, not degenerate) and return NULL, or a constant text "what is
 * wrong, what was expected" that the loader reports with file and line.
 */
#ifndef FARM_MASTER_BUILDER_H
#define FARM_MASTER_BUILDER_H

#include "common/scene.h"
#include "master/duplicates.h"

struct builder;

struct builder *builder_create(void);
void builder_destroy(struct builder *builder); /* NULL is allowed */

/* Add an element; store its index in *index. */
const char *builder_add_material(struct builder *builder, const struct material *material,
                                 uint32_t *index);
const char *builder_add_vertex(struct builder *builder, struct vec3 point, uint32_t *index);
/* normal is normalised. */
const char *builder_add_normal(struct builder *builder, struct vec3 normal, uint32_t *index);

const char *builder_add_light(struct builder *builder, const struct light *light);

/* Indices must come from this builder (asserted). Normals of planes and discs are normalised. */
const char *builder_add_sphere(struct builder *builder, const struct sphere *sphere);
const char *builder_add_plane(struct builder *builder, const struct plane *plane);
const char *builder_add_disc(struct builder *builder, const struct disc *disc);
const char *builder_add_box(struct builder *builder, const struct box *box);
const char *builder_add_cone(struct builder *builder, const struct cone *cone);
const char *builder_add_patch(struct builder *builder, const struct patch *patch);
/* A triangle without area is accepted, as meshes have them, and is never hit. */
const char *builder_add_triangle(struct builder *builder, const struct triangle *triangle);

uint32_t builder_vertex_count(const struct builder *builder);
struct vec3 builder_vertex(const struct builder *builder, uint32_t index);
uint32_t builder_light_count(const struct builder *builder);

/* Number of primitives of all kinds. */
uint64_t builder_primitive_count(const struct builder *builder);

/* Number of primitives of one kind, and an array of them, valid until the next one is added. */
uint32_t builder_kind_count(const struct builder *builder, enum primitive_kind kind);
const void *builder_items(const struct builder *builder, enum primitive_kind kind);

/* Coincident primitives of one kind that transmit light (master/duplicates.h), by their numbers in the order in which
 * they were added. */
struct coincidences builder_coincidences(const struct builder *builder, enum primitive_kind kind);

/*
 * Returns the finished block; the caller frees it. It has no materials that nothing uses; with VARIANT_AUTO it has
 * neither primitives that are never seen, nor vertices and normals that no primitive uses, nor lights that light
 * nothing. view is copied and must be valid. The builder is emptied meanwhile, so that no second copy of a large mesh
 * is held.
 */
struct scene *builder_finish(struct builder *builder, const struct view *view);

#endif
