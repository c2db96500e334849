#include "master/adaptive.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/extremes.h"
#include "common/hash.h"
#include "common/message.h"
#include "common/whole.h"
#include "master/allocation.h"
#include "master/expect.h"
#include "master/forecast.h"
#include "master/hidden.h"
#include "master/lattice.h"

/* In one pass a pixel goes up this many levels at most: what is known of it is not enough for more. */
#define LEVELS_PER_PASS 4

/* What share of the error before it a pass aims at, at least and at most. At least, as much is learnt by a pass;
 * but the more samples a pixel gets at a time, the quicker are they: with 0.12 and four levels the same error
 * took 0.8 to 1.0 of the CPU time that it took with 0.5 and two, in nine runs of seven scenes. At most, so
 * that there is an end to passes that miss a target by a hair. */
#define PASS_AIM_MIN 0.12
#define PASS_AIM_MAX 0.93

/* A pass that promised to leave a share s of the squared error left s^exponent: with an exponent of 0.90 to 1.12
 * the first one behind pass 0 in 14 runs of seven scenes, and in each of them the later ones, which are smaller,
 * with one that was less than 0.1 from that. Of few pixels it tells hardly anything; so it is taken as if one that
 * left a quarter had kept its promise before them: the logarithm of that. */
#define PROMISE_BEFORE (-1.3862943611198906)

/* Seconds per effort (master/allocation.h) of passes after the first, in terms of those of the first: pixels that are
 * even are quick and get none later on. 0.8 to 1.9 at the end of runs of 21 scenes, 1.3 in their median; but early
 * passes are small and up to twice as dear. So it counts as so much of the first pass's effort beside what the later
 * passes themselves have shown: of 527 forecasts from runs of these scenes, to a half to a quarter of their error, 40
 * are then more than 20 % off; with half of this weight 58, with 1.36 in place of 1.26, too, 64. */
#define LATER_SECONDS 1.26
#define LATER_WEIGHT  0.2

/* What samples have taken. */
struct spent {
    double seconds, effort;
};

struct adaptive {
    struct canvas *canvas; /* the means */
    struct crew *crew;     /* that plans; NULL: who calls does, alone */
    struct levels levels;
    double target;
    unsigned passes;
    bool met;           /* the target */
    bool first;         /* pixels get their first samples in this pass */
    bool expected;      /* error and warned are of the pixels as they are */
    uint64_t unsampled; /* pixels without any */
    double unsampled_s; /* that one of them is expected to take; 0: nobody knows */
    uint64_t missing;   /* pixels of the pass that are to come */
    uint64_t asked;     /* for by the pass in all */
    double spent_s;     /* on first samples when the pass was planned */
    double limit;       /* by which the pass was planned */
    double before;      /* the sum of squared errors when the pass was planned, as told by halves */
    double promised;    /* the share of it that the plan expected to be left */
    double log_promised, log_kept;   /* of these shares and what came of them: sums over passes */
    struct spent on_first, on_later; /* on first samples, and on all others */
    /* Of samples that take a ray each, from a level to another one. */
    double efforts[LEVEL_MAX + 1][LEVEL_MAX + 1];
    uint32_t last;         /* level of max_samples */
    float *difference;     /* 3 per pixel: A - B */
    float *spread;         /* of each pixel, as struct pixel_floats has it */
    float *rays;           /* of each pixel, per sample: what it costs */
    uint8_t *level;        /* of each pixel */
    uint8_t *next;         /* which the pass brings it to */
    double *error;         /* expected squared error of each pixel */
    float *warned;         /* its root, by what is around each pixel alone */
    struct hidden *hidden; /* what is missing in what they tell */
};

static double samples_of(const struct adaptive *adaptive, uint32_t level)
{
    return adaptive->levels.samples[level];
}

/* The share of a squared error that is left where a pixel goes from one level to another one. */
static double left_of(const struct adaptive *adaptive, uint32_t from, uint32_t to)
{
    return adaptive->levels.power[from] / adaptive->levels.power[to];
}

size_t adaptive_pixel_bytes(void)
{
    const struct adaptive *a = NULL;
    return 3 * sizeof *a->difference + sizeof *a->spread + sizeof *a->rays + sizeof *a->level +
           sizeof *a->next + sizeof *a->error + sizeof *a->warned + hidden_pixel_bytes();
}

struct adaptive *adaptive_create(const struct view *view, struct canvas *canvas, double target)
{
    struct adaptive *adaptive = allocate_zeroed(1, sizeof *adaptive);
    adaptive->canvas = canvas;
    adaptive->target = target;
    adaptive->last = level_last(view);
    levels_init(&adaptive->levels, view);
    for (uint32_t to = 1; to <= LEVEL_MAX; to++)
        for (uint32_t from = 0; from < to; from++)
            adaptive->efforts[from][to] =
                pow(samples_of(adaptive, to) - samples_of(adaptive, from), EFFORT_POWER);
    assert(view->min_samples % 2 == 0 && view->max_samples % 2 == 0);
    size_t pixels = canvas_pixels(adaptive->canvas);
    /* As the canvas, and for the same reason. */
    adaptive->difference = allocate_there(pixels, 3 * sizeof *adaptive->difference);
    adaptive->spread = allocate_there(pixels, sizeof *adaptive->spread);
    adaptive->rays = allocate_there(pixels, sizeof *adaptive->rays);
    adaptive->level = allocate_there(pixels, 1);
    adaptive->next = memset(allocate_large(pixels), 1, pixels);
    adaptive->error = allocate_there(pixels, sizeof *adaptive->error);
    adaptive->warned = allocate_there(pixels, sizeof *adaptive->warned);
    adaptive->hidden = hidden_create(pixels);
    adaptive->passes = 1;
    adaptive->first = true;
    adaptive->missing = adaptive->unsampled = adaptive->asked = pixels;
    return adaptive;
}

void adaptive_lend(struct adaptive *adaptive, struct crew *crew)
{
    adaptive->crew = crew;
}

void adaptive_destroy(struct adaptive *adaptive)
{
    if (!adaptive) return;
    hidden_destroy(adaptive->hidden);
    free(adaptive->warned);
    free(adaptive->error);
    free(adaptive->next);
    free(adaptive->level);
    free(adaptive->rays);
    free(adaptive->spread);
    free(adaptive->difference);
    free(adaptive);
}

/* ---- what the pixels tell ---- */

/* Of a band of rows. */
static size_t first_pixel(const struct adaptive *adaptive, uint32_t band)
{
    return (size_t)band_begin(adaptive->canvas, band) * adaptive->canvas->width;
}

static double error_of(const struct adaptive *adaptive, size_t pixel)
{
    return own_error(adaptive->difference + 3 * pixel);
}

static struct sampled sampled(const struct adaptive *adaptive)
{
    return (struct sampled){adaptive->canvas, adaptive->difference, adaptive->spread,
                            adaptive->level, &adaptive->levels};
}

/* Of a band of rows, or of all. */
struct told {
    struct error_sum errors; /* as halves tell them */
    struct hidden_sum hidden;
    uint64_t pixels, samples; /* pixels that have some */
};

struct telling {
    const struct adaptive *adaptive;
    struct told *bands;
};

/* One that has samples. */
static void sum_pixel(const struct adaptive *adaptive, const struct sampled *now, size_t i,
                      struct told *sum)
{
    double square = error_of(adaptive, i);
    sum->errors.squares += square;
    sum->errors.fourths += square * square;
    sum->pixels++;
    sum->samples += (uint64_t)samples_of(adaptive, adaptive->level[i]);
    hidden_add(adaptive->hidden, now, i, &sum->hidden);
}

static void sum_band(void *context, uint32_t band)
{
    const struct telling *it = context;
    const struct adaptive *adaptive = it->adaptive;
    size_t end = first_pixel(adaptive, band + 1);
    struct sampled now = sampled(adaptive);
    struct told sum = {.pixels = 0};
    for (size_t i = first_pixel(adaptive, band); i < end; i++)
        if (adaptive->level[i] > 0) sum_pixel(adaptive, &now, i, &sum);
    it->bands[band] = sum;
}

static void add_told(struct told *all, const struct told *more)
{
    error_sum_add(&all->errors, &more->errors);
    all->pixels += more->pixels;
    all->samples += more->samples;
    hidden_join(&all->hidden, &more->hidden);
}

/* The crew is busy with tiles until all of the pass are in. */
static struct told sum_told(const struct adaptive *adaptive)
{
    uint32_t bands = band_count(adaptive->canvas);
    struct told all = {.pixels = 0};
    struct telling it = {adaptive, allocate(bands, sizeof *it.bands)};
    crew_share(adaptive->missing ? NULL : adaptive->crew, bands, sum_band, &it);
    for (uint32_t k = 0; k < bands; k++)
        add_told(&all, &it.bands[k]);
    free(it.bands);
    return all;
}

/* With what is hidden. */
static struct error_told all_errors(const struct adaptive *adaptive, const struct told *told)
{
    return hidden_errors(adaptive->hidden, &told->hidden, told->errors);
}

/* What is expected of the pixels now, if all have samples, and what they tell. */
static struct told expect(struct adaptive *adaptive)
{
    struct told told = sum_told(adaptive);
    hidden_share(adaptive->hidden, &told.hidden);
    if (adaptive->expected || adaptive->unsampled > 0) return told;
    struct sampled now = sampled(adaptive);
    expect_errors(&now, adaptive->crew, adaptive->error, adaptive->warned);
    adaptive->expected = true;
    return told;
}

struct error_told adaptive_errors(const struct adaptive *adaptive, uint64_t *pixels,
                                  uint64_t *samples)
{
    struct told told = sum_told(adaptive);
    *pixels = told.pixels;
    *samples = told.samples;
    return all_errors(adaptive, &told);
}

/* ---- what they cost ---- */

/* Rays of all of the pixel's samples. */
static double cost_of(const struct adaptive *adaptive, size_t pixel)
{
    return (double)adaptive->rays[pixel] * samples_of(adaptive, adaptive->level[pixel]);
}

/* To the next level, if there is one. */
static double effort_of(const struct adaptive *adaptive, size_t pixel)
{
    uint32_t level = adaptive->level[pixel];
    if (level == adaptive->last) return 0;
    return (double)adaptive->rays[pixel] * adaptive->efforts[level][level + 1];
}

static double hidden_in(const struct adaptive *adaptive, size_t pixel)
{
    return hidden_of(adaptive->hidden, pixel, adaptive->level[pixel]);
}

static double gain_of(const struct adaptive *adaptive, size_t pixel)
{
    return (adaptive->error[pixel] + hidden_in(adaptive, pixel)) / cost_of(adaptive, pixel);
}

static double expected_sum(const struct adaptive *adaptive)
{
    size_t pixels = canvas_pixels(adaptive->canvas);
    double sum = 0;
    for (size_t i = 0; i < pixels; i++)
        sum += adaptive->error[i];
    return sum;
}

/* Parts of a picture are allocated side by side: of about so many pixels, a hundredth of a second, and no more of them
 * than this, for an allocation is half a megabyte. The same for any crew, as sums depend on it. */
#define PART_PIXELS (1u << 20)
#define PARTS_MOST  64

struct allocating {
    const struct adaptive *adaptive;
    bool told;      /* whether halves tell anything */
    double error;   /* of a pixel, the mean */
    uint32_t bands; /* of a part */
    struct allocation **parts;
};

static void allocate_pixel(const struct allocating *it, struct allocation *allocation, size_t i)
{
    const struct adaptive *adaptive = it->adaptive;
    double told = it->told ? error_of(adaptive, i) + hidden_in(adaptive, i) : adaptive->error[i];
    allocation_add(allocation, gain_of(adaptive, i), told, effort_of(adaptive, i),
                   adaptive->last - adaptive->level[i]);
}

static void allocate_part(void *context, uint32_t part)
{
    const struct allocating *it = context;
    const struct adaptive *adaptive = it->adaptive;
    struct allocation *allocation = it->parts[part] = allocation_create(it->error);
    uint32_t last = smaller((part + 1) * it->bands, band_count(adaptive->canvas));
    size_t end = first_pixel(adaptive, last);
    for (size_t i = first_pixel(adaptive, part * it->bands); i < end; i++)
        allocate_pixel(it, allocation, i);
}

/* All pixels, and what their halves tell, with what is hidden; where these tell nothing (of all of them), what is
 * expected, as contrasts may still hide something. */
static struct allocation *allocate_all(const struct adaptive *adaptive, const struct told *told)
{
    size_t pixels = canvas_pixels(adaptive->canvas);
    uint32_t bands = band_count(adaptive->canvas);
    uint32_t parts = (uint32_t)smaller_number(ceil((double)pixels / PART_PIXELS), PARTS_MOST);
    double squares = told->errors.squares;
    double sum = squares > 0 ? squares : expected_sum(adaptive);
    struct allocation *made[PARTS_MOST] = {NULL};
    struct allocating it = {.adaptive = adaptive,
                            .told = squares > 0,
                            .error = sum / (double)pixels,
                            .bands = divide_up(bands, parts),
                            .parts = made};
    parts = divide_up(bands, it.bands);
    crew_share(adaptive->crew, parts, allocate_part, &it);
    for (uint32_t part = 1; part < parts; part++) {
        allocation_join(made[0], made[part]);
        allocation_destroy(made[part]);
    }
    return made[0];
}

/* Of a pass to come. */
static double seconds_per_effort(const struct adaptive *adaptive)
{
    const struct spent *first = &adaptive->on_first, *later = &adaptive->on_later;
    return (later->seconds + LATER_WEIGHT * LATER_SECONDS * first->seconds) /
           (later->effort + LATER_WEIGHT * first->effort);
}

/* ---- the plan ---- */

/* What the last pass has kept of its promise. */
static void learn(struct adaptive *adaptive, double squares)
{
    if (!(adaptive->promised > 0 && adaptive->promised < 1 && squares > 0)) return;
    adaptive->log_promised += log(adaptive->promised);
    adaptive->log_kept += log(squares / adaptive->before);
    adaptive->promised = 0;
}

/* Of a band: pixels that go up, and what is expected to be left of the errors as all of its halves tell
 * them. */
struct step {
    uint64_t missing;
    double left;
};

struct stepping {
    struct adaptive *adaptive;
    double limit;
    struct step *bands;
};

/* Whether the pixel would get more samples by what is around it alone. */
static bool is_warned(const struct adaptive *adaptive, size_t pixel, double limit)
{
    double warned = (double)adaptive->warned[pixel];
    double gain = warned * warned / cost_of(adaptive, pixel);
    return allocation_doublings(gain, limit, 1) > 0;
}

/* Its pixels' next levels. */
static void step_band(void *context, uint32_t band)
{
    const struct stepping *it = context;
    struct adaptive *adaptive = it->adaptive;
    size_t end = first_pixel(adaptive, band + 1);
    struct step step = {0, 0};
    for (size_t i = first_pixel(adaptive, band); i < end; i++) {
        unsigned level = adaptive->level[i], most = adaptive->last - level;
        if (most > LEVELS_PER_PASS) most = LEVELS_PER_PASS;
        unsigned up = allocation_doublings(gain_of(adaptive, i), it->limit, most);
        adaptive->next[i] = (uint8_t)(level + up);
        step.missing += up > 0;
        step.left += error_of(adaptive, i) * left_of(adaptive, level, level + up);
    }
    it->bands[band] = step;
}

/* Its pixels that are left where they are, or would be by what is around them. */
static void leave_band(void *context, uint32_t band)
{
    const struct stepping *it = context;
    struct adaptive *adaptive = it->adaptive;
    size_t end = first_pixel(adaptive, band + 1);
    for (size_t i = first_pixel(adaptive, band); i < end; i++) {
        if (!hidden_is_open(adaptive->hidden, i)) continue;
        if (!is_warned(adaptive, i, it->limit))
            hidden_leave(adaptive->hidden, i, adaptive->warned[i]);
        else if (adaptive->next[i] == adaptive->level[i])
            hidden_leave_warned(adaptive->hidden, i);
    }
}

/* Every pixel's next level, and with them what the pass promises; returns whether any goes up. squares:
 * the sum of what halves tell. */
static bool assign_levels(struct adaptive *adaptive, double limit, double squares)
{
    assert(adaptive->missing == 0);
    uint32_t bands = band_count(adaptive->canvas);
    double left = 0;
    struct stepping it = {adaptive, limit, allocate(bands, sizeof *it.bands)};
    crew_share(adaptive->crew, bands, step_band, &it);
    for (uint32_t k = 0; k < bands; k++) {
        adaptive->missing += it.bands[k].missing;
        left += it.bands[k].left;
    }
    free(it.bands);
    adaptive->asked = adaptive->missing;
    if (adaptive->missing == 0) return false;
    crew_share(adaptive->crew, bands, leave_band, &it);
    adaptive->promised = squares > 0 ? left / squares : 0;
    adaptive->before = squares;
    adaptive->limit = limit;
    adaptive->first = false;
    adaptive->passes++;
    return true;
}

/* How a pass has ended. */
struct looked {
    struct told told;
    double high; /* the upper end of the estimate of the picture's error */
};

/* All pixels of the last pass are in. */
static struct looked look_at_pass(struct adaptive *adaptive)
{
    struct told told = expect(adaptive);
    struct error_told errors = all_errors(adaptive, &told);
    struct error_estimate estimate =
        error_estimate(&errors, told.pixels, ERROR_LOOK_PASS, adaptive->passes);
    return (struct looked){told, estimate.high};
}

static bool meets_target(const struct adaptive *adaptive, struct looked looked)
{
    return adaptive->target > 0 && looked.high <= adaptive->target;
}

/* Looks whether the target is met. */
static struct looked look(struct adaptive *adaptive)
{
    struct looked looked = look_at_pass(adaptive);
    learn(adaptive, looked.told.errors.squares);
    adaptive->met = meets_target(adaptive, looked);
    return looked;
}

/* ---- first samples that pass 0 did not get to ---- */

void adaptive_cut(struct adaptive *adaptive, double seconds)
{
    if (adaptive->passes > 1 || adaptive->unsampled == 0) return;
    size_t pixels = canvas_pixels(adaptive->canvas);
    for (size_t i = 0; i < pixels; i++)
        adaptive->next[i] = adaptive->level[i];
    adaptive->missing = adaptive->asked = 0;
    if (seconds > 0)
        adaptive->unsampled_s = seconds / (double)adaptive->unsampled;
    else if (adaptive->unsampled < pixels)
        adaptive->unsampled_s = adaptive->on_first.seconds / (double)(pixels - adaptive->unsampled);
}

/* The pixels of this lattice that have no samples; next: there they are to get some in the next pass; or NULL. */
static uint64_t find_unsampled(const struct adaptive *adaptive, uint32_t lattice, uint8_t *next)
{
    const struct canvas *canvas = adaptive->canvas;
    uint32_t step = lattice_step(lattice);
    uint64_t count = 0;
    for (uint32_t y = 0; y < canvas->height; y += lattice_rows(lattice))
        for (uint32_t x = lattice_first(lattice, y); x < canvas->width; x += step) {
            size_t i = (size_t)y * canvas->width + x;
            if (adaptive->level[i] > 0) continue;
            if (next) next[i] = 1;
            count++;
        }
    return count;
}

/* The finest lattice for which there is time, or else the coarsest one, that has any pixel without samples. */
static uint32_t lattice_within(const struct adaptive *adaptive, double seconds)
{
    uint32_t lattice = LATTICE_COARSEST;
    bool any = find_unsampled(adaptive, lattice, NULL) > 0;
    while (lattice > 0) {
        uint64_t finer = find_unsampled(adaptive, lattice - 1, NULL);
        bool fits = adaptive->unsampled_s > 0 ? (double)finer * adaptive->unsampled_s <= seconds
                                              : seconds == HUGE_VAL;
        if (any && !fits) break;
        any = finer > 0;
        lattice--;
    }
    return lattice;
}

/* What pixels take that get their first samples, by those that did last. */
static void learn_first(struct adaptive *adaptive)
{
    if (adaptive->asked == 0) return;
    adaptive->unsampled_s =
        (adaptive->on_first.seconds - adaptive->spent_s) / (double)adaptive->asked;
}

/* All pixels of the last pass are in, and the lattice has some without samples. */
static void plan_lattice(struct adaptive *adaptive, uint32_t lattice)
{
    assert(adaptive->missing == 0);
    adaptive->asked = adaptive->missing = find_unsampled(adaptive, lattice, adaptive->next);
    assert(adaptive->missing > 0);
    adaptive->spent_s = adaptive->on_first.seconds;
    adaptive->limit = -1 - (double)lattice;
    adaptive->passes++;
}

/* A pass 0 that lacks pixels is cut off when it is clear that there is such a pass behind it. */
static bool plan_lattice_again(struct adaptive *adaptive, double lattice)
{
    bool is_one = lattice >= 0 && lattice <= LATTICE_COARSEST && lattice == floor(lattice);
    if (!is_one || find_unsampled(adaptive, (uint32_t)lattice, NULL) == 0) return false;
    adaptive_cut(adaptive, 0);
    plan_lattice(adaptive, (uint32_t)lattice);
    return true;
}

/* ---- the next pass ---- */

bool adaptive_plan(struct adaptive *adaptive, double seconds)
{
    if (adaptive->unsampled > 0) {
        learn_first(adaptive);
        plan_lattice(adaptive, lattice_within(adaptive, seconds));
        return true;
    }
    struct looked looked = look(adaptive);
    if (adaptive->met) return false;
    struct allocation *allocation = allocate_all(adaptive, &looked.told);
    double share = fmax(PASS_AIM_MIN, adaptive->target / looked.high);
    if (share > PASS_AIM_MAX) share = PASS_AIM_MAX;
    double limit = allocation_limit(allocation, share * share * allocation_told(allocation));
    if (seconds < HUGE_VAL) {
        double effort = seconds / seconds_per_effort(adaptive);
        limit = fmax(limit, allocation_limit_within(allocation, effort));
    }
    allocation_destroy(allocation);
    return assign_levels(adaptive, limit, looked.told.errors.squares);
}

bool adaptive_plan_again(struct adaptive *adaptive, double limit)
{
    if (adaptive->unsampled > 0) return plan_lattice_again(adaptive, -1 - limit);
    if (limit < 0) return false;
    struct looked looked = look(adaptive);
    return !adaptive->met && assign_levels(adaptive, limit, looked.told.errors.squares);
}

double adaptive_limit(const struct adaptive *adaptive)
{
    return adaptive->limit;
}

const uint8_t *adaptive_levels(const struct adaptive *adaptive)
{
    return adaptive->level;
}

uint64_t adaptive_unsampled(const struct adaptive *adaptive)
{
    return adaptive->unsampled;
}

bool adaptive_is_first(const struct adaptive *adaptive)
{
    return adaptive->first;
}

bool adaptive_is_met(struct adaptive *adaptive)
{
    if (adaptive->met) return true;
    return adaptive->target > 0 && adaptive->missing == 0 && adaptive->unsampled == 0 &&
           meets_target(adaptive, look_at_pass(adaptive));
}

double adaptive_seconds(const struct adaptive *adaptive)
{
    return adaptive->on_first.seconds + adaptive->on_later.seconds;
}

/* All samples behind pass 0, also those that are there, if a single pass took them to where a limit does. */
static double effort_behind_first(const struct adaptive *adaptive, double limit)
{
    double sum = 0;
    size_t pixels = canvas_pixels(adaptive->canvas);
    for (size_t i = 0; i < pixels; i++) {
        unsigned level = adaptive->level[i];
        unsigned up = allocation_doublings(gain_of(adaptive, i), limit, adaptive->last - level);
        sum += (double)adaptive->rays[i] * adaptive->efforts[1][level + up];
    }
    return sum;
}

double adaptive_foresee(struct adaptive *adaptive, double rmse, double power)
{
    struct told told = expect(adaptive);
    double squares = told.errors.squares, with_hidden = all_errors(adaptive, &told).sum.squares;
    if (told.pixels < canvas_pixels(adaptive->canvas) || !(squares > 0)) return (double)NAN;
    double exponent =
        (adaptive->log_kept + PROMISE_BEFORE) / (adaptive->log_promised + PROMISE_BEFORE);
    if (adaptive->first) exponent = power / FORECAST_EDGE; /* promises are for edges */
    if (!(exponent > 0)) return (double)NAN;
    double share = pow(rmse * rmse * (double)told.pixels / with_hidden, 1 / exponent);
    if (share >= 1) return 0;
    struct allocation *allocation = allocate_all(adaptive, &told);
    double limit = allocation_limit(allocation, share * allocation_told(allocation));
    allocation_destroy(allocation);
    if (!(limit > 0)) return HUGE_VAL;
    return effort_behind_first(adaptive, limit) * seconds_per_effort(adaptive) -
           adaptive->on_later.seconds;
}

bool adaptive_is_complete(const struct adaptive *adaptive)
{
    return adaptive->missing == 0;
}

double adaptive_missing(const struct adaptive *adaptive)
{
    return adaptive->missing ? (double)adaptive->missing / (double)adaptive->asked : 0;
}

double adaptive_target(const struct adaptive *adaptive)
{
    return adaptive->target;
}

unsigned adaptive_passes(const struct adaptive *adaptive)
{
    return adaptive->passes;
}

/* ---- tiles ---- */

/* Over a tile's pixels in its order, without a division for each. */
struct walk {
    size_t pixel;                 /* of the canvas */
    uint32_t column, width, step; /* in the tile; a step's columns beside whole rows */
    size_t on, back; /* pixels of the canvas: of a step, and from a row's end to the next row */
};

static struct walk walk_begin(const struct adaptive *adaptive, const struct tile *tile)
{
    size_t row = adaptive->canvas->width;
    uint32_t column = tile->phase % tile->w, step = tile->step % tile->w;
    assert(tile->x + tile->w <= row && tile->y + tile->h <= adaptive->canvas->height);
    return (struct walk){.pixel = (tile->y + tile->phase / tile->w) * row + tile->x + column,
                         .column = column,
                         .width = tile->w,
                         .step = step,
                         .on = tile->step / tile->w * row + step,
                         .back = row - tile->w};
}

static void walk_on(struct walk *walk)
{
    walk->pixel += walk->on;
    walk->column += walk->step;
    if (walk->column < walk->width) return;
    walk->column -= walk->width;
    walk->pixel += walk->back;
}

static bool comes(const struct adaptive *adaptive, size_t pixel)
{
    return adaptive->next[pixel] > adaptive->level[pixel];
}

uint32_t adaptive_pixels(const struct adaptive *adaptive, const struct tile *tile)
{
    uint32_t pixels = tile_pixels(tile), in = 0;
    if (adaptive->passes == 1) return pixels;
    struct walk walk = walk_begin(adaptive, tile);
    for (uint32_t k = 0; k < pixels; k++, walk_on(&walk))
        in += comes(adaptive, walk.pixel);
    return in;
}

struct adaptive_work adaptive_work(const struct adaptive *adaptive, const struct tile *tile)
{
    struct adaptive_work work = {0};
    uint32_t pixels = tile_pixels(tile);
    struct walk walk = walk_begin(adaptive, tile);
    for (uint32_t k = 0; k < pixels; k++, walk_on(&walk)) {
        size_t i = walk.pixel;
        if (!comes(adaptive, i)) continue;
        uint32_t before = adaptive->level[i], after = adaptive->next[i];
        work.samples += samples_of(adaptive, after) - samples_of(adaptive, before);
        work.removed +=
            (adaptive->error[i] + hidden_in(adaptive, i)) * (1 - left_of(adaptive, before, after));
    }
    return work;
}

void adaptive_refinements(const struct adaptive *adaptive, const struct tile *tile,
                          struct refinement *refinements)
{
    uint32_t pixels = tile_pixels(tile);
    struct walk walk = walk_begin(adaptive, tile);
    for (uint32_t k = 0; k < pixels; k++, walk_on(&walk))
        refinements[k] =
            (struct refinement){adaptive->level[walk.pixel], adaptive->next[walk.pixel]};
}

/* Pixels whose levels are hashed at once: calls cost more than bytes. */
#define HASHED_PIXELS 256u

uint64_t adaptive_plan_hash(const struct adaptive *adaptive, const struct tile *tile)
{
    uint64_t hash = adaptive->passes;
    uint8_t levels[2 * HASHED_PIXELS];
    uint32_t pixels = tile_pixels(tile), count = 0;
    struct walk walk = walk_begin(adaptive, tile);
    for (uint32_t k = 0; k < pixels; k++, walk_on(&walk)) {
        levels[count++] = adaptive->level[walk.pixel];
        levels[count++] = adaptive->next[walk.pixel];
        if (count < sizeof levels && k + 1 < pixels) continue;
        hash = hash64(levels, count, hash);
        count = 0;
    }
    return hash;
}

/* What so many samples and so many more come to together. */
static float combined(float mean, double samples, float more, double count)
{
    return (float)((samples * (double)mean + count * (double)more) / (samples + count));
}

/* What has come in of a pixel, and of those behind it: struct pixel_floats. */
struct news {
    const float *mean, *difference, *spread, *rays;
};

static double squared_distance(float a, float b)
{
    return ((double)a - (double)b) * ((double)a - (double)b);
}

/* The spread of so many samples and so many more together, of the pixel and of what has come in: by the
 * means of their halves, mean + difference / 2 and mean - difference / 2 (T. Chan, G. Golub & R. LeVeque,
 * Updating formulae and a pairwise algorithm for computing sample variances, 1979). */
static float combined_spread(const struct adaptive *adaptive, size_t pixel, double samples,
                             const struct news *more, double count)
{
    double apart = 0, all = samples + count;
    for (size_t c = 0; c < 3; c++)
        apart += squared_distance(adaptive->canvas->rgb[3 * pixel + c], more->mean[c]) +
                 squared_distance(adaptive->difference[3 * pixel + c], more->difference[c]) / 4;
    double within = samples * squared_distance(adaptive->spread[pixel], 0) +
                    count * squared_distance(*more->spread, 0);
    return (float)sqrt(within / all + samples * count / (all * all) * apart / 3);
}

/* Rays per sample as they came in: a sample is one ray at least. */
static double rays_of(float rays)
{
    return rays >= 1 && rays < HUGE_VALF ? (double)rays : 1;
}

/* What is known of a pixel from its first samples on. */
static void put_first(struct adaptive *adaptive, size_t i, const struct news *more)
{
    memcpy(&adaptive->canvas->rgb[3 * i], more->mean, 3 * sizeof *more->mean);
    memcpy(&adaptive->difference[3 * i], more->difference, 3 * sizeof *more->difference);
    adaptive->spread[i] = *more->spread;
    adaptive->rays[i] = (float)rays_of(*more->rays);
}

static struct known known_of(const struct adaptive *adaptive, size_t i)
{
    struct known known = {.level = adaptive->level[i]};
    memcpy(known.mean, &adaptive->canvas->rgb[3 * i], sizeof known.mean);
    memcpy(known.difference, &adaptive->difference[3 * i], sizeof known.difference);
    known.spread = adaptive->spread[i];
    return known;
}

static void put_more(struct adaptive *adaptive, size_t i, const struct news *more)
{
    double before = samples_of(adaptive, adaptive->level[i]);
    double count = samples_of(adaptive, adaptive->next[i]) - before;
    adaptive->spread[i] = combined_spread(adaptive, i, before, more, count);
    for (size_t c = 0; c < 3; c++) {
        float *mean = &adaptive->canvas->rgb[3 * i + c],
              *difference = &adaptive->difference[3 * i + c];
        *mean = combined(*mean, before, more->mean[c], count);
        *difference = combined(*difference, before, more->difference[c], count);
    }
    adaptive->rays[i] = combined(adaptive->rays[i], before, (float)rays_of(*more->rays), count);
}

/* What the pass brings to a pixel is in; returns its effort. */
static double put_pixel(struct adaptive *adaptive, size_t i, const struct news *more)
{
    uint32_t from = adaptive->level[i], to = adaptive->next[i];
    struct known before = known_of(adaptive, i);
    if (from == 0) {
        put_first(adaptive, i, more);
        adaptive->unsampled--;
    } else {
        put_more(adaptive, i, more);
    }
    adaptive->level[i] = (uint8_t)to;
    struct sampled now = sampled(adaptive);
    if (from > 0) hidden_settle(adaptive->hidden, &now, i, &before);
    adaptive->missing--;
    adaptive->expected = false;
    return rays_of(*more->rays) * adaptive->efforts[from][to];
}

void adaptive_put(struct adaptive *adaptive, const struct tile *tile, const float *part,
                  double seconds)
{
    bool whole = adaptive->passes == 1; /* all pixels of a tile come */
    struct spent *spent = adaptive->first ? &adaptive->on_first : &adaptive->on_later;
    spent->seconds += seconds;
    uint32_t pixels = tile_pixels(tile), in = adaptive_pixels(adaptive, tile);
    struct news at = {.mean = part, .difference = part + 3 * (size_t)in};
    at.spread = at.difference + 3 * (size_t)in;
    at.rays = at.spread + in;
    struct walk walk = walk_begin(adaptive, tile);
    for (uint32_t k = 0; k < pixels; k++, walk_on(&walk)) {
        bool more = comes(adaptive, walk.pixel);
        if (more) spent->effort += put_pixel(adaptive, walk.pixel, &at);
        if (more || whole) at.mean += 3, at.difference += 3, at.spread++, at.rays++;
    }
}
