/* Triangles and patches of a wave. */
#include "worker/points_kinds.h"
#include "worker/triangle.h"

static void gather_triangles(const struct scene *scene, const struct hit *hits, uint32_t begin,
                             uint32_t end, struct points *points)
{
    for (uint32_t i = begin; i < end; i++) {
        struct vec3 at[3];
        triangle_vertices(scene, hits[points->slot[i]].primitive, at);
        set_lane(&points->a, i, at[0]);
        set_lane(&points->b, i, at[1]);
        set_lane(&points->c, i, at[2]);
    }
}

/* The axes of shear_of() without a branch: z is the longest component of the direction. */
struct turn {
    bool to_z, to_y;
};

static inline struct turn turn_of(struct vec3 direction)
{
    double x = fabs(direction.x), y = fabs(direction.y), z = fabs(direction.z);
    return (struct turn){(z >= x) & (z >= y), y >= x};
}

static inline struct vec3 turned(struct turn turn, struct vec3 v)
{
    struct vec3 other = choose(turn.to_y, vec3(v.z, v.x, v.y), vec3(v.y, v.z, v.x));
    return choose(turn.to_z, v, other);
}

/* shear_vertex() with a turned direction. slant.z is its z; slant.x and slant.y are x / z and y / z. */
static inline struct sheared shear_lane(struct turn turn, struct vec3 slant, struct vec3 way)
{
    struct vec3 v = turned(turn, way);
    return (struct sheared){v.x - slant.x * v.z, v.y - slant.y * v.z, v.z};
}

/*
 * Whether triangle_plane_distance() certainly succeeds, so that the weights are kept when the distance is
 * corrected. Plain arithmetic errs by 2^-40 of what is compared; the limits are twice those of that function.
 */
static inline bool plane_is_decided(struct vec3 a, struct vec3 b, struct vec3 c, struct vec3 origin,
                                    struct vec3 direction)
{
    struct vec3 p = vec_sub(b, a), q = vec_sub(c, a), f = vec_sub(a, origin);
    struct vec3 normal = vec_cross(p, q);
    double edges = sum_of_sizes(p) * sum_of_sizes(q);
    double heights = edges * sum_of_sizes(f), speeds = edges * sum_of_sizes(direction);
    double height = fabs(vec_dot(normal, f)), speed = fabs(vec_dot(normal, direction));
    return (height > 2 * PLANE_SHARE * heights) & (speed > 2 * PLANE_SHARE * speeds) &
           (heights > 0x1p-399) & (speeds > 0x1p-399) & (heights < 0x1p399) & (speeds < 0x1p399);
}

/*
 * Whether triangle_crossings() certainly leaves the distance uncorrected. The limit here is half of its
 * limit, a margin larger than the error of the distance.
 */
static inline bool is_flat(const struct sheared *p, const struct sheared *q,
                           const struct sheared *r, double sum, double size)
{
    bool gentle = triangle_slope(p, q, r, sum) <= SLOPE_MAX;
    bool near = corners_are_near(p, q, r, size / 2);
    return gentle & near;
}

/* Whether the distance, which is known to lie in an interval, is certainly far enough, or certainly not. */
static inline bool distance_is_decided(const struct points *points, size_t i, double size,
                                       double longest)
{
    double from = points->t[i] - points->t_error[i], to = points->t[i] + points->t_error[i];
    return (size <= from * longest) | (!(size <= to * longest));
}

/*
 * The weights of a triangle's rough hit, as triangle_crossings() computes them. Where that function goes on
 * to correct the distance it keeps the weights, unless it needs exact arithmetic. start_is_close() need not
 * be asked: a rough hit is ahead of the ray whatever the error of its distance, which is at least 64 u of the
 * largest z.
 */
static inline void weigh_corners(struct points *points, size_t i)
{
    struct vec3 a = lane(&points->a, i), b = lane(&points->b, i), c = lane(&points->c, i);
    struct vec3 origin = lane(&points->origin, i), direction = lane(&points->view, i);
    struct turn turn = turn_of(direction);
    struct vec3 d = turned(turn, direction), slant = vec3(d.x / d.z, d.y / d.z, d.z);
    struct sheared p = shear_lane(turn, slant, vec_sub(a, origin));
    struct sheared q = shear_lane(turn, slant, vec_sub(b, origin));
    struct sheared r = shear_lane(turn, slant, vec_sub(c, origin));
    double e0 = edge_value(&q, &r), e1 = edge_value(&r, &p), e2 = edge_value(&p, &q);
    double sum = e0 + e1 + e2;
    double way = points->t[i] * fabs(d.z);
    struct edge_range edges = edge_range(&p, &q, &r);
    bool crosses = (edges.low > edges.error) | (edges.high < -edges.error);
    bool flat = is_flat(&p, &q, &r, sum, way + vec_largest(origin));
    bool plane = plane_is_decided(a, b, c, origin, direction);
    bool distance = distance_is_decided(points, i, triangle_size(a, b, c), fabs(d.z));
    bool sure = crosses & (flat | plane) & distance;
    /* Never behind the triangles, where u is the t_error of a solid. */
    bool rough = points->v[i] == WEIGHT_UNKNOWN;
    points->u[i] = rough ? e1 / sum : points->u[i];
    points->v[i] = rough ? e2 / sum : points->v[i];
    points->sure[i] = truth(sure | (!rough));
}

IN_LANES(weigh_triangles, points, weigh_corners)

/* Whether all points are so far from their rays' origins that the means of the vertices are used. */
static FLATTENED bool triangles_are_far(struct points *points, uint32_t begin, uint32_t end)
{
    double near = 0;
    _Pragma("omp simd reduction(+ : near)") for (uint32_t i = begin; i < end; i++)
    {
        double size = triangle_size(lane(&points->a, i), lane(&points->b, i), lane(&points->c, i));
        double distance = fabs(points->t[i]) * vec_largest(lane(&points->view, i));
        near += size <= distance ? 0.0 : 1.0;
    }
    return near == 0;
}

/* Stores the point of a triangle; not sure if it may have to be drawn in or scaled. */
static inline void put_triangle(struct points *points, size_t i, const struct place *place,
                                struct vec3 b, struct vec3 c)
{
    struct vec3 a = place->anchor, across = vec_cross(vec_sub(b, a), vec_sub(c, a));
    double size = triangle_size(a, b, c);
    bool sure = (points->sure[i] != 0) & size_is_ordinary(size);
    sure &= !may_move_inward(points->u[i], points->v[i], across, size,
                             vec_largest(place_rounded(place)));
    struct vec3 normal = plain_unit(across, &sure);
    put_surface(points, i, place, normal, sure);
}

static inline void find_far_triangle(struct points *points, size_t i)
{
    struct vec3 a = lane(&points->a, i), b = lane(&points->b, i), c = lane(&points->c, i);
    struct place mean = {a, triangle_mean(a, b, c, points->u[i], points->v[i])};
    put_triangle(points, i, &mean, b, c);
}

IN_LANES(find_far_triangles, points, find_far_triangle)

static inline void find_triangle(struct points *points, size_t i)
{
    struct vec3 a = lane(&points->a, i), b = lane(&points->b, i), c = lane(&points->c, i);
    struct vec3 direction = lane(&points->view, i);
    double size = triangle_size(a, b, c), speed;
    bool far = size <= fabs(points->t[i]) * vec_largest(direction);
    struct dd3 mean = triangle_mean(a, b, c, points->u[i], points->v[i]);
    struct dd3 passage = triangle_passage(a, b, c, lane(&points->origin, i), direction, &speed);
    bool passes = (!far) & triangle_passes(&passage, speed, &mean, size);
    struct place place = {a, choose_dd3(passes, passage, mean)};
    put_triangle(points, i, &place, b, c);
}

IN_LANES(find_triangles, points, find_triangle)

void find_on_triangles(const struct scene *scene, const struct hit *hits, uint32_t begin,
                       uint32_t end, struct points *points)
{
    gather_triangles(scene, hits, begin, end, points);
    weigh_triangles(points, begin, end);
    if (triangles_are_far(points, begin, end))
        find_far_triangles(points, begin, end);
    else
        find_triangles(points, begin, end);
}

static void gather_normals(const struct scene *scene, const struct hit *hits, uint32_t begin,
                           uint32_t end, struct points *points)
{
    const struct patch *patches = scene_patches(scene);
    const struct vec3 *normals = scene_normals(scene);
    for (uint32_t i = begin; i < end; i++) {
        uint32_t index = primitive_index(hits[points->slot[i]].primitive);
        const uint32_t *corner = patches[index].normal;
        set_lane(&points->a, i, normals[corner[0]]);
        set_lane(&points->b, i, normals[corner[1]]);
        set_lane(&points->c, i, normals[corner[2]]);
    }
}

/* The interpolated normal of a patch, from the vertex normals in a, b and c. */
static inline void interpolate_normal(struct points *points, size_t i)
{
    double u = points->u[i], v = points->v[i];
    bool sure = points->sure[i] != 0;
    struct vec3 sum = vec_scale(lane(&points->a, i), 1 - u - v);
    sum = vec_add_scaled(sum, lane(&points->b, i), u);
    sum = vec_add_scaled(sum, lane(&points->c, i), v);
    set_lane(&points->normal, i, plain_unit(sum, &sure));
    points->sure[i] = truth(sure);
}

FIND_IN_LANES(find_patch_normals, gather_normals, interpolate_normal)
