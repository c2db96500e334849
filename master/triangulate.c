#include "master/triangulate.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"

struct corner {
    double x, y;         /* seen along the dominant axis, the polygon counter-clockwise */
    uint32_t prev, next; /* neighbours in what is left of the outline */
    double turn;         /* twice the area of (prev, this, next): > 0 convex, < 0 reflex */
    bool ear;
    bool listed; /* among the blockers */
    bool cut;    /* no longer part of the outline */
};

/* Areas (the polygon has a size of about 1) that rounding may have turned over: a few thousand
 * units of DBL_EPSILON. They are nothing to complain about. */
#define ROUNDING 1e-12

static double turn_of(const struct corner *a, const struct corner *b, const struct corner *c)
{
    return (b->x - a->x) * (c->y - a->y) - (b->y - a->y) * (c->x - a->x);
}

static bool same_place(const struct corner *a, const struct corner *b)
{
    return a->x == b->x && a->y == b->y;
}

/* ---- the plane ---- */

/* A power of two that brings the polygon to a size of about 1, so that no product overflows. */
static int size_exponent(const struct vec3 *polygon, size_t count)
{
    double largest = 0;
    for (size_t i = 0; i < count; i++) {
        struct vec3 half = vec_sub(vec_scale(polygon[i], 0.5), vec_scale(polygon[0], 0.5));
        largest = fmax(largest, fmax(fabs(half.x), fmax(fabs(half.y), fabs(half.z))));
    }
    int exponent;
    (void)frexp(largest, &exponent);
    return exponent + 1;
}

/* The corners relative to the first one, in that size. */
static void shrink(const struct vec3 *polygon, size_t count, struct vec3 *points)
{
    int exponent = size_exponent(polygon, count);
    /* In two steps, as the whole factor may lie outside of the range of double. */
    double first = ldexp(1, -exponent / 2), second = ldexp(1, -exponent - -exponent / 2);
    struct vec3 origin = vec_scale(vec_scale(polygon[0], first), second);
    for (size_t i = 0; i < count; i++)
        points[i] = vec_sub(vec_scale(vec_scale(polygon[i], first), second), origin);
}

/* Newell's normal: its components are twice the areas of the polygon's shadows along the axes. */
static struct vec3 newell_normal(const struct vec3 *points, size_t count)
{
    struct vec3 normal = vec3(0, 0, 0);
    struct vec3 a = points[count - 1];
    for (size_t i = 0; i < count; i++) {
        normal = vec_add(normal, vec_cross(a, points[i]));
        a = points[i];
    }
    return normal;
}

/* Twice the area of a triangle of corners, as a vector across it. */
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

/* ---- ears ---- */

/*
 * Whether the outline runs from corner p, which lies on corner b of the triangle (a, b, c), into
 * the triangle: such an outline has no corner of its own in the triangle when it leaves it again.
 */
static bool runs_inside(const struct corner *corners, const struct corner *p,
                        const struct corner *a, const struct corner *b, const struct corner *c)
{
    uint32_t ends[2] = {p->prev, p->next};
    for (int i = 0; i < 2; i++) {
        const struct corner *end = &corners[ends[i]];
        if (turn_of(b, c, end) > 0 && turn_of(a, b, end) > 0) return true;
    }
    return false;
}

/* Whether corner p of the outline, none of the triangle's own, makes the triangle no ear. */
static bool blocks(const struct corner *corners, const struct corner *p, const struct corner *a,
                   const struct corner *b, const struct corner *c)
{
    if (same_place(p, a)) return runs_inside(corners, p, c, a, b);
    if (same_place(p, b)) return runs_inside(corners, p, a, b, c);
    if (same_place(p, c)) return runs_inside(corners, p, b, c, a);
    return turn_of(a, b, p) >= 0 && turn_of(b, c, p) >= 0 && turn_of(c, a, p) >= 0;
}

/* Only corners that are not convex can lie in an ear. Drops those that no longer count. */
static bool is_blocked(struct triangulation *out, const struct corner *a, const struct corner *b,
                       const struct corner *c)
{
    struct corner *corners = out->corners;
    double min_x = fmin(a->x, fmin(b->x, c->x)), max_x = fmax(a->x, fmax(b->x, c->x));
    double min_y = fmin(a->y, fmin(b->y, c->y)), max_y = fmax(a->y, fmax(b->y, c->y));
    for (size_t i = 0; i < out->blocker_count; i++) {
        struct corner *p = &corners[out->blockers[i]];
        if (p->cut || p->turn > 0) {
            p->listed = false;
            out->blockers[i--] = out->blockers[--out->blocker_count];
            continue;
        }
        if (p->x < min_x || p->x > max_x || p->y < min_y || p->y > max_y) continue;
        if (p != a && p != b && p != c && blocks(corners, p, a, b, c)) return true;
    }
    return false;
}

static void measure(struct triangulation *out, uint32_t index)
{
    struct corner *b = &out->corners[index];
    b->turn = turn_of(&out->corners[b->prev], b, &out->corners[b->next]);
    if (b->turn > 0 || b->listed) return;
    b->listed = true;
    out->blockers[out->blocker_count++] = index;
}

static void judge(struct triangulation *out, uint32_t index)
{
    struct corner *b = &out->corners[index];
    b->ear = b->turn > 0 && !is_blocked(out, &out->corners[b->prev], b, &out->corners[b->next]);
}

static void judge_all(struct triangulation *out, uint32_t start)
{
    uint32_t i = start;
    do {
        judge(out, i);
        i = out->corners[i].next;
    } while (i != start);
}

/* Takes a corner off the outline; gives the one before it. */
static uint32_t cut(struct triangulation *out, uint32_t index)
{
    struct corner *corner = &out->corners[index];
    corner->cut = true;
    out->corners[corner->prev].next = corner->next;
    out->corners[corner->next].prev = corner->prev;
    measure(out, corner->prev);
    measure(out, corner->next);
    judge(out, corner->prev);
    judge(out, corner->next);
    return corner->prev;
}

/* A corner that is no ear gives a triangle all the same, so that no hole is left, unless there is
 * nothing to it. */
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

static bool find_ear(const struct corner *corners, uint32_t *at)
{
    uint32_t start = *at;
    do {
        if (corners[*at].ear) return true;
        *at = corners[*at].next;
    } while (*at != start);
    return false;
}

/*
 * The corner to take off when there is no ear: one without area if there is one, else the most
 * convex one (the polygon crosses itself, or rounding says so).
 */
static uint32_t find_worst(const struct corner *corners, uint32_t start)
{
    uint32_t best = start, i = start;
    do {
        if (corners[i].turn == 0) return i;
        if (corners[i].turn > corners[best].turn) best = i;
        i = corners[i].next;
    } while (i != start);
    return best;
}

static void clip(struct triangulation *out, size_t count)
{
    struct corner *corners = out->corners;
    uint32_t at = 0;
    project(out->points, count, corners);
    out->blocker_count = 0;
    for (uint32_t i = 0; i < count; i++)
        measure(out, i);
    judge_all(out, at);
    for (size_t left = count; left >= 3; left--) {
        if (!find_ear(corners, &at)) at = find_worst(corners, at);
        emit(out, at);
        /* Going on at the corner after next keeps the triangles of a round outline from becoming a
         * fan of slivers. */
        at = corners[corners[cut(out, at)].next].next;
    }
}

/* ---- polygons of four corners ---- */

/* The lesser of two triangles' shares in the area that is seen along the normal; < 0: one of them
 * faces the other way. */
static double least_share(const struct vec3 *points, const uint32_t t[2][3], struct vec3 normal)
{
    return fmin(vec_dot(triangle_normal(points, t[0]), normal),
                vec_dot(triangle_normal(points, t[1]), normal));
}

/*
 * Cuts along the diagonal that leaves both halves facing the way of the whole. Unlike ears, which
 * are looked for in the polygon's shadow, this is right for the bent quads of height fields too,
 * and always gives two triangles.
 */
static void split(struct triangulation *out)
{
    static const uint32_t halves[2][2][3] = {{{3, 0, 1}, {1, 2, 3}}, {{0, 1, 2}, {0, 2, 3}}};
    struct vec3 normal = newell_normal(out->points, 4);
    double first = least_share(out->points, halves[0], normal);
    double second = least_share(out->points, halves[1], normal);
    bool use_first = first > ROUNDING || first > second;
    memcpy(out->triangles, halves[use_first ? 0 : 1], sizeof halves[0]);
    out->count = 2;
    /* A bow tie as wide on both sides has no normal. */
    out->improper = (first < -ROUNDING && second < -ROUNDING) ||
                    (vec_length(normal) <= ROUNDING &&
                     vec_length(triangle_normal(out->points, halves[1][0])) > ROUNDING);
}

const char *triangulate(const struct vec3 *polygon, size_t count, struct triangulation *out)
{
    out->count = 0;
    out->improper = false;
    if (count < 3) return "a polygon needs at least 3 corners";
    if (count > POLYGON_MAX_CORNERS)
        return "the polygon has too many corners, at most 20000 are possible";
    if (count > out->capacity) {
        out->capacity = count;
        out->blockers = reallocate(out->blockers, count, sizeof *out->blockers);
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
    if (count == 4)
        split(out);
    else
        clip(out, count);
    return NULL;
}

void triangulation_free(struct triangulation *triangulation)
{
    free(triangulation->blockers);
    free(triangulation->points);
    free(triangulation->corners);
    free(triangulation->triangles);
    *triangulation = (struct triangulation){0};
}
