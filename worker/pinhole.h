/*
 * Tests of the triangles of a leaf for rays with a common origin, in float and with vertices of 16 bits, as
 * in worker/rough_triangles.h, which defines units, places and errors.
 *
 * For such rays the value of an edge depends only on a ray's sx and sy, and does so linearly. In the frame
 * sheared for a ray in the middle of the bundle, vertex p is at p.x, p.y and, in units of the leaf's Z, at
 * depth p.z. For a ray that is at (X, Y) relative to the middle ray at depth 1, the vertex is at p.x - X p.z,
 * p.y - Y p.z. So the value of edge pq is
 *
 *     (p.x q.y - p.y q.x) + X (p.y q.z - p.z q.y) + Y (p.z q.x - p.x q.z),
 *
 * where the brackets are computed for eight triangles at once, and once for a bundle. The values for all rays
 * in a window lie between those at the window's corners.
 */
#ifndef FARM_WORKER_PINHOLE_H
#define FARM_WORKER_PINHOLE_H

#include "worker/rough_packet.h"

/* All rays of a bundle with a common origin. */
struct pinhole {
    double from_center[3]; /* the origin, in the order of the shear's axes */
    double sx, sy;         /* the middle of the rays' sx and sy */
    double wide;           /* no ray differs from it by more, except for the middle's rounding */
    bool down;             /* dz < 0 */
};

/* A window of rays, relative to the middle ray. */
struct window {
    struct floats x, y, wide_x, wide_y; /* its middle, and half of its width */
};

/* LANES of these rays. */
struct pinhole_rays {
    struct floats x, y;
    struct window window;
};

/* Half, with a margin for the rounding of subtractions. */
#define WINDOW_HALF (0.5 * (1 + 0x1p-10))

/*
 * Sets up a bundle with a common origin, whose packets are prepared. If rays differ only in the last bit,
 * their middle is one end of their range, and the other end differs by up to 2^-53 more than `wide`. With Z
 * less than 2^40 and a depth of 3/2 that is 0.0002 places, of the 0.002 that PINHOLE_ERROR has left.
 */
static INLINED struct pinhole pinhole_of(const struct bundle *bundle)
{
    const struct packet *packet = bundle->packets[0];
    struct lanes low_x = packet->sx, high_x = low_x, low_y = packet->sy, high_y = low_y;
    for (unsigned i = 1; i < bundle->count; i++) {
        low_x = lanes_smaller(bundle->packets[i]->sx, low_x);
        high_x = lanes_larger(bundle->packets[i]->sx, high_x);
        low_y = lanes_smaller(bundle->packets[i]->sy, low_y);
        high_y = lanes_larger(bundle->packets[i]->sy, high_y);
    }
    double x[2] = {lanes_lowest(low_x), lanes_highest(high_x)};
    double y[2] = {lanes_lowest(low_y), lanes_highest(high_y)};
    struct pinhole eye = {.sx = x[0] / 2 + x[1] / 2,
                          .sy = y[0] / 2 + y[1] / 2,
                          .wide = larger_number(x[1] - x[0], y[1] - y[0]) * WINDOW_HALF,
                          .down = lanes_lowest(packet->inverse_dz) < 0};
    for (unsigned i = 0; i < 3; i++)
        eye.from_center[i] = lanes_lowest(packet->origin[i]) - bundle->bvh->center[bundle->axes[i]];
    return eye;
}

/* The middle of the window is rounded like a ray. */
static INLINED struct pinhole_rays pinhole_rays_of(const struct pinhole *eye,
                                                   const struct packet *packet)
{
    struct lanes x = lanes_sub(packet->sx, lanes_of(eye->sx));
    struct lanes y = lanes_sub(packet->sy, lanes_of(eye->sy));
    double low_x = lanes_lowest(x), low_y = lanes_lowest(y);
    double high_x = lanes_highest(x), high_y = lanes_highest(y);
    return (struct pinhole_rays){floats_of_lanes(x),
                                 floats_of_lanes(y),
                                 {floats_of((float)(low_x / 2 + high_x / 2)),
                                  floats_of((float)(low_y / 2 + high_y / 2)),
                                  floats_of((float)((high_x - low_x) * WINDOW_HALF)),
                                  floats_of((float)((high_y - low_y) * WINDOW_HALF))}};
}

/*
 * Leaves nearer than DEPTH_MIN units are not handled, so the depths of vertices are between 1/2 and 3/2 of Z.
 *
 * PLACE_ERROR, of which less than 1.0763 is used, is the error of x' for a single ray. For rays less than
 * 2^18 aside, with v = 2^-24, the following is added. X errs by 3 2^18 v, as the ray's part, Z and their
 * product are rounded, times a depth of 3/2. A depth errs by 2 v, times 2^18: to 1 is added a term of at most
 * 1/2, whose inverse and product contribute v / 2 each, and the sum v. Together 6.5 2^18 v < 0.1016, and with
 * the former less than 1.178.
 */
#define DEPTH_MIN     0x1p17
#define PINHOLE_ERROR (PLACE_ERROR + 0.1)

/*
 * Error of an edge's value, if for all rays of the bundle the vertices are less than `size` aside, and the
 * rays themselves are less than that from the middle one. The places contribute 4 PINHOLE_ERROR size, and
 * twice the square of that error. Roundings are, in units of v size^2, of a product and of the difference:
 *
 *  - 1 + 2 in the first bracket; 1.5 + 3 in each other one, as depths are at most 3/2, times X or Y;
 *  - 2 in each sum of brackets: whatever is added first, it is the value for another ray of the window, whose
 *    vertices are less than `size` aside as well, and at most 2 size^2. A ray's value takes two such sums, the
 *    largest in a window four.
 *
 * Together 3 + 2 4.5 + 4 2 = 20. If all products are rounded, that adds 1 + 2 1.5 in the brackets, and 3 + 3 in
 * the products of the others with X and Y, of which a window has two parts each: 30. Twice the square is 2.8; a
 * tenth of PINHOLE_ERROR size, which is 7.5 with the least size, has room for it. For small triangles of a
 * leaf, the size of their own vertices gives a tenth of the bound that the leaf's would.
 */
#define PINHOLE_SIZE_MIN 64

static INLINED struct floats pinhole_edge_error(struct floats size)
{
    struct floats share = floats_mul(floats_of((float)(32 * FLOAT_ROUNDOFF)), size);
    return floats_mul(floats_add(share, floats_of((float)(4.1 * PINHOLE_ERROR))), size);
}

/* A leaf relative to the common origin. */
struct pinhole_leaf {
    struct floats base_x, base_y, depth, inverse_depth; /* X, Y and Z of worker/rough_triangles.h */
    /* How much farther aside a vertex may be for other rays than for the middle one. */
    struct floats aside;
    double base_z, unit;
};

/* Sets up a leaf; false: rays must be tested singly. */
static INLINED bool pinhole_leaf_of(const struct pinhole *eye, const unsigned axes[3],
                                    const struct bvh_corners *corners, struct pinhole_leaf *leaf)
{
    double inverse = (double)corners->inverse;
    double z = (double)corners->base[axes[2]] - eye->from_center[2];
    double x = (double)corners->base[axes[0]] - eye->from_center[0] - eye->sx * z;
    double y = (double)corners->base[axes[1]] - eye->from_center[1] - eye->sy * z;
    x *= inverse;
    y *= inverse;
    z *= inverse;
    double wide = eye->wide * fabs(z), aside = larger_number(fabs(x), fabs(y)) + wide;
    leaf->base_x = floats_of((float)x);
    leaf->base_y = floats_of((float)y);
    leaf->depth = floats_of((float)z);
    leaf->inverse_depth = floats_of((float)(1 / z));
    leaf->aside = floats_of((float)(1.5 * wide + PINHOLE_SIZE_MIN));
    leaf->base_z = z;
    leaf->unit = 1 / inverse;
    bool ahead = (z < 0) == eye->down && fabs(z) > DEPTH_MIN && fabs(z) < AHEAD_MAX;
    return ahead && aside < ASIDE_MAX;
}

/* The value of an edge, for each of LANES triangles: at + X x + Y y. */
struct pinhole_edge {
    struct floats at, x, y;
};

struct pinhole_corner {
    struct floats x, y, z;
};

static INLINED struct pinhole_edge pinhole_edge(const struct pinhole_corner *p,
                                                const struct pinhole_corner *q)
{
    return (struct pinhole_edge){floats_mul_sub(p->x, q->y, floats_mul(p->y, q->x)),
                                 floats_mul_sub(p->y, q->z, floats_mul(p->z, q->y)),
                                 floats_mul_sub(p->z, q->x, floats_mul(p->x, q->z))};
}

/* LANES triangles. A ray inside a triangle has positive values for all edges, if all rays certainly see the
 * same side. */
struct pinhole_triangles {
    lane_set sided;
    struct pinhole_edge edges[3];
    struct floats error;       /* error of the values */
    struct floats z[3], range; /* depths of the vertices, as places; their range */
};

static INLINED struct floats most_of_edge(const struct pinhole_edge *edge,
                                          const struct window *window)
{
    struct floats middle =
        floats_mul_add(edge->x, window->x, floats_mul_add(edge->y, window->y, edge->at));
    return floats_mul_add(floats_abs(edge->x), window->wide_x,
                          floats_mul_add(floats_abs(edge->y), window->wide_y, middle));
}

/* The triangles that some ray of the window may cross, including all whose side is uncertain. */
static INLINED lane_set in_window(const struct pinhole_triangles *seen, const struct window *window)
{
    struct floats least = most_of_edge(&seen->edges[0], window);
    least = floats_smaller(most_of_edge(&seen->edges[1], window), least);
    least = floats_smaller(most_of_edge(&seen->edges[2], window), least);
    return ALL_LANES & ~(seen->sided & floats_less(floats_add(least, seen->error), floats_of(0)));
}

static INLINED struct floats sum_of_three(struct floats a, struct floats b, struct floats c)
{
    return floats_add(floats_add(a, b), c);
}

/*
 * Orients the triangles towards the side that all rays of the window see, by the sign of the sum of the
 * edges' values, which errs by three errors.
 */
static INLINED void take_sides(struct pinhole_triangles *seen, const struct window *window)
{
    struct pinhole_edge *edges = seen->edges;
    struct floats at = sum_of_three(edges[0].at, edges[1].at, edges[2].at);
    struct floats x = sum_of_three(edges[0].x, edges[1].x, edges[2].x);
    struct floats y = sum_of_three(edges[0].y, edges[1].y, edges[2].y);
    struct floats doubt = floats_mul(seen->error, floats_of(4));
    doubt = floats_mul_add(floats_abs(x), window->wide_x, doubt);
    doubt = floats_mul_add(floats_abs(y), window->wide_y, doubt);
    seen->sided = floats_less(doubt, floats_abs(at));
    UNROLLED
    for (unsigned k = 0; k < 3; k++) {
        edges[k].at = floats_flip(edges[k].at, at);
        edges[k].x = floats_flip(edges[k].x, at);
        edges[k].y = floats_flip(edges[k].y, at);
    }
}

/* Sets up LANES of a leaf's triangles; returns those that some ray may cross. */
static INLINED lane_set pinhole_triangles(const struct pinhole *eye,
                                          const struct pinhole_leaf *leaf,
                                          const struct rough_places *places,
                                          struct pinhole_triangles *seen)
{
    struct pinhole_corner corner[3];
    struct floats sx = floats_of((float)eye->sx), sy = floats_of((float)eye->sy);
    struct floats most = floats_of(0); /* largest distance aside */
    UNROLLED
    for (unsigned k = 0; k < 3; k++) {
        struct floats z = places->at[2][k];
        struct rough_corners at =
            rough_shear(places->at[0][k], places->at[1][k], z, leaf->base_x, leaf->base_y, sx, sy);
        corner[k] = (struct pinhole_corner){at.x, at.y,
                                            floats_mul_add(z, leaf->inverse_depth, floats_of(1))};
        seen->z[k] = z;
        most = floats_larger(floats_larger(floats_abs(at.x), floats_abs(at.y)), most);
    }
    struct floats last = floats_larger(floats_larger(seen->z[0], seen->z[1]), seen->z[2]);
    struct floats first = floats_smaller(floats_smaller(seen->z[0], seen->z[1]), seen->z[2]);
    seen->range = floats_sub(last, first);
    seen->error = pinhole_edge_error(floats_add(most, leaf->aside));
    seen->edges[0] = pinhole_edge(&corner[1], &corner[2]);
    seen->edges[1] = pinhole_edge(&corner[2], &corner[0]);
    seen->edges[2] = pinhole_edge(&corner[0], &corner[1]);
    struct floats wide = floats_abs(floats_mul(leaf->depth, floats_of(float_above(eye->wide))));
    struct window all = {floats_of(0), floats_of(0), wide, wide};
    take_sides(seen, &all);
    return in_window(seen, &all);
}

/* Rays at a leaf: (X, Y) and their window. */
static INLINED struct pinhole_rays rays_at_leaf(const struct pinhole_rays *rays,
                                                const struct pinhole_leaf *leaf)
{
    const struct window *window = &rays->window;
    return (struct pinhole_rays){floats_mul(rays->x, leaf->depth),
                                 floats_mul(rays->y, leaf->depth),
                                 {floats_mul(window->x, leaf->depth),
                                  floats_mul(window->y, leaf->depth),
                                  floats_abs(floats_mul(window->wide_x, leaf->depth)),
                                  floats_abs(floats_mul(window->wide_y, leaf->depth))}};
}

static INLINED struct floats edge_at(const struct pinhole_edge *edge, unsigned i,
                                     const struct pinhole_rays *rays)
{
    return floats_mul_add(
        floats_splat(&edge->x, i), rays->x,
        floats_mul_add(floats_splat(&edge->y, i), rays->y, floats_splat(&edge->at, i)));
}

/*
 * The rays that certainly cross triangle i, and bounds on their distances; *open: rays that may cross it. As
 * in rough_distances(), the error is that of the weights and one place. That place also covers the nine
 * roundings of the mean, seven if products are not rounded: 2^16 v each, less than 2^-4.
 */
static INLINED struct rough_crossings
pinhole_crossings(const struct packet *packet, const struct pinhole_leaf *leaf,
                  const struct pinhole_triangles *seen, unsigned i,
                  const struct pinhole_rays *through, lane_set rays, lane_set *open)
{
    struct floats e0 = edge_at(&seen->edges[0], i, through);
    struct floats e1 = edge_at(&seen->edges[1], i, through);
    struct floats e2 = edge_at(&seen->edges[2], i, through);
    struct floats low = floats_smaller(floats_smaller(e0, e1), e2);
    struct floats error = floats_splat(&seen->error, i);
    lane_set sided = seen->sided >> i & 1 ? ALL_LANES : 0;
    lane_set crossed = rays & sided & floats_less(error, low);
    lane_set missed = sided & floats_less(floats_add(low, error), floats_of(0));
    struct rough_crossings found = {.maybe = crossed, .certain = crossed};
    *open = rays & ~(crossed | missed);
    if (!crossed) return found;
    struct floats inverse = floats_div(floats_of(1), sum_of_three(e0, e1, e2));
    struct floats mean = floats_mul(e0, floats_splat(&seen->z[0], i));
    mean = floats_mul_add(e1, floats_splat(&seen->z[1], i), mean);
    mean = floats_mul(floats_mul_add(e2, floats_splat(&seen->z[2], i), mean), inverse);
    struct floats share = floats_mul(floats_mul(floats_of(6.1f), error), inverse);
    struct floats doubt = floats_mul_add(floats_smaller(share, floats_of(1)),
                                         floats_splat(&seen->range, i), floats_of(1));
    struct lanes scale = lanes_mul(lanes_of(leaf->unit), packet->inverse_dz);
    struct lanes t = lanes_mul(lanes_add(lanes_of_floats(mean), lanes_of(leaf->base_z)), scale);
    struct lanes off = lanes_mul(lanes_of_floats(doubt), lanes_abs(scale));
    found.from = lanes_sub(t, off);
    found.to = lanes_add(t, off);
    return found;
}

#endif
