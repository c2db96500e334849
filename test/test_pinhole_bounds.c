/* Tests of the error bounds of worker/pinhole.h: the values of edges and the depths of crossings, computed in float,
 * err by no more than the bounds, and by a good part of them. */
#include "scene_fixture.h"

#include "worker/bvh_leaf.h"
#include "worker/pinhole.h"

#define SIGHTS 6000

/* A leaf's triangles are in a box of this size, in units of places. */
#define BOX 65533.0

/* How a leaf is seen: in units, relative to the box's first corner, in the order of the shear's axes. */
struct sight {
    unsigned axes[3];
    double unit;
    double depth;       /* Z */
    double x, y;        /* sx and sy of a ray in the middle */
    struct vec3 target; /* a point on that ray */
    double spread;      /* of the other rays at that depth */
};

static struct vec3 in_scene(const struct sight *sight, struct vec3 v)
{
    double at[3];
    for (unsigned i = 0; i < 3; i++)
        at[sight->axes[i]] = vec_component(&v, i) * sight->unit;
    return vec3(at[0], at[1], at[2]);
}

static struct vec3 in_sight(const struct sight *sight, struct vec3 v)
{
    double x = vec_component(&v, sight->axes[0]), y = vec_component(&v, sight->axes[1]);
    return vec_scale(vec3(x, y, vec_component(&v, sight->axes[2])), 1 / sight->unit);
}

static struct vec3 eye_of(const struct sight *sight)
{
    double way = -sight->depth - sight->target.z;
    return vec_add(sight->target, vec3(way * sight->x, way * sight->y, way));
}

static struct vec3 random_in_box(uint64_t *random)
{
    return vec_add(vec3(BOX / 2, BOX / 2, BOX / 2), random_vector(random, BOX / 2));
}

/* A random number of the range, often one of its ends. */
static double random_or_extreme(uint64_t *random, double most)
{
    double value = random_between(random, -most, most);
    return random_below(random, 3) > 0 ? copysign(most * (1 - 0x1p-10), value) : value;
}

/* Rays through the box, or past it as far as anything is decided. */
static struct sight random_sight(uint64_t *random)
{
    struct sight sight = {.unit = ldexp(1, random_exponent(random, -10, 8))};
    for (unsigned i = 0, first = random_below(random, 3); i < 3; i++)
        sight.axes[i] = (first + i) % 3;
    int exponent = random_below(random, 2) > 0 ? 17 : random_exponent(random, 17, 39);
    sight.depth = ldexp(random_below(random, 2) > 0 ? 1 : -1, exponent) * (1 + 0x1p-10);
    sight.x = random_or_extreme(random, 1);
    sight.y = random_or_extreme(random, 1);
    sight.spread = ldexp(1, random_exponent(random, -6, 16));
    sight.target = random_in_box(random);
    if (random_below(random, 2) > 0) return sight;
    double aside = ASIDE_MAX - sight.spread;
    sight.target.x = random_or_extreme(random, aside);
    sight.target.y = random_or_extreme(random, aside);
    sight.target.z = 0;
    return sight;
}

static void rays_in_sight(uint64_t *random, const struct sight *sight, struct ray rays[2 * LANES])
{
    struct vec3 eye = eye_of(sight), way = vec_sub(sight->target, eye);
    double length = ldexp(1, random_exponent(random, -20, 20)) / fabs(way.z);
    for (unsigned i = 0; i < 2 * LANES; i++) {
        struct vec3 aside = random_vector(random, sight->spread);
        aside.z = 0;
        struct vec3 direction = vec_scale(vec_add(way, aside), length);
        rays[i] = ray_along(in_scene(sight, eye), in_scene(sight, direction));
    }
}

static void any_triangle(uint64_t *random, const struct sight *sight, struct vec3 at[3])
{
    (void)sight;
    for (unsigned k = 0; k < 3; k++)
        at[k] = random_in_box(random);
}

static void small_triangle(uint64_t *random, const struct sight *sight, struct vec3 at[3])
{
    double size = ldexp(BOX, -random_exponent(random, 2, 14));
    at[0] = random_below(random, 2) > 0 ? sight->target : random_in_box(random);
    at[1] = vec_add(at[0], random_vector(random, size));
    at[2] = vec_add(at[0], random_vector(random, size));
}

static void sliver(uint64_t *random, const struct sight *sight, struct vec3 at[3])
{
    any_triangle(random, sight, at);
    at[2] = vec_add_scaled(at[0], vec_sub(at[1], at[0]), random_between(random, 0, 1));
    at[2] = vec_add(at[2], random_vector(random, ldexp(1, random_exponent(random, -2, 8))));
}

/* A triangle seen edge-on: some rays see one side and some the other, or the places leave it open. */
static void edge_on(uint64_t *random, const struct sight *sight, struct vec3 at[3])
{
    struct vec3 middle = vec3(BOX / 2, BOX / 2, BOX / 2);
    at[0] = vec_add(middle, random_vector(random, BOX / 4));
    at[1] = vec_add(middle, random_vector(random, BOX / 4));
    struct vec3 way = vec_sub(at[0], eye_of(sight));
    at[2] = vec_add_scaled(at[0], way, random_between(random, 0, BOX / 8) / vec_largest(way));
}

/* A coordinate whose place is half a unit above it, or almost as much below. */
static double half_place(double place, bool above)
{
    return floor(place) + (above ? 0.5 : 0.5 - 0x1p-8);
}

/* A triangle with two vertices in the corner of the box that is farthest aside. Their places err in opposite
 * directions, so that the errors add up in the value of their edge. */
static void badly_rounded(uint64_t *random, const struct sight *sight, struct vec3 at[3])
{
    double x = -sight->target.x, y = -sight->target.y;
    bool deeper = sight->y * x > sight->x * y;
    for (unsigned k = 0; k < 2; k++) {
        double in = 16 * (k + 1) + random_below(random, 8);
        at[k].x = half_place(x > 0 ? BOX - in : in, (y > 0) == (k == 0));
        at[k].y = half_place(y > 0 ? BOX - in : in, (x < 0) == (k == 0));
        at[k].z = half_place(in, deeper == (k == 0));
    }
    at[2] = random_in_box(random);
}

/* A triangle of equal depth everywhere, whose places err by half a unit. */
static void flat(uint64_t *random, const struct sight *sight, struct vec3 at[3])
{
    any_triangle(random, sight, at);
    double z = half_place(random_between(random, 1, BOX - 1), random_below(random, 2) > 0);
    at[0].z = at[1].z = at[2].z = z;
}

static void add_in_sight(struct builder *builder, const struct sight *sight,
                         const struct vec3 at[3])
{
    add_triangle(builder, in_scene(sight, at[0]), in_scene(sight, at[1]), in_scene(sight, at[2]),
                 0);
}

/* A scene of the leaf's triangles, of which the first fills the box, and of one that makes the tree so large that rays
 * may come from anywhere. */
static struct scene *scene_in_sight(uint64_t *random, const struct sight *sight)
{
    static void (*const kinds[])(uint64_t *, const struct sight *, struct vec3 *) = {
        any_triangle, small_triangle, sliver, edge_on, badly_rounded, flat};
    struct builder *builder = builder_create();
    struct vec3 at[3] = {{0, 0, 0}, {BOX, BOX, BOX}, {0, BOX, 0}};
    add_material(builder, vec3(1, 1, 1), 0);
    add_in_sight(builder, sight, at);
    for (unsigned i = 1; i < LANES; i++) {
        kinds[random_below(random, sizeof kinds / sizeof *kinds)](random, sight, at);
        for (unsigned k = 0; k < 3; k++)
            at[k] = vec3(smaller_number(larger_number(at[k].x, 0), BOX),
                         smaller_number(larger_number(at[k].y, 0), BOX),
                         smaller_number(larger_number(at[k].z, 0), BOX));
        add_in_sight(builder, sight, at);
    }
    for (unsigned k = 0; k < 3; k++)
        at[k] = random_vector(random, 0x1p38);
    add_in_sight(builder, sight, at);
    return finish_scene(builder);
}

/* A leaf outside of any tree, with all triangles except the last one. The caller frees it. */
static struct bvh_leaf *leaf_in_sight(const struct scene *scene, const struct bvh *bvh)
{
    struct bvh_leaf *leaves = malloc((LANES + corner_entries(LANES)) * sizeof *leaves);
    assert_non_null(leaves);
    for (uint32_t i = 0; i < LANES; i++)
        leaves[i] = bvh_leaf_of(scene, primitive_id(PRIMITIVE_TRIANGLE, i));
    bvh_write_corners(scene, bvh->center, leaves, LANES);
    return leaves;
}

/* A triangle and a ray, in units, without the rounding to floats and places. */
struct exact {
    double edge[3], sum, z;
};

static struct exact exactly(const struct scene *scene, unsigned index, const struct ray *ray,
                            const struct sight *sight)
{
    const uint32_t *vertex = scene_triangles(scene)[index].vertex;
    struct vec3 p[3], way = in_sight(sight, ray->direction);
    struct exact exact = {.sum = 0};
    for (unsigned k = 0; k < 3; k++) {
        p[k] = in_sight(sight, vec_sub(scene_vertices(scene)[vertex[k]], ray->origin));
        p[k].x -= way.x / way.z * p[k].z;
        p[k].y -= way.y / way.z * p[k].z;
    }
    for (unsigned k = 0; k < 3; k++) {
        const struct vec3 *a = &p[(k + 1) % 3], *b = &p[(k + 2) % 3];
        exact.edge[k] = a->x * b->y - a->y * b->x;
        exact.sum += exact.edge[k];
        exact.z += exact.edge[k] * p[k].z;
    }
    exact.z /= exact.sum;
    return exact;
}

/* The largest errors, relative to their bounds, and the numbers of tests. */
struct off {
    double edge, depth, weights;
    uint64_t leaves, near, aside, sided, edge_on, crossed;
};

/* What is decided of a triangle and a ray. */
struct verdict {
    bool sided, passed_by, missed, crossed;
    double edge[3], z[3], error, from, to;
};

/* The mean of z, weighted with the values of the edges, each of which is off by its error. */
static double mean_of_z(const struct verdict *is, double error, unsigned more)
{
    double sum = 0, weights = 0;
    for (unsigned k = 0; k < 3; k++) {
        double weight = is->edge[k] + (more >> k & 1 ? error : -error);
        weights += weight;
        sum += weight * is->z[k];
    }
    return sum / weights;
}

/* Checks, for a ray that certainly crosses the triangle, that the depth is within its bounds, also with the largest
 * errors that the values of edges and the places may have. */
static void check_depth(const struct verdict *is, const struct exact *exact, double unit, double dz,
                        struct off *off)
{
    double at = is->from / 2 + is->to / 2, half = is->to / 2 - is->from / 2;
    double by = fabs(at - exact->z * unit / dz) / half, doubt = half * fabs(dz) / unit;
    assert_true(by <= 1);
    off->depth = larger_number(by, off->depth);
    for (unsigned more = 0; more < 8; more++) {
        by = fabs(mean_of_z(is, is->error, more) - mean_of_z(is, 0, 0));
        assert_true(by + 0.5 <= doubt);
        off->weights = larger_number(by / doubt, off->weights);
    }
}

/* The largest error of the values of edges, for this side. */
static double off_by(const struct verdict *is, const struct exact *exact, double side)
{
    double most = 0;
    for (unsigned k = 0; k < 3; k++)
        most = larger_number(fabs(is->edge[k] - side * exact->edge[k]), most);
    return most;
}

/* Checks a verdict for the side, 1 or -1, with which the values agree. */
static void check_verdict(const struct verdict *is, const struct exact *exact, struct off *off)
{
    double one = off_by(is, exact, 1), other = off_by(is, exact, -1);
    double side = other < one ? -1 : 1, by = smaller_number(one, other) / is->error;
    double low = smaller_number(smaller_number(side * exact->edge[0], side * exact->edge[1]),
                                side * exact->edge[2]);
    assert_true(by <= 1);
    off->edge = larger_number(by, off->edge);
    assert_true(!is->sided || side * exact->sum > 0);
    assert_true(!is->passed_by || low < 0);
    assert_true(!is->missed || low < 0);
    assert_true(!is->crossed || low > 0);
    off->sided += is->sided;
    off->edge_on += !is->sided;
    off->crossed += is->crossed;
}

static double lane_of(struct floats a, unsigned lane)
{
    float at[LANES];
    floats_store(at, a);
    return (double)at[lane];
}

/* A leaf and how it is seen. */
struct looked {
    const struct scene *scene;
    const struct sight *sight;
    struct pinhole_leaf leaf;
    struct pinhole_triangles seen;
};

/* Checks triangle i with the rays of a packet. */
static void check_triangle(const struct looked *at, unsigned i, const struct packet *packet,
                           const struct pinhole_rays *through, const struct ray *rays,
                           struct off *off)
{
    const struct pinhole_triangles *seen = &at->seen;
    lane_set window = in_window(seen, &through->window), open;
    struct rough_crossings found =
        pinhole_crossings(packet, &at->leaf, seen, i, through, ALL_LANES, &open);
    double from[LANES] = {0}, to[LANES] = {0};
    if (found.certain) {
        lanes_store(from, found.from);
        lanes_store(to, found.to);
    }
    for (unsigned lane = 0; lane < LANES; lane++) {
        bool crossed = found.certain >> lane & 1, told = !(open >> lane & 1);
        struct verdict is = {.sided = seen->sided >> i & 1,
                             .passed_by = !(window >> i & 1),
                             .missed = told && !crossed,
                             .crossed = crossed,
                             .error = lane_of(seen->error, i),
                             .from = from[lane],
                             .to = to[lane]};
        for (unsigned k = 0; k < 3; k++) {
            is.edge[k] = lane_of(edge_at(&seen->edges[k], i, through), lane);
            is.z[k] = lane_of(seen->z[k], i);
        }
        struct exact exact = exactly(at->scene, i, &rays[lane], at->sight);
        check_verdict(&is, &exact, off);
        double dz = vec_component(&rays[lane].direction, at->sight->axes[2]);
        if (crossed) check_depth(&is, &exact, at->sight->unit, dz, off);
    }
}

/* All rays are as close to the middle as the bundle says, but for the middle's rounding. */
static void check_middle(const struct pinhole *eye, const struct bundle *bundle)
{
    double sx[LANES], sy[LANES], most = eye->wide + 0x1p-53;
    for (unsigned p = 0; p < bundle->count; p++) {
        lanes_store(sx, bundle->packets[p]->sx);
        lanes_store(sy, bundle->packets[p]->sy);
        for (unsigned lane = 0; lane < LANES; lane++)
            assert_true(fabs(sx[lane] - eye->sx) <= most && fabs(sy[lane] - eye->sy) <= most);
    }
}

static void check_leaf(struct looked *at, const struct bvh_corners *corners,
                       const struct bundle *bundle, const struct ray *rays, struct off *off)
{
    const struct pinhole eye = pinhole_of(bundle);
    check_middle(&eye, bundle);
    if (!pinhole_leaf_of(&eye, bundle->axes, corners, &at->leaf)) return;
    assert_same(at->leaf.unit, at->sight->unit);
    struct rough_places places = rough_places(bundle->packets[0], corners, LANES, 0);
    pinhole_triangles(&eye, &at->leaf, &places, &at->seen);
    for (unsigned p = 0; p < bundle->count; p++) {
        struct pinhole_rays through = pinhole_rays_of(&eye, bundle->packets[p]);
        through = rays_at_leaf(&through, &at->leaf);
        for (unsigned i = 0; i < LANES; i++)
            check_triangle(at, i, bundle->packets[p], &through, rays + (size_t)p * LANES, off);
    }
    off->leaves++;
    off->near += fabs(at->leaf.base_z) < DEPTH_MIN * (1 + 0x1p-8);
    off->aside += fabs(lane_of(at->leaf.base_x, 0)) > ASIDE_MAX * (1 - 0x1p-8);
}

static void check_sight(const struct sight *sight, uint64_t *random, struct off *off)
{
    struct scene *scene = scene_in_sight(random, sight);
    struct bvh *bvh = build_tree(scene);
    struct ray rays[2 * LANES];
    struct packet packets[2];
    struct bundle bundle = {.count = 2, .packets = {&packets[0], &packets[1]}};
    rays_in_sight(random, sight, rays);
    if (bundle_of(rays, &bundle) && bundle_enters(&bundle, bvh)) {
        struct bvh_leaf *leaves = leaf_in_sight(scene, bvh);
        struct looked at = {.scene = scene, .sight = sight};
        for (unsigned i = 0; i < bundle.count; i++) {
            packet_prepare(&packets[i], &bundle);
            packet_enters(&packets[i], &bundle);
        }
        check_leaf(&at, bvh_corners(leaves, LANES), &bundle, rays, off);
        free(leaves);
    }
    free(bvh);
    free(scene);
}

static void test_bounds(void **state)
{
    uint64_t random = 2;
    struct off off = {.leaves = 0};
    for (int i = 0; i < SIGHTS; i++) {
        struct sight sight = random_sight(&random);
        check_sight(&sight, &random, &off);
    }
    assert_true(off.edge > 0.5 && off.depth > 0.4 && off.weights > 0.2);
    assert_true(off.leaves > SIGHTS / 2);
    assert_true(off.near > SIGHTS / 10 && off.aside > SIGHTS / 20);
    assert_true(off.sided > SIGHTS && off.edge_on > SIGHTS && off.crossed > SIGHTS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
