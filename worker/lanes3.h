/* Vectors of eight lanes. */
#ifndef FARM_WORKER_LANES3_H
#define FARM_WORKER_LANES3_H

#include "common/vec.h"
#include "worker/lanes.h"

struct lanes3 {
    struct lanes x, y, z;
};

/* The same vector in all lanes. */
static INLINED struct lanes3 lanes3_of(struct vec3 a)
{
    return (struct lanes3){lanes_of(a.x), lanes_of(a.y), lanes_of(a.z)};
}

static INLINED struct lanes lanes_negate(struct lanes a)
{
    return lanes_sub(lanes_of(-0.0), a);
}

static INLINED struct lanes3 lanes3_sub(struct lanes3 a, struct lanes3 b)
{
    return (struct lanes3){lanes_sub(a.x, b.x), lanes_sub(a.y, b.y), lanes_sub(a.z, b.z)};
}

static INLINED struct lanes lanes3_dot(struct lanes3 a, struct lanes3 b)
{
    return lanes_add(lanes_add(lanes_mul(a.x, b.x), lanes_mul(a.y, b.y)), lanes_mul(a.z, b.z));
}

static INLINED struct lanes lanes3_sum_of_sizes(struct lanes3 a)
{
    return lanes_add(lanes_add(lanes_abs(a.x), lanes_abs(a.y)), lanes_abs(a.z));
}

#endif
