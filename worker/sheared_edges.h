/*
 * The filter of triangle_crossings() for several triangles or rays at once, with the same operations in the
 * same order. This file is included once for each WIDE, which is lanes or quad.
 */

#define WIDE_JOIN_(a, b) a##_##b
#define WIDE_JOIN(a, b)  WIDE_JOIN_(a, b)
#define W(name)          WIDE_JOIN(WIDE, name)
#define SHEARED          WIDE_JOIN(sheared, WIDE)

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

#undef WIDE_JOIN_
#undef WIDE_JOIN
#undef W
#undef SHEARED
#undef WIDE
