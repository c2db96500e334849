/*
 * Triangles of a leaf as rays from one point see them, in float and from corners of 16 bits, as in
 * worker/rough_triangles.h, from which units, places and errors are.
 *
 * For such rays, a ray's sx and sy are all that an edge's value depends on, and it does so linearly.
 * In the frame that is sheared for a ray in the middle of the bundle, corner p is at p.x, p.y and,
 * with the leaf's Z for the unit of depth, p.z; a ray that is (X, Y) aside of the middle one where z = 1
 * sees it at p.x - X p.z, p.y - Y p.z. So the value of edge pq is
 *
 *     (p.x q.y - p.y q.x) + X (p.y q.z - p.z q.y) + Y (p.z q.x - p.x q.z),
 *
 * where the brackets are computed for eight triangles at once, and once for a bundle; between the
 * values at the corners of a window of rays are those of all rays in it.
 */
#ifndef FARM_WORKER_PINHOLE_H
#define FARM_WORKER_PINHOLE_H

#include "worker/rough_packet.h"

/* All rays of a bundle that have one origin. */
struct pinhole {
    double from_center[3]; /* the origin, in the order of the shear's axes */
    double sx, sy;         /* the middle of the rays' */
    double wide;           /* those of no ray differ by more, but for the middle's rounding */
    bool down;             /* dz < 0 */
};

/* Some of them: what they are aside of the middle by. */
struct window {
    struct floats x, y, wide_x, wide_y; /* its middle, and half of what it is wide */
};

/* LANES of them. */
struct pinhole_rays {
    struct floats x, y;
    struct window window;
};

/* Half, and what subtractions may be rounded by. */
#define WINDOW_HALF (0.5 * (1 + 0x1p-10))

/*
 * Of a bundle that has one origin, whose packets are prepared. Where rays differ in the last bit alone,
 * their middle is one end of them, and the other end differs by up to 2^-53 more than `wide`. With Z
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

/* Their middle is rounded as a ray is. */
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
 * Nothing is nearer than this, in units: depths of corners are between 1/2 and 3/2 of Z.
 *
 * PLACE_ERROR, of which less than 1.0763 is used, is of x' for a ray on its own. To this are added, of
 * v = 2^-24, for rays less than 2^18 aside: X is off by 3 2^18 v, as the ray's part, Z and their
 * product are rounded, times a depth of 3/2; a depth by 2 v, times 2^18: to 1 something of at most 1/2
 * is added, whose inverse and product make v / 2 each, and the sum v. Together 6.5 2^18 v < 0.1016, and
 * with the former less than 1.178.
 */
#define DEPTH_MIN     0x1p17
#define PINHOLE_ERROR (PLACE_ERROR + 0.1)

/*
 * With corners that all rays of the bundle see less than `size` aside, and rays that are less than that
 * aside of the middle one, an edge's value is off by 4 PINHOLE_ERROR size and the square of that error
 * twice because of the places. Roundings are, in units of v size^2, of a product and of the difference:
 *
 *  - 1 + 2 in the first bracket; 1.5 + 3 in each other one, as depths are at most 3/2, times X or Y;
 *  - 2 in each sum of brackets: whatever is added first, it is the value for another ray of the
 *    window, whose corners are less than `size` aside as well, and no more than 2 size^2. A ray's
 *    value takes two such sums, the largest in a window four.
 *
 * Together 3 + 2 4.5 + 4 2 = 20. Where all products are rounded, that is 1 + 2 1.5 in the brackets, and
 * 3 + 3 of the others with X and Y, which are both parts of a window at most: 30. The square takes 4
 * of the tenth of PINHOLE_ERROR size, of which there are 7.5 with the least size. The size of a triangle's
 * own corners makes for small triangles of a leaf a tenth of what that of the leaf would.
 */
#define PINHOLE_SIZE_MIN 64

static INLINED struct floats pinhole_edge_error(struct floats size)
{
    struct floats share = floats_mul(floats_of((float)(32 * FLOAT_ROUNDOFF)), size);
    return floats_mul(floats_add(share, floats_of((float)(4.1 * PINHOLE_ERROR))), size);
}

/* A leaf as it is seen through the pinhole. */
struct pinhole_leaf {
    struct floats base_x, base_y, depth, inverse_depth; /* X, Y and Z of worker/rough_triangles.h */
    struct floats aside; /* by how much more than the middle ray others see a corner aside */
    double base_z, unit;
};

/* false: rays are to be tested on their own. */
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

/* The value of an edge of each of LANES triangles: at + X x + Y y. */
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

/* LANES triangles. What is inside has positive values of all edges, where the side that is seen is
 * certainly the same for all rays. */
struct pinhole_triangles {
    lane_set sided;
    struct pinhole_edge edges[3];
    struct floats error;       /* of the values */
    struct floats z[3], range; /* places of the corners in depth; between what they are */
};

static INLINED struct floats most_of_edge(const struct pinhole_edge *edge,
                                          const struct window *window)
{
    struct floats middle =
        floats_mul_add(edge->x, window->x, floats_mul_add(edge->y, window->y, edge->at));
    return floats_mul_add(floats_abs(edge->x), window->wide_x,
                          floats_mul_add(floats_abs(edge->y), window->wide_y, middle));
}

/* Of the triangles that have a side those that some ray of the window may cross, and all others. */
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

/* Turns the triangles to the side that all rays of the window see: by the sum of the edges' values,
 * which errs by three errors. */
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

/* LANES of a leaf's triangles from `first` on; returns those that some ray may cross. */
static INLINED lane_set pinhole_triangles(const struct pinhole *eye,
                                          const struct pinhole_leaf *leaf,
                                          const struct rough_places *places,
                                          struct pinhole_triangles *seen)
{
    struct pinhole_corner corner[3];
    struct floats sx = floats_of((float)eye->sx), sy = floats_of((float)eye->sy);
    struct floats most = floats_of(0); /* aside */
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

/* Rays in front of a leaf: (X, Y) and the window that they are in. */
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
 * Triangle i: the rays that certainly cross it, and between what distances; *open: those that may.
 * As in rough_distances() the whole doubt is that of the weights and one place, which takes the nine
 * roundings of the mean, too, seven where products are not rounded: 2^16 v each, less than 2^-4.
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
