/*
 * The arithmetic of the reference renderer: numbers of many bits, points made of them, random displacements, and the
 * record of decisions.
 */
#ifndef FARM_TEST_REFERENCE_NUMBERS_H
#define FARM_TEST_REFERENCE_NUMBERS_H

#include <math.h>
#include <mpfr.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "common/scene.h"

/* ---- numbers ---- */

/* Numbers are allocated from a pool of this size like from a stack: release() frees all that were allocated since
 * mark(). */
#define POOL_SIZE 30000u

typedef mpfr_ptr real;

struct point {
    real x, y, z;
};

struct reference {
    const struct scene *scene;
    mpfr_t *pool;
    size_t used;
    struct reach *reach[PRIMITIVE_KINDS];
    double displacement;
    uint64_t random, decisions;
};

typedef struct reference *ref;

static inline real new_real(ref r)
{
    if (r->used == POOL_SIZE) {
        fprintf(stderr, "reference: out of numbers\n");
        abort();
    }
    return r->pool[r->used++];
}

static inline size_t mark(ref r)
{
    return r->used;
}

static inline void release(ref r, size_t at)
{
    r->used = at;
}

static inline real number(ref r, double value)
{
    real out = new_real(r);
    mpfr_set_d(out, value, MPFR_RNDN);
    return out;
}

#define BINARY(name, function)                                                                     \
    static inline real name(ref r, real a, real b)                                                 \
    {                                                                                              \
        real out = new_real(r);                                                                    \
        function(out, a, b, MPFR_RNDN);                                                            \
        return out;                                                                                \
    }
BINARY(add, mpfr_add)
BINARY(sub, mpfr_sub)
BINARY(mul, mpfr_mul)
BINARY(divide, mpfr_div)
BINARY(power, mpfr_pow)
#undef BINARY

static inline real root(ref r, real a)
{
    real out = new_real(r);
    mpfr_sqrt(out, a, MPFR_RNDN);
    return out;
}

static inline int sign(real a)
{
    return mpfr_sgn(a);
}

static inline int compare(real a, real b)
{
    return mpfr_cmp(a, b);
}

static inline struct point new_point(ref r)
{
    real x = new_real(r), y = new_real(r);
    return (struct point){x, y, new_real(r)};
}

static inline void point_copy(struct point to, struct point from)
{
    mpfr_set(to.x, from.x, MPFR_RNDN);
    mpfr_set(to.y, from.y, MPFR_RNDN);
    mpfr_set(to.z, from.z, MPFR_RNDN);
}

static inline struct point point_of(ref r, struct vec3 v)
{
    real x = number(r, v.x), y = number(r, v.y);
    return (struct point){x, y, number(r, v.z)};
}

static inline struct point point_add(ref r, struct point a, struct point b)
{
    return (struct point){add(r, a.x, b.x), add(r, a.y, b.y), add(r, a.z, b.z)};
}

static inline struct point point_sub(ref r, struct point a, struct point b)
{
    return (struct point){sub(r, a.x, b.x), sub(r, a.y, b.y), sub(r, a.z, b.z)};
}

static inline struct point point_mul(ref r, struct point a, struct point b)
{
    return (struct point){mul(r, a.x, b.x), mul(r, a.y, b.y), mul(r, a.z, b.z)};
}

static inline struct point point_scale(ref r, struct point a, real s)
{
    return (struct point){mul(r, a.x, s), mul(r, a.y, s), mul(r, a.z, s)};
}

static inline struct point point_along(ref r, struct point a, struct point d, real t)
{
    return point_add(r, a, point_scale(r, d, t));
}

static inline real dot(ref r, struct point a, struct point b)
{
    return add(r, add(r, mul(r, a.x, b.x), mul(r, a.y, b.y)), mul(r, a.z, b.z));
}

static inline struct point cross(ref r, struct point a, struct point b)
{
    return (struct point){sub(r, mul(r, a.y, b.z), mul(r, a.z, b.y)),
                          sub(r, mul(r, a.z, b.x), mul(r, a.x, b.z)),
                          sub(r, mul(r, a.x, b.y), mul(r, a.y, b.x))};
}

static inline struct point unit(ref r, struct point a)
{
    real length = root(r, dot(r, a, a));
    return (struct point){divide(r, a.x, length), divide(r, a.y, length), divide(r, a.z, length)};
}

static inline struct point negative(ref r, struct point a)
{
    return point_scale(r, a, number(r, -1));
}

static inline double largest(struct point a)
{
    double x = fabs(mpfr_get_d(a.x, MPFR_RNDN)), y = fabs(mpfr_get_d(a.y, MPFR_RNDN));
    return fmax(fmax(x, y), fabs(mpfr_get_d(a.z, MPFR_RNDN)));
}

/* ---- displacements and decisions ---- */

static inline void decide(ref r, uint64_t what)
{
    r->decisions = (r->decisions ^ what) * UINT64_C(0x9e3779b97f4a7c15);
    r->decisions ^= r->decisions >> 29;
}

static inline double random_sign(ref r)
{
    r->random ^= r->random << 13;
    r->random ^= r->random >> 7;
    r->random ^= r->random << 17;
    return (double)(r->random >> 11) * 0x1p-52 - 1;
}

/* Moves each component by up to `displacement` u of magnitude. */
static inline void displace(ref r, struct point p, double magnitude)
{
    if (!(r->displacement > 0)) return;
    double reach = r->displacement * 0x1p-53 * magnitude;
    real component[] = {p.x, p.y, p.z};
    for (int i = 0; i < 3; i++)
        mpfr_add_d(component[i], component[i], reach * random_sign(r), MPFR_RNDN);
}

#endif
