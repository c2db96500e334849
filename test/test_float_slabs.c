/* Tests the intersection of rays and boxes in float, which finds all boxes that double finds, at all sizes, and the way
 * of bundles of rays through trees of such boxes. */
#include "scene_fixture.h"

#include "worker/float_slabs.h"
#include "worker/packet_walk.h"

#define TRIES 400000

/* Powers of two: the size of the scene; rays have origins and directions of other sizes. */
struct sizes {
    int scene, origin, direction;
};

static struct sizes random_sizes(uint64_t *random)
{
    struct sizes sizes = {random_exponent(random, -60, 65), 0, random_exponent(random, -45, 45)};
    if (random_below(random, 4) > 0) sizes.scene = random_exponent(random, -3, 3);
    sizes.origin = sizes.scene + random_exponent(random, -30, 8);
    if (random_below(random, 2) > 0) sizes.direction = 0;
    return sizes;
}

/* A number from -size to size, sometimes 0 or a small part of size. */
static double random_part(uint64_t *random, double size)
{
    double x = random_between(random, -size, size);
    switch (random_below(random, 8)) {
    case 0:
        return random_below(random, 2) > 0 ? 0.0 : -0.0;
    case 1:
        return ldexp(x, random_exponent(random, -60, 0));
    default:
        return x;
    }
}

static struct vec3 random_parts(uint64_t *random, double size)
{
    double x = random_part(random, size), y = random_part(random, size);
    return vec3(x, y, random_part(random, size));
}

/* Fills a node with boxes of all sizes, some of them flat, some with a face in an axis-aligned plane through the
 * origin of the ray. */
static void fill_node(uint64_t *random, double size, const struct vec3 *origin,
                      struct bvh_node *node)
{
    for (unsigned slot = 0; slot < BVH_WIDTH; slot++) {
        for (unsigned axis = 0; axis < 3; axis++) {
            double at = random_part(random, size), w = fabs(random_part(random, size));
            if (random_below(random, 8) == 0) at = vec_component(origin, axis);
            if (random_below(random, 3) > 0) w = ldexp(w, random_exponent(random, -20, 0));
            node->min[axis][slot] = slot == 7 ? INFINITY : (float)at;
            node->max[axis][slot] = slot == 7 ? -INFINITY : (float)(at + w);
        }
    }
}

/* Any direction, or one towards a corner of a box. */
static struct vec3 random_direction(uint64_t *random, int exponent, const struct vec3 *origin,
                                    const struct bvh_node *node)
{
    unsigned slot = random_below(random, 7);
    if (random_below(random, 4) == 0) return random_parts(random, ldexp(1, exponent));
    struct vec3 corner =
        vec3((double)node->min[0][slot], (double)node->max[1][slot], (double)node->min[2][slot]);
    struct vec3 way = vec_sub(corner, *origin);
    double length = vec_largest(way);
    return length > 0 ? vec_scale(way, ldexp(1, exponent) / length) : way;
}

/* A limit beyond all boxes, or at the entry of one of them. */
static double random_limit(uint64_t *random, struct lanes enter)
{
    double at[LANES];
    lanes_store(at, enter);
    double limit = at[random_below(random, BVH_WIDTH)];
    bool some = random_below(random, 2) > 0 && limit >= 0 && limit < INFINITE;
    return some ? limit : INFINITE;
}

static void test_no_box_is_lost(void **state)
{
    uint64_t random = 1, taken = 0, met = 0, more = 0;
    for (int i = 0; i < TRIES; i++) {
        struct sizes sizes = random_sizes(&random);
        double size = ldexp(1, sizes.scene);
        float reach = (float)size;
        const struct bvh bvh = {.reach = (double)reach, .size = (double)reach};
        struct vec3 origin = random_parts(&random, ldexp(1, sizes.origin));
        struct bvh_node node = {.child = {0}};
        fill_node(&random, size, &origin, &node);
        struct vec3 direction = random_direction(&random, sizes.direction, &origin, &node);
        if (vec_is_zero(direction)) continue;
        struct ray ray = ray_along(origin, direction);
        struct float_slabs floats;
        if (!float_slabs_of(&bvh, &ray, &floats)) continue;
        taken++;
        struct slabs doubles = slabs_of(&bvh, &ray);
        struct lanes enter;
        struct floats float_enter;
        lane_set all = slabs_meet(&doubles, &node, INFINITE, &enter);
        assert_int_equal(all & 0x80, 0);
        double limit = random_limit(&random, enter);
        lane_set wanted = slabs_meet(&doubles, &node, limit, &enter);
        lane_set found = float_slabs_meet(&floats, &node, float_slab_limit(limit), &float_enter);
        assert_int_equal(wanted & ~found, 0);
        assert_int_equal(found & 0x80, 0);
        met += (unsigned)__builtin_popcount(wanted);
        more += (unsigned)__builtin_popcount(found & ~wanted);
        double at[LANES];
        float float_at[LANES];
        lanes_store(at, enter);
        floats_store(float_at, float_enter);
        /* A subnormal number errs by half of the smallest. */
        for (lane_set rest = wanted; rest; rest = without_lowest(rest))
            assert_true((double)float_at[lowest_lane(rest)] <=
                        at[lowest_lane(rest)] * FLOAT_WIDENING + 0x1p-150);
    }
    /* Float is used for most rays, finds boxes, and hardly more of them than double does. */
    assert_true(taken > TRIES / 2);
    assert_true(met > taken / 4);
    assert_true(more < met / 4);
}

/* ---- packets ---- */

#define RAYS (BUNDLE * LANES)

/* A tree with a centre, to which coordinates in nodes are relative, often much larger than the tree. */
static struct bvh random_tree(uint64_t *random, int exponent)
{
    double reach = ldexp(1, exponent), far = ldexp(1, exponent + random_exponent(random, -5, 30));
    struct vec3 center = vec3(0, 0, 0);
    if (random_below(random, 2) > 0) center = random_parts(random, far);
    return (struct bvh){.node_count = 1,
                        .center = {center.x, center.y, center.z},
                        .reach = reach,
                        .size = reach + vec_largest(center)};
}

/* Rays of similar directions, some of which hardly move along an axis, from one point or from points near it. */
static void random_rays(uint64_t *random, struct vec3 origin, struct vec3 way, struct ray *rays)
{
    double length = vec_largest(way), spread = ldexp(length, random_exponent(random, -60, -1));
    double apart =
        random_below(random, 2) ? ldexp(vec_largest(origin), random_exponent(random, -30, 0)) : 0;
    for (unsigned i = 0; i < RAYS; i++) {
        struct vec3 from = vec_add(origin, random_parts(random, apart));
        struct vec3 direction = vec_add(way, random_parts(random, spread));
        if (random_below(random, 4) == 0 && fabs(way.x) < length / 2)
            direction.x = random_part(random, ldexp(length, -25));
        if (random_below(random, 4) == 0 && fabs(way.y) < length / 2)
            direction.y = random_part(random, ldexp(length, -25));
        rays[i] = ray_along(from, direction);
    }
}

struct tally {
    uint64_t taken, met; /* bundles; pairs of a ray and a box that it meets */
    uint64_t more;       /* pairs of a ray and a box that its packet counts as met */
    uint64_t boxes,
        vain; /* that some ray meets; that the bundle counts as met, and no packet does */
};

/* A limit beyond all boxes, or where one of the rays enters one of the boxes. */
static double limit_of_ray(uint64_t *random, const struct bundle *bundle,
                           const struct bvh_node *node, const struct ray *rays)
{
    struct slabs slabs = slabs_of(bundle->bvh, &rays[random_below(random, RAYS)]);
    struct lanes enter;
    slabs_meet(&slabs, node, INFINITE, &enter);
    return random_limit(random, enter);
}

/* Checks that the bundle and its packets meet all boxes that single rays meet in double. */
static void check_bundle(uint64_t *random, const struct bundle *bundle, const struct bvh_node *node,
                         const struct ray *rays, struct tally *tally)
{
    struct floats enter;
    double limit = limit_of_ray(random, bundle, node, rays);
    lane_set all = ranges_meet(bundle, node, float_slab_limit(limit), &enter), some = 0, any = 0;
    lane_set in[BVH_WIDTH];
    assert_int_equal(all & 0x80, 0);
    for (unsigned p = 0; p < bundle->count; p++) {
        packet_prepare(bundle->packets[p], bundle);
        packet_enters(bundle->packets[p], bundle);
        for (unsigned slot = 0; slot < 7; slot++) {
            struct packet_box box = packet_box(bundle, node, slot);
            in[slot] = rays_meet(bundle->packets[p], &box, ray_limits(lanes_of(limit)));
            some |= (lane_set)(in[slot] != 0) << slot;
        }
        for (unsigned i = 0; i < LANES; i++) {
            struct slabs slabs = slabs_of(bundle->bvh, &rays[p * LANES + i]);
            struct lanes ignored;
            lane_set wanted = slabs_meet(&slabs, node, limit, &ignored);
            any |= wanted;
            for (unsigned slot = 0; slot < 7; slot++) {
                assert_true(!(wanted >> slot & 1) || in[slot] >> i & 1);
                tally->more += in[slot] >> i & 1 & ~(wanted >> slot);
            }
            tally->met += (unsigned)__builtin_popcount(wanted);
        }
    }
    assert_int_equal(any & ~all, 0);
    tally->boxes += (unsigned)__builtin_popcount(any);
    tally->vain += (unsigned)__builtin_popcount(all & ~some);
    tally->taken++;
}

static void test_packets_lose_no_box(void **state)
{
    uint64_t random = 3;
    struct tally tally = {0};
    for (int i = 0; i < TRIES / 20; i++) {
        struct sizes sizes = random_sizes(&random);
        struct bvh bvh = random_tree(&random, sizes.scene);
        struct vec3 center = vec3(bvh.center[0], bvh.center[1], bvh.center[2]);
        struct vec3 place = random_parts(&random, ldexp(1, sizes.origin));
        struct bvh_node node = {.child = {0}};
        fill_node(&random, bvh.reach, &place, &node);
        struct vec3 way = random_direction(&random, sizes.direction, &place, &node);
        if (vec_is_zero(way)) continue;
        struct ray rays[RAYS];
        struct packet packets[BUNDLE];
        struct bundle bundle = {.count = BUNDLE};
        for (unsigned p = 0; p < BUNDLE; p++)
            bundle.packets[p] = &packets[p];
        random_rays(&random, vec_add(center, place), way, rays);
        if (!bundle_of(rays, &bundle) || !bundle_enters(&bundle, &bvh)) continue;
        check_bundle(&random, &bundle, &node, rays, &tally);
    }
    assert_true(tally.taken > TRIES / 80 && tally.met > tally.taken * RAYS / 4);
    /* A packet counts 0.35 as many pairs more as there are, most of them of rays that hardly move along an axis. The
     * bundle counts 0.59 as many boxes in vain as are met, as its rays are up to half of their way apart. */
    assert_true((double)tally.more < 0.4 * (double)tally.met);
    assert_true((double)tally.vain < 0.65 * (double)tally.boxes);
}

/* RAYS rays from (0, 0, 10) downwards, a little apart. */
static void down(struct ray rays[RAYS])
{
    for (unsigned i = 0; i < RAYS; i++)
        rays[i] = ray_along(vec3(0, 0, 10), vec3(0.125 + i / 256., i / 256., -1));
}

static bool makes_bundle(const struct ray rays[RAYS], struct bundle *bundle,
                         struct packet packets[BUNDLE])
{
    *bundle = (struct bundle){.count = BUNDLE};
    for (unsigned p = 0; p < BUNDLE; p++)
        bundle->packets[p] = &packets[p];
    return bundle_of(rays, bundle);
}

/* Rays have a common origin only if all coordinates of all of them are the same. */
static void test_one_origin(void **state)
{
    const unsigned others[] = {1, LANES, RAYS - 1};
    struct bundle bundle;
    struct packet packets[BUNDLE];
    struct ray rays[RAYS];
    down(rays);
    assert_true(makes_bundle(rays, &bundle, packets) && bundle.one_origin);
    for (unsigned axis = 0; axis < 3; axis++)
        for (unsigned i = 0; i < 3; i++) {
            down(rays);
            (&rays[others[i]].origin.x)[axis] += 0x1p-40;
            assert_true(makes_bundle(rays, &bundle, packets) && !bundle.one_origin);
        }
}

/* Rays of which one may have another longest axis make no bundle; a bundle that is made anew has met no leaves. */
static void test_longest_axis(void **state)
{
    struct bundle bundle;
    struct packet packets[BUNDLE];
    struct ray rays[RAYS];
    for (unsigned axis = 0; axis < 2; axis++)
        for (int i = 0; i < 4; i++) {
            down(rays);
            (&rays[9].direction.x)[axis] = (i % 2 ? 1 : -1) * (i < 2 ? 1 : 1.5);
            assert_false(makes_bundle(rays, &bundle, packets));
        }
    down(rays);
    assert_true(makes_bundle(rays, &bundle, packets));
    bundle.leaves = bundle.visits = 7;
    assert_true(bundle_of(rays, &bundle));
    assert_true(bundle.leaves == 0 && bundle.visits == 0);
}

/* One ray that is not finite, or directions that are too short or too long, make no bundle. */
static void test_no_bundle(void **state)
{
    const double odd[] = {HUGE_VAL, -HUGE_VAL, (double)NAN};
    struct bundle bundle;
    struct packet packets[BUNDLE];
    struct ray rays[RAYS];
    for (unsigned i = 0; i < 3; i++)
        for (unsigned k = 0; k < 6; k++) {
            down(rays);
            (k < 3 ? &rays[9].origin.x : &rays[9].direction.x)[k % 3] = odd[i];
            assert_false(makes_bundle(rays, &bundle, packets));
            for (unsigned n = 0; n < RAYS; n++)
                rays[n].origin = rays[9].origin;
            assert_false(makes_bundle(rays, &bundle, packets));
        }
    for (int exponent = -50; exponent <= 50; exponent += 10) {
        down(rays);
        for (unsigned i = 0; i < RAYS; i++)
            rays[i].direction = vec_scale(rays[i].direction, ldexp(1, exponent));
        assert_int_equal(makes_bundle(rays, &bundle, packets), abs(exponent) < 40);
    }
}

/* Components of directions that are all of one sign, but so small that only double has a number for their inverse. */
static void test_slow_components(void **state)
{
    uint64_t random = 7;
    struct tally tally = {0};
    const double sizes[] = {0x1p-55, 0x1p-100, 0x1p-130, 0x1p-140, 0x1p-1000};
    for (unsigned i = 0; i < 500; i++) {
        struct bvh bvh = random_tree(&random, 0);
        struct bvh_node node = {.child = {0}};
        struct bundle bundle;
        struct packet packets[BUNDLE];
        struct ray rays[RAYS];
        down(rays);
        const struct vec3 place = {random_part(&random, 1), 0, 10};
        fill_node(&random, 1, &place, &node);
        for (unsigned k = 0; k < RAYS; k++) {
            rays[k].origin = vec_add(place, vec3(bvh.center[0], bvh.center[1], bvh.center[2]));
            rays[k].direction.x = (i % 2 ? 1 : -1) * sizes[i % 5] * random_between(&random, 1, 2);
            rays[k].direction.y /= 16;
        }
        if (makes_bundle(rays, &bundle, packets) && bundle_enters(&bundle, &bvh))
            check_bundle(&random, &bundle, &node, rays, &tally);
    }
    assert_true(tally.taken > 200 && tally.met > tally.taken);
}

/* ---- bundles in a tree ---- */

/* Rays from (0, 0, 10) towards a square of this size around a point. */
static void aim(struct bundle *bundle, struct packet packets[BUNDLE], struct ray rays[RAYS],
                struct vec3 target, double size)
{
    uint64_t random = 5;
    for (unsigned i = 0; i < RAYS; i++)
        rays[i] = ray_to(vec3(0, 0, 10), vec_add(target, random_vector(&random, size)));
    assert_true(makes_bundle(rays, bundle, packets));
}

/* The leaves that a bundle has visited, from top to bottom. */
struct visits {
    unsigned count, most; /* after so many, nothing farther than the last one matters */
    float last;           /* the highest point of the last one */
    bool disorder;
};

static void note_visit(void *context, const struct bvh_node *node, unsigned slot, double *limit)
{
    struct visits *visits = context;
    float highest = node->max[2][slot];
    visits->disorder |= highest > visits->last;
    visits->last = highest;
    if (++visits->count == visits->most) *limit = 10 - (double)highest;
}

/* A column of spheres whose boxes do not overlap, below the rays' origin. */
static struct scene *column(unsigned spheres)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    for (unsigned i = 0; i < spheres; i++)
        add_sphere(builder, vec3(0, 0, -(double)i), 0.25, 0);
    return finish_scene(builder);
}

static unsigned count_leaves(const struct bvh *bvh)
{
    unsigned leaves = 0;
    for (uint64_t i = 0; i < bvh->node_count; i++)
        for (unsigned slot = 0; slot < BVH_WIDTH; slot++)
            leaves += bvh_nodes(bvh)[i].count[slot] > 0;
    return leaves;
}

/* A bundle visits the leaves within its limit in the order in which it enters them, and a limit that becomes less ends
 * that. */
static void test_near_leaves_first(void **state)
{
    for (unsigned spheres = 1; spheres <= 300; spheres = 2 * spheres + 1) {
        struct scene *scene = column(spheres);
        struct bvh *bvh = build_tree(scene);
        struct packet packets[BUNDLE];
        struct ray rays[RAYS];
        struct bundle bundle;
        unsigned leaves = count_leaves(bvh);
        aim(&bundle, packets, rays, vec3(0, 0, 9), 1e-6);
        assert_true(bundle_enters(&bundle, bvh));
        struct visits all = {.last = INFINITY};
        bundle_traverse(&bundle, INFINITE, note_visit, &all);
        assert_true(all.count == leaves && !all.disorder);
        double limit = 10 + 0.5 * spheres;
        struct visits near = {.last = INFINITY};
        bundle_traverse(&bundle, limit, note_visit, &near);
        assert_true(near.count > 0 && !near.disorder && 10 - (double)near.last <= limit + 1e-3);
        assert_true(near.count < leaves || leaves < 3);
        for (unsigned most = 1; most <= leaves; most++) {
            struct visits some = {.last = INFINITY, .most = most};
            bundle_traverse(&bundle, INFINITE, note_visit, &some);
            assert_int_equal(some.count, most);
        }
        free(bvh);
        free(scene);
    }
}

/* No leaf is lost among those that are entered at the same distance, as all are in which the rays begin. */
static void test_equal_distances(void **state)
{
    uint64_t random = 8;
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    for (unsigned i = 0; i < 200; i++)
        add_sphere(builder, vec_add(vec3(0, 0, 10), random_vector(&random, 1)), 2, 0);
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    struct packet packets[BUNDLE];
    struct ray rays[RAYS];
    struct bundle bundle;
    struct visits all = {.last = INFINITY};
    aim(&bundle, packets, rays, vec3(0, 0, 0), 1);
    assert_true(bundle_enters(&bundle, bvh));
    bundle_traverse(&bundle, INFINITE, note_visit, &all);
    assert_int_equal(all.count, count_leaves(bvh));
    free(bvh);
    free(scene);
}

/* A bundle whose rays meet no leaf gives up after some of them, the later the likelier a leaf is hit by few rays; one
 * whose rays meet leaves never does. */
static void test_giving_up(void **state)
{
    for (int one_origin = 0; one_origin < 2; one_origin++) {
        struct bundle apart = {.one_origin = one_origin}, together = apart;
        unsigned leaves = 1;
        while (leaves < 100 && is_worth_it(&apart, 0))
            leaves++;
        assert_int_equal(leaves, one_origin ? PINHOLE_ON_TRIAL : LEAVES_ON_TRIAL);
        for (unsigned i = 0; i < 1000; i++) /* as many rays as leaves */
            assert_true(is_worth_it(&together, i % 2 ? 0 : 2));
        for (unsigned i = 0; i < 2000; i++) /* as many leaves as before, and as many again */
            assert_int_equal(is_worth_it(&together, 0), one_origin || i < 999);
    }
}

/* Twelve clusters of small spheres, far from each other, which have trees of their own. */
static struct scene *clusters(void)
{
    uint64_t random = 6;
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    for (unsigned i = 0; i < 12 * 100; i++) {
        struct vec3 place = vec3(1e7 * cos(i % 12), 1e7 * sin(i % 12), -1e6 * (i % 12) - 1e7);
        add_sphere(builder, vec_add(place, random_vector(&random, 1)), 0.01, 0);
    }
    return finish_scene(builder);
}

/* A bundle enters the trees that its rays meet, and hardly others. */
static void test_trees_of_bundle(void **state)
{
    struct scene *scene = clusters();
    struct bvh *bvh = build_tree(scene);
    unsigned trees = (unsigned)__builtin_popcount(all_trees(bvh));
    assert_true(trees > BVH_WIDTH);
    for (unsigned i = 0; i < 12; i++) {
        struct packet packets[BUNDLE];
        struct ray rays[RAYS];
        struct bundle bundle;
        struct vec3 place = vec3(1e7 * cos(i), 1e7 * sin(i), -1e6 * i - 1e7);
        aim(&bundle, packets, rays, place, 0.5);
        lane_set wanted = 0, found = trees_of_bundle(&bundle, bvh, INFINITE);
        for (unsigned k = 0; k < RAYS; k++)
            wanted |= trees_of_ray(bvh, &rays[k], INFINITE);
        assert_int_equal(wanted & ~found, 0);
        assert_true(wanted && __builtin_popcount(found) <= 2);
        assert_int_equal(trees_of_bundle(&bundle, bvh, 0.5) & ~UINT32_C(1), 0);
    }
    free(bvh);
    free(scene);
}

static void test_rounds_outward(void **state)
{
    uint64_t random = 2;
    for (int i = 0; i < TRIES; i++) {
        double x = ldexp(random_between(&random, -2, 2), random_exponent(&random, -100, 100));
        if (i % 4 == 0) x = (double)(float)x; /* is kept or passed by one */
        assert_true((double)float_above(x) >= x && (double)float_below(x) <= x);
        assert_true((double)float_above(x) - (double)float_below(x) <= 0x1p-21 * fabs(x));
    }
}

/* Rays for which float is not accurate enough are left to double. */
static void test_left_to_double(void **state)
{
    const struct bvh bvh = {.reach = 1, .size = 1};
    const struct bvh vast = {.reach = 0x1p70, .size = 0x1p70};
    const struct bvh open = {.reach = INFINITE, .size = INFINITE};
    struct float_slabs slabs;
    struct ray ray = ray_along(vec3(0, 0, 2), vec3(0, 0, -1));
    assert_true(float_slabs_of(&bvh, &ray, &slabs));
    assert_false(float_slabs_of(&vast, &ray, &slabs));
    assert_false(float_slabs_of(&open, &ray, &slabs));
    ray.origin.z = 0x1p20;
    assert_false(float_slabs_of(&bvh, &ray, &slabs));
    ray = ray_along(vec3(0, 0, 2), vec3(0, 0, -0x1p-50));
    assert_false(float_slabs_of(&bvh, &ray, &slabs));
    ray.direction.z = 0x1p50;
    assert_false(float_slabs_of(&bvh, &ray, &slabs));
}

/* How close a ray passes boxes that float counts as met depends on its origin and not on the size of the scene, except
 * on an axis along which it hardly moves. */
static void test_size_does_not_blur(void **state)
{
    const struct bvh vast = {.reach = 0x1p23, .size = 0x1p23};
    struct bvh_node node = {.child = {0}};
    for (unsigned slot = 0; slot < BVH_WIDTH; slot++)
        for (unsigned axis = 0; axis < 3; axis++) {
            node.min[axis][slot] = slot == 0 ? 2 : INFINITY;
            node.max[axis][slot] = slot == 0 ? 2.25f : -INFINITY;
        }
    struct float_slabs slabs;
    struct floats enter;
    struct ray near = ray_along(vec3(0, 0, 0), vec3(1, 1 - 0x1p-10, 1));
    assert_true(float_slabs_of(&vast, &near, &slabs));
    assert_int_equal(float_slabs_meet(&slabs, &node, INFINITY, &enter), 1);
    struct ray past = ray_along(vec3(0, 0.25 + 0x1p-10, 0), vec3(1, 1, 1));
    assert_true(float_slabs_of(&vast, &past, &slabs));
    assert_int_equal(float_slabs_meet(&slabs, &node, INFINITY, &enter), 0);
    past = ray_along(vec3(0, 2.5, 2.125), vec3(1, 0, 0));
    assert_true(float_slabs_of(&vast, &past, &slabs));
    assert_int_equal(float_slabs_meet(&slabs, &node, INFINITY, &enter), 0);
    const struct bvh far = {.center = {0x1p40, 0, 0}, .reach = 4, .size = 0x1p40 + 4};
    past = ray_along(vec3(0x1p40, 2.5, 2.125), vec3(1, 0, 0));
    assert_true(float_slabs_of(&far, &past, &slabs));
    assert_int_equal(float_slabs_meet(&slabs, &node, INFINITY, &enter), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_box_is_lost),     cmocka_unit_test(test_packets_lose_no_box),
        cmocka_unit_test(test_size_does_not_blur), cmocka_unit_test(test_rounds_outward),
        cmocka_unit_test(test_left_to_double),     cmocka_unit_test(test_near_leaves_first),
        cmocka_unit_test(test_one_origin),         cmocka_unit_test(test_no_bundle),
        cmocka_unit_test(test_longest_axis),       cmocka_unit_test(test_slow_components),
        cmocka_unit_test(test_equal_distances),    cmocka_unit_test(test_giving_up),
        cmocka_unit_test(test_trees_of_bundle),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
