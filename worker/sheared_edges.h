/*
 * The filter of triangle_crossings() for several triangles or rays at once, with the same operations in the
 * same order. This file is included once for each WIDE, which is lanes or quad.
 */

#define WIDE_JOIN_(a, b) a##_##b
#define WIDE_JOIN(a, b)  WIDE_JOIN_(a, b)
#define W(name)          WIDE_JOIN(WIDE, name)
#define SHEARED          WIDE_JOIN(sheared, WIDE)
#define EDGES            WIDE_JOIN(edges, WIDE)

/* struct sheared in every lane. */
struct SHEARED {
    struct WIDE x, y, z;
};

static INLINED struct WIDE W(edge)(const struct SHEARED *p, const struct SHEARED *q)
{
    return W(sub)(W(mul)(p->x, q->y), W(mul)(p->y, q->x));
}

static INLINED struct WIDE W(largest)(struct WIDE a, struct WIDE b, struct WIDE c)
{
    return W(larger)(W(larger)(a, b), c);
}

static INLINED struct WIDE W(least)(struct WIDE a, struct WIDE b, struct WIDE c)
{
    return W(smaller)(W(smaller)(a, b), c);
}

static INLINED struct WIDE W(sideways)(const struct SHEARED *p)
{
    return W(add)(W(abs)(p->x), W(abs)(p->y));
}

/* edge_error() in every lane. */
static INLINED struct WIDE W(edge_error)(const struct SHEARED *p, const struct SHEARED *q,
                                         const struct SHEARED *r)
{
    struct WIDE s = W(largest)(W(sideways)(p), W(sideways)(q), W(sideways)(r));
    struct WIDE z = W(largest)(W(abs)(p->z), W(abs)(q->z), W(abs)(r->z));
    struct WIDE product = W(mul)(W(mul)(W(of)(EDGE_FILTER), s), W(add)(z, s));
    return W(add)(product, W(of)(EDGE_LEAST));
}

/* The values of the edges and their error; where the line certainly misses the triangle, and where it certainly
 * crosses it. */
struct EDGES {
    struct WIDE e0, e1, e2, error;
    lane_set missed, crossed;
};

static INLINED struct EDGES W(edges)(const struct SHEARED *p, const struct SHEARED *q,
                                     const struct SHEARED *r)
{
    struct WIDE e0 = W(edge)(q, r), e1 = W(edge)(r, p), e2 = W(edge)(p, q);
    struct WIDE low = W(least)(e0, e1, e2), high = W(largest)(e0, e1, e2);
    struct WIDE error = W(edge_error)(p, q, r), zero = W(of)(0);
    /* The rounded sum has the sign of the exact one: low < -error. */
    lane_set below = W(less)(W(add)(low, error), zero), above = W(less)(error, high);
    lane_set inside = W(less)(error, low) | W(less)(W(add)(high, error), zero);
    return (struct EDGES){e0, e1, e2, error, below & above, inside};
}

#undef WIDE_JOIN_
#undef WIDE_JOIN
#undef W
#undef SHEARED
#undef EDGES
#undef WIDE
