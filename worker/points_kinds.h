/*
 * What points_find() computes in lanes, by kind of primitive: where rays have hit it, and the normals there. Each
 * function stands for one of surface_at(), or a part of it, with the same bits; where a lane does not decide it leaves
 * sure = 0, and the point is computed on its own.
 */
#ifndef FARM_WORKER_POINTS_KINDS_H
#define FARM_WORKER_POINTS_KINDS_H

#include "worker/place.h"
#include "worker/points.h"

/* For points->slot[begin .. end - 1], whose rays have been gathered. */
typedef void find_points(const struct scene *scene, const struct hit *hits, uint32_t begin,
                         uint32_t end, struct points *points);

/* worker/points_triangles.c */
find_points find_on_triangles;  /* and on patches, as if they were triangles */
find_points find_patch_normals; /* after the former: the shading normals */

/* worker/points_solids.c */
find_points find_on_spheres;
find_points find_on_sides; /* of cones that the ray does not start on */
find_points find_on_exits; /* sides of cones that the ray starts on */
find_points find_on_caps;  /* of cones */
find_points find_on_flats; /* discs and planes */

/* Defines such a function: gather(), of the same type, fetches what defines the surfaces; then of_one() is called for
 * each lane. */
#define FIND_IN_LANES(name, gather, of_one)                                                        \
    IN_LANES(name##_lanes, points, of_one)                                                         \
    void name(const struct scene *scene, const struct hit *hits, uint32_t begin, uint32_t end,     \
              struct points *points)                                                               \
    {                                                                                              \
        gather(scene, hits, begin, end, points);                                                   \
        name##_lanes(points, begin, end);                                                          \
    }

/* Stores a point and its normals. */
static inline void put_surface(struct points *points, size_t i, const struct place *place,
                               struct vec3 normal, bool sure)
{
    set_lane(&points->point, i, offset_from_surface(place, normal, lane(&points->view, i)));
    set_lane(&points->geometric, i, normal);
    set_lane(&points->normal, i, normal);
    points->sure[i] = truth(sure);
}

#endif
