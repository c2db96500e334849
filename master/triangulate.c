#include "master/triangulate.h"

#include <assert.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"

struct corner {
    double x, y; /* projected along the dominant axis, so that the polygon is counter-clockwise */
    uint32_t prev, next; /* neighbours in what is left of the outline */
    double turn;         /* twice the area of (prev, this, next): > 0 convex, < 0 reflex */
    bool ear;
    bool listed;      /* in the list of a cell of the grid */
    uint32_t in_cell; /* the next one in that list, or NONE */
    bool cut;         /* no longer part of the outline */
};

#define NONE UINT32_MAX

/* The most cells along an edge of the grid: half as many cells as corners. */
#define GRID_EDGE 100

_Static_assert(2 * GRID_EDGE * GRID_EDGE >= POLYGON_MAX_CORNERS, "a cell for each two corners");

/* A uniform grid with a list per cell of the corners in it that are not convex. */
struct grid {
    double x, y;             /* its least x and y */
    double scale_x, scale_y; /* cells per unit of length */
    uint32_t edge;           /* cells across */
    uint32_t cells[GRID_EDGE * GRID_EDGE];
};

/* Areas up to this (of a polygon of size about 1) may have the wrong sign by rounding, a few thousand units of
 * DBL_EPSILON, and cause no complaint. */
#define ROUNDING 1e-12

/* ---- orientation ---- */

/*
 * An exact predicate, after J. R. Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
 * Predicates", Discrete & Computational Geometry 18, 1997. Rounded, a corner on an edge would lie beside it, where the
 * outline seems to cross itself.
 */

/* The rounding error of sum = a + b (Knuth's TwoSum). */
static double error_of_sum(double a, double b, double sum)
{
    double part = sum - a;
    return (a - (sum - part)) + (b - part);
}

/* A sum without error. Its components do not overlap, are ordered by size, and none is 0. */
struct expansion {
    double components[16];
    int count;
};

/* Shewchuk's Grow-Expansion, without components that are 0. */
static void add(struct expansion *sum, double number)
{
    int kept = 0;
    for (int i = 0; i < sum->count; i++) {
        double component = sum->components[i], high = number + component;
        double error = error_of_sum(number, component, high);
        if (error != 0) sum->components[kept++] = error;
        number = high;
    }
    if (number != 0) sum->components[kept++] = number;
    sum->count = kept;
}

static void add_product(struct expansion *sum, double a, double b)
{
    double product = a * b;
    add(sum, fma(a, b, -product));
    add(sum, product);
}

/* a - b without error: rounded, and the rest. */
static void subtract(double a, double b, double difference[2])
{
    difference[0] = a - b;
    difference[1] = error_of_sum(a, -b, difference[0]);
}

/* turn_of() of triangles that are small or have no area. Not inlined, as that would make the others slower. */
static __attribute__((noinline)) double
small_turn_of(const struct corner *a, const struct corner *b, const struct corner *c)
{
    double ab_x[2], ab_y[2], ac_x[2], ac_y[2];
    subtract(b->x, a->x, ab_x);
    subtract(b->y, a->y, ab_y);
    subtract(c->x, a->x, ac_x);
    subtract(c->y, a->y, ac_y);
    double left = ab_x[0] * ac_y[0], right = ab_y[0] * ac_x[0];
    /* Shewchuk's ccwerrboundA */
    double error = (3 + 16 * 0x1p-53) * 0x1p-53 * (fabs(left) + fabs(right));
    if (fabs(left - right) >= error) return left - right;
    /* Mostly the differences are exact. Then Kahan's difference of products has the right sign. */
    if (ab_x[1] == 0 && ab_y[1] == 0 && ac_x[1] == 0 && ac_y[1] == 0)
        return fma(ab_x[0], ac_y[0], -right) - fma(ab_y[0], ac_x[0], -right);
    struct expansion turn = {.count = 0};
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) {
            add_product(&turn, ab_x[i], ac_y[j]);
            add_product(&turn, -ab_y[i], ac_x[j]);
        }
    return turn.count > 0 ? turn.components[turn.count - 1] : 0;
}

/*
 * Twice the area of (a, b, c), > 0 if it is counter-clockwise. Its sign is exact unless a coordinate that is not 0 is
 * less than 2^-400 of the polygon's size: products may underflow then.
 */
static double turn_of(const struct corner *a, const struct corner *b, const struct corner *c)
{
    double turn = (b->x - a->x) * (c->y - a->y) - (b->y - a->y) * (c->x - a->x);
    /* No difference is above 2, so that the error is at most 24 * 2^-53. */
    return fabs(turn) > 0x1p-48 ? turn : small_turn_of(a, b, c);
}

static bool same_place(const struct corner *a, const struct corner *b)
{
    return a->x == b->x && a->y == b->y;
}

/* ---- the plane ---- */

/* The exponent of a power of two that scales the polygon to a size of about 1, so that no product overflows. */
static int size_exponent(const struct vec3 *polygon, size_t count)
{
    double largest = 0;
    for (size_t i = 0; i < count; i++) {
        struct vec3 half = vec_sub(vec_scale(polygon[i], 0.5), vec_scale(polygon[0], 0.5));
        largest = fmax(largest, vec_largest(half));
    }
    int exponent;
    (void)frexp(largest, &exponent);
    return exponent + 1;
}

/* The corners, scaled to that size. Their origin stays, as to subtract a corner would round. A coordinate that all have
 * in common becomes 0, for it may overflow; others are at most 2^53 times the size. */
static void shrink(const struct vec3 *polygon, size_t count, struct vec3 *points)
{
    int exponent = size_exponent(polygon, count);
    /* In two steps, as the whole factor may lie outside of the range of double. */
    double first = ldexp(1, -exponent / 2), second = ldexp(1, -exponent - -exponent / 2);
    bool x = false, y = false, z = false;
    for (size_t i = 1; i < count; i++) {
        x = x || polygon[i].x != polygon[0].x;
        y = y || polygon[i].y != polygon[0].y;
        z = z || polygon[i].z != polygon[0].z;
    }
    for (size_t i = 0; i < count; i++) {
        struct vec3 p = polygon[i], differs = vec3(x ? p.x : 0, y ? p.y : 0, z ? p.z : 0);
        points[i] = vec_scale(vec_scale(differs, first), second);
    }
}

/* Newell's normal: its components are twice the areas of the polygon's projections along the axes. */
static struct vec3 newell_normal(const struct vec3 *points, size_t count)
{
    struct vec3 normal = vec3(0, 0, 0);
    struct vec3 a = vec_sub(points[count - 1], points[0]);
    for (size_t i = 0; i < count; i++) {
        struct vec3 b = vec_sub(points[i], points[0]);
        normal = vec_add(normal, vec_cross(a, b));
        a = b;
    }
    return normal;
}

/* The normal of a triangle of corners, whose length is twice the area. */
static struct vec3 triangle_normal(const struct vec3 *points, const uint32_t t[3])
{
    return vec_cross(vec_sub(points[t[1]], points[t[0]]), vec_sub(points[t[2]], points[t[0]]));
}

static void project(const struct vec3 *points, size_t count, struct corner *corners)
{
    struct vec3 n = newell_normal(points, count);
    struct vec3 size = vec3(fabs(n.x), fabs(n.y), fabs(n.z));
    for (size_t i = 0; i < count; i++) {
        struct vec3 p = points[i];
        struct corner *c = &corners[i];
        double sense;
        if (size.x >= size.y && size.x >= size.z)
            c->x = p.y, c->y = p.z, sense = n.x;
        else if (size.y >= size.z)
            c->x = p.z, c->y = p.x, sense = n.y;
        else
            c->x = p.x, c->y = p.y, sense = n.z;
        if (sense < 0) c->y = -c->y;
        c->listed = c->cut = false;
        c->prev = (uint32_t)(i == 0 ? count - 1 : i - 1);
        c->next = (uint32_t)(i + 1 == count ? 0 : i + 1);
    }
}

/* ---- the grid ---- */

static double cells_in_a_unit(double extent, uint32_t edge)
{
    double scale = edge / extent;
    return extent > 0 && isfinite(scale) ? scale : 0;
}

static void begin_grid(struct grid *grid, const struct corner *corners, size_t count)
{
    double min_x = corners[0].x, max_x = min_x, min_y = corners[0].y, max_y = min_y;
    for (size_t i = 1; i < count; i++) {
        min_x = fmin(min_x, corners[i].x), max_x = fmax(max_x, corners[i].x);
        min_y = fmin(min_y, corners[i].y), max_y = fmax(max_y, corners[i].y);
    }
    uint32_t edge = (uint32_t)sqrt((double)count / 2);
    grid->x = min_x, grid->y = min_y, grid->edge = edge;
    grid->scale_x = cells_in_a_unit(max_x - min_x, edge);
    grid->scale_y = cells_in_a_unit(max_y - min_y, edge);
    memset(grid->cells, 0xff, (size_t)edge * edge * sizeof *grid->cells); /* NONE */
}

/* Monotonic in along. */
static uint32_t cell_at(const struct grid *grid, double along, double scale)
{
    double cell = along * scale;
    return cell < grid->edge - 1 ? (uint32_t)cell : grid->edge - 1;
}

static uint32_t column_of(const struct grid *grid, double x)
{
    return cell_at(grid, x - grid->x, grid->scale_x);
}

static uint32_t row_of(const struct grid *grid, double y)
{
    return cell_at(grid, y - grid->y, grid->scale_y);
}

static uint32_t *cell_of(struct grid *grid, const struct corner *corner)
{
    return &grid->cells[row_of(grid, corner->y) * grid->edge + column_of(grid, corner->x)];
}

/* ---- ears ---- */

/*
 * Whether corner p of the outline, none of the triangle's own, prevents the triangle (a, b, c) from being an ear. On
 * the edges ab and bc, which are part of the outline, other parts of it may lie, too: there p only does if the outline
 * goes on into the triangle, which it may leave again without another corner in it.
 */
static bool blocks(const struct corner *corners, const struct corner *p, const struct corner *a,
                   const struct corner *b, const struct corner *c)
{
    double ab = turn_of(a, b, p);
    if (ab < 0) return false;
    double bc = turn_of(b, c, p);
    if (bc < 0) return false;
    double ca = turn_of(c, a, p);
    if (ca < 0) return false;
    if (ab > 0 && bc > 0) return true;
    const struct corner *ends[2] = {&corners[p->prev], &corners[p->next]};
    for (int i = 0; i < 2; i++)
        if ((ab > 0 || turn_of(a, b, ends[i]) > 0) && (bc > 0 || turn_of(b, c, ends[i]) > 0) &&
            (ca > 0 || turn_of(c, a, ends[i]) > 0))
            return true;
    return false;
}

struct box {
    double min_x, max_x, min_y, max_y;
};

static bool is_outside(const struct corner *p, const struct box *box)
{
    return p->x < box->min_x || p->x > box->max_x || p->y < box->min_y || p->y > box->max_y;
}

/* Checks the corners listed in one cell. Removes those from the list that are cut or have become convex. */
static bool is_blocked_in(struct triangulation *out, uint32_t *cell, const struct box *box,
                          const struct corner *a, const struct corner *b, const struct corner *c)
{
    struct corner *corners = out->corners;
    out->looks++;
    for (uint32_t *link = cell; *link != NONE; out->looks++) {
        struct corner *p = &corners[*link];
        if (p->cut || p->turn > 0) {
            p->listed = false;
            *link = p->in_cell;
            continue;
        }
        link = &p->in_cell;
        if (is_outside(p, box) || p == a || p == b || p == c) continue;
        if (blocks(corners, p, a, b, c)) return true;
    }
    return false;
}

/* Only corners that are not convex can be inside an ear. */
static bool is_blocked(struct triangulation *out, const struct corner *a, const struct corner *b,
                       const struct corner *c)
{
    struct grid *grid = out->grid;
    struct box box = {fmin(a->x, fmin(b->x, c->x)), fmax(a->x, fmax(b->x, c->x)),
                      fmin(a->y, fmin(b->y, c->y)), fmax(a->y, fmax(b->y, c->y))};
    uint32_t first = column_of(grid, box.min_x), last = column_of(grid, box.max_x);
    uint32_t bottom = row_of(grid, box.min_y), top = row_of(grid, box.max_y);
    for (uint32_t row = bottom; row <= top; row++)
        for (uint32_t column = first; column <= last; column++)
            if (is_blocked_in(out, &grid->cells[row * grid->edge + column], &box, a, b, c))
                return true;
    return false;
}

static void update_turn(struct triangulation *out, uint32_t index)
{
    struct corner *b = &out->corners[index];
    b->turn = turn_of(&out->corners[b->prev], b, &out->corners[b->next]);
    if (b->turn > 0 || b->listed) return;
    uint32_t *cell = cell_of(out->grid, b);
    b->listed = true;
    b->in_cell = *cell;
    *cell = index;
}

static void update_ear(struct triangulation *out, uint32_t index)
{
    struct corner *b = &out->corners[index];
    b->ear = b->turn > 0 && !is_blocked(out, &out->corners[b->prev], b, &out->corners[b->next]);
}

static void update_ears(struct triangulation *out, uint32_t start)
{
    uint32_t i = start;
    do {
        update_ear(out, i);
        i = out->corners[i].next;
    } while (i != start);
}

/* Removes a corner from the outline; returns the one before it. */
static uint32_t cut(struct triangulation *out, uint32_t index)
{
    struct corner *corner = &out->corners[index];
    corner->cut = true;
    out->corners[corner->prev].next = corner->next;
    out->corners[corner->next].prev = corner->prev;
    update_turn(out, corner->prev);
    update_turn(out, corner->next);
    update_ear(out, corner->prev);
    update_ear(out, corner->next);
    return corner->prev;
}

/* Adds the triangle of a corner. One that is no ear is added, too, so that no hole is left, unless it has no area. */
static void emit(struct triangulation *out, uint32_t index)
{
    const struct corner *corner = &out->corners[index];
    const uint32_t triangle[3] = {corner->prev, index, corner->next};
    if (!corner->ear) {
        struct vec3 normal = triangle_normal(out->points, triangle);
        if (vec_is_zero(normal)) return;
        if (corner->turn != 0 && vec_length(normal) > ROUNDING) out->improper = true;
    }
    memcpy(out->triangles[out->count++], triangle, sizeof triangle);
}

static bool find_ear(struct triangulation *out, uint32_t *at)
{
    const struct corner *corners = out->corners;
    uint32_t start = *at;
    do {
        out->looks++;
        if (corners[*at].ear) return true;
        *at = corners[*at].next;
    } while (*at != start);
    return false;
}

/*
 * The corner to cut when there is no ear: one without area if there is one, else the most convex one (the polygon
 * crosses itself, or seems to by rounding).
 */
static uint32_t find_fallback(struct triangulation *out, uint32_t start)
{
    const struct corner *corners = out->corners;
    uint32_t best = start, i = start;
    do {
        out->looks++;
        if (corners[i].turn == 0) return i;
        if (corners[i].turn > corners[best].turn) best = i;
        i = corners[i].next;
    } while (i != start);
    return best;
}

/* ---- spikes ---- */

/* Whether the outline comes back from b towards c along the edge on which it has come from a. */
static bool comes_back(const struct corner *a, const struct corner *b, const struct corner *c)
{
    double along = (a->x - b->x) * (c->x - b->x) + (a->y - b->y) * (c->y - b->y);
    return same_place(a, c) || (turn_of(a, b, c) == 0 && along > 0);
}

static bool is_spike(const struct corner *corners, uint32_t index)
{
    const struct corner *corner = &corners[index];
    return comes_back(&corners[corner->prev], corner, &corners[corner->next]);
}

/*
 * Cuts off the spike at this corner, if there is one, with all that comes back along the same edges. Where an ear has
 * been cut off beside it, that is what is left of a lobe that touches the rest of the polygon in a corner, or hangs on
 * a bridge. It has no area, but a triangle of the corner at its foot would span from one lobe to the other. (Tips of
 * slits, which have the polygon on both sides, only come with the outline.) Subtracts from *left the corners that it
 * cuts off; returns the corner before the spike, or this one if there is none.
 */
static uint32_t cut_spike(struct triangulation *out, uint32_t index, size_t *left)
{
    const struct corner *corners = out->corners;
    while (*left >= 3 && is_spike(corners, index)) {
        index = cut(out, index);
        --*left;
        uint32_t foot = corners[index].next;
        if (!same_place(&corners[index], &corners[foot])) {
            /* One side has a corner that the other has not: it is the tip of what is left. */
            if (!is_spike(corners, index) && is_spike(corners, foot)) index = foot;
            continue;
        }
        /* The two feet stay, which may have normals of their own, unless they are the tip of a longer spike. */
        const struct corner *before = &corners[corners[index].prev],
                            *after = &corners[corners[foot].next];
        if (!comes_back(before, &corners[index], after)) break;
        cut(out, foot);
        --*left;
    }
    return index;
}

/*
 * Whether a spike stands out of the polygon, else it is a slit: the number of edges to the right of a point beside it
 * is even. That point is at the tip b, a little towards the other end a of its last edge, or above that edge.
 */
static bool stands_out(struct triangulation *out, size_t count, uint32_t index)
{
    const struct corner *b = &out->corners[index], *a = &out->corners[b->prev];
    double y = a->y < b->y ? b->y : nextafter(b->y, HUGE_VAL);
    bool even = true;
    out->looks += count;
    for (size_t i = 0; i < count; i++) {
        const struct corner *p = &out->corners[i], *q = &out->corners[i + 1 < count ? i + 1 : 0];
        bool rises = p->y < y;
        if (rises == (q->y < y)) continue;
        double turn = turn_of(p, q, b);
        if (turn == 0) turn = turn_of(p, q, a);
        if (rises ? turn > 0 : turn < 0) even = !even;
    }
    return even;
}

/* Cuts off the hair at this corner, with one of the two corners at its foot: with both neither could be an ear. Returns
 * the corner before it. */
static uint32_t cut_hair(struct triangulation *out, uint32_t index, size_t *left)
{
    const struct corner *corners = out->corners;
    index = cut_spike(out, index, left);
    uint32_t foot = corners[index].next;
    if (*left < 3 || !same_place(&corners[index], &corners[foot])) return index;
    cut(out, foot);
    --*left;
    return index;
}

/* Cuts off the hairs, unless that takes more looks than it may: where they bend, triangles outside of the polygon would
 * seem to be ears. */
static void cut_hairs(struct triangulation *out, size_t count, uint64_t most, size_t *left)
{
    const struct corner *corners = out->corners;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t at = i;
        while (*left >= 3 && out->looks <= most && !corners[at].cut && is_spike(corners, at) &&
               stands_out(out, count, at)) {
            at = cut_hair(out, at, left);
            if (!is_spike(corners, at)) at = corners[at].next;
        }
    }
}

/* ---- the whole ---- */

/* Ear clipping; false if it takes more looks than it may. */
static bool clip(struct triangulation *out, size_t count)
{
    struct corner *corners = out->corners;
    uint64_t most = (uint64_t)POLYGON_LOOKS * count;
    uint32_t at = 0;
    size_t left = count;
    project(out->points, count, corners);
    begin_grid(out->grid, corners, count);
    out->looks = 0;
    for (uint32_t i = 0; i < count; i++)
        update_turn(out, i);
    cut_hairs(out, count, most, &left);
    while (corners[at].cut)
        at++;
    update_ears(out, at);
    while (left >= 3) {
        if (out->looks > most) return false;
        if (!find_ear(out, &at)) at = find_fallback(out, at);
        emit(out, at);
        at = cut(out, at);
        left--;
        at = cut_spike(out, at, &left);
        /* Going on at the corner after next keeps the triangles of a round outline from becoming a
         * fan of slivers. */
        at = corners[cut_spike(out, corners[at].next, &left)].next;
    }
    return true;
}

/* ---- polygons of four corners ---- */

/* The smaller of the areas of two triangles projected along the normal, up to a common factor; < 0: one of them faces
 * the other way. */
static double least_area(const struct vec3 *points, const uint32_t t[2][3], struct vec3 normal)
{
    return fmin(vec_dot(triangle_normal(points, t[0]), normal),
                vec_dot(triangle_normal(points, t[1]), normal));
}

/*
 * Cuts along the diagonal that leaves both halves facing the same way as the whole. Unlike ears, which are searched in
 * the projection, this is right for the bent quads of height fields, too, and always gives two triangles.
 */
static void split_quad(struct triangulation *out)
{
    static const uint32_t halves[2][2][3] = {{{3, 0, 1}, {1, 2, 3}}, {{0, 1, 2}, {0, 2, 3}}};
    struct vec3 normal = newell_normal(out->points, 4);
    double first = least_area(out->points, halves[0], normal);
    double second = least_area(out->points, halves[1], normal);
    bool use_first = first > ROUNDING || first > second;
    memcpy(out->triangles, halves[use_first ? 0 : 1], sizeof halves[0]);
    out->count = 2;
    /* A bow tie with two equal sides has no normal. */
    out->improper = (first < -ROUNDING && second < -ROUNDING) ||
                    (vec_length(normal) <= ROUNDING &&
                     vec_length(triangle_normal(out->points, halves[1][0])) > ROUNDING);
}

const char *triangulate(const struct vec3 *polygon, size_t count, struct triangulation *out)
{
    out->count = 0;
    out->improper = false;
    assert(count >= 3 && count <= POLYGON_MAX_CORNERS);
    if (count > out->capacity) {
        out->capacity = count;
        out->grid = reallocate(out->grid, 1, sizeof *out->grid);
        out->points = reallocate(out->points, count, sizeof *out->points);
        out->corners = reallocate(out->corners, count, sizeof *out->corners);
        out->triangles = reallocate(out->triangles, count, sizeof *out->triangles);
    }
    if (count == 3) {
        for (uint32_t i = 0; i < 3; i++)
            out->triangles[0][i] = i;
        out->count = 1;
        return NULL;
    }
    shrink(polygon, count, out->points);
    if (count == 4) {
        split_quad(out);
        return NULL;
    }
    return clip(out, count)
               ? NULL
               : "the polygon takes too long to be cut into triangles, expected one that crosses "
                 "itself less or is less tangled";
}

void triangulation_free(struct triangulation *triangulation)
{
    free(triangulation->grid);
    free(triangulation->points);
    free(triangulation->corners);
    free(triangulation->triangles);
    *triangulation = (struct triangulation){0};
}
