/*
 * Rays that go much the same way, walked through the tree together: some packets of LANES rays, a
 * bundle. A node is looked at once for all of them, by interval arithmetic: what a ray's slab distances
 * may be lies between products of the ends of the bundle's ranges, and as rounding is monotonic that
 * holds for the rounded distances, too. Only leaves, and the triangles in them, are tested ray by ray,
 * one to a lane, packet after packet; where the rays have one origin, with what all of them have in
 * common (worker/pinhole.h).
 *
 * Hits have the same bits as those of rays on their own: a bundle only decides which primitives a
 * ray is tested with.
 */
#ifndef FARM_WORKER_PACKET_H
#define FARM_WORKER_PACKET_H

#include "worker/nearest.h"
#include "worker/wide.h"

struct known_planes;
struct passages;
struct blocker;

/*
 * Where bundles have not been worth it, the next rays are taken packet by packet or one by one: 1, 3,
 * 7, ... packets after failures in a row. Says nothing about hits.
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

/* Packets of a bundle, at most. With 1 or 2 most meshes take longer; one of a million triangles, about
 * as large as a pixel, is faster with 2. */
#define BUNDLE 4

/* What all rays of nearest() have in common. */
struct nearest_batch {
    const struct scene *scene;
    const struct bvh *bvh;
    struct known_planes *planes; /* NULL with the paper's formulas */
    uint64_t *exact;             /* counts exact fallbacks */
};

/* nearest_rough() of so many times LANES rays. false, and no hit is told, when they are too different; what was tested
 * until then counts in *exact. */
bool nearest_bundle(const struct nearest_batch *batch, const struct ray *rays, unsigned packets,
                    struct hit *hits);

/* What all rays of occluded() have in common. */
struct occlusion_batch {
    const struct scene *scene;
    const struct bvh *bvh;
    struct passages *passages; /* LANES lists; NULL: nothing is transparent */
    struct blocker *blocker;   /* what has blocked the rays before */
    uint64_t *exact;           /* counts exact fallbacks */
};

/*
 * occluded() of LANES rays, likewise; what is found before they turn out to be too different is kept:
 * *open are those that are yet to be traced. Afterwards the blocker is what has blocked these, or nothing
 * where one of them came through.
 */
bool occluded_packet(const struct occlusion_batch *batch, const struct ray *rays,
                     struct vec3 *transmittance, lane_set *open);

#endif
