/*
 * A scene under construction on rank 0: growing arrays that become one scene block.
 *
 * Adding checks the values (finite, in range, not degenerate) and returns NULL, or a constant text
 * "what is wrong, what was expected" that the loader prints with its file and line.
 */
#ifndef FARM_MASTER_BUILDER_H
#define FARM_MASTER_BUILDER_H

#include "common/scene.h"
#include "master/duplicates.h"

struct builder;

struct builder *builder_create(void);
void builder_destroy(struct builder *builder); /* NULL is allowed */

/* Stores the index of the new element in *index. */
const char *builder_add_material(struct builder *builder, const struct material *material,
                                 uint32_t *index);
const char *builder_add_vertex(struct builder *builder, struct vec3 point, uint32_t *index);
/* normal need not have unit length; it is normalised. */
const char *builder_add_normal(struct builder *builder, struct vec3 normal, uint32_t *index);

const char *builder_add_light(struct builder *builder, const struct light *light);

/* Indices must come from this builder (asserted). Normals of planes and discs are normalised. */
const char *builder_add_sphere(struct builder *builder, const struct sphere *sphere);
const char *builder_add_plane(struct builder *builder, const struct plane *plane);
const char *builder_add_disc(struct builder *builder, const struct disc *disc);
const char *builder_add_box(struct builder *builder, const struct box *box);
const char *builder_add_cone(struct builder *builder, const struct cone *cone);
const char *builder_add_patch(struct builder *builder, const struct patch *patch);
/* A triangle without area is accepted (meshes have them) and simply never hit. */
const char *builder_add_triangle(struct builder *builder, const struct triangle *triangle);

uint32_t builder_vertex_count(const struct builder *builder);
struct vec3 builder_vertex(const struct builder *builder, uint32_t index);
uint32_t builder_light_count(const struct builder *builder);

/* Of all kinds. */
uint64_t builder_primitive_count(const struct builder *builder);

/* Of one kind. */
uint32_t builder_kind_count(const struct builder *builder, enum primitive_kind kind);
/* Of one kind, by their numbers in the order that they were added in. */
struct doubles builder_doubles(const struct builder *builder, enum primitive_kind kind);

/*
 * How far all primitives but planes reach from a place in each of these directions, times the direction's length: the
 * most of the products (point - origin) * direction, into reach[count]. False when there are none. Infinite where a
 * primitive is as large as numbers go.
 */
bool builder_reach(const struct builder *builder, struct vec3 origin, unsigned count,
                   const struct vec3 *directions, double *reach);

/*
 * The axis-aligned box around all primitives but planes; false when there are none. Corners may be
 * infinite when a primitive is as large as numbers go.
 */
bool builder_bounds(const struct builder *builder, struct vec3 *min, struct vec3 *max);

/*
 * The finished block, without the materials that nothing uses, and by VARIANT_AUTO without primitives that are never
 * seen, corners that none has and lights that none shows (view is copied in, already valid); the caller frees it. The
 * builder is emptied as it goes, so that no second copy of a large mesh is held.
 */
struct scene *builder_finish(struct builder *builder, const struct view *view);

#endif
