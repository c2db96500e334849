/*
 * The catalogue of stiff and extreme cases: the interface of a case, and what the cases share.
 *
 * A case draws random inputs, gives them to the kernel twice, with the paper's formulas and with ours, and
 * compares both with an oracle that shares no code with the kernel: GMP or MPFR numbers, a closed form, or a
 * count that topology dictates. Where not a formula is tested but the tree, or which of equal hits is taken
 * (rows 23, 35 to 37), the oracle is brute force: the kernel's own tests of every object.
 */
#ifndef FARM_BENCH_STABILITY_H
#define FARM_BENCH_STABILITY_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "bench/scenes.h"
#include "common/processor.h"
#include "common/scene.h"
#include "master/builder.h"
#include "worker/nearest.h"

/* The amount of work of a run. */
struct budget {
    uint64_t rays;    /* for most cases: 1e6 at full size */
    uint64_t many;    /* for one unit of the cases that count crossings: 1e8 at full size */
    unsigned threads; /* for share() */
    bool quick;       /* the reduced run of `make test`: small meshes and pictures */
};

enum verdict {
    VERDICT_GREEN, /* the pass mark is met on every sample */
    VERDICT_RED,   /* it is not: the note says where */
    VERDICT_MARKED /* not applicable, or out of reach for the reason in the note */
};

/* The result of a case. The texts are for the table; a case leaves empty what does not apply. */
struct case_result {
    char paper[96];     /* the paper's formulas, "0.2 r, 31 % wrong" */
    char ours[96];      /* the same for ours */
    double worst;       /* largest error of ours */
    const char *unit;   /* of worst: "ulp", "u"; NULL when the case only counts decisions */
    double limit;       /* the most that worst may be, if there is a unit */
    uint64_t samples;   /* samples that were compared with the oracle */
    uint64_t wrong;     /* wrong decisions of ours */
    double paper_worst; /* the same for the paper's formulas, over paper_samples; 0: not counted */
    uint64_t paper_wrong, paper_samples;
    uint64_t fallbacks; /* predicates of ours that needed exact arithmetic */
    enum verdict verdict;
    char note[256];
};

struct block;

struct stability_case {
    int number;       /* of the catalogue; 0 ends a table */
    const char *name; /* as in the catalogue */
    const char *oracle;
    const char *pass_mark;
    /* Runs the whole case and fills in *result, which is zeroed. NULL: budget->rays samples are divided by share() and
     * processed by work(), and the result is that of conclude() with unit and limit. */
    void (*run)(const struct budget *budget, struct case_result *result);
    void (*work)(struct block *block, const void *context);
    const void *context;
    const char *unit;
    double limit;
    bool files; /* run() loads those of picture_files() */
};

/* One table per file, ended by an entry with number 0. */
extern const struct stability_case sphere_cases[];    /* 1-4, 8, 9, 11, 12 */
extern const struct stability_case tangent_cases[];   /* 5-7 */
extern const struct stability_case refused_cases[];   /* 10 */
extern const struct stability_case flat_cases[];      /* 13, 14 */
extern const struct stability_case box_cases[];       /* 15, 16 */
extern const struct stability_case mesh_cases[];      /* 17-21 */
extern const struct stability_case coplanar_cases[];  /* 22, 23 */
extern const struct stability_case triangle_cases[];  /* 24, 25 */
extern const struct stability_case contact_cases[];   /* 26-29 */
extern const struct stability_case moved_cases[];     /* 30-32 */
extern const struct stability_case ray_cases[];       /* 33, 34 */
extern const struct stability_case tree_cases[];      /* 35-39 */
extern const struct stability_case cone_cases[];      /* 40-44 */
extern const struct stability_case light_cases[];     /* 45-50 */
extern const struct stability_case bounce_cases[];    /* 51-55 */
extern const struct stability_case farm_cases[];      /* 56-58 */
extern const struct stability_case reference_cases[]; /* 59 */
extern const struct stability_case touching_cases[];  /* 60, 61 */

/* ---- random numbers: the same on every run and machine, whatever the number of threads ---- */

/* One expression must not draw twice side by side: the compiler would choose which is first. A number that is drawn in
 * an argument of one of these functions is drawn before those of the function. */

struct random {
    uint64_t state;
};

/* SplitMix64 (G. Steele, D. Lea and C. Flood, OOPSLA 2014): any seed will do. */
static inline uint64_t random_bits(struct random *random)
{
    uint64_t z = random->state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

static inline struct random random_seeded(uint64_t number, uint64_t block)
{
    struct random random = {number << 40 ^ block};
    random.state = random_bits(&random);
    return random;
}

static inline double random_between(struct random *random, double low, double high)
{
    return low + (high - low) * ((double)(random_bits(random) >> 11) * 0x1p-53);
}

/* 0 .. count - 1; the bias is below count * 2^-64. */
static inline uint64_t random_below(struct random *random, uint64_t count)
{
    return (uint64_t)((unsigned __int128)random_bits(random) * count >> 64);
}

/* Uniform in the logarithm. */
static inline double random_log(struct random *random, double low, double high)
{
    return exp(random_between(random, log(low), log(high)));
}

static inline double random_sign(struct random *random)
{
    return random_bits(random) >> 63 ? -1 : 1;
}

/* value or -value. */
static inline double random_signed(struct random *random, double value)
{
    return random_sign(random) * value;
}

/* Uniform on the unit sphere, up to rounding. */
struct vec3 random_unit(struct random *random);

/* A vector of this length, up to rounding, in a random direction. */
struct vec3 random_away(struct random *random, double length);

/* Unit vectors that make a right-handed frame with axis (unit), turned at random. */
void random_frame(struct random *random, struct vec3 axis, struct vec3 *u, struct vec3 *v);

/* Uniform in the cube of edge 2 * reach around the origin. */
static inline struct vec3 random_point(struct random *random, double reach)
{
    double x = random_between(random, -reach, reach), y = random_between(random, -reach, reach);
    return vec3(x, y, random_between(random, -reach, reach));
}

/* Integer coordinates from -reach to reach. */
static inline struct vec3 integer_point(struct random *random, int reach)
{
    uint64_t span = 2 * (uint64_t)reach + 1;
    double x = (double)random_below(random, span) - reach;
    double y = (double)random_below(random, span) - reach;
    return vec3(x, y, (double)random_below(random, span) - reach);
}

/* Sets x, y or z, by number. */
static inline void set_component(struct vec3 *v, unsigned axis, double value)
{
    *(axis == 0 ? &v->x : axis == 1 ? &v->y : &v->z) = value;
}

/* ---- counting errors ---- */

/* The errors of one set of formulas: sums and extremes, so that the order of adding does not matter. */
struct score {
    double worst;      /* largest error */
    uint64_t worst_at; /* its sample; of equal errors the first one */
    uint64_t wrong;    /* wrong decisions */
    uint64_t wrong_at; /* the first of them */
};

struct tally {
    struct score paper, ours;
    uint64_t samples;
    /* The number of samples that the paper's formulas were tested with; 0: all of them. */
    uint64_t paper_samples;
    uint64_t fallbacks;
};

/* The larger of two errors; HUGE_VAL when one is NaN, where fmax() would take the other. */
static inline double worse_of(double a, double b)
{
    return isnan(a) || isnan(b) ? HUGE_VAL : fmax(a, b);
}

static inline void score_error(struct score *score, double error, uint64_t sample)
{
    if (isnan(error)) error = HUGE_VAL; /* a NaN must not pass for a small error */
    if (error > score->worst || (error == score->worst && sample < score->worst_at)) {
        score->worst = error;
        score->worst_at = sample;
    }
}

static inline void score_wrong(struct score *score, uint64_t sample)
{
    if (score->wrong == 0 || sample < score->wrong_at) score->wrong_at = sample;
    score->wrong++;
}

/* Calls work() for every item from 0 to items - 1, on budget->threads threads. */
void share_out(const struct budget *budget, uint64_t items,
               void (*work)(uint64_t item, void *context), void *context);

/* Samples first .. first + count - 1 of a case; random is seeded by the case and first alone. */
struct block {
    uint64_t first, count;
    struct random random;
    struct tally *tally;
};

/*
 * Divides `samples` samples of case `number` into blocks of SHARE_BLOCK, works through them on
 * budget->threads threads and adds up the tallies. The result does not depend on the threads.
 */
#define SHARE_BLOCK 4096u
void share(const struct budget *budget, int number, uint64_t samples,
           void (*work)(struct block *block, const void *context), const void *context,
           struct tally *total);

/* Fills in samples, worst, wrong, fallbacks, both texts and the verdict: green when our formulas have no wrong
 * decision and no error above limit. unit NULL: decisions only. */
void conclude(struct case_result *result, const struct tally *tally, const char *unit,
              double limit);

/* ---- scenes ---- */

/* Most cases create a new scene after this many rays. */
#define RAYS_PER_SCENE 32

/*
 * How the kernel is called, except where it serves as a reference. alike, 1 to ALIKE_MAX: the number of copies of each
 * ray that are passed to it at once, so that packets are tested, too. With one copy more than a packet or a bundle has
 * rays, the last copy is traced alone, and the others are compared with it.
 */
struct stage_way {
    enum processor_level kernel;
    unsigned alike;
};

#define ALIKE_MAX 33 /* the rays of a bundle, and one more */

/* To be called before the first scene is made. Default: the highest level, and each ray alone. */
void stage_set_way(struct stage_way way);
enum processor_level stage_kernel(void);

/* One scene with both sets of formulas, and its tree. */
struct stage {
    struct scene *ours, *paper;
    struct bvh *bvh;
};

/* Checks the result of builder_add_...(): a text other than NULL is an error in the case, and fatal. */
void expect_added(const char *why);

/* Adds a material that transmits half of the light, so that occluded() counts crossings. */
uint32_t stage_material(struct builder *builder);
void stage_sphere(struct builder *builder, struct vec3 center, double radius);
void stage_triangle(struct builder *builder, struct vec3 a, struct vec3 b, struct vec3 c);

/* A view of width x height pixels from eye towards look_at, y up, fov degrees high. */
struct view stage_view(struct vec3 eye, struct vec3 look_at, double fov, uint32_t width,
                       uint32_t height);

/* Destroys the builder. view may be NULL when nothing is rendered. */
struct stage stage_finish(struct builder *builder, const struct view *view);
void stage_free(struct stage *stage);

/* For trees that a case makes itself, in entries: the room that each primitive of a leaf takes with its corners, and
 * the room after the last one for what is loaded beyond it in a row of eight places. */
#define ENTRY_ROOM (1 + (uint32_t)((sizeof(struct bvh_corners) + CORNER_ROWS * 2 + 3) / 4))
#define LEAF_END   4

struct ray stage_ray(struct vec3 origin, struct vec3 direction);

/* The ray that continues from a hit in this direction. */
struct ray stage_going_on(const struct surface *surface, const struct hit *hit,
                          struct vec3 direction);

/* Calls nearest() for each ray, in the way of stage_set_way(); *fallbacks counts those of all copies. If copies
 * of a ray differ in any bit of their hits, that is fatal. */
void stage_hits(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                size_t count, struct hit *hits, uint64_t *fallbacks);

/* The nearest hit with one of the stage's scenes. */
struct hit stage_nearest(const struct stage *stage, const struct scene *scene,
                         const struct ray *ray, uint64_t *fallbacks);

/* Counts the surfaces that rays cross when all surfaces have stage_material(); at most 1000. */
void stage_crossings(const struct stage *stage, const struct scene *scene, const struct ray *rays,
                     size_t count, unsigned *crossings, uint64_t *fallbacks);

#endif
