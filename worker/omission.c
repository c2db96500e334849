#include "worker/omission.h"

#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "worker/exact.h"

/*
 * Rays are traced for the bound while all that are left could be more than LOOK_SHARE of what was found, more
 * than LOOK_CUTOFFS times the cutoff, and more than LOOK_LEAST, which no picture shows; but at most LOOK_RAYS
 * for a sample. Where surfaces lose light, the effect of pruning is at most the cutoff already, so there are
 * such rays only where max_depth has ended a path. Where they lose none, nearly everything that pruning has
 * left out would have to be traced for the sake of RADIANCE_LEVELS levels, which hardly any ray has; there
 * LOOK_CUTOFFS_LOSSLESS applies.
 */
#define LOOK_SHARE            0.25
#define LOOK_CUTOFFS          4
#define LOOK_CUTOFFS_LOSSLESS 32
#define LOOK_LEAST            0x1p-20
#define LOOK_RAYS             64

void omission_clear(struct omission *omission)
{
    tree_clear(&omission->pending);
    omission->found = vec3(0, 0, 0);
    omission->terms = omission->rays = 0;
    omission->folded = 0;
}

void omission_free(struct omission *omission)
{
    tree_free(&omission->pending);
}

/* ---- few enough ---- */

static void rate(struct tree *tree, const struct radiance *radiance, struct branch *branch)
{
    tree_rate(tree, branch,
              radiance_bound(radiance, &branch->ray, branch->weight, branch->depth, false));
}

static int larger_first(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x < y) - (x > y);
}

/* The largest bound after the OMISSION_KEPT largest ones. */
static double largest_gone(const struct tree *tree)
{
    double *bounds = allocate(tree->count, sizeof *bounds);
    memcpy(bounds, tree->bounds, tree->count * sizeof *bounds);
    qsort(bounds, tree->count, sizeof *bounds, larger_first);
    double largest = bounds[OMISSION_KEPT];
    free(bounds);
    return largest;
}

void omission_fold(struct omission *omission, const struct radiance *radiance)
{
    struct tree *tree = &omission->pending;
    for (uint32_t i = 0; i < tree->count; i++)
        if (tree->pending[i].coarse) rate(tree, radiance, &tree->pending[i]);
    double largest = largest_gone(tree);
    /* The last branch fills the gap of a removed one; it has been examined already. */
    for (uint32_t i = tree->count; i-- > 0 && tree->count > OMISSION_KEPT;) {
        struct branch gone;
        if (tree->bounds[i] > largest) continue;
        tree_remove(tree, &tree->pending[i], &gone);
        omission->folded = nextafter(omission->folded + gone.bound, HUGE_VAL);
    }
}

void omission_take(struct omission *omission, const struct radiance *radiance, struct tree *tree)
{
    struct tree *all = &omission->pending;
    uint32_t own = all->count;
    tree_take(all, tree);
    for (uint32_t i = own; i < all->count; i++) {
        struct branch *branch = &all->pending[i];
        if (!radiance->levels && branch->depth < radiance->scene->view.max_depth) continue;
        tree_rate(all, branch,
                  radiance_coarse_bound(radiance, branch->weight, branch->depth, false));
        branch->coarse = true;
    }
}

/* The largest component of what was found. Each term is computed as for the picture, with some ten roundings. */
static double largest_found(const struct omission *omission)
{
    if (omission->terms == 0) return 0;
    struct vec3 found = omission->found;
    /* Terms are >= 0, so NaN stems from infinity. */
    if (isnan(found.x + found.y + found.z)) return HUGE_VAL;
    return vec_max(found) * (1 + (omission->terms + 32) * UNIT_ROUNDOFF);
}

bool omission_next(struct omission *omission, const struct radiance *radiance,
                   struct branch *branch)
{
    if (omission->pending.count == 0) return false;
    double times = radiance->levels ? LOOK_CUTOFFS_LOSSLESS : LOOK_CUTOFFS;
    double least = fmax(times * radiance->scene->view.cutoff, LOOK_LEAST);
    double tolerance = fmax(least, largest_found(omission) * LOOK_SHARE) - omission->folded;
    struct tree *tree = &omission->pending;
    struct branch *next;
    while ((next = tree_next(tree, tolerance)) != NULL && next->coarse)
        rate(tree, radiance, next);
    if (!next || omission->rays >= LOOK_RAYS) return false;
    omission->rays++;
    tree_remove(tree, next, branch);
    return true;
}

void omission_found(struct omission *omission, struct vec3 weight, struct vec3 color)
{
    omission->found = vec_add(omission->found, vec_mul(color, weight));
    omission->terms++;
}

void omission_found_point(struct omission *omission, const struct radiance *radiance,
                          struct vec3 weight, const struct shading_point *at)
{
    const struct light *lights = scene_lights(radiance->scene);
    omission_found(omission, weight, shade_ambient(at->material));
    if (!material_shows_light(at->material)) return;
    for (uint32_t k = 0; k < radiance->scene->lights.count; k++) {
        struct vec3 to_light, strength = lights[k].color;
        if (vec_is_zero(strength) || !light_faces(at, &lights[k], &to_light)) continue;
        if (radiance->light_grows) strength = vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL);
        omission_found(omission, weight, shade_light(at, to_light, strength));
    }
}

double omission_bound(const struct omission *omission)
{
    double found = largest_found(omission);
    if (omission->pending.count == 0 && omission->folded == 0) return found;
    return nextafter(nextafter(found + tree_sum(&omission->pending), HUGE_VAL) + omission->folded,
                     HUGE_VAL);
}
