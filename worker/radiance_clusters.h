/* Divides the primitives of a scene into the clusters from which worker/radiance.c makes its groups. */
#ifndef FARM_WORKER_RADIANCE_CLUSTERS_H
#define FARM_WORKER_RADIANCE_CLUSTERS_H

#include <stdbool.h>
#include <stdint.h>

#include "common/scene.h"
#include "worker/bounds.h"

/*
 * Kinds of surface by the share of light that they pass on from reflected and refracted rays. Each kind has
 * groups of its own, if it occurs.
 */
enum passing { PASSES_NOTHING, PASSES_LESS, PASSES_ALL, PASSINGS };

/* The share of light that a surface passes on from its reflected and its refracted ray together. It is the same with
 * total internal reflection, where the mirror ray gets both shares. */
static inline struct vec3 passed_by(const struct material *m)
{
    return vec3(m->reflection + m->transmission * m->color.x,
                m->reflection + m->transmission * m->color.y,
                m->reflection + m->transmission * m->color.z);
}

/* The bounded or the unbounded primitives whose surfaces are of one kind; *count: how many. Duplicates do not count, so
 * that pruning is the same whether they are left out or not. The caller frees the array. */
uint32_t *radiance_ids(const struct scene *scene, enum passing passing, bool bounded,
                       uint32_t *count);

/* The ids first .. first + count - 1 of a table, and the box around their primitives. */
struct radiance_cluster {
    uint32_t first, count;
    struct bounds box;
};

/* Divides all `count` ids, of which there must be one, into at most `most` clusters, 1 to RADIANCE_GROUPS, and splits
 * the longest one first. The ids are reordered. Returns the number of clusters. */
uint32_t radiance_clusters(const struct scene *scene, uint32_t *ids, uint32_t count,
                           struct radiance_cluster *clusters, uint32_t most);

#endif
