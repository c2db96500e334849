#include "worker/packet.h"

#include "worker/nearest_walk.h"
#include "worker/packet_walk.h"

/* ---- triangles ---- */

/* A triangle as the rays of a packet see it, by the filter of triangle_crossings(). */
struct packet_view {
    lane_set maybe, certain; /* not certainly missed; certainly crossed */
    struct sheared_lanes p, q, r;
    struct lanes e0, e1, e2, error;
};

static INLINED struct sheared_lanes packet_shear(const struct packet *packet,
                                                 const struct vec3 *vertex)
{
    const unsigned *axes = packet->axes;
    struct lanes z = lanes_sub(lanes_of(vec_component(vertex, axes[2])), packet->origin[2]);
    struct lanes x = lanes_sub(lanes_of(vec_component(vertex, axes[0])), packet->origin[0]);
    struct lanes y = lanes_sub(lanes_of(vec_component(vertex, axes[1])), packet->origin[1]);
    return (struct sheared_lanes){lanes_sub(x, lanes_mul(packet->sx, z)),
                                  lanes_sub(y, lanes_mul(packet->sy, z)), z};
}

static INLINED struct packet_view
packet_view(const struct packet *packet, const struct vec3 *vertices, const struct bvh_leaf *leaf)
{
    struct packet_view view = {.p = packet_shear(packet, &vertices[leaf->vertex[0]]),
                               .q = packet_shear(packet, &vertices[leaf->vertex[1]]),
                               .r = packet_shear(packet, &vertices[leaf->vertex[2]])};
    view.e0 = lanes_edge(&view.q, &view.r);
    view.e1 = lanes_edge(&view.r, &view.p);
    view.e2 = lanes_edge(&view.p, &view.q);
    struct lanes low = lanes_smaller(lanes_smaller(view.e0, view.e1), view.e2);
    struct lanes high = lanes_larger(lanes_larger(view.e0, view.e1), view.e2);
    struct lanes zero = lanes_of(0);
    view.error = lanes_edge_error(&view.p, &view.q, &view.r);
    struct lanes below = lanes_add(low, view.error), above = lanes_sub(high, view.error);
    view.maybe = ALL_LANES & ~(lanes_less(below, zero) & lanes_less(zero, above));
    view.certain = lanes_less(view.error, low) | lanes_less(lanes_add(high, view.error), zero);
    return view;
}

/*
 * Where the rays that certainly cross a triangle do so, within bounds. The exact crossing lies at a
 * mean z of the vertices, with weights e that err by `error` each: z by at most q times the range of
 * the vertices' z when the errors sum up to half of q of the sum of the weights. All other roundings,
 * of z, of the mean and of the quotients, and what t differs by in the end, are less than 64 u of
 * the largest z.
 */
static INLINED void packet_distances(const struct packet *packet, const struct packet_view *view,
                                     double from[LANES], double to[LANES])
{
    struct lanes sum = lanes_add(lanes_add(view->e0, view->e1), view->e2);
    struct lanes inverse = lanes_div(lanes_of(1), sum);
    struct lanes mean = lanes_add(lanes_mul(view->e0, view->p.z), lanes_mul(view->e1, view->q.z));
    mean = lanes_mul(lanes_add(mean, lanes_mul(view->e2, view->r.z)), inverse);
    struct lanes low = lanes_smaller(lanes_smaller(view->p.z, view->q.z), view->r.z);
    struct lanes high = lanes_larger(lanes_larger(view->p.z, view->q.z), view->r.z);
    struct lanes q = lanes_mul(lanes_mul(lanes_of(6), view->error), lanes_abs(inverse));
    struct lanes doubt = lanes_mul(lanes_smaller(q, lanes_of(1)), lanes_sub(high, low));
    struct lanes size = lanes_larger(lanes_abs(low), lanes_abs(high));
    doubt = lanes_add(doubt, lanes_mul(lanes_of(64 * UNIT_ROUNDOFF), size));
    doubt = lanes_mul(doubt, lanes_abs(packet->inverse_dz));
    struct lanes t = lanes_mul(mean, packet->inverse_dz);
    lanes_store(from, lanes_sub(t, doubt));
    lanes_store(to, lanes_add(t, doubt));
}

/* ---- the nearest hits ---- */

/* A triangle that may be a ray's nearest. */
struct candidate {
    const struct bvh_leaf *leaf;
    double from; /* no nearer than this */
};

#define CANDIDATES 6

struct nearest_packet {
    struct packet packet;
    const struct scene *scene;
    const struct ray *rays;
    uint64_t *exact;
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
    if (!(it->walking >> lane & 1)) *walk = nearest_walk_of(it->scene, &it->rays[lane], it->exact);
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
        struct crossings found = probe_triangle(&walk->probe, candidate->leaf, false);
        nearest_crossing(walk, &found, 0, candidate->leaf->id, false);
    }
    it->count[lane] = 0;
    it->limit[lane] = smaller(it->limit[lane], walk->probe.purpose.farthest);
}

static INLINED void keep(struct nearest_packet *it, unsigned lane, const struct bvh_leaf *leaf,
                         double from)
{
    if (it->count[lane] == CANDIDATES) settle(it, lane);
    it->candidates[lane][it->count[lane]++] = (struct candidate){leaf, from};
}

/* Keeps what the rays may meet first. What certainly counts brings the limit down to what may yet
 * be as near by worker/order.h. */
static void packet_candidates(struct nearest_packet *it, const struct bvh_leaf *leaf,
                              const struct packet_view *view, lane_set set)
{
    double from[LANES], to[LANES];
    packet_distances(&it->packet, view, from, to);
    for (; set; set = without_lowest(set)) {
        unsigned lane = lowest_lane(set);
        const struct ray *ray = &it->rays[lane];
        if (leaf->id == ray->from) continue;
        if (!(view->certain >> lane & 1)) {
            keep(it, lane, leaf, -INFINITE);
            continue;
        }
        if (from[lane] > it->limit[lane] || to[lane] < 0) continue;
        keep(it, lane, leaf, from[lane]);
        if (!(from[lane] > it->least[lane] && to[lane] < ray->t_max)) continue;
        double limit = to[lane] + 2 * (it->origin_error[lane] + ORDER_ERROR * to[lane]);
        it->limit[lane] = smaller(limit, it->limit[lane]);
    }
}

static INLINED void visit_by_packet(void *context, const struct bvh_node *node, unsigned slot,
                                    double *limit)
{
    struct nearest_packet *it = context;
    lane_set rays = rays_meet(&it->packet, node, slot, lanes_load(it->limit));
    if (!rays) return;
    const struct bvh_leaf *leaves = bvh_leaves(it->packet.bvh) + node->child[slot];
    const struct vec3 *vertices = scene_vertices(it->scene);
    uint32_t count = node->count[slot], triangles = triangles_of(leaves, count);
    for (uint32_t i = 0; i < triangles; i++) {
        struct packet_view view = packet_view(&it->packet, vertices, &leaves[i]);
        lane_set set = rays & view.maybe;
        if (set) packet_candidates(it, &leaves[i], &view, set);
    }
    for (lane_set rest = triangles < count ? rays : 0; rest; rest = without_lowest(rest)) {
        unsigned lane = lowest_lane(rest);
        struct nearest_walk *walk = walk_of(it, lane);
        for (uint32_t i = triangles; i < count; i++)
            nearest_primitive(walk, leaves[i].id, false);
        it->limit[lane] = smaller(it->limit[lane], walk->probe.purpose.farthest);
    }
    *limit = highest_of(lanes_load(it->limit));
}

bool nearest_packet(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                    struct hit *hits, uint64_t *exact)
{
    struct nearest_packet it;
    if (!packet_of(bvh, rays, &it.packet)) return false;
    it.scene = scene;
    it.rays = rays;
    it.exact = exact;
    it.walking = 0;
    for (unsigned lane = 0; lane < LANES; lane++) {
        const struct ray *ray = &rays[lane];
        bool leaves_triangle = ray->from != PRIMITIVE_NONE && is_triangle(ray->from);
        double way = largest_component(ray->origin) / largest_component(ray->direction);
        it.limit[lane] = ray->t_max;
        it.least[lane] = leaves_triangle ? PASSAGE_REACH * way : 0;
        it.origin_error[lane] = ORDER_ERROR * way;
        it.count[lane] = 0;
        if (scene->primitives[PRIMITIVE_PLANE].count == 0) continue;
        struct nearest_walk *walk = walk_of(&it, lane);
        nearest_planes(walk, false);
        it.limit[lane] = walk->probe.purpose.farthest;
    }
    packet_traverse(bvh, &it.packet, highest_of(lanes_load(it.limit)), visit_by_packet, &it);
    for (unsigned lane = 0; lane < LANES; lane++) {
        settle(&it, lane);
        hits[lane] = it.walks[lane].hit;
    }
    return true;
}
