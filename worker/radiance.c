#include "worker/radiance.h"

#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "worker/box.h"
#include "worker/primitive.h"
#include "worker/radiance_clusters.h"
#include "worker/shade.h"
#include "worker/wave.h"

/*
 * Relative slack of a bound. Both a bound and the value that it bounds are computed from a few numbers: a
 * branch's weight, its share of its parent's, the colour of a surface or of the background, and their sum. 32
 * roundings cover all that is added in one level of the tree, for both.
 */
#define BOUND_SLACK (1 + 32 * UNIT_ROUNDOFF)

/*
 * How much the box of a group is larger than those of its primitives, relative to their coordinates: these
 * are rounded by a few u, and a hit may stand off by as much. With the paper's formulas, which suffer from
 * cancellation, a ray may find a crossing anywhere, so no box is known for them.
 */
#define BOX_SLACK 0x1p-46

/* ---- groups ---- */

static void raise_row(group_row row[3], uint32_t group, struct vec3 to)
{
    row[0][group] = fmax(row[0][group], to.x);
    row[1][group] = fmax(row[1][group], to.y);
    row[2][group] = fmax(row[2][group], to.z);
}

/* The box, rounded outward. */
static struct bounds padded(const struct radiance *radiance, const struct bounds *box)
{
    if (radiance->scene->view.formulas == FORMULAS_PAPER) return BOUNDS_ALL;
    struct bounds more;
    for (int axis = 0; axis < 3; axis++) {
        double reach = fmax(fabs(box->min[axis]), fabs(box->max[axis]));
        double slack = isfinite(reach) ? reach * BOX_SLACK : 0;
        more.min[axis] = box->min[axis] - slack;
        more.max[axis] = box->max[axis] + slack;
    }
    return more;
}

static void add_group(struct radiance *radiance, const uint32_t *ids,
                      const struct radiance_cluster *cluster)
{
    const struct scene *scene = radiance->scene;
    uint32_t group = radiance->groups++;
    bool *seen = allocate_zeroed((size_t)scene->materials.count, sizeof *seen);
    struct bounds box = padded(radiance, &cluster->box);
    struct box_lights box_lights;
    box_lights_init(&box_lights, scene, &box, radiance->light_grows);
    for (int axis = 0; axis < 3; axis++) {
        radiance->min[axis][group] = box.min[axis];
        radiance->max[axis][group] = box.max[axis];
    }
    for (uint32_t i = 0; i < cluster->count; i++) {
        uint32_t index = primitive_material(scene, ids[cluster->first + i]);
        const struct material *material = &scene_materials(scene)[index];
        if (seen[index]) continue;
        seen[index] = true;
        raise_row(radiance->direct, group, box_lights_bound(&box_lights, material));
        raise_row(radiance->passed, group, passed_by(material));
    }
    box_lights_free(&box_lights);
    free(seen);
    /* With the paper's formulas a ray may hit again the surface that it has left. */
    if (cluster->count > 1 || radiance->scene->view.formulas == FORMULAS_PAPER) return;
    radiance->only[group] = ids[cluster->first];
    radiance->single = true;
}

/*
 * The most groups of bounded primitives of each kind. Surfaces that pass nothing on have a known brightness
 * and end a ray. For those that lose nothing, knowing whether they can be hit is worth most. With one group
 * for the unbounded primitives of each kind, the total is RADIANCE_GROUPS.
 */
static const uint32_t groups_of[PASSINGS] = {
    [PASSES_NOTHING] = 1, [PASSES_LESS] = 3, [PASSES_ALL] = RADIANCE_GROUPS - PASSINGS - 4};

static void find_groups(struct radiance *radiance)
{
    const struct scene *scene = radiance->scene;
    struct radiance_cluster clusters[RADIANCE_GROUPS];
    for (int i = 0; i < 2 * PASSINGS; i++) {
        enum passing passing = (enum passing)(i / 2);
        bool bounded = i % 2;
        uint32_t count, *ids = radiance_ids(scene, passing, bounded, &count);
        uint32_t most = bounded ? groups_of[passing] : 1;
        uint32_t parts = count ? radiance_clusters(scene, ids, count, clusters, most) : 0;
        for (uint32_t k = 0; k < parts; k++)
            add_group(radiance, ids, &clusters[k]);
        free(ids);
    }
}

/* ---- R, the bound on what any ray can bring ---- */

/*
 * If a bound over all levels exceeds this many times that of a single level, it does not help to tell which
 * rays of a tree of max_depth levels matter.
 */
#define LARGE_SUM 0x1p8

static struct vec3 sky_of(const struct view *view)
{
    struct vec3 a = view->background_bottom, b = view->background_top;
    return vec_scale(vec3(fmax(a.x, b.x), fmax(a.y, b.y), fmax(a.z, b.z)), BOUND_SLACK);
}

/*
 * Computes one component of R: `base`, the fixed point over the groups that lose light, and `each`, what
 * every level adds in groups that lose hardly any light or none. Let R with n levels below be base + (n + 1)
 * each, which is at least the fixed point. Groups of the first kind lower it, groups of the second kind add
 * what they show.
 */
static void far_component(struct radiance *radiance, unsigned c, double sky)
{
    double base = sky, each = 0;
    for (uint32_t g = 0; g < radiance->groups; g++) {
        double direct = radiance->direct[c][g], kept = radiance->passed[c][g] * BOUND_SLACK;
        if (1 - kept >= 1 / radiance->deepest)
            base = fmax(base, direct / (1 - kept) * BOUND_SLACK);
        else if (radiance->passed[c][g] <= 1 + 4 * UNIT_ROUNDOFF)
            each = fmax(each, direct);
        else
            base = HUGE_VAL;
    }
    /* The relative slack of RENDER_MAX_DEPTH levels of BOUND_SLACK is 3.6e-9. */
    radiance->base[c] = base * (1 + 0x1p-27);
    radiance->each[c] = each * (1 + 0x1p-27);
}

static double next_component(const struct radiance *radiance, unsigned c, double sky, double below)
{
    double most = sky;
    for (uint32_t g = 0; g < radiance->groups; g++) {
        double passed = radiance->passed[c][g];
        double next = radiance->direct[c][g] + (passed > 0 ? passed * below : 0);
        most = fmax(most, next * BOUND_SLACK);
    }
    return most;
}

/* Computes radiance->levels if bounds level by level are much tighter than the sum over any number of levels. */
static void find_levels(struct radiance *radiance, const double sky[3])
{
    uint32_t deepest = radiance->scene->view.max_depth;
    double below[3] = {0, 0, 0};
    bool lossless[3], any = false;
    for (unsigned c = 0; c < 3; c++) {
        double one = next_component(radiance, c, sky[c], 0);
        lossless[c] = radiance->each[c] > 0 || radiance->base[c] > one * LARGE_SUM;
        any |= lossless[c];
    }
    if (!any) return;
    radiance->levels = allocate((size_t)deepest + 1, sizeof *radiance->levels);
    for (uint32_t i = 0; i <= deepest; i++) {
        for (unsigned c = 0; c < 3; c++)
            below[c] =
                lossless[c] ? next_component(radiance, c, sky[c], below[c]) : radiance->base[c];
        radiance->levels[i] = vec3(below[0], below[1], below[2]);
    }
}

void radiance_init(struct radiance *radiance, const struct scene *scene)
{
    memset(radiance, 0, sizeof *radiance);
    radiance->scene = scene;
    for (int axis = 0; axis < 3; axis++)
        for (uint32_t g = 0; g < RADIANCE_GROUPS; g++) {
            radiance->min[axis][g] = BOUNDS_NONE.min[axis];
            radiance->max[axis][g] = BOUNDS_NONE.max[axis];
            radiance->only[g] = PRIMITIVE_NONE;
        }
    radiance->light_grows = radiance_light_grows(scene);
    radiance->deepest = fmax(RADIANCE_LEVELS, scene->view.max_depth);
    find_groups(radiance);
    struct vec3 most = sky_of(&scene->view);
    double sky[3] = {most.x, most.y, most.z};
    for (unsigned c = 0; c < 3; c++)
        far_component(radiance, c, sky[c]);
    find_levels(radiance, sky);
}

void radiance_free(struct radiance *radiance)
{
    free(radiance->levels);
    radiance->levels = NULL;
}

/* ---- one ray ---- */

/* 1 / d; infinite if d is too small. It is then positive for a zero of either sign: see meet(). */
static inline double inverse_along(double d)
{
    return fabs(d) < 0x1p-1000 ? HUGE_VAL : 1 / d;
}

/*
 * Sets met[g] to 1 for the groups whose boxes the ray meets. A distance to a face has a relative error of 3
 * u. It is NaN if the ray runs in the face; as the first operand of a comparison it then loses, and the ray
 * counts as between that pair of faces.
 */
static FLATTENED void meet(const struct radiance *radiance, const struct ray *ray, group_row met)
{
    const double early = 1 - 8 * UNIT_ROUNDOFF, late = 1 + 8 * UNIT_ROUNDOFF;
    double ox = ray->origin.x, oy = ray->origin.y, oz = ray->origin.z;
    double ix = inverse_along(ray->direction.x), iy = inverse_along(ray->direction.y);
    double iz = inverse_along(ray->direction.z);
    const double *x0 = radiance->min[0], *y0 = radiance->min[1], *z0 = radiance->min[2];
    const double *x1 = radiance->max[0], *y1 = radiance->max[1], *z1 = radiance->max[2];
    OVER_LANES
    for (uint32_t g = 0; g < RADIANCE_GROUPS; g++) {
        double ax = (x0[g] - ox) * ix, bx = (x1[g] - ox) * ix;
        double ay = (y0[g] - oy) * iy, by = (y1[g] - oy) * iy;
        double az = (z0[g] - oz) * iz, bz = (z1[g] - oz) * iz;
        double enter = 0, leave = HUGE_VAL;
        double nx = bx < ax ? bx : ax, fx = ax > bx ? ax : bx;
        double ny = by < ay ? by : ay, fy = ay > by ? ay : by;
        double nz = bz < az ? bz : az, fz = az > bz ? az : bz;
        enter = nx > enter ? nx : enter;
        enter = ny > enter ? ny : enter;
        enter = nz > enter ? nz : enter;
        leave = fx < leave ? fx : leave;
        leave = fy < leave ? fy : leave;
        leave = fz < leave ? fz : leave;
        met[g] = truth((enter * early <= leave * late) & (x0[g] <= x1[g]));
    }
}

/* Cosine from which a direction leads outward for certain, whatever the rounding of a direction and a point
 * on a sphere. */
#define OUTWARD 0x1p-20

/* Whether a ray that starts on a primitive certainly does not hit it again. */
static bool leaves(const struct scene *scene, const struct ray *ray)
{
    const struct sphere *sphere;
    switch (primitive_kind(ray->from)) {
    case PRIMITIVE_SPHERE:
        sphere = &scene_spheres(scene)[primitive_index(ray->from)];
        return vec_dot(ray->direction, vec_sub(ray->origin, sphere->center)) >
               OUTWARD * sphere->radius;
    case PRIMITIVE_BOX:
        return !box_goes_inside(ray_from_part(ray), ray);
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_DISC:
    case PRIMITIVE_PLANE:
        return true;
    case PRIMITIVE_CONE:
    case PRIMITIVE_KINDS:
        break;
    }
    return false;
}

/* Drops groups whose only primitive is the one that the ray leaves. */
static void drop_left(const struct radiance *radiance, const struct ray *ray, group_row met)
{
    for (uint32_t g = 0; g < radiance->groups; g++)
        if (radiance->only[g] == ray->from && leaves(radiance->scene, ray)) met[g] = 0;
}

static void meet_all(const struct radiance *radiance, group_row met)
{
    for (uint32_t g = 0; g < RADIANCE_GROUPS; g++)
        met[g] = truth(g < radiance->groups);
}

/* share * of, but 0 if either is 0 and the other infinite. */
static inline double passed_of(double share, double of)
{
    return share > 0 && of > 0 ? share * of : 0;
}

/* The largest component of weight * color, rounded up; color may be infinite. */
static double largest_share(struct vec3 weight, struct vec3 color)
{
    double x = passed_of(weight.x, color.x), y = passed_of(weight.y, color.y);
    double z = passed_of(weight.z, color.z);
    return max_number(x, max_number(y, z)) * BOUND_SLACK;
}

double radiance_primary_bound(const struct radiance *radiance)
{
    if (radiance->levels) return vec_max(radiance->levels[radiance->scene->view.max_depth]);
    return fmax(radiance->base[0], fmax(radiance->base[1], radiance->base[2]));
}

/* Raises *most to direct + passed * next of the groups that are met; next may be infinite. */
static inline void raise_by_met(const struct radiance *radiance, const group_row met,
                                struct vec3 next, struct vec3 *most)
{
    const group_row *direct = radiance->direct, *passed = radiance->passed;
    for (uint32_t g = 0; g < radiance->groups; g++) {
        if (met[g] == 0) continue;
        most->x = max_number(most->x, direct[0][g] + passed_of(passed[0][g], next.x));
        most->y = max_number(most->y, direct[1][g] + passed_of(passed[1][g], next.y));
        most->z = max_number(most->z, direct[2][g] + passed_of(passed[2][g], next.z));
    }
}

/* R of a ray of this depth. */
static struct vec3 this_level(const struct radiance *radiance, uint32_t depth, bool in_picture)
{
    uint32_t last = radiance->scene->view.max_depth;
    if (in_picture && radiance->levels) return radiance->levels[last - depth];
    double left = fmax(0, radiance->deepest + 1 - depth); /* its own level included */
    const double *base = radiance->base, *each = radiance->each;
    /* Avoids 0 * each, which may be infinite. */
    if (left == 0) return vec3(base[0], base[1], base[2]);
    return vec3(base[0] + left * each[0], base[1] + left * each[1], base[2] + left * each[2]);
}

double radiance_coarse_bound(const struct radiance *radiance, struct vec3 weight, uint32_t depth,
                             bool in_picture)
{
    return largest_share(weight, this_level(radiance, depth, in_picture)) * BOUND_SLACK;
}

double radiance_bound(const struct radiance *radiance, const struct ray *ray, struct vec3 weight,
                      uint32_t depth, bool in_picture)
{
    const struct view *view = &radiance->scene->view;
    bool last = in_picture && depth == view->max_depth;
    struct vec3 next = last ? vec3(0, 0, 0) : this_level(radiance, depth + 1, in_picture);
    bool good = vec_is_finite(ray->origin) && vec_is_finite(ray->direction);
    group_row met;
    if (good)
        meet(radiance, ray, met);
    else
        meet_all(radiance, met);
    if (good && radiance->single && ray->from != PRIMITIVE_NONE) drop_left(radiance, ray, met);
    struct vec3 most = good ? background(view, ray->direction) : sky_of(view);
    raise_by_met(radiance, met, next, &most);
    return largest_share(weight, most) * BOUND_SLACK;
}
