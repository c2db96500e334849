/*
 * The arithmetic of optics.h as inlined functions, without branches where they are not needed: used by
 * optics.c for single rays, and by points_light.c in lanes.
 */
#ifndef FARM_WORKER_OPTICS_BODY_H
#define FARM_WORKER_OPTICS_BODY_H

#include <stdint.h>
#include <string.h>

#include "worker/exact.h"

/* ---- what the functions share ---- */

/*
 * a . b with an error of 2^-103 |a| |b| (T. Ogita, S. Rump and S. Oishi, "Accurate sum and dot product", SIAM
 * J. Sci. Comput. 26, 2005, without its last rounding). Unlike exact_dot(), it does not compensate
 * cancellation: both vectors are near unit length here, and the error relative to |a| |b| is what matters.
 */
static inline struct dd twofold_dot(struct vec3 a, struct vec3 b)
{
    struct dd x = exact_product(a.x, b.x), y = exact_product(a.y, b.y), z = exact_product(a.z, b.z);
    struct dd part = exact_sum(x.high, y.high), sum = exact_sum(part.high, z.high);
    return sum_of_ordered(sum.high, sum.low + (part.low + (x.low + y.low + z.low)));
}

/* a.a - 1, from the square of a vector that has unit length up to rounding. */
static inline double excess(struct dd square)
{
    return (square.high - 1) + square.low;
}

/* (v + q n)(1 - d/2), rounded once except for terms of u^2; d is some u. */
static inline double combined(double v, double n, struct dd q, double d)
{
    struct dd product = exact_product(q.high, n);
    struct dd sum = exact_sum(v, product.high);
    double low = sum.low + (product.low + q.low * n);
    return sum.high + fma(-0.5 * d, sum.high, low);
}

/* ---- the highlight ---- */

#define SQRT_HALF 0.70710678118654752

/* Whether the fourth power of v is in range, down to the last bit. */
static inline bool is_in_range(struct vec3 v)
{
    double square = vec_dot(v, v);
    return (square > 0x1p-200) & (square < 0x1p200);
}

/*
 * atanh(s) for |s| <= 3 - 2 sqrt 2 = 0.1716: s (1 + s^2/3 + s^4/5 + ... ). After the last term below,
 * s^20/21, the remainder is less than 0.1716^22 / 23 / (1 - 0.03) = 2^-60.5 of the value. All terms but the
 * leading s are at most 1 % of the value, so their rounding errors amount to 0.03 u.
 */
static inline struct dd dd_atanh(struct dd s)
{
    double q = s.high * s.high;
    double p = 1.0 / 21;
    p = fma(p, q, 1.0 / 19);
    p = fma(p, q, 1.0 / 17);
    p = fma(p, q, 1.0 / 15);
    p = fma(p, q, 1.0 / 13);
    p = fma(p, q, 1.0 / 11);
    p = fma(p, q, 1.0 / 9);
    p = fma(p, q, 1.0 / 7);
    p = fma(p, q, 1.0 / 5);
    p = fma(p, q, 1.0 / 3);
    return sum_of_ordered(s.high, fma(s.high * q, p, s.low));
}

/* ln 2 in two parts. The first has 32 bits, so its product with an integer below 2^21 is exact. */
#define LN2_HIGH 0x1.62e42feep-1
#define LN2_LOW  0x1.a39ef35793c76p-33

/* Stores an integer k in the low bits of a double's mantissa: 2^52 + k, 0 <= k < 2^52. */
#define WHOLE 0x1p52

static inline uint64_t bits_of(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static inline double of_bits(uint64_t bits)
{
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* 2^k as a normal number; k is an integer, -1022 <= k <= 1023. */
static inline double whole_power_of_two(double k)
{
    return of_bits(bits_of(WHOLE + 1023 + k) << 52);
}

/* The k with 2^k <= value < 2^(k + 1); value > 0, normal. */
static inline double exponent_of(double value)
{
    return of_bits(bits_of(value) >> 52 | bits_of(WHOLE)) - (WHOLE + 1023);
}

/* The j with ratio / 2^j between 1/sqrt 2 and sqrt 2; ratio > 0, normal. */
static inline double scale_near_one(double ratio)
{
    double j = exponent_of(ratio);
    return ratio > 2 * SQRT_HALF * whole_power_of_two(j) ? j + 1 : j;
}

/*
 * e^x for -700 <= x <= 0. x = k ln 2 + r with |r| <= 0.347; the remainder of the series after r^13/13! is
 * below 0.347^14 / 14! = 2^-57.7. Rounding errors of the series are scaled by r^2/2 <= 0.06, so the error is
 * that of the last sum, below 1.3 u. No power of two is subnormal.
 */
static inline double power_of_e(struct dd x)
{
    double k = rint(x.high * 1.4426950408889634);
    struct dd r = exact_sum(fma(-k, LN2_HIGH, x.high), fma(-k, LN2_LOW, x.low));
    double p = 1.0 / 6227020800;
    p = fma(p, r.high, 1.0 / 479001600);
    p = fma(p, r.high, 1.0 / 39916800);
    p = fma(p, r.high, 1.0 / 3628800);
    p = fma(p, r.high, 1.0 / 362880);
    p = fma(p, r.high, 1.0 / 40320);
    p = fma(p, r.high, 1.0 / 5040);
    p = fma(p, r.high, 1.0 / 720);
    p = fma(p, r.high, 1.0 / 120);
    p = fma(p, r.high, 1.0 / 24);
    p = fma(p, r.high, 1.0 / 6);
    p = fma(p, r.high, 0.5);
    struct dd sum = sum_of_ordered(1, r.high);
    double low = fma(r.high * r.high, p, fma(r.low, r.high, r.low) + sum.low);
    return whole_power_of_two(k) * (sum.high + low);
}

/*
 * With T to the light, V = view and N the normal, let P = (T.V)(N.N) - 2 (T.N)(V.N) and Q^2 = (N.N)^2
 * (T.T)(V.V). Then cos b is P / Q for vectors of any length, and its logarithm is computed as
 *
 *   ln cos b = atanh((2^j P^2 - Q^2) / (2^j P^2 + Q^2)) - j/2 ln 2
 *
 * with j such that 2^j P^2 / Q^2 is between 1/sqrt 2 and sqrt 2. Near the middle of the highlight, where j =
 * 0, the numerator is -Q^2 sin^2 b. It is the difference of two nearly equal numbers, and exponents up to
 * 1e15 magnify its error: hence double-double up to there.
 */
struct lobe {
    struct dd p, q2;
};

static inline struct lobe lobe_of(struct vec3 view, struct vec3 normal, struct vec3 light)
{
    struct dd t_v = twofold_dot(light, view), n_n = twofold_dot(normal, normal);
    struct dd t_n = twofold_dot(light, normal), v_n = twofold_dot(view, normal);
    struct dd lengths = dd_mul(twofold_dot(light, light), twofold_dot(view, view));
    return (struct lobe){dd_add(dd_mul(t_v, n_n), dd_scale(dd_mul(t_n, v_n), -2)),
                         dd_mul(dd_mul(n_n, n_n), lengths)};
}

/* If P is less than this, its square is not in range. */
#define LOBE_P_MIN 0x1p-300

/* cos^n b for P >= LOBE_P_MIN, after P was divided by 2^shift. */
static inline double lobe_power(const struct lobe *lobe, double shift, double shininess)
{
    struct dd p2 = dd_mul(lobe->p, lobe->p), q2 = lobe->q2;
    bool off = (shift != 0) | (p2.high < SQRT_HALF * q2.high);
    double j = off ? scale_near_one(q2.high / p2.high) : 0, scale = whole_power_of_two(j);
    p2 = (struct dd){p2.high * scale, p2.low * scale};
    struct dd s = dd_div(dd_add(p2, dd_negate(q2)), dd_add(p2, q2));
    struct dd log = dd_atanh(s);
    double halves = 0.5 * j - shift;
    struct dd sum = dd_add((struct dd){-halves * LN2_HIGH, -halves * LN2_LOW}, log);
    log.high = halves != 0 ? sum.high : log.high;
    log.low = halves != 0 ? sum.low : log.low;
    struct dd power = exact_product(shininess, log.high);
    power.low = fma(shininess, log.low, power.low);
    /* Rounding may make the cosine more than 1. */
    power.low = power.high > 0 ? 0 : power.low;
    power.high = power.high > 0 ? 0 : power.high;
    return power.high >= -700 ? power_of_e(power) : 0;
}

/* ---- mirrors ---- */

/*
 * (v - 2 (v.n) n / n.n) / |v|. With n.n = 1 + e and v.v = 1 + d, where e and d are some u, the divisions
 * become multiplications by 1 - e and by the Newton step 1 - d/2, accurate up to u^2. *v_n receives v.n.
 */
static inline struct vec3 mirrored_view(struct vec3 view, struct vec3 normal, double *v_n)
{
    struct dd dot = twofold_dot(view, normal);
    double e = excess(twofold_dot(normal, normal)), d = excess(twofold_dot(view, view));
    struct dd q = {-2 * dot.high, -2 * (dot.low - dot.high * e)};
    *v_n = dot.high;
    return vec3(combined(view.x, normal.x, q, d), combined(view.y, normal.y, q, d),
                combined(view.z, normal.z, q, d));
}

/*
 * Components are rounded by half an ulp, the vector by at most u, and so is out.n, which is -v.n. Only if
 * that is smaller can out point behind the surface.
 */
static inline bool mirror_may_enter(double v_n)
{
    return (v_n <= 0) & (v_n >= -2 * UNIT_ROUNDOFF);
}

/* ---- refraction ---- */

/* A refraction from index n1 to index n2 with incident cosine c, all scaled alike. */
struct transition {
    double n1, n2;
    struct dd c;
    struct dd k; /* n2^2 k = (n2 - n1)(n2 + n1) + (n1 c)^2 */
};

/* Whether indices up to this can be used without scaling. */
static inline bool is_plain_index(double largest)
{
    return (largest > 0x1p-100) & (largest < 0x1p100);
}

/*
 * In double-double, n2^2 k has an error of some 2^-102 of its two terms. If less than 2^-40 of them is left,
 * it is summed exactly instead. So the value has an error of at most 2^-62 of itself, and its sign is always
 * right.
 */
#define K_FILTER 0x1p-40

/* The refraction in double-double; *sure: that is accurate enough. */
static inline struct transition transition_from(double n1, double n2, struct dd cos_i, bool *sure)
{
    struct transition at = {.n1 = n1, .n2 = n2, .c = cos_i};
    struct dd root = dd_scale(at.c, at.n1);
    struct dd square = dd_mul(root, root);
    struct dd rest = dd_mul(exact_sum(at.n2, -at.n1), exact_sum(at.n2, at.n1));
    at.k = dd_add(rest, square);
    *sure = !(fabs(at.k.high) < K_FILTER * square.high);
    return at;
}

/* If n2 is this much smaller than the index on the other side (1e-150 of it), no light enters. */
#define N2_MIN 0x1p-500

/* a v + b n, rounded once. */
static inline double blended(struct dd a, double v, struct dd b, double n)
{
    struct dd first = exact_product(a.high, v), second = exact_product(b.high, n);
    struct dd sum = exact_sum(first.high, second.high);
    return sum.high + (sum.low + (first.low + second.low) + (a.low * v + b.low * n));
}

/*
 * -v.n of the exact unit vectors that view and normal approximate, see mirrored_view(). *e and *d receive the
 * excess over 1 of the squares of normal and view.
 */
static inline struct dd cosine_in(struct vec3 view, struct vec3 normal, double *e, double *d)
{
    struct dd v_n = twofold_dot(view, normal);
    *e = excess(twofold_dot(normal, normal));
    *d = excess(twofold_dot(view, view));
    struct dd cos_i = dd_scale(v_n, -1);
    return sum_of_ordered(cos_i.high, cos_i.low - 0.5 * (*d + *e) * cos_i.high);
}

/* v (n1 / n2) + n (n1 c - sqrt(n2^2 k)) / n2. root: the square root of n2^2 k. */
static inline struct vec3 passed_view(struct vec3 view, struct vec3 normal,
                                      const struct transition *at, struct dd root, double e,
                                      double d)
{
    struct dd eta = dd_div(dd(at->n1), dd(at->n2));
    struct dd g = dd_add(dd_scale(at->c, at->n1), dd_negate(root));
    g = dd_div(g, dd(at->n2));
    eta.low -= 0.5 * d * eta.high;
    g.low -= 0.5 * e * g.high;
    return vec3(blended(eta, view.x, g, normal.x), blended(eta, view.y, g, normal.y),
                blended(eta, view.z, g, normal.z));
}

#endif
