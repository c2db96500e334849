/*
 * The arithmetic of worker/solid_lanes.h, which includes this file twice: for eight pairs of a ray and a
 * solid, and for one pair. NUMBER and VECTOR are the types, OP() and OP3() the operations on them, OF() makes
 * names, and ALL is the set of all pairs. They are undefined at the end.
 */

struct OF(ray) {
    VECTOR o, d;
    NUMBER speed;    /* sum of absolute values: at least |d| */
    NUMBER inverse2; /* 1 / d.d */
};

struct OF(sphere) {
    VECTOR center;
    NUMBER radius;
};

struct OF(cone) {
    VECTOR base, apex;
    NUMBER base_radius, apex_radius;
};

/*
 * What is known of the line's passage through the solid. If it is not missed, the line is in the solid only
 * between enter_low and leave_high. If `decided`, the line certainly enters between enter_low and enter_high and
 * leaves between leave_low and leave_high; these intervals include the rounding of the distances.
 */
struct OF(spans) {
    lane_set missed, decided;
    lane_set enter_side, leave_side; /* if `decided`: through a cone's side, or a sphere */
    lane_set enter_cap, leave_cap;   /* if `decided`: through a cap; `rising` tells which */
    lane_set rising;                 /* the ray goes from the base towards the apex */
    NUMBER enter_low, enter_high, leave_low, leave_high;
};

/* Whether products of four lengths, directions and their errors are in range. */
static INLINED lane_set OF(are_ordinary)(NUMBER largest, NUMBER smallest)
{
    return OP(less)(largest, OP(of)(0x1p200)) & OP(less)(OP(of)(0x1p-200), smallest);
}

static INLINED NUMBER OP(fma_dot)(VECTOR a, VECTOR b)
{
    return OP(fma)(a.z, b.z, OP(fma)(a.y, b.y, OP(mul)(a.x, b.x)));
}

/* a + b s */
static INLINED VECTOR OP(advance)(VECTOR a, VECTOR b, NUMBER s)
{
    return (VECTOR){OP(fma)(b.x, s, a.x), OP(fma)(b.y, s, a.y), OP(fma)(b.z, s, a.z)};
}

static INLINED NUMBER OP(square)(NUMBER a)
{
    return OP(mul)(a, a);
}

static INLINED NUMBER OP(times)(double factor, NUMBER a)
{
    return OP(mul)(OP(of)(factor), a);
}

/*
 * l = f + t0 d errs by 3 u L (f by u of itself, the sum by u of its own), and t0 differs from the closest
 * approach by 9 u L / |d|. So the distance |l| from the line to the centre errs by less than 13 u L, less
 * than half of E = 32 u L. Then r^2 - l.l, if positive, errs by less than 2 (r + E) E, with its own
 * roundings; its root h, divided by |d|, by that over 2 h; and t0 by E / 2 |d|, with the roundings of t0 +-
 * h.
 */
#define SPHERE_SPAN_ERROR (32 * UNIT_ROUNDOFF)

static INLINED struct OF(spans)
    OF(sphere_spans)(const struct OF(sphere) * sphere, const struct OF(ray) * ray)
{
    VECTOR f = OP3(sub)(ray->o, sphere->center);
    NUMBER r = sphere->radius, reach = OP(add)(OP3(sum_of_sizes)(f), r);
    NUMBER t0 = OP(negate)(OP(mul)(OP(fma_dot)(f, ray->d), ray->inverse2));
    VECTOR l = OP(advance)(f, ray->d, t0);
    NUMBER ll = OP(fma_dot)(l, l), error = OP(times)(SPHERE_SPAN_ERROR, reach);
    NUMBER outer = OP(add)(r, error);
    NUMBER square = OP(fma)(r, r, OP(negate)(ll));
    NUMBER square_error = OP(times)(2, OP(mul)(outer, error));
    lane_set ordinary =
        OF(are_ordinary)(OP(larger)(reach, ray->speed), OP(smaller)(reach, ray->speed));
    struct OF(spans) spans = {.missed = ordinary & OP(less)(OP(square)(outer), ll)};
    if (spans.missed == ALL) return spans;
    NUMBER half = OP(sqrt)(OP(mul)(square, ray->inverse2));
    NUMBER per_speed = OP(mul)(ray->speed, ray->inverse2); /* at least 1 / |d| */
    NUMBER slack = OP(div)(OP(mul)(square_error, ray->inverse2), half);
    slack = OP(fma)(error, per_speed, slack);
    NUMBER whole = OP(mul)(OP(add)(outer, error), per_speed);

    spans.decided = ordinary & OP(less)(OP(times)(4, square_error), square);
    spans.enter_side = spans.leave_side = ALL;
    spans.enter_high = OP(add)(OP(sub)(t0, half), slack);
    spans.leave_low = OP(sub)(OP(add)(t0, half), slack);
    NUMBER most = OP(choose)(spans.decided, OP(add)(half, slack), whole);
    spans.enter_low = OP(choose)(ordinary, OP(sub)(t0, most), OP(of)(-INFINITE));
    spans.leave_high = OP(choose)(ordinary, OP(add)(t0, most), OP(of)(INFINITE));
    return spans;
}

/*
 * The cone as in worker/cone.h, with its axis w as the unit of height: a point p is at height s = p.w / W,
 * and at p - s w from the axis. For g = f + t0 d and for d these are s_g, s_d, P = g - s_g w, Q = d - s_d w;
 * the radii are rho_g = r0 + (r1 - r0) s_g and rho_d = (r1 - r0) s_d. The line is inside while
 *
 *   A x^2 - 2 B x + C <= 0,   A = Q.Q - rho_d^2,  B = rho_g rho_d - P.Q,  C = P.P - rho_g^2
 *
 * and between the caps at x = -g.w / d.w and (W - g.w) / d.w, where x is counted from t0.
 *
 * Let k = R / |w| with the larger radius R, and K2 = 2 (1 + k^2) >= (1 + k)^2. g errs by 4 u L, s_g by 16 u L
 * / |w| and s_d by 12 u |d| / |w|; P by 24 u L, Q by 16 u |d|, rho_g by 20 u (1 + k) L, rho_d by 16 u k |d|;
 * these are at most L, |d|, (1 + k) L and k |d|. So A, B and C err by less than E |d|^2, E L |d| and E L^2,
 * with E = 64 u K2, own roundings included; each of them is at most E / (64 u) times the same. B^2 - A C then
 * errs by less than 8 K2 E (L |d|)^2.
 */
#define CONE_SPAN_ERROR (64 * UNIT_ROUNDOFF)

/* An interval of x with an error of its ends, if `decided`; an unbounded one is infinite. */
struct OF(interval) {
    lane_set decided;
    NUMBER low, high, error;
};

struct OF(cone_line) {
    VECTOR w, g;
    NUMBER reach, t0;
    NUMBER g_w, d_w, W;
};

static INLINED struct OF(cone_line)
    OF(cone_line_of)(const struct OF(cone) * cone, const struct OF(ray) * ray)
{
    struct OF(cone_line) line;
    VECTOR f = OP3(sub)(ray->o, cone->base);
    line.w = OP3(sub)(cone->apex, cone->base);
    VECTOR to_middle = OP(advance)(f, line.w, OP(of)(-0.5));
    line.t0 = OP(negate)(OP(mul)(OP(fma_dot)(to_middle, ray->d), ray->inverse2));
    line.g = OP(advance)(f, ray->d, line.t0);
    line.W = OP(fma_dot)(line.w, line.w);
    line.g_w = OP(fma_dot)(line.g, line.w);
    line.d_w = OP(fma_dot)(ray->d, line.w);
    line.reach = OP(add)(OP3(sum_of_sizes)(f), OP3(sum_of_sizes)(line.w));
    line.reach = OP(add)(line.reach, OP(larger)(cone->base_radius, cone->apex_radius));
    return line;
}

/*
 * The interval between the caps: g.w and W err by 16 u L |w|, d.w by 6 u |d| |w|. Undecided for a ray orthogonal
 * to the axis up to rounding.
 */
static INLINED struct OF(interval)
    OF(slab_span)(const struct OF(cone_line) * line, const struct OF(ray) * ray)
{
    NUMBER width = OP3(sum_of_sizes)(line->w), inverse = OP(div)(OP(of)(1), line->d_w);
    NUMBER to_base = OP(negate)(OP(mul)(line->g_w, inverse));
    NUMBER to_apex = OP(mul)(OP(sub)(line->W, line->g_w), inverse);
    NUMBER most = OP(add)(OP(abs)(to_base), OP(abs)(to_apex));
    NUMBER error = OP(mul)(OP(fma)(most, ray->speed, line->reach), width);
    error = OP(times)(32 * UNIT_ROUNDOFF, OP(mul)(error, OP(abs)(inverse)));
    NUMBER least = OP(times)(0x1p14 * UNIT_ROUNDOFF, OP(mul)(ray->speed, width));
    return (struct OF(interval)){OP(less)(least, OP(abs)(line->d_w)), OP(smaller)(to_base, to_apex),
                                 OP(larger)(to_base, to_apex), error};
}

/*
 * The interval inside the side, if A is certainly positive. The line then meets only one nappe, and if that is
 * the wrong one, the planes of the caps leave nothing of it. The root of the discriminant D errs by its error
 * over its root, if D is more than 4 times that error; a quotient N / A by (error of N + |N| error of A / A)
 * / A, except for terms of second order. *missed: there are no roots; if so for all pairs, nothing else is
 * set.
 */
static INLINED struct OF(interval)
    OF(side_span)(const struct OF(cone) * cone, const struct OF(cone_line) * line,
                  const struct OF(ray) * ray, lane_set *missed)
{
    NUMBER inverse_W = OP(div)(OP(of)(1), line->W);
    NUMBER s_g = OP(mul)(line->g_w, inverse_W), s_d = OP(mul)(line->d_w, inverse_W);
    VECTOR P = OP(advance)(line->g, line->w, OP(negate)(s_g));
    VECTOR Q = OP(advance)(ray->d, line->w, OP(negate)(s_d));
    NUMBER widening = OP(sub)(cone->apex_radius, cone->base_radius);
    NUMBER rho_g = OP(fma)(widening, s_g, cone->base_radius);
    NUMBER rho_d = OP(mul)(widening, s_d);
    NUMBER A = OP(sub)(OP(fma_dot)(Q, Q), OP(square)(rho_d));
    NUMBER B = OP(sub)(OP(mul)(rho_g, rho_d), OP(fma_dot)(P, Q));
    NUMBER C = OP(sub)(OP(fma_dot)(P, P), OP(square)(rho_g));
    NUMBER D = OP(sub)(OP(square)(B), OP(mul)(A, C));

    NUMBER radius = OP(larger)(cone->base_radius, cone->apex_radius);
    NUMBER K2 = OP(fma)(OP(square)(radius), inverse_W, OP(of)(1));
    K2 = OP(times)(2, K2);
    NUMBER error = OP(times)(CONE_SPAN_ERROR, K2);
    NUMBER speed = ray->speed, size = OP(mul)(line->reach, speed);
    NUMBER A_error = OP(mul)(error, OP(square)(speed));
    NUMBER B_error = OP(mul)(error, size);
    NUMBER D_error = OP(mul)(OP(mul)(OP(times)(8, K2), B_error), size);

    lane_set narrow = OP(less)(OP(times)(0x1p6, A_error), A);
    *missed &= narrow & OP(less)(D, OP(negate)(D_error));
    if (*missed == ALL) return (struct OF(interval)){.decided = 0};
    NUMBER root = OP(sqrt)(D), inverse_A = OP(div)(OP(of)(1), A);
    NUMBER slack = OP(add)(B_error, OP(div)(D_error, root));
    NUMBER most = OP(mul)(OP(add)(OP(abs)(B), root), OP(mul)(A_error, inverse_A));
    slack = OP(mul)(OP(add)(slack, OP(times)(2, most)), OP(times)(2, inverse_A));
    return (struct OF(interval)){narrow & OP(less)(OP(times)(4, D_error), D),
                                 OP(mul)(OP(sub)(B, root), inverse_A),
                                 OP(mul)(OP(add)(B, root), inverse_A), slack};
}

/*
 * The spans of a capped cone. For an open one only `missed` is valid, and that the line is in it only between
 * enter_low and leave_high.
 */
static INLINED struct OF(spans)
    OF(cone_spans)(const struct OF(cone) * cone, const struct OF(ray) * ray)
{
    const NUMBER none = OP(of)(-INFINITE), all = OP(of)(INFINITE);
    struct OF(cone_line) line = OF(cone_line_of)(cone, ray);
    lane_set ordinary = OF(are_ordinary)(OP(larger)(line.reach, ray->speed),
                                         OP(smaller)(OP3(sum_of_sizes)(line.w), ray->speed));
    struct OF(spans) spans = {.missed = ordinary};
    struct OF(interval) side = OF(side_span)(cone, &line, ray, &spans.missed);
    if (spans.missed == ALL) return spans;
    struct OF(interval) slab = OF(slab_span)(&line, ray);
    slab.decided &= ordinary;
    side.decided &= ordinary;
    NUMBER slab_low = OP(choose)(slab.decided, OP(sub)(slab.low, slab.error), none);
    NUMBER slab_high = OP(choose)(slab.decided, OP(add)(slab.high, slab.error), all);
    NUMBER side_low = OP(choose)(side.decided, OP(sub)(side.low, side.error), none);
    NUMBER side_high = OP(choose)(side.decided, OP(add)(side.high, side.error), all);
    spans.enter_low = OP(add)(line.t0, OP(larger)(slab_low, side_low));
    spans.leave_high = OP(add)(line.t0, OP(smaller)(slab_high, side_high));
    NUMBER entered = OP(larger)(OP(add)(slab.low, slab.error), OP(add)(side.low, side.error));
    NUMBER left = OP(smaller)(OP(sub)(slab.high, slab.error), OP(sub)(side.high, side.error));
    spans.enter_high = OP(add)(line.t0, entered);
    spans.leave_low = OP(add)(line.t0, left);
    spans.enter_side = OP(less)(OP(add)(slab.low, slab.error), OP(sub)(side.low, side.error));
    spans.leave_side = OP(less)(OP(add)(side.high, side.error), OP(sub)(slab.high, slab.error));
    spans.enter_cap = OP(less)(OP(add)(side.low, side.error), OP(sub)(slab.low, slab.error));
    spans.leave_cap = OP(less)(OP(add)(slab.high, slab.error), OP(sub)(side.high, side.error));
    spans.rising = OP(less)(OP(of)(0), line.d_w);
    spans.missed = ordinary & (spans.missed | OP(less)(spans.leave_high, spans.enter_low));
    spans.decided = side.decided & slab.decided & OP(less)(spans.enter_high, spans.leave_low);
    return spans;
}

/*
 * The interval in which the line crosses a plane, if decided. f = point - o errs by u of itself, n.f by 4.1 u
 * |f| and n.d by 3 u |d|, as n is unit. If n.d is more than 2^14 u |d|, their quotient t errs by less than 8
 * u (|f| + |t d|) / n.d, its own rounding included. Sums of absolute values are bounds on the lengths.
 */
#define PLANE_SPAN_ERROR (16 * UNIT_ROUNDOFF)

struct OF(plane_span) {
    lane_set decided;
    NUMBER from, to;
};

static INLINED struct OF(plane_span)
    OF(plane_span)(VECTOR point, VECTOR normal, const struct OF(ray) * ray)
{
    VECTOR f = OP3(sub)(point, ray->o);
    NUMBER speed = OP(fma_dot)(ray->d, normal), t = OP(div)(OP(fma_dot)(f, normal), speed);
    NUMBER way = OP3(sum_of_sizes)(f), size = OP(fma)(OP(abs)(t), ray->speed, way);
    NUMBER error = OP(div)(OP(times)(PLANE_SPAN_ERROR, size), OP(abs)(speed));
    lane_set decided = OF(are_ordinary)(OP(larger)(way, ray->speed), OP(smaller)(way, ray->speed)) &
                       OP(less)(OP(times)(0x1p14 * UNIT_ROUNDOFF, ray->speed), OP(abs)(speed));
    return (struct OF(plane_span)){decided, OP(sub)(t, error), OP(add)(t, error)};
}

/* ---- the crossings that count ---- */

/* Where the ray starts, if the spans are `decided`: certainly before the solid, or certainly inside of it. */
struct OF(start) {
    lane_set outside, inside;
};

static INLINED struct OF(start) OF(start)(const struct OF(spans) * spans)
{
    const NUMBER zero = OP(of)(0);
    return (struct OF(start)){OP(less)(zero, spans->enter_low),
                              OP(less)(spans->enter_high, zero) & OP(less)(zero, spans->leave_low)};
}

/* The first crossing of the solid ahead of the ray's origin, if `decided`. */
struct OF(first_crossing) {
    lane_set decided;
    /* If `decided`: certainly on this part (on_side also for a sphere). */
    lane_set on_side, on_base, on_apex;
    NUMBER from, to;
};

/* Pairs whose part is known. */
static INLINED lane_set OF(is_on_part)(const struct OF(first_crossing) * first)
{
    return first->on_side | first->on_base | first->on_apex;
}

/* The part of one of these pairs. */
static INLINED uint32_t OF(part_at)(const struct OF(first_crossing) * first, unsigned i)
{
    if (first->on_base >> i & 1) return CONE_BASE_CAP;
    return first->on_apex >> i & 1 ? CONE_APEX_CAP : CONE_SIDE;
}

static INLINED struct OF(first_crossing) OF(first_crossing)(const struct OF(spans) * spans)
{
    struct OF(start) start = OF(start)(spans);
    lane_set outside = start.outside, inside = start.inside;
    lane_set enter_cap = outside & spans->enter_cap, leave_cap = inside & spans->leave_cap;
    return (struct OF(first_crossing)){
        spans->decided & (outside | inside),
        (outside & spans->enter_side) | (inside & spans->leave_side),
        (enter_cap & spans->rising) | (leave_cap & ~spans->rising),
        (enter_cap & ~spans->rising) | (leave_cap & spans->rising),
        OP(choose)(outside, spans->enter_low, spans->leave_low),
        OP(choose)(outside, spans->enter_high, spans->leave_high),
    };
}

/* The pairs that certainly cross the surface once, and twice, between 0 and t_max. */
struct OF(crossing_sets) {
    lane_set once, twice;
};

static INLINED struct OF(crossing_sets)
    OF(crossing_sets)(const struct OF(spans) * spans, NUMBER t_max)
{
    struct OF(start) start = OF(start)(spans);
    lane_set outside = start.outside, inside = start.inside;
    lane_set through = OP(less)(spans->leave_high, t_max);
    lane_set ends_inside = OP(less)(spans->enter_high, t_max) & OP(less)(t_max, spans->leave_low);
    return (struct OF(crossing_sets)){spans->decided &
                                          ((outside & ends_inside) | (inside & through)),
                                      spans->decided & outside & through};
}

/* The pairs that may meet within 0 <= t <= limit. */
static INLINED lane_set OF(may_be_crossed)(const struct OF(spans) * spans, NUMBER limit)
{
    return ALL & ~(spans->missed | OP(less)(spans->leave_high, OP(of)(0)) |
                   OP(less)(limit, spans->enter_low));
}

#undef OF
#undef OP
#undef OP3
#undef NUMBER
#undef VECTOR
#undef ALL
