/* The candidates of a packet's rays: what may be the nearest hit of each, and which of them it is. */
#ifndef FARM_WORKER_PACKET_CANDIDATES_H
#define FARM_WORKER_PACKET_CANDIDATES_H

#include <stdalign.h>
#include <string.h>

#include "worker/nearest_walk.h"
#include "worker/packet_triangle.h"
#include "worker/packet_walk.h"
#include "worker/pinhole.h"

/* A packet in search of its nearest hits. */
struct nearest_packet {
    struct packet packet;
    struct pinhole_rays through; /* if all rays have a common origin */
    struct ray_lanes ray_lanes;
    const struct scene *scene;
    const struct ray *rays;
    struct known_planes *planes;
    uint64_t *exact;
    alignas(64) double limit[LANES]; /* largest distance that matters to the ray */
    struct floats float_limit;       /* ray_limits() */
    struct lanes first_limit;        /* the limits when the traversal began */
    struct lanes least;              /* nearer crossings may have been passed, see shape.h */
    struct lanes origin_error;
    /*
     * A triangle or plane that is certainly crossed before what was known when it was found; most rays have
     * no other candidate.
     */
    uint32_t first[LANES];
    struct lanes first_from, first_to; /* as in struct candidate; first_from infinite: none */
    struct candidate candidates[LANES][CANDIDATES];
    unsigned count[LANES];
    lane_set keeping; /* rays that have had candidates */
    lane_set walking; /* rays whose walk has begun */
    struct nearest_walk walks[LANES];
};

static INLINED void nearest_packet_begin(struct nearest_packet *it,
                                         const struct nearest_batch *batch, const struct ray *rays)
{
    it->scene = batch->scene;
    it->rays = rays;
    it->planes = batch->planes;
    it->exact = batch->exact;
    it->keeping = it->walking = 0;
    memset(it->count, 0, sizeof it->count);
    lanes_store(it->limit, it->packet.t_max);
}

/* Prepares a packet for its first test. */
static void nearest_prepare(struct nearest_packet *it, const struct bundle *bundle)
{
    packet_prepare(&it->packet, bundle);
    if (has_lines(it->scene)) it->ray_lanes = rays_in_lanes(it->packet.o, it->packet.d);
    struct lanes way = lanes_mul(largest_of(it->packet.o), lanes_abs(it->packet.inverse_dz));
    it->origin_error = lanes_mul(lanes_of(ORDER_ERROR), way);
    it->least = lanes_mul(lanes_of(PASSAGE_REACH), way);
    it->first_limit = lanes_load(it->limit);
    it->float_limit = ray_limits(it->first_limit);
    it->first_from = lanes_of(INFINITE);
    memset(it->first, 0xff, sizeof it->first);
}

/* ---- gathering them ---- */

static struct nearest_walk *walk_of(struct nearest_packet *it, unsigned lane)
{
    struct nearest_walk *walk = &it->walks[lane];
    if (!(it->walking >> lane & 1))
        nearest_begin(walk, it->scene, &it->rays[lane], it->planes, it->exact);
    it->walking |= UINT32_C(1) << lane;
    return walk;
}

/* Tests a ray with its candidates. */
static void settle(struct nearest_packet *it, unsigned lane)
{
    if (it->count[lane] == 0) return;
    struct nearest_walk *walk = walk_of(it, lane);
    for (unsigned i = 0; i < it->count[lane]; i++) {
        const struct candidate *candidate = &it->candidates[lane][i];
        if (candidate->from <= it->limit[lane]) nearest_primitive(walk, candidate->id);
    }
    it->count[lane] = 0;
    it->limit[lane] = smaller_number(it->limit[lane], walk->probe.purpose.farthest);
}

static INLINED void keep(struct nearest_packet *it, unsigned lane, struct candidate candidate)
{
    if (it->count[lane] == CANDIDATES) settle(it, lane);
    it->keeping |= UINT32_C(1) << lane;
    it->candidates[lane][it->count[lane]++] = candidate;
}

/* Adds triangles or planes that rays certainly cross as candidates. */
static INLINED void keep_certain(struct nearest_packet *it, lane_set set, const uint32_t ids[LANES],
                                 struct lanes from, struct lanes to)
{
    double first[LANES], last[LANES];
    lanes_store(first, from);
    lanes_store(last, lanes_choose(lanes_less(it->least, from), to, lanes_of(INFINITE)));
    for (; set; set = without_lowest(set)) {
        unsigned lane = lowest_lane(set);
        keep(it, lane, (struct candidate){ids[lane], 0, first[lane], last[lane]});
    }
}

/*
 * Lowers the limits of rays that certainly hit something by `to`, unless they end before; crossings beyond may still be
 * equally near by worker/order.h, up to twice the error.
 */
static INLINED void lower_limits(struct nearest_packet *it, lane_set rays, struct lanes to)
{
    struct lanes error = lanes_add(it->origin_error, lanes_mul(lanes_of(ORDER_ERROR), to));
    struct lanes now = lanes_load(it->limit);
    struct lanes limit = lanes_smaller(lanes_add(to, lanes_mul(lanes_of(2), error)), now);
    lanes_store(it->limit, lanes_choose(rays, limit, now));
}

/*
 * For the rays that certainly cross a primitive and for which it may be the nearest, keeps it as the first or
 * as a candidate. Returns the rays whose first it now is.
 */
static INLINED lane_set keep_nearer(struct nearest_packet *it, uint32_t id, lane_set set,
                                    struct lanes from, struct lanes to)
{
    set &= ~(lanes_less(lanes_load(it->limit), from) | lanes_less(to, lanes_of(0)));
    if (!set) return 0;
    lower_limits(it, set & lanes_less(it->least, from), to);
    lane_set nearer = set & lanes_less(lanes_load(it->limit), it->first_from);
    set &= ~(nearer | equal_ids(it->first, id)); /* the latter: other pieces of the same triangle */
    it->first_from = lanes_choose(nearer, from, it->first_from);
    it->first_to = lanes_choose(nearer, to, it->first_to);
    put_ids(it->first, nearer, id);
    if (!set) return nearer;
    uint32_t ids[LANES];
    put_ids(ids, ALL_LANES, id);
    keep_certain(it, set, ids, from, to);
    return nearer;
}

/* Adds a triangle to the candidates of the rays that may hit it. */
static INLINED lane_set triangle_candidates(void *context, const struct bvh_leaf *leaf,
                                            const struct rough_crossings *found)
{
    struct nearest_packet *it = context;
    lane_set set = found->maybe & ~rays_from(&it->packet, leaf->id);
    for (lane_set rest = set & ~found->certain; rest; rest = without_lowest(rest))
        keep(it, lowest_lane(rest), (struct candidate){leaf->id, 0, -INFINITE, INFINITE});
    if (keep_nearer(it, leaf->id, set & found->certain, found->from, found->to))
        __builtin_prefetch(corner_indices(it->scene, leaf->id)); /* for prefetch_firsts() */
    return ALL_LANES;
}

/* Tests rays with a primitive, one by one. */
static void test_each(struct nearest_packet *it, uint32_t id, lane_set set)
{
    for (; set; set = without_lowest(set)) {
        unsigned lane = lowest_lane(set);
        if (is_left_behind(it->scene, id, &it->rays[lane])) continue;
        struct nearest_walk *walk = walk_of(it, lane);
        nearest_primitive(walk, id);
        it->limit[lane] = smaller_number(it->limit[lane], walk->probe.purpose.farthest);
    }
}

/* The same as triangle_candidates(), for a solid that has spans. */
static void solid_candidates(struct nearest_packet *it, const struct bvh_leaf *leaf, lane_set rays)
{
    /* The order of a way out and of what is next to it is not decided here: nearest_walk.h, may_precede(). */
    lane_set leaving = rays & rays_from(&it->packet, leaf->id);
    test_each(it, leaf->id, leaving);
    struct spans_lanes spans = spans_of_rays(it->scene, leaf->id, &it->ray_lanes);
    lane_set set = rays & ~leaving & may_be_crossed_lanes(&spans, lanes_load(it->limit));
    if (!set) return;
    struct first_crossing_lanes first = first_crossing_lanes(&spans);
    lane_set decided = has_usable_spans(it->scene, leaf->id) ? set & first.decided : 0;
    decided &= lanes_less(it->least, first.from);
    double from[LANES], to[LANES];
    lanes_store(from, first.from);
    lanes_store(to, first.to);
    for (lane_set rest = decided; rest; rest = without_lowest(rest)) {
        unsigned lane = lowest_lane(rest);
        bool on_part = is_on_part_lanes(&first) >> lane & 1;
        keep(it, lane,
             (struct candidate){leaf->id, part_at_lanes(&first, lane), from[lane],
                                on_part ? to[lane] : INFINITE});
    }
    lower_limits(it, decided, first.to);
    test_each(it, leaf->id, set & ~decided);
}

static void plane_candidates(struct nearest_packet *it, uint32_t id)
{
    struct plane_span_lanes span = plane_span_of_rays(it->scene, id, &it->ray_lanes);
    lane_set ahead = span.decided & lanes_less(it->least, span.from),
             behind = span.decided & lanes_less(span.to, lanes_of(0));
    lane_set set = ALL_LANES & ~rays_from(&it->packet, id);
    keep_nearer(it, id, set & ahead, span.from, span.to);
    test_each(it, id, set & ~(ahead | behind));
}

/* ---- deciding between them ---- */

/* Whether something other than its first may be a ray's nearest. */
static bool has_another(const struct nearest_packet *it, unsigned lane)
{
    for (unsigned i = 0; i < it->count[lane]; i++) {
        const struct candidate *candidate = &it->candidates[lane][i];
        if (candidate->from <= it->limit[lane] && candidate->id != it->first[lane]) return true;
    }
    return false;
}

/* Sets the hits of rays whose first is their nearest beyond doubt; returns these rays. */
static lane_set hits_of_firsts(const struct nearest_packet *it, lane_set set, struct hit *hits)
{
    double from[LANES], to[LANES];
    lanes_store(from, it->first_from);
    lanes_store(to, it->first_to);
    set &= lanes_less(it->least, it->first_from) & lanes_less(it->first_to, it->first_limit);
    for (lane_set rest = set; rest; rest = without_lowest(rest)) {
        unsigned lane = lowest_lane(rest);
        hits[lane] = rough_hit(it->first[lane], 0, from[lane], to[lane]);
    }
    return set;
}

/* Prefetches vertices before a bundle's hits go to points_find(): in a large mesh they are in no near cache. */
static INLINED void prefetch_firsts(const struct nearest_packet *it)
{
    const struct vec3 *vertices = scene_vertices(it->scene);
    lane_set set = lanes_less(it->first_from, lanes_of(INFINITE));
    while (set) {
        uint32_t id = it->first[lowest_lane(set)];
        set &= ~equal_ids(it->first, id);
        if (!is_triangle(id)) continue;
        const uint32_t *corner = corner_indices(it->scene, id);
        for (unsigned k = 0; k < 3; k++)
            __builtin_prefetch(&vertices[corner[k]]);
    }
}

/*
 * Sets together the hits of rays whose first is their only candidate; returns these rays. The firsts of other
 * rays become candidates.
 */
static lane_set settle_together(struct nearest_packet *it, struct hit *hits)
{
    lane_set firsts = lanes_less(it->first_from, lanes_of(INFINITE)) &
                      lanes_at_most(it->first_from, lanes_load(it->limit));
    lane_set set = firsts & ~it->walking;
    for (lane_set rest = set & it->keeping; rest; rest = without_lowest(rest))
        if (has_another(it, lowest_lane(rest))) set &= ~(UINT32_C(1) << lowest_lane(rest));
    if (set) set = hits_of_firsts(it, set, hits);
    if (firsts & ~set) keep_certain(it, firsts & ~set, it->first, it->first_from, it->first_to);
    return set;
}

/*
 * If a ray has only one candidate that can be its nearest, and is so beyond doubt, makes it the hit. Returns
 * false otherwise.
 */
static bool settle_roughly(struct nearest_packet *it, unsigned lane, struct hit *hit)
{
    const struct candidate *only = NULL;
    for (unsigned i = 0; i < it->count[lane]; i++) {
        const struct candidate *candidate = &it->candidates[lane][i];
        if (candidate->from > it->limit[lane]) continue;
        if (only && candidate->id != only->id) return false;
        only = candidate;
    }
    if (!only || !(only->to < it->rays[lane].t_max)) return false;
    if ((it->walking >> lane & 1) && !clearly_precedes(&it->walks[lane], only->id, only->to))
        return false;
    *hit = rough_hit(only->id, only->part, only->from, only->to);
    return true;
}

/* Determines the hit of a single ray. */
static void settle_alone(struct nearest_packet *it, unsigned lane, struct hit *hit)
{
    if (it->count[lane] > 0 && settle_roughly(it, lane, hit)) return;
    settle(it, lane);
    if (it->walking >> lane & 1) *hit = it->walks[lane].hit;
}

static void nearest_packet_end(struct nearest_packet *it, struct hit *hits)
{
    static const struct hit none = {.t = INFINITE, .primitive = PRIMITIVE_NONE};
    lane_set together = it->packet.prepared ? settle_together(it, hits) : 0;
    for (lane_set rest = ALL_LANES & ~together; rest; rest = without_lowest(rest))
        hits[lowest_lane(rest)] = none;
    lane_set alone = (it->walking | it->keeping) & ~together;
    for (; alone; alone = without_lowest(alone))
        settle_alone(it, lowest_lane(alone), &hits[lowest_lane(alone)]);
}

#endif
