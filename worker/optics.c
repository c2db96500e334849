#include "worker/optics.h"

#include "worker/optics_body.h"

/* v, scaled by a power of two if it is not in range. */
static inline struct vec3 scaled_to_range(struct vec3 v)
{
    return is_in_range(v) ? v : vec_scale_exactly(v, -vec_exponent(v));
}

FLATTENED double phong_lobe(struct vec3 view, struct vec3 normal, struct vec3 to_light,
                            double shininess)
{
    struct lobe lobe = lobe_of(view, normal, scaled_to_range(to_light));
    if (!(lobe.p.high > 0)) return 0;
    int shift = 0; /* of p, to bring its square into range */
    if (lobe.p.high < LOBE_P_MIN) {
        (void)frexp(lobe.p.high, &shift);
        lobe.p = dd_ldexp(lobe.p, -shift);
    }
    /* As ln cos^2 b <= cos^2 b - 1, a value that is certainly below e^-700 needs no logarithm: (n / 2) ln cos^2 b is
     * below -700 if n (Q^2 - P^2) > 1400 Q^2; the rest of 1402 covers the roundings. */
    double difference = lobe.q2.high - lobe.p.high * lobe.p.high;
    if (!shift && shininess * difference > 1402 * lobe.q2.high) return 0;
    return lobe_power(&lobe, shift, shininess);
}

double naive_phong_lobe(struct vec3 view, struct vec3 normal, struct vec3 to_light,
                        double shininess)
{
    double cos_b = vec_dot(to_light, view) - 2 * vec_dot(to_light, normal) * vec_dot(normal, view);
    /* By rounding. The bounds of worker/radiance.h allow for no lobe above 1. */
    if (cos_b > 1) cos_b = 1;
    return cos_b > 0 ? pow(cos_b, shininess) : 0;
}

FLATTENED struct vec3 mirror(struct vec3 view, struct vec3 normal)
{
    double v_n;
    struct vec3 out = mirrored_view(view, normal, &v_n);
    /* Rounding takes at most u back of these 4 u along n. */
    if (mirror_may_enter(v_n) && twofold_dot(out, normal).high < 0)
        out = vec_add_scaled(out, normal, 4 * UNIT_ROUNDOFF);
    return out;
}

struct vec3 naive_mirror(struct vec3 view, struct vec3 normal)
{
    return vec_add_scaled(view, normal, -2 * vec_dot(view, normal));
}

/* ---- refraction ---- */

/* n2^2 k, summed exactly and rounded once. */
static struct dd exact_k(const struct transition *at)
{
    const double terms[][4] = {
        {at->n2, at->n2, 1, 1},
        {at->n1, -at->n1, 1, 1},
        {at->n1, at->n1, at->c.high, at->c.high},
        {at->n1, at->n1, at->c.high, 2 * at->c.low},
        {at->n1, at->n1, at->c.low, at->c.low},
    };
    struct accumulator sum;
    int exponent;
    accumulator_clear(&sum);
    for (unsigned i = 0; i < sizeof terms / sizeof *terms; i++)
        accumulator_add(&sum, terms[i], 4, false);
    double mantissa = accumulator_value(&sum, &exponent);
    return dd(ldexp(mantissa, exponent));
}

static inline struct transition transition_of(double from, double to, struct dd cos_i)
{
    double largest = fmax(from, to);
    if (!is_plain_index(largest)) {
        int exponent;
        (void)frexp(largest, &exponent);
        from = ldexp(from, -exponent);
        to = ldexp(to, -exponent);
    }
    bool sure;
    struct transition at = transition_from(from, to, cos_i, &sure);
    if (!sure) at.k = exact_k(&at);
    return at;
}

FLATTENED double snell_k(double from, double to, double cos_i)
{
    struct transition at = transition_of(from, to, dd(cos_i));
    if (at.n2 < N2_MIN) return -HUGE_VAL;
    return (at.k.high + at.k.low) / at.n2 / at.n2;
}

double naive_snell_k(double eta, double cos_i)
{
    return 1 - eta * eta * (1 - cos_i * cos_i);
}

FLATTENED bool snell(struct vec3 view, struct vec3 normal, double from, double to,
                     struct vec3 *direction)
{
    double e, d;
    struct transition at = transition_of(from, to, cosine_in(view, normal, &e, &d));
    if (at.k.high < 0 || at.n2 < N2_MIN) return false;
    *direction = passed_view(view, normal, &at, dd_sqrt(at.k), e, d);
    return true;
}

bool naive_snell(struct vec3 view, struct vec3 normal, double eta, struct vec3 *direction)
{
    double cos_i = -vec_dot(view, normal);
    double k = naive_snell_k(eta, cos_i);
    if (k < 0) return false;
    struct vec3 along = vec_scale(view, eta);
    *direction = vec_add_scaled(along, normal, eta * cos_i - sqrt(k));
    return true;
}
