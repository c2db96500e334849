#include "master/hidden.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"

/* In place of what was expected: no plan has left the pixel at its level, or what it had met at one has been found, and
 * its later samples tell what they leave of that. */
#define OPEN (-1.0f)
#define MET  (-2.0f)

/*
 * What nothing has warned of is so much more than was expected. An edge between colours of neighbours that are c apart
 * lets c^2 / n^3 be expected at least, and c^2 is the most that its error can be: 64 times as much with 4 samples. So
 * edges are not among it. Errors that they tell and show are alike, and would add noise; and a pixel's new samples fill
 * gaps that its first ones have left, so that at an edge their mean is off to the other side, and shows too much.
 */
#define FAR_OFF 64

struct hidden {
    float *expected;       /* of each pixel that was left, as hidden_leave() has it; OPEN or MET */
    uint32_t *number;      /* of each pixel, its own in records; 0: it has none */
    struct known *records; /* what pixels were that told or showed so much; room for room; owned */
    uint32_t count, room;
    uint64_t
        left[LEVEL_MAX + 1]; /* of each level: pixels that nothing had warned of, and that left */
    double share[LEVEL_MAX + 1]; /* of each level: hidden in each such pixel that is there */
};

struct hidden *hidden_create(size_t pixels)
{
    struct hidden *hidden = allocate_zeroed(1, sizeof *hidden);
    hidden->expected = allocate_there(pixels, sizeof *hidden->expected);
    hidden->number = allocate_there(pixels, sizeof *hidden->number);
    hidden->count = 1; /* the one that nobody has */
    for (size_t i = 0; i < pixels; i++)
        hidden->expected[i] = OPEN;
    return hidden;
}

void hidden_destroy(struct hidden *hidden)
{
    if (!hidden) return;
    free(hidden->records);
    free(hidden->number);
    free(hidden->expected);
    free(hidden);
}

bool hidden_is_open(const struct hidden *hidden, size_t pixel)
{
    return hidden->expected[pixel] == OPEN;
}

void hidden_leave(struct hidden *hidden, size_t pixel, float warned)
{
    hidden->expected[pixel] = warned;
}

static bool is_left(const struct hidden *hidden, size_t pixel)
{
    return hidden->expected[pixel] >= 0;
}

/* The samples of a pixel behind those that it had at a level. */
struct later {
    double first, count; /* samples: at the level, and behind it */
    double apart;        /* squared distance of the means */
    double error;        /* squared, of the later mean, by its halves */
    double stands_out;   /* squared distance of the later mean from what is around */
    double spread;       /* squared, as struct pixel_floats has it */
};

/* The mean of the neighbours, 8 at most, as they are now. */
static void mean_around(const struct canvas *canvas, size_t pixel, double mean[3])
{
    uint32_t width = canvas->width, x = (uint32_t)(pixel % width), y = (uint32_t)(pixel / width);
    double count = 0;
    mean[0] = mean[1] = mean[2] = 0;
    for (uint32_t v = y > 0 ? y - 1 : 0; v <= y + 1 && v < canvas->height; v++)
        for (uint32_t u = x > 0 ? x - 1 : 0; u <= x + 1 && u < width; u++) {
            if (u == x && v == y) continue;
            for (size_t c = 0; c < 3; c++)
                mean[c] += (double)canvas->rgb[3 * ((size_t)v * width + u) + c];
            count++;
        }
    for (unsigned c = 0; c < 3; c++)
        mean[c] /= count;
}

static double square(double a)
{
    return a * a;
}

/* Means, halves and spread of all samples were combined from those of the first and the later ones. */
static struct later later_of(const struct sampled *now, size_t pixel, const struct known *before)
{
    double all = now->levels->samples[now->level[pixel]];
    double first = now->levels->samples[before->level], count = all - first, around[3];
    struct later later = {.first = first, .count = count};
    double halves = 0;
    mean_around(now->canvas, pixel, around);
    for (size_t c = 0; c < 3; c++) {
        double mean_before = (double)before->mean[c], split_before = (double)before->difference[c];
        double mean = (all * (double)now->canvas->rgb[3 * pixel + c] - first * mean_before) / count;
        double split =
            (all * (double)now->difference[3 * pixel + c] - first * split_before) / count;
        later.apart += square(mean - mean_before) / 3;
        later.stands_out += square(mean - around[c]) / 3;
        later.error += square(split) / 12;
        halves += square(split - split_before) / 12;
    }
    double within =
        all * square((double)now->spread[pixel]) - first * square((double)before->spread);
    later.spread = fmax(within / count - first / all * (later.apart + halves), 0);
    return later;
}

/*
 * A thing that covers the share p of a pixel and differs by c from what is around leaves a mean that stands out by C =
 * p c and a spread of S^2 = p (1 - p) c^2, so that p = C^2 / (C^2 + S^2). n samples miss it with a chance of q = (1 -
 * p)^n, and C^2 is the error then. So for each such thing that was met there are q / (1 - q) others (D. Horvitz & D.
 * Thompson, "A generalization of sampling without replacement from a finite universe", J. Am. Stat. Assoc. 47, 1952).
 * By the later samples, as the first ones were lucky. In the mean this is the surplus of those that were met, which is
 * a small difference of large numbers itself.
 */
static double missed_for(const struct later *later)
{
    double all = later->stands_out + later->spread;
    if (!(all > 0 && all < HUGE_VAL)) return 0;
    double miss = later->first * log1p(-later->stands_out / all); /* ln q */
    return miss < 0 ? later->stands_out / expm1(-miss) : 0;
}

/* One more of the later samples that had met it, while none need have, would have added that to missed_for(): c^2 is
 * told n^2 times by halves one of which had met it once. */
static double unseen_of(const struct later *later, const struct known *before)
{
    return later->first / later->count * own_error(before->difference);
}

/* What the error of the first samples was: what the means are apart, but for the error of the later one. */
static double shown_by(const struct later *later)
{
    double shown = later->apart - later->error;
    return isfinite(shown) ? shown : 0;
}

static void record(struct hidden *hidden, size_t pixel, const struct known *before)
{
    if (hidden->number[pixel] == 0) {
        if (hidden->count >= hidden->room) {
            hidden->room = 2 * hidden->room + 64;
            hidden->records = reallocate(hidden->records, hidden->room, sizeof *hidden->records);
        }
        hidden->number[pixel] = hidden->count++;
    }
    hidden->records[hidden->number[pixel]] = *before;
}

void hidden_settle(struct hidden *hidden, const struct sampled *now, size_t pixel,
                   const struct known *before)
{
    if (!is_left(hidden, pixel)) return;
    double expected = (double)hidden->expected[pixel], much = SURPRISE * expected * expected;
    struct later later = later_of(now, pixel, before);
    bool met = own_error(before->difference) > much;
    hidden->left[before->level]++;
    hidden->expected[pixel] = met ? MET : OPEN;
    if (met || shown_by(&later) > much) record(hidden, pixel, before);
}

void hidden_add(const struct hidden *hidden, const struct sampled *now, size_t pixel,
                struct hidden_sum *sum)
{
    sum->levels[now->level[pixel]].pixels += is_left(hidden, pixel);
    if (hidden->number[pixel] == 0) return;
    const struct known *before = &hidden->records[hidden->number[pixel]];
    struct unwarned *level = &sum->levels[before->level];
    struct later later = later_of(now, pixel, before);
    if (hidden->expected[pixel] == MET) {
        double missed = missed_for(&later);
        level->expected += missed;
        level->squares += missed * missed;
        level->unseen = fmax(level->unseen, unseen_of(&later, before));
    } else {
        double shown = shown_by(&later), all = later.first + later.count;
        level->found += shown;
        level->squares += shown * shown;
        sum->carried += square(later.first / all) * shown;
    }
}

void hidden_join(struct hidden_sum *all, const struct hidden_sum *more)
{
    all->carried += more->carried;
    for (unsigned k = 1; k <= LEVEL_MAX; k++) {
        struct unwarned *to = &all->levels[k];
        const struct unwarned *from = &more->levels[k];
        to->pixels += from->pixels;
        to->expected += from->expected;
        to->found += from->found;
        to->squares += from->squares;
        to->unseen = fmax(to->unseen, from->unseen);
    }
}

/* Of a level's pixels that nothing warned of, those that are at it still. */
static double part_there(const struct hidden *hidden, const struct hidden_sum *sum, unsigned level)
{
    double there = (double)sum->levels[level].pixels;
    return there > 0 ? there / (there + (double)hidden->left[level]) : 0;
}

/* What these have missed, together: what is expected, less what was found with those that left. The more have left, the
 * more of this is noise; so it counts for the part that is there, and for the rest that part of what is expected. */
static double hidden_at(const struct hidden *hidden, const struct hidden_sum *sum, unsigned level)
{
    const struct unwarned *it = &sum->levels[level];
    double part = part_there(hidden, sum, level);
    return part * fmax(it->expected - it->found + (1 - part) * it->expected, 0);
}

struct error_sum hidden_errors(const struct hidden *hidden, const struct hidden_sum *sum,
                               struct error_sum told)
{
    struct error_sum errors = {fmax(told.squares + sum->carried, 0), told.fourths};
    for (unsigned level = 1; level <= LEVEL_MAX; level++) {
        const struct unwarned *it = &sum->levels[level];
        double part = part_there(hidden, sum, level);
        errors.squares += hidden_at(hidden, sum, level);
        errors.fourths += part * part * (it->squares + it->unseen * it->unseen);
    }
    return errors;
}

void hidden_share(struct hidden *hidden, const struct hidden_sum *sum)
{
    for (unsigned level = 1; level <= LEVEL_MAX; level++) {
        double there = (double)sum->levels[level].pixels;
        hidden->share[level] = there > 0 ? hidden_at(hidden, sum, level) / there : 0;
    }
}

double hidden_of(const struct hidden *hidden, size_t pixel, unsigned level)
{
    return is_left(hidden, pixel) ? hidden->share[level] : 0;
}
