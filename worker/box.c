#include "worker/box.h"

/* The sign of the distance to face p minus that to face q; the distances (p - o) / d are compared as
 * fractions. */
static int compare_faces(const struct box *box, const struct ray *ray, uint32_t p, uint32_t q)
{
    double dp = vec_component(&ray->direction, p / 2), dq = vec_component(&ray->direction, q / 2);
    struct dd to_p = exact_difference(box_face(box, p), vec_component(&ray->origin, p / 2));
    struct dd to_q = exact_difference(box_face(box, q), vec_component(&ray->origin, q / 2));
    struct accumulator difference;
    accumulator_clear(&difference);
    accumulator_add_dd(&difference, 1, to_p, dd(dq), dd(1));
    accumulator_add_dd(&difference, -1, to_q, dd(dp), dd(1));
    int sign = accumulator_sign(&difference);
    return (dp < 0) != (dq < 0) ? -sign : sign;
}

bool box_is_met(const struct box *box, const struct ray *ray)
{
    for (uint32_t i = 0; i < 3; i++) {
        double speed = vec_component(&ray->direction, i);
        if (speed == 0) continue; /* box_line() has found that the line is between these faces */
        uint32_t in = 2 * i + (speed < 0 ? 1 : 0);
        for (uint32_t j = 0; j < 3; j++) {
            double other = vec_component(&ray->direction, j);
            if (other == 0) continue;
            uint32_t out = 2 * j + (other < 0 ? 0 : 1);
            if (compare_faces(box, ray, in, out) > 0) return false;
        }
    }
    return true;
}
