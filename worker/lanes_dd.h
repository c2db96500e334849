/* The double-double arithmetic of worker/exact.h in eight lanes: the same operations, so that each
 * lane has the same bits. */
#ifndef FARM_WORKER_LANES_DD_H
#define FARM_WORKER_LANES_DD_H

#include "worker/lanes.h"

struct lanes3 {
    struct lanes x, y, z;
};

struct lanes_dd {
    struct lanes high, low;
};

struct lanes_dd3 {
    struct lanes_dd x, y, z;
};

/* ---- vectors ---- */

static INLINED struct lanes3 lanes3_sub(struct lanes3 a, struct lanes3 b)
{
    return (struct lanes3){lanes_sub(a.x, b.x), lanes_sub(a.y, b.y), lanes_sub(a.z, b.z)};
}

static INLINED struct lanes lanes3_dot(struct lanes3 a, struct lanes3 b)
{
    return lanes_add(lanes_add(lanes_mul(a.x, b.x), lanes_mul(a.y, b.y)), lanes_mul(a.z, b.z));
}

static INLINED struct lanes3 lanes3_cross(struct lanes3 a, struct lanes3 b)
{
    return (struct lanes3){lanes_sub(lanes_mul(a.y, b.z), lanes_mul(a.z, b.y)),
                           lanes_sub(lanes_mul(a.z, b.x), lanes_mul(a.x, b.z)),
                           lanes_sub(lanes_mul(a.x, b.y), lanes_mul(a.y, b.x))};
}

static INLINED struct lanes lanes3_sum_of_sizes(struct lanes3 a)
{
    return lanes_add(lanes_add(lanes_abs(a.x), lanes_abs(a.y)), lanes_abs(a.z));
}

/* ---- numbers ---- */

static INLINED struct lanes lanes_negate(struct lanes a)
{
    return lanes_sub(lanes_of(-0.0), a);
}

static INLINED struct lanes_dd lanes_sum_of_ordered(struct lanes a, struct lanes b)
{
    struct lanes high = lanes_add(a, b);
    return (struct lanes_dd){high, lanes_sub(b, lanes_sub(high, a))};
}

static INLINED struct lanes_dd lanes_exact_sum(struct lanes a, struct lanes b)
{
    struct lanes high = lanes_add(a, b), part = lanes_sub(high, a);
    struct lanes low = lanes_add(lanes_sub(a, lanes_sub(high, part)), lanes_sub(b, part));
    return (struct lanes_dd){high, low};
}

static INLINED struct lanes_dd lanes_exact_difference(struct lanes a, struct lanes b)
{
    return lanes_exact_sum(a, lanes_negate(b));
}

static INLINED struct lanes_dd lanes_exact_product(struct lanes a, struct lanes b)
{
    struct lanes high = lanes_mul(a, b);
    return (struct lanes_dd){high, lanes_fma(a, b, lanes_negate(high))};
}

static INLINED struct lanes_dd lanes_dd_add(struct lanes_dd a, struct lanes_dd b)
{
    struct lanes_dd high = lanes_exact_sum(a.high, b.high), low = lanes_exact_sum(a.low, b.low);
    struct lanes_dd sum = lanes_sum_of_ordered(high.high, lanes_add(high.low, low.high));
    return lanes_sum_of_ordered(sum.high, lanes_add(low.low, sum.low));
}

static INLINED struct lanes_dd lanes_dd_sub(struct lanes_dd a, struct lanes_dd b)
{
    return lanes_dd_add(a, (struct lanes_dd){lanes_negate(b.high), lanes_negate(b.low)});
}

static INLINED struct lanes_dd lanes_dd_mul(struct lanes_dd a, struct lanes_dd b)
{
    struct lanes_dd product = lanes_exact_product(a.high, b.high);
    struct lanes cross = lanes_fma(a.low, b.high, lanes_mul(a.low, b.low));
    struct lanes rest = lanes_add(product.low, lanes_fma(a.high, b.low, cross));
    return lanes_sum_of_ordered(product.high, rest);
}

static INLINED struct lanes_dd lanes_dd_scale(struct lanes_dd a, struct lanes b)
{
    struct lanes_dd product = lanes_exact_product(a.high, b);
    return lanes_sum_of_ordered(product.high, lanes_fma(a.low, b, product.low));
}

static INLINED struct lanes_dd lanes_dd_div(struct lanes_dd a, struct lanes_dd b)
{
    struct lanes quotient = lanes_div(a.high, b.high);
    struct lanes_dd part = lanes_dd_scale(b, quotient);
    struct lanes rest = lanes_add(lanes_sub(a.high, part.high), lanes_sub(a.low, part.low));
    return lanes_sum_of_ordered(quotient, lanes_div(rest, b.high));
}

/* The high part of dd_advance(). */
static INLINED struct lanes lanes_dd_advance(struct lanes_dd f, struct lanes t, struct lanes d)
{
    struct lanes_dd step = lanes_exact_product(t, d);
    struct lanes_dd high = lanes_exact_sum(f.high, step.high);
    struct lanes_dd low = lanes_exact_sum(f.low, step.low);
    struct lanes_dd sum = lanes_exact_sum(high.high, low.high);
    return lanes_add(sum.high, lanes_add(sum.low, lanes_add(high.low, low.low)));
}

/* ---- vectors of numbers ---- */

static INLINED struct lanes_dd3 lanes_exact_difference3(struct lanes3 a, struct lanes3 b)
{
    return (struct lanes_dd3){lanes_exact_difference(a.x, b.x), lanes_exact_difference(a.y, b.y),
                              lanes_exact_difference(a.z, b.z)};
}

static INLINED struct lanes3 lanes_dd3_round(struct lanes_dd3 a)
{
    return (struct lanes3){a.x.high, a.y.high, a.z.high};
}

static INLINED struct lanes_dd lanes_dd3_dot(struct lanes_dd3 a, struct lanes_dd3 b)
{
    struct lanes_dd sum = lanes_dd_add(lanes_dd_mul(a.x, b.x), lanes_dd_mul(a.y, b.y));
    return lanes_dd_add(sum, lanes_dd_mul(a.z, b.z));
}

static INLINED struct lanes_dd lanes_dd3_dot_vec(struct lanes_dd3 a, struct lanes3 b)
{
    struct lanes_dd sum = lanes_dd_add(lanes_dd_scale(a.x, b.x), lanes_dd_scale(a.y, b.y));
    return lanes_dd_add(sum, lanes_dd_scale(a.z, b.z));
}

static INLINED struct lanes_dd3 lanes_dd3_cross(struct lanes_dd3 a, struct lanes_dd3 b)
{
    return (struct lanes_dd3){lanes_dd_sub(lanes_dd_mul(a.y, b.z), lanes_dd_mul(a.z, b.y)),
                              lanes_dd_sub(lanes_dd_mul(a.z, b.x), lanes_dd_mul(a.x, b.z)),
                              lanes_dd_sub(lanes_dd_mul(a.x, b.y), lanes_dd_mul(a.y, b.x))};
}

#endif
