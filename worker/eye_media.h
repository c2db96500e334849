/*
 * The media around a point that no ray has come to, such as the eye.
 */
#ifndef FARM_WORKER_EYE_MEDIA_H
#define FARM_WORKER_EYE_MEDIA_H

#include "worker/bvh.h"
#include "worker/medium.h"

/*
 * The stack at a point that no ray has come to, such as the eye. The point is inside an object if the ray in the
 * direction `ahead` leaves the object without having entered it; so a point exactly on a surface is on the side that
 * the ray leads to. A solid must not lie elsewhere; for open surfaces, which may be left on one side only, four rays in
 * different directions must agree. The side behind a plane is inside. At most 64 objects around the point are found;
 * those farther out are reported as unmatched later.
 */
uint32_t media_at(struct media *media, const struct bvh *bvh, struct vec3 point, struct vec3 ahead);

/*
 * The same for a point where media_meet_at() is true, in front of each ray that starts there. The four rays start
 * halfway to the first surface, because those from the point itself may lead to both sides of it.
 */
uint32_t media_ahead(struct media *media, const struct bvh *bvh, struct vec3 point,
                     struct vec3 ahead);

/*
 * Whether the point is exactly on the surface of a solid, on a plane or on a triangle that transmits light, so that its
 * media depend on the direction. (Triangles count with their boxes in their planes.) A ray from inside a convex solid
 * leaves it, and so does the opposite one; from its surface no more than one of the two does.
 */
bool media_meet_at(struct media *media, const struct bvh *bvh, struct vec3 point);

#endif
