/* Triangles against a packet of rays: one triangle for all of them, and one for each. */
#ifndef FARM_WORKER_PACKET_TRIANGLE_H
#define FARM_WORKER_PACKET_TRIANGLE_H

#include "worker/lanes_dd.h"
#include "worker/packet_walk.h"

/* ---- one triangle ---- */

/* As all rays see it, by the filter of triangle_crossings(). */
struct packet_view {
    lane_set maybe, certain; /* not certainly missed; certainly crossed */
    struct sheared_lanes p, q, r;
    struct lanes e0, e1, e2, error;
};

static INLINED struct sheared_lanes packet_shear(const struct packet *packet, struct lanes x,
                                                 struct lanes y, struct lanes z)
{
    x = lanes_sub(x, packet->origin[0]);
    y = lanes_sub(y, packet->origin[1]);
    z = lanes_sub(z, packet->origin[2]);
    return (struct sheared_lanes){lanes_sub(x, lanes_mul(packet->sx, z)),
                                  lanes_sub(y, lanes_mul(packet->sy, z)), z};
}

static INLINED struct sheared_lanes shear_for_packet(const struct packet *packet,
                                                     const struct vec3 *vertex)
{
    const unsigned *axes = packet->axes;
    return packet_shear(packet, lanes_of(vec_component(vertex, axes[0])),
                        lanes_of(vec_component(vertex, axes[1])),
                        lanes_of(vec_component(vertex, axes[2])));
}

static INLINED void decide(struct packet_view *view)
{
    view->e0 = lanes_edge(&view->q, &view->r);
    view->e1 = lanes_edge(&view->r, &view->p);
    view->e2 = lanes_edge(&view->p, &view->q);
    struct lanes low = lanes_smaller(lanes_smaller(view->e0, view->e1), view->e2);
    struct lanes high = lanes_larger(lanes_larger(view->e0, view->e1), view->e2);
    struct lanes error = lanes_edge_error(&view->p, &view->q, &view->r), zero = lanes_of(0);
    /* A sum or a difference has the sign of the exact one: low < -error. */
    lane_set below = lanes_less(lanes_add(low, error), zero);
    lane_set above = lanes_less(error, high);
    view->error = error;
    view->maybe = ALL_LANES & ~(below & above);
    view->certain = lanes_less(error, low) | lanes_less(lanes_add(high, error), zero);
}

static INLINED struct packet_view
packet_view(const struct packet *packet, const struct scene *scene, const struct bvh_leaf *leaf)
{
    const struct vec3 *vertices = scene_vertices(scene);
    const uint32_t *corner = corner_indices(scene, leaf->id);
    struct packet_view view;
    view.p = shear_for_packet(packet, &vertices[corner[0]]);
    view.q = shear_for_packet(packet, &vertices[corner[1]]);
    view.r = shear_for_packet(packet, &vertices[corner[2]]);
    decide(&view);
    return view;
}

/* A mean of the vertices' z, and by how much it is off because of its weights. */
struct mean_lanes {
    struct lanes z, doubt;
};

/*
 * With weights e of one sign that are off by `error` each, the mean is off by twice the share of
 * three errors in the sum of the weights, in units of the range of z, if that share is not above a
 * half; and never by more than the range.
 */
static INLINED struct mean_lanes mean_of_vertices(const struct lanes z[3], struct lanes e0,
                                                  struct lanes e1, struct lanes e2,
                                                  struct lanes error)
{
    struct lanes inverse = lanes_div(lanes_of(1), lanes_add(lanes_add(e0, e1), e2));
    struct lanes sum = lanes_add(lanes_mul(e0, z[0]), lanes_mul(e1, z[1]));
    sum = lanes_add(sum, lanes_mul(e2, z[2]));
    struct lanes range = lanes_sub(lanes_largest(z[0], z[1], z[2]), lanes_least(z[0], z[1], z[2]));
    struct lanes share = lanes_mul(lanes_mul(lanes_of(6), error), lanes_abs(inverse));
    return (struct mean_lanes){lanes_mul(sum, inverse),
                               lanes_mul(lanes_smaller(share, lanes_of(1)), range)};
}

/*
 * Where the rays that certainly cross a triangle do so, within bounds. The exact crossing lies at a
 * mean z of the vertices with the edges' values for weights. All other roundings, of z, of the mean
 * and of the quotients, and what t is off by when it is computed in the end, are less than 64 u of
 * the largest z.
 */
static INLINED void packet_distances(const struct packet *packet, const struct packet_view *view,
                                     struct lanes *from, struct lanes *to)
{
    const struct lanes z[3] = {view->p.z, view->q.z, view->r.z};
    struct mean_lanes mean = mean_of_vertices(z, view->e0, view->e1, view->e2, view->error);
    struct lanes size = lanes_largest(lanes_abs(z[0]), lanes_abs(z[1]), lanes_abs(z[2]));
    struct lanes doubt = lanes_add(mean.doubt, lanes_mul(lanes_of(64 * UNIT_ROUNDOFF), size));
    doubt = lanes_mul(doubt, lanes_abs(packet->inverse_dz));
    struct lanes t = lanes_mul(mean.z, packet->inverse_dz);
    *from = lanes_sub(t, doubt);
    *to = lanes_add(t, doubt);
}

/* ---- a triangle for each ray ---- */

/* difference_of_products(p.x, q.y, p.y, q.x) */
static INLINED struct lanes lanes_edge_value(const struct sheared_lanes *p,
                                             const struct sheared_lanes *q)
{
    struct lanes cd = lanes_mul(p->y, q->x);
    struct lanes error = lanes_fma(lanes_negate(p->y), q->x, cd);
    return lanes_add(lanes_fma(p->x, q->y, lanes_negate(cd)), error);
}

/* Lanes whose slope is less, and more, than SLOPE_MAX by more than a quotient's rounding. */
struct slope_sets {
    lane_set flat, steep;
};

static INLINED struct slope_sets slope_sets(const struct packet_view *view, struct lanes sum)
{
    const struct sheared_lanes *p = &view->p, *q = &view->q, *r = &view->r;
    struct lanes qx = lanes_sub(q->x, p->x), qy = lanes_sub(q->y, p->y);
    struct lanes qz = lanes_sub(q->z, p->z), rx = lanes_sub(r->x, p->x);
    struct lanes ry = lanes_sub(r->y, p->y), rz = lanes_sub(r->z, p->z);
    struct lanes x = lanes_sub(lanes_mul(qz, ry), lanes_mul(rz, qy));
    struct lanes y = lanes_sub(lanes_mul(qx, rz), lanes_mul(rx, qz));
    struct lanes slope = lanes_add(lanes_abs(x), lanes_abs(y)), size = lanes_abs(sum);
    return (struct slope_sets){
        lanes_less(slope, lanes_mul(lanes_of(SLOPE_MAX * (1 - 0x1p-20)), size)),
        lanes_less(lanes_mul(lanes_of(SLOPE_MAX * (1 + 0x1p-20)), size), slope)};
}

/* triangle_correct(): the lanes where it may be done. */
static INLINED lane_set correct_each(const struct packet *packet, const struct lanes3 corner[3],
                                     struct lanes *t)
{
    const struct lanes3 o = {packet->o[0], packet->o[1], packet->o[2]};
    const struct lanes3 d = {packet->d[0], packet->d[1], packet->d[2]};
    struct lanes3 e1 = lanes3_sub(corner[1], corner[0]), e2 = lanes3_sub(corner[2], corner[0]);
    struct lanes3 n = lanes3_cross(e1, e2);
    struct lanes_dd3 f = lanes_exact_difference3(o, corner[0]);
    struct lanes3 v = {lanes_dd_advance(f.x, *t, d.x), lanes_dd_advance(f.y, *t, d.y),
                       lanes_dd_advance(f.z, *t, d.z)};
    struct lanes speed = lanes3_dot(n, d);
    struct lanes edges = lanes_mul(lanes3_sum_of_sizes(e1), lanes3_sum_of_sizes(e2));
    struct lanes error = lanes_mul(lanes_mul(lanes_of(3), edges), lanes3_sum_of_sizes(v));
    lane_set good = lanes_less(error, lanes_abs(lanes_mul(speed, *t)));
    *t = lanes_sub(*t, lanes_div(lanes3_dot(n, v), speed));
    return good;
}

/* triangle_plane_distance(): the lanes where it can be told. */
static INLINED lane_set plane_distance_each(const struct packet *packet,
                                            const struct lanes3 corner[3], struct lanes *t)
{
    const struct lanes3 o = {packet->o[0], packet->o[1], packet->o[2]};
    const struct lanes3 d = {packet->d[0], packet->d[1], packet->d[2]};
    struct lanes_dd3 p = lanes_exact_difference3(corner[1], corner[0]);
    struct lanes_dd3 q = lanes_exact_difference3(corner[2], corner[0]);
    struct lanes_dd3 f = lanes_exact_difference3(corner[0], o), normal = lanes_dd3_cross(p, q);
    struct lanes_dd height = lanes_dd3_dot(f, normal), speed = lanes_dd3_dot_vec(normal, d);
    struct lanes edges =
        lanes_mul(lanes3_sum_of_sizes(lanes_dd3_round(p)), lanes3_sum_of_sizes(lanes_dd3_round(q)));
    struct lanes heights = lanes_mul(edges, lanes3_sum_of_sizes(lanes_dd3_round(f)));
    struct lanes speeds = lanes_mul(edges, lanes3_sum_of_sizes(d)), share = lanes_of(PLANE_SHARE);
    *t = lanes_dd_div(height, speed).high;
    return lanes_less(lanes_mul(share, heights), lanes_abs(height.high)) &
           lanes_less(lanes_mul(share, speeds), lanes_abs(speed.high)) &
           lanes_less(lanes_of(0x1p-400), lanes_smaller(heights, speeds)) &
           lanes_less(lanes_larger(heights, speeds), lanes_of(0x1p400));
}

/* Where the slope asks for it; returns the lanes in which t is right then. */
static INLINED lane_set improve_each(const struct packet *packet, const struct lanes3 corner[3],
                                     lane_set steep, struct lanes *t)
{
    struct lanes better = *t;
    lane_set corrected = steep & correct_each(packet, corner, &better);
    *t = lanes_choose(corrected, better, *t);
    if (corrected == steep) return steep;
    lane_set told = steep & ~corrected & plane_distance_each(packet, corner, &better);
    *t = lanes_choose(told, better, *t);
    return corrected | told;
}

/* What triangle_crossings() finds for each ray and a triangle of its own, in the lanes of `good`.
 */
struct packet_crossings {
    lane_set good;
    struct lanes t, u, v;
};

/* Corner k of each lane's triangle. */
static INLINED struct lanes3 gather(const struct vec3 *vertices,
                                    const uint32_t *const corners[LANES], unsigned k)
{
    const double *at[LANES];
    const struct axis_order xyz = axis_order(0, 1, 2);
    struct lanes out[3];
    UNROLLED
    for (unsigned i = 0; i < LANES; i++)
        at[i] = &vertices[corners[i][k]].x;
    lanes_transpose(at, &xyz, out);
    return (struct lanes3){out[0], out[1], out[2]};
}

static INLINED struct sheared_lanes shear_each(const struct packet *packet, struct lanes3 corner)
{
    const struct lanes at[3] = {corner.x, corner.y, corner.z};
    const unsigned *axes = packet->axes;
    return packet_shear(packet, at[axes[0]], at[axes[1]], at[axes[2]]);
}

static INLINED struct packet_crossings
packet_crossings(const struct packet *packet, const struct scene *scene, const uint32_t ids[LANES])
{
    const struct vec3 *vertices = scene_vertices(scene);
    const uint32_t *corners[LANES];
    UNROLLED
    for (unsigned i = 0; i < LANES; i++)
        corners[i] = corner_indices(scene, ids[i]);
    const struct lanes3 corner[3] = {gather(vertices, corners, 0), gather(vertices, corners, 1),
                                     gather(vertices, corners, 2)};
    struct packet_view view = {.p = shear_each(packet, corner[0]),
                               .q = shear_each(packet, corner[1]),
                               .r = shear_each(packet, corner[2])};
    decide(&view);
    struct lanes e0 = lanes_edge_value(&view.q, &view.r), e1 = lanes_edge_value(&view.r, &view.p);
    struct lanes e2 = lanes_edge_value(&view.p, &view.q);
    struct lanes sum = lanes_add(lanes_add(e0, e1), e2);
    struct lanes t = lanes_add(lanes_mul(e0, view.p.z), lanes_mul(e1, view.q.z));
    t = lanes_div(lanes_add(t, lanes_mul(e2, view.r.z)), sum);
    t = lanes_div(t, packet->d[packet->axes[2]]);
    struct slope_sets slopes = slope_sets(&view, sum);
    lane_set good = view.certain & slopes.flat, steep = view.certain & slopes.steep;
    if (steep) good |= improve_each(packet, corner, steep, &t);
    return (struct packet_crossings){good, t, lanes_div(e1, sum), lanes_div(e2, sum)};
}

#endif
