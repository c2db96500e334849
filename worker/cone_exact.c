#include "worker/cone_exact.h"

/* The sum, rounded once. A value smaller than 2^-900 is returned as about 2^-900: only its sign counts, and its low
 * word must not underflow. */
static struct dd rounded_sum(const struct accumulator *sum)
{
    int exponent;
    struct dd value = accumulator_round(sum, &exponent);
    return dd_ldexp(value, exponent > -900 ? exponent : -900);
}

struct dd cone_exact_minor(double a, struct dd x, double b, struct dd y)
{
    struct accumulator minor;
    accumulator_clear(&minor);
    accumulator_add_dd(&minor, 1, dd(a), x, dd(1));
    accumulator_add_dd(&minor, -1, dd(b), y, dd(1));
    return rounded_sum(&minor);
}

/* W = w.w */
static void exact_W(struct accumulator *W, const struct cone_line *line)
{
    accumulator_clear(W);
    for (unsigned i = 0; i < 3; i++)
        accumulator_add_dd(W, 1, dd3_component(&line->w, i), dd3_component(&line->w, i), dd(1));
}

struct dd cone_exact_A(const struct scaled_cone *it, const struct cone_line *line)
{
    struct accumulator sum, W, D, speed;
    exact_W(&W, line);
    accumulator_clear(&sum);
    accumulator_clear(&speed);
    for (unsigned i = 0; i < 3; i++) {
        unsigned j = (i + 1) % 3;
        struct dd di = dd(vec_component(&it->direction, i)),
                  dj = dd(vec_component(&it->direction, j));
        accumulator_clear(&D);
        accumulator_add_dd(&D, 1, di, dd3_component(&line->w, j), dd(1));
        accumulator_add_dd(&D, -1, dj, dd3_component(&line->w, i), dd(1));
        accumulator_add_product(&sum, &W, &D, &D, false);
        accumulator_add_dd(&speed, 1, line->widening, di, dd3_component(&line->w, i));
    }
    accumulator_add_product(&sum, &speed, &speed, NULL, true);
    return dd_div(rounded_sum(&sum), line->W);
}

/* += sign (r0 w_i + (r1 - r0) f_i) d_j */
static void add_slanted(struct accumulator *sum, int sign, const struct scaled_cone *it,
                        const struct cone_line *line, unsigned i, unsigned j)
{
    struct dd d = dd(vec_component(&it->direction, j));
    accumulator_add_dd(sum, sign, dd(it->cone.base_radius), dd3_component(&line->w, i), d);
    accumulator_add_dd(sum, sign, line->widening, dd3_component(&line->f, i), d);
}

struct dd cone_exact_discriminant(const struct scaled_cone *it, const struct cone_line *line)
{
    struct accumulator sum, W, cross, P; /* P = f.(d x w) */
    const struct dd3 d = dd3_of(it->direction);
    exact_W(&W, line);
    accumulator_clear(&sum);
    for (unsigned i = 0; i < 3; i++) {
        unsigned j = (i + 1) % 3;
        accumulator_clear(&cross);
        add_slanted(&cross, 1, it, line, j, i);
        add_slanted(&cross, -1, it, line, i, j);
        accumulator_add_product(&sum, &W, &cross, &cross, false);
    }
    accumulator_add_dd(&W, 1, line->widening, line->widening, dd(1));
    accumulator_clear(&P);
    accumulator_add_triple(&P, &line->f, &d, &line->w);
    accumulator_add_product(&sum, &W, &P, &P, true);
    return rounded_sum(&sum);
}

struct dd cone_exact_C(const struct scaled_cone *it, const struct cone_line *line)
{
    struct accumulator sum, W, F, rho;
    struct dd r = dd(it->cone.base_radius);
    exact_W(&W, line);
    accumulator_clear(&sum);
    accumulator_clear(&rho);
    for (unsigned i = 0; i < 3; i++) {
        unsigned j = (i + 1) % 3;
        struct dd fi = dd3_component(&line->f, i), wi = dd3_component(&line->w, i);
        accumulator_clear(&F);
        accumulator_add_dd(&F, 1, fi, dd3_component(&line->w, j), dd(1));
        accumulator_add_dd(&F, -1, dd3_component(&line->f, j), wi, dd(1));
        accumulator_add_product(&sum, &W, &F, &F, false);
        accumulator_add_dd(&rho, 1, r, wi, wi);
        accumulator_add_dd(&rho, 1, line->widening, fi, wi);
    }
    accumulator_add_product(&sum, &rho, &rho, NULL, true);
    return dd_div(rounded_sum(&sum), line->W);
}
