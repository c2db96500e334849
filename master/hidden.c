#include "master/hidden.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "master/expect.h"

/* In place of what was expected. OPEN: no plan has left the pixel at its level. MET: it has met something at one, and
 * its own halves tell what later samples leave of that. WARNED: it was left though what is around had warned of
 * something, as its own samples had met nothing. */
#define OPEN   (-1.0f)
#define MET    (-2.0f)
#define WARNED (-3.0f)

struct hidden {
    float *expected; /* of each pixel that was left, as hidden_leave() has it; or one of these */
    /* Of each pixel: which record has what it was when it left a level; 0: none. */
    uint32_t *met;         /* at which it had met something */
    uint32_t *found;       /* at which it had missed what was found later: the last such level */
    struct known *records; /* owned */
    uint32_t count;
    /* Of each level: pixels that nothing had warned of and that have left it; what is hidden in each that is there. */
    uint64_t left[LEVEL_MAX + 1];
    double share[LEVEL_MAX + 1];
};

size_t hidden_pixel_bytes(void)
{
    const struct hidden *h = NULL;
    return sizeof *h->expected + sizeof *h->met + sizeof *h->found;
}

struct hidden *hidden_create(size_t pixels)
{
    struct hidden *hidden = allocate_zeroed(1, sizeof *hidden);
    hidden->expected = allocate_there(pixels, sizeof *hidden->expected);
    hidden->met = allocate_there(pixels, sizeof *hidden->met);
    hidden->found = allocate_there(pixels, sizeof *hidden->found);
    hidden->count = 1; /* the one that nobody has */
    for (size_t i = 0; i < pixels; i++)
        hidden->expected[i] = OPEN;
    return hidden;
}

void hidden_destroy(struct hidden *hidden)
{
    if (!hidden) return;
    free(hidden->records);
    free(hidden->found);
    free(hidden->met);
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

void hidden_leave_warned(struct hidden *hidden, size_t pixel)
{
    hidden->expected[pixel] = WARNED;
}

static bool is_left(const struct hidden *hidden, size_t pixel)
{
    return hidden->expected[pixel] >= 0;
}

/* The samples of a pixel behind those that it had at a level. */
struct later {
    double first, count; /* samples: at the level, and behind it */
    double mean[3];
    double apart;    /* squared distance of their mean from that of the first ones */
    double error;    /* squared, of their mean, by its halves */
    double variance; /* of one of them */
};

static double squared(double a)
{
    return a * a;
}

/* Means, halves and spread of all samples were combined from those of the first and the later ones. */
static struct later later_of(const struct sampled *now, size_t pixel, const struct known *before)
{
    double all = now->levels->samples[now->level[pixel]];
    double first = now->levels->samples[before->level], count = all - first, halves = 0;
    struct later later = {.first = first, .count = count};
    for (size_t c = 0; c < 3; c++) {
        double mean_before = (double)before->mean[c], split_before = (double)before->difference[c];
        double mean = (all * (double)now->canvas->rgb[3 * pixel + c] - first * mean_before) / count;
        double split =
            (all * (double)now->difference[3 * pixel + c] - first * split_before) / count;
        later.mean[c] = mean;
        later.apart += squared(mean - mean_before) / 3;
        later.error += squared(split) / 12;
        halves += squared(split - split_before) / 12;
    }
    double within =
        all * squared((double)now->spread[pixel]) - first * squared((double)before->spread);
    double spread = fmax(within / count - first / all * (later.apart + halves), 0);
    later.variance = spread + later.error; /* about the halves' means, and of these */
    return later;
}

/* The squared distance of a colour from the mean of the pixel's neighbours, 8 at most, as they are now; 0 where none is
 * finite. */
static double stands_out(const struct canvas *canvas, size_t pixel, const double color[3])
{
    uint32_t width = canvas->width, x = (uint32_t)(pixel % width), y = (uint32_t)(pixel / width);
    double count = 0, sum[3] = {0, 0, 0}, distance = 0;
    for (uint32_t v = y > 0 ? y - 1 : 0; v <= y + 1 && v < canvas->height; v++)
        for (uint32_t u = x > 0 ? x - 1 : 0; u <= x + 1 && u < width; u++) {
            const float *there = canvas_at(canvas, u, v);
            bool counts = isfinite(there[0]) && isfinite(there[1]) && isfinite(there[2]);
            if ((u == x && v == y) || !counts) continue;
            for (unsigned c = 0; c < 3; c++)
                sum[c] += (double)there[c];
            count++;
        }
    if (count == 0) return 0;
    for (unsigned c = 0; c < 3; c++)
        distance += squared(color[c] - sum[c] / count) / 3;
    return distance;
}

/*
 * A thing that covers the share p of a pixel and differs by c from what is around leaves a mean that stands out by C =
 * p c and a variance of V = p (1 - p) c^2, so that p = C^2 / (C^2 + V). n samples miss it with a chance of q = (1 -
 * p)^n, and C^2 is the error then. So for each such thing that was met there are q / (1 - q) others (D. Horvitz & D.
 * Thompson, "A generalization of sampling without replacement from a finite universe", J. Am. Stat. Assoc. 47, 1952).
 * C and V are of the later samples, for the first ones were lucky. contrast: C^2.
 */
static double missed_for(const struct later *later, double contrast)
{
    double all = contrast + later->variance;
    if (!(all > 0 && all < HUGE_VAL)) return 0;
    double miss = later->first * log1p(-contrast / all); /* ln q */
    return miss < 0 ? contrast / expm1(-miss) : 0;
}

/* What missed_for() would be more if one more of the later samples, m, had met it, of which there need be none: about
 * c^2 / (m n), where halves of n samples one of which has met it tell c^2 / n^2. */
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

static void record(struct hidden *hidden, uint32_t *number, const struct known *before)
{
    if (*number == 0) {
        hidden->records = grow(hidden->records, hidden->count, sizeof *hidden->records);
        *number = hidden->count++;
    }
    hidden->records[*number] = *before;
}

void hidden_settle(struct hidden *hidden, const struct sampled *now, size_t pixel,
                   const struct known *before)
{
    if (hidden->expected[pixel] == WARNED) hidden->expected[pixel] = OPEN;
    if (!is_left(hidden, pixel)) return;
    double expected = (double)hidden->expected[pixel], much = SURPRISE * expected * expected;
    double of_mean = squared((double)before->spread) / now->levels->samples[before->level];
    bool met = fmax(own_error(before->difference), of_mean) > much; /* halves may agree by luck */
    hidden->left[before->level]++;
    hidden->expected[pixel] = met ? MET : OPEN;
    if (met) {
        record(hidden, &hidden->met[pixel], before);
    } else {
        struct later later = later_of(now, pixel, before);
        if (shown_by(&later) > much) record(hidden, &hidden->found[pixel], before);
    }
}

static void add_met(const struct sampled *now, size_t pixel, const struct known *before,
                    struct hidden_sum *sum)
{
    struct unwarned *level = &sum->levels[before->level];
    struct later later = later_of(now, pixel, before);
    double contrast = stands_out(now->canvas, pixel, later.mean);
    double missed = missed_for(&later, contrast);
    level->expected += missed;
    /* This one might not have been met; and the others, missed / contrast of them, may be more or fewer. */
    if (missed > 0) level->variance += missed * (missed + contrast);
    level->unseen = fmax(level->unseen, unseen_of(&later, before));
}

/* Halves do not tell the part of the error that first samples have which missed something: with the square of their
 * share of the pixel's samples it is in its mean still. */
static void add_found(const struct sampled *now, size_t pixel, const struct known *before,
                      struct hidden_sum *sum)
{
    struct later later = later_of(now, pixel, before);
    double carried = squared(later.first / (later.first + later.count)) * shown_by(&later);
    sum->carried.squares += carried;
    sum->carried.fourths += carried * carried;
}

void hidden_add(const struct hidden *hidden, const struct sampled *now, size_t pixel,
                struct hidden_sum *sum)
{
    uint32_t met = hidden->met[pixel], found = hidden->found[pixel];
    sum->levels[now->level[pixel]].pixels += is_left(hidden, pixel);
    sum->levels[now->level[pixel]].warned += hidden->expected[pixel] == WARNED;
    if (met > 0) add_met(now, pixel, &hidden->records[met], sum);
    if (found > 0) add_found(now, pixel, &hidden->records[found], sum);
}

void hidden_join(struct hidden_sum *all, const struct hidden_sum *more)
{
    error_sum_add(&all->carried, &more->carried);
    for (unsigned k = 1; k <= LEVEL_MAX; k++) {
        struct unwarned *to = &all->levels[k];
        const struct unwarned *from = &more->levels[k];
        to->pixels += from->pixels;
        to->warned += from->warned;
        to->expected += from->expected;
        to->variance += from->variance;
        to->unseen = fmax(to->unseen, from->unseen);
    }
}

/* Of a level's pixels that nothing warned of, those that are at it still. */
static double part_there(const struct hidden *hidden, const struct hidden_sum *sum, unsigned level)
{
    double there = (double)sum->levels[level].pixels;
    return there > 0 ? there / (there + (double)hidden->left[level]) : 0;
}

/* What one of these has missed, in the mean: as much as any had that nothing warned of when a plan looked at it. What
 * was found since in those that have left is not taken off: the difference would be mostly luck. */
static double hidden_in_one(const struct hidden *hidden, const struct hidden_sum *sum,
                            unsigned level)
{
    const struct unwarned *it = &sum->levels[level];
    return it->pixels > 0 ? part_there(hidden, sum, level) * it->expected / (double)it->pixels : 0;
}

/* In these, and in those that were left though something had warned, which have missed as much. */
static double hidden_at(const struct hidden *hidden, const struct hidden_sum *sum, unsigned level)
{
    const struct unwarned *it = &sum->levels[level];
    return hidden_in_one(hidden, sum, level) * (double)(it->pixels + it->warned);
}

struct error_told hidden_errors(const struct hidden *hidden, const struct hidden_sum *sum,
                                struct error_sum halves)
{
    struct error_told told = {.sum = halves, .carried = sum->carried.squares};
    for (unsigned level = 1; level <= LEVEL_MAX; level++) {
        const struct unwarned *it = &sum->levels[level];
        double part = part_there(hidden, sum, level);
        told.hidden += hidden_at(hidden, sum, level);
        told.sum.fourths += part * part * (it->variance + it->unseen * it->unseen);
    }
    told.sum.squares = fmax(halves.squares + sum->carried.squares, 0) + told.hidden;
    told.sum.fourths += sum->carried.fourths;
    return told;
}

void hidden_share(struct hidden *hidden, const struct hidden_sum *sum)
{
    for (unsigned level = 1; level <= LEVEL_MAX; level++)
        hidden->share[level] = hidden_in_one(hidden, sum, level);
}

double hidden_of(const struct hidden *hidden, size_t pixel, unsigned level)
{
    bool was_left = is_left(hidden, pixel) || hidden->expected[pixel] == WARNED;
    return was_left ? hidden->share[level] : 0;
}
