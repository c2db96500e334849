/*
 * Bundles: up to BUNDLE packets of LANES coherent rays each, which traverse the tree together. A node is
 * tested once for the whole bundle, by interval arithmetic: the slab distances of any of its rays lie between
 * products of the ends of the bundle's ranges. As rounding is monotonic, that holds for the rounded
 * distances, too. Only leaves and the triangles in them are tested for each ray, one ray per lane, packet
 * after packet. If the rays have a common origin, the tests use that (worker/pinhole.h).
 *
 * The hits have the same bits as those of single rays: a bundle only decides which primitives a ray is tested
 * with.
 */
#ifndef FARM_WORKER_PACKET_H
#define FARM_WORKER_PACKET_H

#include "worker/nearest.h"
#include "worker/wide.h"

struct known_planes;
struct passages;
struct blocker;

/*
 * Controls when bundles are tried. After failures in a row, the next 1, 3, 7, ... packets are traced in
 * smaller units, that is packet by packet or ray by ray. Does not affect hits.
 */
struct packet_trust {
    unsigned failures, wait;
};

#define WAIT_MAX 31

static inline bool packet_is_due(struct packet_trust *trust)
{
    if (trust->wait == 0) return true;
    trust->wait--;
    return false;
}

static inline bool packet_was(struct packet_trust *trust, bool worth_it)
{
    trust->failures = worth_it ? 0 : 2 * trust->failures + 1;
    if (trust->failures > WAIT_MAX) trust->failures = WAIT_MAX;
    trust->wait = trust->failures;
    return worth_it;
}

/*
 * The most packets in a bundle. With 1 or 2 most meshes take longer; one of a million triangles, each about
 * as large as a pixel, is faster with 2.
 */
#define BUNDLE 4

/* What all rays of nearest() have in common. */
struct nearest_batch {
    const struct scene *scene;
    const struct bvh *bvh;
    struct known_planes *planes;
    uint64_t *exact; /* counts exact fallbacks */
};

/*
 * nearest_rough() for packets * LANES rays. Returns false, without hits, if the rays are not coherent enough;
 * predicates tested before that count in batch->exact.
 */
bool nearest_bundle(const struct nearest_batch *batch, const struct ray *rays, unsigned packets,
                    struct hit *hits);

/* What all rays of occluded() have in common. */
struct occlusion_batch {
    const struct scene *scene;
    const struct bvh *bvh;
    struct passages *passages; /* LANES lists, one for each ray; NULL: nothing is transparent */
    struct blocker *blocker;   /* what has blocked preceding rays */
    uint64_t *exact;           /* counts exact fallbacks */
};

/*
 * The same for occluded(), with LANES rays. If they turn out not to be coherent enough, what was found is
 * kept, and *open is the set of rays still to be traced. The blocker receives what has blocked these, or
 * nothing if one of them was not blocked.
 */
bool occluded_packet(const struct occlusion_batch *batch, const struct ray *rays,
                     struct vec3 *transmittance, lane_set *open);

#endif
