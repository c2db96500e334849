#include "master/triangulate.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "common/message.h"

struct corner {
    double x, y;         /* seen along the dominant axis, the polygon counter-clockwise */
    uint32_t prev, next; /* neighbours in what is left of the outline */
    double turn;         /* twice the area of (prev, this, next): > 0 convex, < 0 reflex */
    bool ear;
    bool listed; /* among the blockers */
    bool cut;    /* no longer part of the outline */
};

/* How often all ears are looked for again when none is left, before one is cut off by force. */
#define RECOUNTS 4

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

static struct vec3 shrink(struct vec3 point, struct vec3 origin, int exponent)
{
    struct vec3 p =
        vec3(ldexp(point.x, -exponent), ldexp(point.y, -exponent), ldexp(point.z, -exponent));
    struct vec3 o =
        vec3(ldexp(origin.x, -exponent), ldexp(origin.y, -exponent), ldexp(origin.z, -exponent));
    return vec_sub(p, o);
}

/* Newell's normal: its components are twice the areas of the polygon's shadows along the axes. */
static struct vec3 newell_normal(const struct vec3 *polygon, size_t count, int exponent)
{
    struct vec3 normal = vec3(0, 0, 0);
    struct vec3 a = shrink(polygon[count - 1], polygon[0], exponent);
    for (size_t i = 0; i < count; i++) {
        struct vec3 b = shrink(polygon[i], polygon[0], exponent);
        normal = vec_add(normal, vec_cross(a, b));
        a = b;
    }
    return normal;
}

static void project(const struct vec3 *polygon, size_t count, struct corner *corners)
{
    int exponent = size_exponent(polygon, count);
    struct vec3 n = newell_normal(polygon, count, exponent);
    struct vec3 size = vec3(fabs(n.x), fabs(n.y), fabs(n.z));
    for (size_t i = 0; i < count; i++) {
        struct vec3 p = shrink(polygon[i], polygon[0], exponent);
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

static void emit(struct triangulation *out, uint32_t index)
{
    const struct corner *corner = &out->corners[index];
    uint32_t *triangle = out->triangles[out->count++];
    triangle[0] = corner->prev;
    triangle[1] = index;
    triangle[2] = corner->next;
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
    int recounts = RECOUNTS;
    out->blocker_count = 0;
    for (uint32_t i = 0; i < count; i++)
        measure(out, i);
    judge_all(out, at);
    for (size_t left = count; left >= 3; left--) {
        bool found = find_ear(corners, &at);
        if (!found && recounts-- > 0) {
            judge_all(out, at);
            found = find_ear(corners, &at);
        }
        if (!found) at = find_worst(corners, at);
        if (corners[at].turn > 0) emit(out, at);
        /* Going on at the corner after next keeps the triangles of a round outline from becoming a
         * fan of slivers. */
        at = corners[corners[cut(out, at)].next].next;
    }
}

const char *triangulate(const struct vec3 *polygon, size_t count, struct triangulation *out)
{
    out->count = 0;
    if (count < 3) return "a polygon needs at least 3 corners";
    if (count > POLYGON_MAX_CORNERS)
        return "the polygon has too many corners, at most 20000 are possible";
    if (count > out->capacity) {
        out->capacity = count;
        out->blockers = reallocate(out->blockers, count, sizeof *out->blockers);
        out->corners = reallocate(out->corners, count, sizeof *out->corners);
        out->triangles = reallocate(out->triangles, count, sizeof *out->triangles);
    }
    if (count == 3) {
        for (uint32_t i = 0; i < 3; i++)
            out->triangles[0][i] = i;
        out->count = 1;
        return NULL;
    }
    project(polygon, count, out->corners);
    clip(out, count);
    return NULL;
}

void triangulation_free(struct triangulation *triangulation)
{
    free(triangulation->blockers);
    free(triangulation->corners);
    free(triangulation->triangles);
    *triangulation = (struct triangulation){0};
}
