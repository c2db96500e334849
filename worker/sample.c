#include "worker/sample.h"

/*
 * A 64-bit mix in which every input bit affects every output bit (the finaliser of SplitMix64, G. Steele, D.
 * Lea & C. Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014).
 */
static inline uint64_t mix(uint64_t bits)
{
    bits += UINT64_C(0x9e3779b97f4a7c15);
    bits = (bits ^ bits >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    bits = (bits ^ bits >> 27) * UINT64_C(0x94d049bb133111eb);
    return bits ^ bits >> 31;
}

/*
 * The second dimension of Sobol's sequence (I. Sobol', USSR Comp. Math. 7, 1967), with its binary digits in
 * reverse: the most significant digit of the coordinate is bit 0. In the first dimension the digits are those
 * of the index. In the second they are the digits of the index times Pascal's triangle modulo 2; this matrix
 * is a Kronecker power of [1 1; 0 1], so the product is computed by halves, quarters and so on. Of 2^m
 * consecutive samples that begin at a multiple of 2^m, one lies in each of the 2^m elementary intervals of
 * every shape 2^-i x 2^(i-m).
 */
static inline uint32_t sobol_second(uint32_t index)
{
    index ^= index >> 16;
    index ^= (index & 0xff00ff00u) >> 8;
    index ^= (index & 0xf0f0f0f0u) >> 4;
    index ^= (index & 0xccccccccu) >> 2;
    return index ^ (index & 0xaaaaaaaau) >> 1;
}

/*
 * Owen's scrambling (A. Owen, "Randomly Permuted (t,m,s)-Nets and (t,s)-Sequences", 1995): each digit is
 * flipped or not at random, independently for each value of all digits before it. Elementary intervals keep
 * their samples, and every sample is uniform in its own. The method follows S. Laine & T. Karras (EGSR 2011),
 * who process all digits at once with integer arithmetic: sums, products with odd numbers, and exclusive ors
 * with even multiples carry information to later digits only. Adding a random number makes every value of the
 * digits equally likely. The product with another random number, and arbitrary constants, make each digit
 * depend on all digits before it.
 */
static inline uint32_t scramble(uint32_t digits, uint64_t seed)
{
    digits += (uint32_t)seed;
    digits ^= digits * 0x9e3779b8u;
    digits *= (uint32_t)(seed >> 32) | 1;
    digits ^= digits * 0x6c50b47cu;
    digits *= 0xb82f1e53u;
    digits ^= digits * 0xc7afe638u;
    return digits;
}

static inline uint32_t reversed(uint32_t bits)
{
    bits = bits >> 16 | bits << 16;
    bits = (bits & 0xff00ff00u) >> 8 | (bits & 0x00ff00ffu) << 8;
    bits = (bits & 0xf0f0f0f0u) >> 4 | (bits & 0x0f0f0f0fu) << 4;
    bits = (bits & 0xccccccccu) >> 2 | (bits & 0x33333333u) << 2;
    return (bits & 0xaaaaaaaau) >> 1 | (bits & 0x55555555u) << 1;
}

/*
 * Each half of each pixel has its own seed: neighbouring pixels share no pattern, and the remaining error
 * looks like fine noise without structure.
 */
static inline uint64_t seed_of(uint32_t x, uint32_t y, uint32_t sample)
{
    return mix(mix((uint64_t)y << 32 | x) + (sample & 1));
}

static inline uint32_t first_digits(uint32_t sample, uint64_t seed)
{
    return reversed(scramble(sample >> 1, seed));
}

static inline uint32_t second_digits(uint32_t sample, uint64_t seed)
{
    return reversed(scramble(sobol_second(sample >> 1), mix(seed)));
}

/* The direction through the point x, y of the picture, not normalised. */
static inline struct vec3 direction_through(const struct view *view, double x, double y)
{
    double height = view->height;
    double u = (2 * x - view->width) / height;
    double v = (2 * y - height) / height;
    const struct camera *camera = &view->camera;
    struct vec3 direction = vec_add_scaled(camera->forward, camera->right, u);
    return vec_add_scaled(direction, camera->down, v);
}

void sample_put(struct sample_lanes *lanes, uint32_t i, uint32_t x, uint32_t y, uint32_t sample)
{
    lanes->pixel_x[i] = x;
    lanes->pixel_y[i] = y;
    lanes->sample[i] = sample;
}

static FLATTENED void place_lanes(const struct view *view, struct sample_lanes *lanes,
                                  uint32_t count)
{
    const uint32_t *x = lanes->pixel_x, *y = lanes->pixel_y, *sample = lanes->sample;
    if (view->max_samples == 1) {
        OVER_LANES
        for (uint32_t i = 0; i < count; i++) {
            lanes->x[i] = x[i] + 0.5;
            lanes->y[i] = y[i] + 0.5;
        }
        return;
    }
    OVER_LANES
    for (uint32_t i = 0; i < count; i++) {
        uint64_t seed = seed_of(x[i], y[i], sample[i]);
        lanes->x[i] = x[i] + first_digits(sample[i], seed) * 0x1p-32;
        lanes->y[i] = y[i] + second_digits(sample[i], seed) * 0x1p-32;
    }
}

static inline void aim_lane(const struct view *view, struct sample_lanes *lanes, uint32_t i)
{
    bool sure = true;
    struct vec3 direction = direction_through(view, lanes->x[i], lanes->y[i]);
    set_lane(&lanes->direction, i, plain_unit(direction, &sure));
    lanes->sure[i] = truth(sure);
}

static FLATTENED void aim_lanes(const struct view *view, struct sample_lanes *lanes, uint32_t count)
{
    OVER_LANES
    for (uint32_t i = 0; i < count; i++)
        aim_lane(view, lanes, i);
}

void sample_rays(const struct view *view, struct sample_lanes *lanes, uint32_t count,
                 struct ray *rays)
{
    place_lanes(view, lanes, count);
    aim_lanes(view, lanes, count);
    for (uint32_t i = 0; i < count; i++) {
        struct vec3 unit = lane(&lanes->direction, i);
        if (lanes->sure[i] == 0)
            unit = vec_normalize(direction_through(view, lanes->x[i], lanes->y[i]));
        struct ray *ray = &rays[i]; /* field by field, so that no whole ray is copied */
        ray->origin = view->camera.eye;
        ray->direction = unit;
        ray->t_max = HUGE_VAL;
        ray->from = PRIMITIVE_NONE;
        ray->from_part = 0;
    }
}
