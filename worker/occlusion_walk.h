/* The tests of a shadow ray, one primitive at a time. */
#ifndef FARM_WORKER_OCCLUSION_WALK_H
#define FARM_WORKER_OCCLUSION_WALK_H

#include "worker/passages.h"
#include "worker/probe.h"

/*
 * What has blocked a ray, because it often blocks the neighbouring rays as well: a leaf of triangles, which
 * are tested fastest together, or a single other primitive. count 0: nothing.
 */
struct blocker {
    const struct bvh_leaf *leaves;
    uint32_t count;
    const struct bvh *bvh; /* the tree that contains them */
};

struct occlusion_walk {
    struct blocker *blocker;
    const struct bvh *bvh; /* the tree that is traversed */
    struct probe probe;
    struct reach reach;
    struct passages *passages;
    bool blocked;
};

/* Whether the ray ends at any crossing with this primitive. Without a list nothing is transparent. */
static INLINED bool is_opaque(const struct passages *passages, const struct bvh_leaf *leaf)
{
    return !passages || !leaf->transparent;
}

/* Records crossings of a primitive. Returns false, with blocked set, if it is opaque. */
static INLINED bool occlusion_by(struct occlusion_walk *walk, const struct bvh_leaf *leaf,
                                 unsigned crossings)
{
    walk->blocked = is_opaque(walk->passages, leaf);
    if (walk->blocked) return false;
    uint32_t material = primitive_material(walk->probe.scene, leaf->id);
    passages_add(walk->passages, material, leaf->id, crossings);
    return true;
}

static INLINED bool occlusion_of(struct occlusion_walk *walk, const struct crossings *found,
                                 const struct bvh_leaf *leaf)
{
    unsigned crossings = crossings_that_count(walk->probe.ray, found);
    return crossings == 0 || occlusion_by(walk, leaf, crossings);
}

static INLINED bool occlusion_primitive(struct occlusion_walk *walk, const struct bvh_leaf *leaf)
{
    struct crossings found = probe_crossings(&walk->probe, leaf->id);
    return occlusion_of(walk, &found, leaf);
}

static INLINED bool occlusion_triangle(struct occlusion_walk *walk, const struct bvh_leaf *leaf,
                                       bool certain)
{
    if (certain) return leaf->id == walk->probe.ray->from || occlusion_by(walk, leaf, 1);
    struct crossings found = probe_triangle(&walk->probe, leaf);
    return occlusion_of(walk, &found, leaf);
}

/* Tests the triangles of a leaf with `count` entries. */
static INLINED bool occlusion_triangles(struct occlusion_walk *walk, const struct bvh_leaf *leaves,
                                        uint32_t count, uint32_t triangles)
{
    for (uint32_t i = 0; i < triangles; i += LANES) {
        struct triangle_sets sets =
            probe_triangles(&walk->probe, leaves, count, triangles, i, &walk->reach);
        for (lane_set set = sets.maybe; set; set = without_lowest(set)) {
            unsigned lane = lowest_lane(set);
            if (!occlusion_triangle(walk, &leaves[i + lane], sets.certain >> lane & 1))
                return false;
        }
    }
    return true;
}

static INLINED bool occlusion_span(struct occlusion_walk *walk, const struct bvh_leaf *leaf)
{
    const struct probe *probe = &walk->probe;
    if (leaf->id == probe->ray->from) return occlusion_primitive(walk, leaf);
    struct spans_one span = spans_of_one(probe->scene, leaf->id, &probe->line);
    if (!may_be_crossed_one(&span, probe->ray->t_max)) return true;
    struct crossing_sets_one certain = crossing_sets_one(&span, probe->ray->t_max);
    if ((certain.once | certain.twice) &&
        has_usable_spans_ahead(probe->scene, leaf->id, probe->ray, first_crossing_one(&span).from))
        return occlusion_by(walk, leaf, certain.twice ? 2 : 1);
    return occlusion_primitive(walk, leaf);
}

/* Records what has blocked the ray, for the next one, and returns false to end the traversal. */
static INLINED bool end_at_blocker(struct occlusion_walk *walk, const struct bvh_leaf *leaves,
                                   uint32_t count)
{
    *walk->blocker = (struct blocker){leaves, count, walk->bvh};
    return false;
}

/* Tests the primitives of a leaf other than triangles. */
static INLINED bool occlusion_solids(struct occlusion_walk *walk, const struct bvh_leaf *leaves,
                                     uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        if (!(has_spans(leaves[i].id) ? occlusion_span(walk, &leaves[i])
                                      : occlusion_primitive(walk, &leaves[i])))
            return end_at_blocker(walk, &leaves[i], 1);
    return true;
}

/* Whether the blocker of the preceding ray blocks this one too, if that can be decided quickly. */
static INLINED bool occlusion_by_blocker(struct occlusion_walk *walk)
{
    const struct bvh_leaf *leaves = walk->blocker->leaves;
    const struct probe *probe = &walk->probe;
    uint32_t count = walk->blocker->count, triangles = triangles_of(leaves, count);
    if (triangles == 0) return has_spans(leaves->id) && !occlusion_span(walk, leaves);
    for (uint32_t i = 0; i < triangles; i += LANES) {
        lane_set others = first_lanes(triangles - i) & ~entries_of(leaves + i, probe->ray->from);
        struct triangle_sets sets = {others, 0};
        if (!sort_rough_triangles(bvh_corners(leaves, count), triangles, i, &probe->rough,
                                  &walk->reach, &sets))
            return false;
        for (lane_set set = sets.certain; set; set = without_lowest(set))
            if (is_opaque(walk->passages, &leaves[i + lowest_lane(set)])) return true;
    }
    return false;
}

static INLINED void occlusion_begin(struct occlusion_walk *walk, const struct scene *scene,
                                    const struct ray *ray, struct passages *passages,
                                    uint64_t *exact)
{
    probe_begin(&walk->probe, scene, ray, true, exact);
    if (has_triangles(scene)) walk->reach = reach_of(ray, &walk->probe.shear);
    walk->passages = passages;
    walk->blocked = false;
}

/* The number of times that the ray crosses a plane. A surface close to its start may have been passed. */
static INLINED unsigned plane_passages(const struct occlusion_walk *walk, uint32_t id)
{
    const struct probe *probe = &walk->probe;
    const struct ray *ray = probe->ray;
    if (id != ray->from) {
        struct plane_span_one span = plane_span_of_one(probe->scene, id, &probe->line);
        if (span.decided && (span.to < 0 || ray->t_max < span.from)) return 0;
        if (span.decided && start_reach(ray) < span.from && span.to < ray->t_max) return 1;
    }
    struct crossings found = probe_crossings(probe, id);
    return crossings_that_count(ray, &found);
}

/* Tests the planes; false: one of them blocks the ray. */
static INLINED bool occlusion_planes(struct occlusion_walk *walk)
{
    const struct scene *scene = walk->probe.scene;
    uint32_t end = plane_ids_end(scene);
    for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < end; id++) {
        unsigned crossings = plane_passages(walk, id);
        if (crossings == 0) continue;
        struct bvh_leaf plane = bvh_leaf_of(scene, id);
        if (!occlusion_by(walk, &plane, crossings)) return false;
    }
    return true;
}

#endif
