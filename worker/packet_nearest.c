#include "worker/packet.h"

#include "worker/lanes.h"

/* Without SIMD nobody asks for packets (worker/nearest.c, occluded.c), and eight times the scalar code
 * would take half a minute to compile. */
#if LANES_IN_SIMD

#include "worker/nearest_walk.h"
#include "worker/rough_packet.h"

/* A primitive that may be a ray's nearest. */
struct candidate {
    const struct bvh_leaf *leaf;
    double from; /* no nearer than this */
    double to;   /* of a solid: as in struct waiting */
};

#define CANDIDATES 6

struct nearest_packet {
    struct packet packet;
    struct ray_lanes ray_lanes;
    const struct scene *scene;
    const struct ray *rays;
    uint64_t *exact;
    bool given_up;
    double limit[LANES]; /* nothing beyond is of interest to the ray */
    double least[LANES]; /* what is nearer may be a passage through the triangle it starts on */
    double origin_error[LANES];
    struct candidate candidates[LANES][CANDIDATES];
    unsigned count[LANES];
    lane_set walking; /* rays that have a walk */
    struct nearest_walk walks[LANES];
};

static struct nearest_walk *walk_of(struct nearest_packet *it, unsigned lane)
{
    struct nearest_walk *walk = &it->walks[lane];
    if (!(it->walking >> lane & 1)) nearest_begin(walk, it->scene, &it->rays[lane], it->exact);
    it->walking |= UINT32_C(1) << lane;
    return walk;
}

/* Tests a ray with its candidates. */
static void settle(struct nearest_packet *it, unsigned lane)
{
    struct nearest_walk *walk = walk_of(it, lane);
    for (unsigned i = 0; i < it->count[lane]; i++) {
        const struct candidate *candidate = &it->candidates[lane][i];
        if (candidate->from > it->limit[lane]) continue;
        if (!is_triangle(candidate->leaf->id)) {
            nearest_primitive(walk, candidate->leaf->id, false);
            continue;
        }
        struct crossings found = probe_triangle(&walk->probe, candidate->leaf, false);
        nearest_crossing(walk, &found, 0, candidate->leaf->id, false);
    }
    it->count[lane] = 0;
    it->limit[lane] = smaller(it->limit[lane], walk->probe.purpose.farthest);
}

static INLINED void keep(struct nearest_packet *it, unsigned lane, const struct bvh_leaf *leaf,
                         double from, double to)
{
    if (it->count[lane] == CANDIDATES) settle(it, lane);
    it->candidates[lane][it->count[lane]++] = (struct candidate){leaf, from, to};
}

/* Keeps what the rays may meet first. What certainly counts brings the limit down to what may yet
 * be as near by worker/order.h. */
static INLINED lane_set triangle_candidates(void *context, const struct bvh_leaf *leaf,
                                            const struct rough_crossings *found)
{
    struct nearest_packet *it = context;
    double from[LANES], to[LANES];
    lanes_store(from, found->from);
    lanes_store(to, found->to);
    for (lane_set set = found->maybe; set; set = without_lowest(set)) {
        unsigned lane = lowest_lane(set);
        const struct ray *ray = &it->rays[lane];
        if (leaf->id == ray->from) continue;
        if (!(found->certain >> lane & 1)) {
            keep(it, lane, leaf, -INFINITE, INFINITE);
            continue;
        }
        if (from[lane] > it->limit[lane] || to[lane] < 0) continue;
        keep(it, lane, leaf, from[lane], INFINITE);
        if (!(from[lane] > it->least[lane] && to[lane] < ray->t_max)) continue;
        double limit = to[lane] + 2 * (it->origin_error[lane] + ORDER_ERROR * to[lane]);
        it->limit[lane] = smaller(limit, it->limit[lane]);
    }
    return ALL_LANES;
}

/* Tests rays with a primitive, one by one. */
static void test_each(struct nearest_packet *it, uint32_t id, lane_set set)
{
    for (; set; set = without_lowest(set)) {
        unsigned lane = lowest_lane(set);
        struct nearest_walk *walk = walk_of(it, lane);
        nearest_primitive(walk, id, false);
        it->limit[lane] = smaller(it->limit[lane], walk->probe.purpose.farthest);
    }
}

/* The same as triangle_candidates(), for a solid that has spans. */
static void solid_candidates(struct nearest_packet *it, const struct bvh_leaf *leaf, lane_set rays)
{
    struct spans_lanes spans = spans_of_rays(it->scene, leaf->id, &it->ray_lanes);
    lane_set leaving = 0;
    for (unsigned lane = 0; lane < LANES; lane++)
        leaving |= (lane_set)(it->rays[lane].from == leaf->id) << lane;
    lane_set set = rays & (leaving | may_be_crossed_lanes(&spans, lanes_load(it->limit)));
    if (!set) return;
    struct first_crossing_lanes first = first_crossing_lanes(&spans);
    lane_set told = is_told_solid(it->scene, leaf->id) ? set & first.told & ~leaving : 0;
    double from[LANES], to[LANES];
    lanes_store(from, first.from);
    lanes_store(to, first.to);
    for (lane_set rest = told; rest; rest = without_lowest(rest)) {
        unsigned lane = lowest_lane(rest);
        keep(it, lane, leaf, from[lane], first.on_side >> lane & 1 ? to[lane] : INFINITE);
        if (!(to[lane] < it->rays[lane].t_max)) continue;
        double limit = to[lane] + 2 * (it->origin_error[lane] + ORDER_ERROR * to[lane]);
        it->limit[lane] = smaller(limit, it->limit[lane]);
    }
    test_each(it, leaf->id, set & ~told);
}

static INLINED void visit_by_packet(void *context, const struct bvh_node *node, unsigned slot,
                                    double *limit)
{
    struct nearest_packet *it = context;
    lane_set rays = rays_meet(&it->packet, node, slot, ray_limits(lanes_load(it->limit)));
    it->given_up = !is_worth_it(&it->packet, rays);
    if (it->given_up) *limit = -INFINITE; /* ends the walk */
    if (!rays || it->given_up) return;
    const struct bvh_leaf *leaves = bvh_leaves(it->packet.bvh) + node->child[slot];
    uint32_t count = node->count[slot], triangles = triangles_of(leaves, count);
    if (triangles > 0)
        packet_triangles(&it->packet, it->scene, leaves, count, triangles, rays,
                         triangle_candidates, it);
    for (uint32_t i = triangles; i < count; i++) {
        if (has_spans(leaves[i].id))
            solid_candidates(it, &leaves[i], rays);
        else
            test_each(it, leaves[i].id, rays);
    }
    *limit = lanes_highest(lanes_load(it->limit));
}

/* Where rays start, and what is in front of the tree. */
static void begin_rays(struct nearest_packet *it)
{
    const struct packet *packet = &it->packet;
    struct lanes way = lanes_div(largest_of(packet->o), lanes_abs(packet->d[packet->axes[2]]));
    lanes_store(it->origin_error, lanes_mul(lanes_of(ORDER_ERROR), way));
    lanes_store(it->least, lanes_mul(lanes_of(PASSAGE_REACH), way));
    for (unsigned lane = 0; lane < LANES; lane++) {
        const struct ray *ray = &it->rays[lane];
        it->limit[lane] = ray->t_max;
        it->count[lane] = 0;
        if (it->scene->primitives[PRIMITIVE_PLANE].count == 0) continue;
        struct nearest_walk *walk = walk_of(it, lane);
        nearest_planes(walk, false);
        it->limit[lane] = walk->probe.purpose.farthest;
    }
}

/* The one triangle that a ray without a walk can hit first; NULL: there is none, or it is not
 * certain. */
static const struct bvh_leaf *only_candidate(const struct nearest_packet *it, unsigned lane)
{
    const struct bvh_leaf *only = NULL;
    if (it->walking >> lane & 1) return NULL;
    for (unsigned i = 0; i < it->count[lane]; i++) {
        const struct candidate *candidate = &it->candidates[lane][i];
        if (candidate->from > it->limit[lane]) continue;
        if (only && candidate->leaf->id == only->id) continue; /* another piece of it */
        if (only || candidate->from <= 0 || !is_triangle(candidate->leaf->id)) return NULL;
        only = candidate->leaf;
    }
    return only;
}

/* The hits of rays with one candidate, for all together; returns whose they are. */
static lane_set settle_together(const struct nearest_packet *it, struct hit *hits)
{
    const struct bvh_leaf *leaves[LANES];
    lane_set set = 0;
    for (unsigned lane = 0; lane < LANES; lane++) {
        leaves[lane] = only_candidate(it, lane);
        if (leaves[lane]) set |= UINT32_C(1) << lane;
    }
    if (!set) return 0;
    for (unsigned lane = 0; lane < LANES; lane++)
        if (!leaves[lane]) leaves[lane] = leaves[lowest_lane(set)];
    struct packet_crossings found = packet_crossings(&it->packet, it->scene, leaves);
    double t[LANES], u[LANES], v[LANES];
    lanes_store(t, found.t);
    lanes_store(u, found.u);
    lanes_store(v, found.v);
    set &= found.good;
    for (lane_set rest = set; rest; rest = without_lowest(rest)) {
        unsigned lane = lowest_lane(rest);
        if (t[lane] > it->least[lane] && t[lane] < it->rays[lane].t_max)
            hits[lane] = (struct hit){t[lane], u[lane], v[lane], leaves[lane]->id, 0};
        else
            set &= ~(UINT32_C(1) << lane);
    }
    return set;
}

/* Takes the one solid that a ray meets first for its hit, if that is all there is to say of it. */
static bool settle_roughly(struct nearest_packet *it, unsigned lane, struct hit *hit)
{
    const struct candidate *only = NULL;
    for (unsigned i = 0; i < it->count[lane]; i++) {
        const struct candidate *candidate = &it->candidates[lane][i];
        if (candidate->from > it->limit[lane]) continue;
        if (only && candidate->leaf->id != only->leaf->id) return false;
        only = candidate;
    }
    if (!only || !(only->to < it->rays[lane].t_max)) return false;
    uint32_t id = only->leaf->id;
    if ((it->walking >> lane & 1) && !clearly_precedes(&it->walks[lane], id, only->to))
        return false;
    *hit = rough_hit(id, only->from, only->to);
    return true;
}

bool nearest_packet(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                    struct hit *hits, uint64_t *exact, bool rough)
{
    struct nearest_packet it;
    if (!packet_of(bvh, rays, &it.packet)) return false;
    it.ray_lanes = rays_in_lanes(it.packet.o, it.packet.d);
    it.scene = scene;
    it.rays = rays;
    it.exact = exact;
    it.walking = 0;
    it.given_up = false;
    begin_rays(&it);
    packet_traverse(bvh, &it.packet, lanes_highest(lanes_load(it.limit)), visit_by_packet, &it);
    if (it.given_up) return false;
    lane_set settled = settle_together(&it, hits);
    for (unsigned lane = 0; lane < LANES; lane++) {
        if (settled >> lane & 1) continue;
        if (rough && settle_roughly(&it, lane, &hits[lane])) continue;
        hits[lane] = (struct hit){.t = INFINITE, .primitive = PRIMITIVE_NONE};
        if (it.count[lane] > 0) settle(&it, lane);
        if (it.walking >> lane & 1) hits[lane] = it.walks[lane].hit;
    }
    return true;
}

#else

bool nearest_packet(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                    struct hit *hits, uint64_t *exact, bool rough)
{
    (void)scene;
    (void)bvh;
    (void)rays;
    (void)hits;
    (void)exact;
    (void)rough;
    return false; /* none is worth it */
}

#endif
