/* Cones, cylinders, boxes and discs for Embree, in float. */
#include "bench/kernel_embree.h"

/* Where a line of unit direction enters and leaves a convex solid, and through which part. */
struct crossing_pair {
    unsigned count;
    float t[2];
    unsigned part[2];
};

enum { SIDE, BASE_CAP, APEX_CAP };

static inline void add_crossing(struct crossing_pair *pair, float t, unsigned part)
{
    if (pair->count == 2) {
        /* A rim may be hit by side and cap: the outermost two crossings count. */
        if (t < pair->t[0])
            pair->t[0] = t, pair->part[0] = part;
        else if (t > pair->t[1])
            pair->t[1] = t, pair->part[1] = part;
        return;
    }
    unsigned at = pair->count++;
    if (at == 1 && t < pair->t[0]) {
        pair->t[1] = pair->t[0];
        pair->part[1] = pair->part[0];
        at = 0;
    }
    pair->t[at] = t;
    pair->part[at] = part;
}

static inline void cone_caps(const struct solid_cone *cone, struct f3 q, struct f3 e, float pz,
                             float dz, struct crossing_pair *pair)
{
    float base = -pz / dz, apex = (cone->height - pz) / dz;
    struct f3 at = f3_add_scaled(q, e, base);
    if (f3_dot(at, at) <= cone->base_radius * cone->base_radius) add_crossing(pair, base, BASE_CAP);
    at = f3_add_scaled(q, e, apex);
    if (f3_dot(at, at) <= cone->apex_radius * cone->apex_radius) add_crossing(pair, apex, APEX_CAP);
}

/* Distances are measured from the point of the ray that is nearest to the base, so that a distant eye costs no
 * precision. */
static inline struct crossing_pair cone_crossings(const struct solid_cone *cone, struct f3 o,
                                                  struct f3 d)
{
    struct crossing_pair pair = {0};
    struct f3 to_origin = f3_sub(o, cone->base);
    float shift = -f3_dot(to_origin, d);
    struct f3 p = f3_add_scaled(to_origin, d, shift);
    float pz = f3_dot(p, cone->axis), dz = f3_dot(d, cone->axis);
    struct f3 q = f3_add_scaled(p, cone->axis, -pz), e = f3_add_scaled(d, cone->axis, -dz);
    float rz = cone->base_radius + cone->slope * pz, kz = cone->slope * dz;
    float a = f3_dot(e, e) - kz * kz, b = f3_dot(q, e) - kz * rz, c = f3_dot(q, q) - rz * rz;
    float square = b * b - a * c;
    if (square >= 0) {
        float sum = -(b + copysignf(sqrtf(square), b));
        float t[2] = {sum / a, c / sum};
        for (int i = 0; i < 2; i++) {
            float z = pz + t[i] * dz;
            if (z >= 0 && z <= cone->height) add_crossing(&pair, t[i], SIDE);
        }
    }
    if (cone->capped && dz != 0) cone_caps(cone, q, e, pz, dz, &pair);
    pair.t[0] += shift;
    pair.t[1] += shift;
    return pair;
}

static inline struct f3 cone_normal_at(const struct solid_cone *cone, struct f3 point,
                                       unsigned part)
{
    if (part == BASE_CAP) return f3_scale(cone->axis, -1);
    if (part == APEX_CAP) return cone->axis;
    struct f3 p = f3_sub(point, cone->base);
    struct f3 radial = f3_add_scaled(p, cone->axis, -f3_dot(p, cone->axis));
    return f3_add_scaled(f3_normalize(radial), cone->axis, -cone->slope);
}

/* part: twice the axis, and 1 for the face of max. */
static inline struct crossing_pair box_crossings(const struct solid_box *box, struct f3 o,
                                                 struct f3 d)
{
    const float low[3] = {box->min.x, box->min.y, box->min.z};
    const float high[3] = {box->max.x, box->max.y, box->max.z};
    const float from[3] = {o.x, o.y, o.z}, along[3] = {d.x, d.y, d.z};
    struct crossing_pair pair = {.count = 2, .t = {-INFINITY, INFINITY}};
    for (unsigned axis = 0; axis < 3; axis++) {
        float a = (low[axis] - from[axis]) / along[axis];
        float b = (high[axis] - from[axis]) / along[axis];
        bool swap = along[axis] < 0;
        float in = swap ? b : a, out = swap ? a : b;
        if (in > pair.t[0]) pair.t[0] = in, pair.part[0] = 2 * axis + swap;
        if (out < pair.t[1]) pair.t[1] = out, pair.part[1] = 2 * axis + !swap;
    }
    if (!(pair.t[0] <= pair.t[1])) pair.count = 0;
    return pair;
}

static inline struct f3 box_normal_of(unsigned part)
{
    float sign = part & 1 ? 1 : -1;
    return f3(part / 2 == 0 ? sign : 0, part / 2 == 1 ? sign : 0, part / 2 == 2 ? sign : 0);
}

static inline struct crossing_pair disc_crossing(const struct flat_disc *disc, struct f3 o,
                                                 struct f3 d)
{
    struct crossing_pair pair = {0};
    float t = f3_dot(f3_sub(disc->center, o), disc->normal) / f3_dot(d, disc->normal);
    struct f3 off = f3_sub(f3_add_scaled(o, d, t), disc->center);
    if (f3_dot(off, off) <= disc->radius * disc->radius) add_crossing(&pair, t, 0);
    return pair;
}

static inline struct crossing_pair crossings_of(const struct part *part, unsigned primitive,
                                                struct f3 o, struct f3 d)
{
    switch (part->kind) {
    case PRIMITIVE_CONE:
        return cone_crossings((const struct solid_cone *)part->solids + primitive, o, d);
    case PRIMITIVE_BOX:
        return box_crossings((const struct solid_box *)part->solids + primitive, o, d);
    default:
        return disc_crossing((const struct flat_disc *)part->solids + primitive, o, d);
    }
}

static inline struct f3 normal_of(const struct part *part, unsigned primitive, struct f3 point,
                                  unsigned side)
{
    switch (part->kind) {
    case PRIMITIVE_CONE:
        return cone_normal_at((const struct solid_cone *)part->solids + primitive, point, side);
    case PRIMITIVE_BOX:
        return box_normal_of(side);
    default:
        return ((const struct flat_disc *)part->solids + primitive)->normal;
    }
}

/*
 * Rays and hits of a packet of N: arrays of N numbers of four bytes, in the order of the members of
 * struct RTCRay and of struct RTCHit, which are those for N = 1.
 */
enum { ORG_X, ORG_Y, ORG_Z, T_NEAR, DIR_X, DIR_Y, DIR_Z, TIME, T_FAR, MASK, ID, FLAGS, RAY_FIELDS };
enum { NG_X, NG_Y, NG_Z, U, V, PRIMITIVE_ID, GEOMETRY_ID, INSTANCE_ID };

static inline struct f3 ray_vector(const float *ray, unsigned n, unsigned first)
{
    return f3(ray[first * n], ray[(first + 1) * n], ray[(first + 2) * n]);
}

/* The first crossing within the ray; count when there is none. */
static inline unsigned first_within(const struct crossing_pair *found, const float *ray, unsigned n,
                                    unsigned from)
{
    while (from < found->count &&
           !(found->t[from] > ray[T_NEAR * n] && found->t[from] < ray[T_FAR * n]))
        from++;
    return from;
}

static inline void intersect_one(const struct RTCIntersectFunctionNArguments *arguments, unsigned n,
                                 unsigned i)
{
    const struct part *part = arguments->geometryUserPtr;
    unsigned primitive = arguments->primID;
    float *ray = (float *)arguments->rayhit + i;
    struct f3 o = ray_vector(ray, n, ORG_X), d = ray_vector(ray, n, DIR_X);
    struct crossing_pair found = crossings_of(part, primitive, o, d);
    unsigned k = first_within(&found, ray, n, 0);
    if (k == found.count) return;
    struct f3 point = f3_add_scaled(o, d, found.t[k]);
    struct f3 normal = normal_of(part, primitive, point, found.part[k]);
    float *hit = ray + RAY_FIELDS * n;
    unsigned *ids = (unsigned *)arguments->rayhit + RAY_FIELDS * n + i;
    ray[T_FAR * n] = found.t[k];
    hit[NG_X * n] = normal.x;
    hit[NG_Y * n] = normal.y;
    hit[NG_Z * n] = normal.z;
    ids[PRIMITIVE_ID * n] = primitive;
    ids[GEOMETRY_ID * n] = arguments->geomID;
    ids[INSTANCE_ID * n] = RTC_INVALID_GEOMETRY_ID;
}

static void intersect_solid(const struct RTCIntersectFunctionNArguments *arguments)
{
    if (arguments->N == 1) {
        intersect_one(arguments, 1, 0);
        return;
    }
    for (unsigned i = 0; i < arguments->N; i++)
        if (arguments->valid[i]) intersect_one(arguments, arguments->N, i);
}

/* Shadow rays are always traced one by one. */
static void occlude_solid(const struct RTCOccludedFunctionNArguments *arguments)
{
    const struct part *part = arguments->geometryUserPtr;
    float *ray = (float *)arguments->ray;
    struct f3 o = ray_vector(ray, 1, ORG_X), d = ray_vector(ray, 1, DIR_X);
    struct crossing_pair found = crossings_of(part, arguments->primID, o, d);
    unsigned k = first_within(&found, ray, 1, 0);
    if (k == found.count) return;
    if (!part->transparent) {
        ray[T_FAR] = -INFINITY;
        return;
    }
    for (; k < found.count; k = first_within(&found, ray, 1, k + 1))
        shadow_pass((struct shadow_query *)arguments->context, part, arguments->geomID,
                    arguments->primID, found.t[k]);
}

static void solid_bounds(const struct RTCBoundsFunctionArguments *arguments)
{
    const struct part *part = arguments->geometryUserPtr;
    struct f3 low, high;
    if (part->kind == PRIMITIVE_BOX) {
        const struct solid_box *box = (const struct solid_box *)part->solids + arguments->primID;
        low = box->min;
        high = box->max;
    } else {
        struct f3 a, b, axis;
        float ra, rb;
        if (part->kind == PRIMITIVE_CONE) {
            const struct solid_cone *cone =
                (const struct solid_cone *)part->solids + arguments->primID;
            a = cone->base, b = f3_add_scaled(a, cone->axis, cone->height), axis = cone->axis;
            ra = cone->base_radius, rb = cone->apex_radius;
        } else {
            const struct flat_disc *disc =
                (const struct flat_disc *)part->solids + arguments->primID;
            a = b = disc->center, axis = disc->normal, ra = rb = disc->radius;
        }
        struct f3 e = f3(sqrtf(fmaxf(0, 1 - axis.x * axis.x)), sqrtf(fmaxf(0, 1 - axis.y * axis.y)),
                         sqrtf(fmaxf(0, 1 - axis.z * axis.z)));
        low = f3(fminf(a.x - ra * e.x, b.x - rb * e.x), fminf(a.y - ra * e.y, b.y - rb * e.y),
                 fminf(a.z - ra * e.z, b.z - rb * e.z));
        high = f3(fmaxf(a.x + ra * e.x, b.x + rb * e.x), fmaxf(a.y + ra * e.y, b.y + rb * e.y),
                  fmaxf(a.z + ra * e.z, b.z + rb * e.z));
    }
    *arguments->bounds_o = (struct RTCBounds){low.x, low.y, low.z, 0, high.x, high.y, high.z, 0};
}

void solids_attach(RTCGeometry geometry)
{
    rtcSetGeometryBoundsFunction(geometry, solid_bounds, NULL);
    rtcSetGeometryIntersectFunction(geometry, intersect_solid);
    rtcSetGeometryOccludedFunction(geometry, occlude_solid);
}
