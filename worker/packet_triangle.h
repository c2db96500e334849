/* Tests of a triangle against a packet of rays. */
#ifndef FARM_WORKER_PACKET_TRIANGLE_H
#define FARM_WORKER_PACKET_TRIANGLE_H

#include "worker/bundle.h"

/* struct sheared in every lane. */
struct sheared_lanes {
    struct lanes x, y, z;
};

static INLINED struct lanes lanes_edge(const struct sheared_lanes *p, const struct sheared_lanes *q)
{
    return lanes_sub(lanes_mul(p->x, q->y), lanes_mul(p->y, q->x));
}

static INLINED struct lanes lanes_sideways(const struct sheared_lanes *p)
{
    return lanes_add(lanes_abs(p->x), lanes_abs(p->y));
}

/* edge_error() in every lane. */
static INLINED struct lanes lanes_edge_error(const struct sheared_lanes *p,
                                             const struct sheared_lanes *q,
                                             const struct sheared_lanes *r)
{
    struct lanes s = lanes_largest(lanes_sideways(p), lanes_sideways(q), lanes_sideways(r));
    struct lanes z = lanes_largest(lanes_abs(p->z), lanes_abs(q->z), lanes_abs(r->z));
    struct lanes product = lanes_mul(lanes_mul(lanes_of(EDGE_FILTER), s), lanes_add(z, s));
    return lanes_add(product, lanes_of(EDGE_LEAST));
}

/* The values of the edges and their error; where the line certainly misses the triangle, and where it certainly
 * crosses it. */
struct edges_lanes {
    struct lanes e0, e1, e2, error;
    lane_set missed, crossed;
};

static INLINED struct edges_lanes lanes_edges(const struct sheared_lanes *p,
                                              const struct sheared_lanes *q,
                                              const struct sheared_lanes *r)
{
    struct lanes e0 = lanes_edge(q, r), e1 = lanes_edge(r, p), e2 = lanes_edge(p, q);
    struct lanes low = lanes_least(e0, e1, e2), high = lanes_largest(e0, e1, e2);
    struct lanes error = lanes_edge_error(p, q, r), zero = lanes_of(0);
    /* The rounded sum has the sign of the exact one: low < -error. */
    lane_set below = lanes_less(lanes_add(low, error), zero), above = lanes_less(error, high);
    lane_set inside = lanes_less(error, low) | lanes_less(lanes_add(high, error), zero);
    return (struct edges_lanes){e0, e1, e2, error, below & above, inside};
}

/* The triangle relative to each ray, by the filter of triangle_crossings(). */
struct packet_view {
    struct sheared_lanes p, q, r;
    struct edges_lanes edges;
};

static INLINED struct sheared_lanes shear_for_packet(const struct packet *packet,
                                                     const struct vec3 *vertex)
{
    struct lanes way[3];
    UNROLLED
    for (unsigned i = 0; i < 3; i++)
        way[i] = lanes_sub(lanes_of(vec_component(vertex, packet->axes[i])), packet->origin[i]);
    return (struct sheared_lanes){lanes_sub(way[0], lanes_mul(packet->sx, way[2])),
                                  lanes_sub(way[1], lanes_mul(packet->sy, way[2])), way[2]};
}

static INLINED struct packet_view packet_view(const struct packet *packet,
                                              const struct scene *scene, uint32_t id)
{
    const struct vec3 *vertices = scene_vertices(scene);
    const uint32_t *corner = corner_indices(scene, id);
    struct packet_view view;
    view.p = shear_for_packet(packet, &vertices[corner[0]]);
    view.q = shear_for_packet(packet, &vertices[corner[1]]);
    view.r = shear_for_packet(packet, &vertices[corner[2]]);
    view.edges = lanes_edges(&view.p, &view.q, &view.r);
    return view;
}

/* A weighted mean of the vertices' z, and a bound on its error due to the weights. */
struct mean_lanes {
    struct lanes z, doubt;
};

/*
 * If weights e of one sign err by `error` each, the mean errs by twice the ratio of three errors to the sum
 * of the weights, in units of the range of z, if that ratio is at most a half; and never by more than the
 * range.
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
 * Bounds on the distance at which rays that certainly cross a triangle do so. The exact crossing is at the
 * mean of the vertices' z, weighted with the edges' values. All other roundings, of z, of the mean and of the
 * quotients, and the error of the final t, are less than 64 u of the largest z.
 */
static INLINED void packet_distances(const struct packet *packet, const struct packet_view *view,
                                     struct lanes *from, struct lanes *to)
{
    const struct lanes z[3] = {view->p.z, view->q.z, view->r.z};
    const struct edges_lanes *edges = &view->edges;
    struct mean_lanes mean = mean_of_vertices(z, edges->e0, edges->e1, edges->e2, edges->error);
    struct lanes size = lanes_largest(lanes_abs(z[0]), lanes_abs(z[1]), lanes_abs(z[2]));
    struct lanes doubt = lanes_add(mean.doubt, lanes_mul(lanes_of(64 * UNIT_ROUNDOFF), size));
    doubt = lanes_mul(doubt, lanes_abs(packet->inverse_dz));
    struct lanes t = lanes_mul(mean.z, packet->inverse_dz);
    *from = lanes_sub(t, doubt);
    *to = lanes_add(t, doubt);
}

#endif
