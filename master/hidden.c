#include "master/hidden.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "master/expect.h"

/* Special values of struct hidden's state. OPEN: no plan has left the pixel at its present level. MET: at some level
 * its samples had hit something, and its own halves show what later samples leave of the error. WARNED: a plan has left
 * it although it was warned, because its own samples had hit nothing. */
#define OPEN   (-1.0f)
#define MET    (-2.0f)
#define WARNED (-3.0f)

struct hidden {
    float *state; /* per pixel: predicted_rms of hidden_leave(), or one of the values above */
    /* Per pixel, an index into records: its state when it left a level. 0: none. */
    uint32_t *met;   /* a level at which it had hit something */
    uint32_t *found; /* the last level at which it had missed what was found later */
    struct pixel_statistics *records; /* owned; record 0 is not used */
    uint32_t count;
    /* Per level: unwarned pixels that have left it; mean hidden squared error of those that are still at it. */
    uint64_t left[LEVEL_MAX + 1];
    double share[LEVEL_MAX + 1];
};

size_t hidden_pixel_bytes(void)
{
    const struct hidden *h = NULL;
    return sizeof *h->state + sizeof *h->met + sizeof *h->found;
}

struct hidden *hidden_create(size_t pixels)
{
    struct hidden *hidden = allocate_zeroed(1, sizeof *hidden);
    hidden->state = allocate_prefaulted(pixels, sizeof *hidden->state);
    hidden->met = allocate_prefaulted(pixels, sizeof *hidden->met);
    hidden->found = allocate_prefaulted(pixels, sizeof *hidden->found);
    hidden->count = 1; /* record 0 means none */
    for (size_t i = 0; i < pixels; i++)
        hidden->state[i] = OPEN;
    return hidden;
}

void hidden_destroy(struct hidden *hidden)
{
    if (!hidden) return;
    free(hidden->records);
    free(hidden->found);
    free(hidden->met);
    free(hidden->state);
    free(hidden);
}

bool hidden_is_open(const struct hidden *hidden, size_t pixel)
{
    return hidden->state[pixel] == OPEN;
}

void hidden_leave(struct hidden *hidden, size_t pixel, float predicted_rms)
{
    hidden->state[pixel] = predicted_rms;
}

void hidden_leave_warned(struct hidden *hidden, size_t pixel)
{
    hidden->state[pixel] = WARNED;
}

static bool is_left(const struct hidden *hidden, size_t pixel)
{
    return hidden->state[pixel] >= 0;
}

/* The later samples of a pixel, those that it got after leaving a level; the first samples are those it had there. */
struct later {
    double first, count; /* numbers of first and of later samples */
    double mean[3];
    double apart;    /* squared distance between the means of the later and the first samples */
    double error;    /* squared error of the later samples' mean, by their halves */
    double variance; /* of one later sample */
};

static double squared(double a)
{
    return a * a;
}

/* The variance of a pixel's samples: within its halves, and between them. */
static double variance_of(const struct pixel_statistics *pixel)
{
    return squared((double)pixel->spread) + own_error(pixel->difference);
}

/* Separates the later samples from all: statistics_put() combined means, halves and spreads, this solves for the later
 * samples' part. */
static struct later later_of(const struct statistics *now, size_t pixel,
                             const struct pixel_statistics *before)
{
    double all = now->levels.samples[now->level[pixel]];
    double first = now->levels.samples[before->level], count = all - first, halves = 0;
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
    later.variance = spread + later.error; /* within the halves, and between them */
    return later;
}

/* Squared distance of a colour from the mean of the pixel's neighbours (8 at most) as they are at present; 0 where none
 * is finite. */
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
 * A feature that covers the share p of a pixel and differs by c from its surroundings makes the pixel's mean differ
 * from them by C = p c, and its samples have the variance V = p (1 - p) c^2; so p = C^2 / (C^2 + V). All of n samples
 * miss the feature with probability q = (1 - p)^n, and the squared error is C^2 then. So each such feature that was hit
 * stands for q / (1 - q) others that were missed (D. Horvitz & D. Thompson, "A generalization of sampling without
 * replacement from a finite universe", J. Am. Stat. Assoc. 47, 1952). C and V are taken from the later samples, as the
 * first ones were lucky to hit it. contrast: C^2. Returns the expected squared error of the missed ones, q / (1 - q)
 * C^2.
 */
static double missed_for(const struct later *later, double contrast, double least_share)
{
    double all = contrast + later->variance;
    if (!(all > 0 && all < HUGE_VAL)) return 0;
    double share = fmin(fmax(contrast / all, least_share), 1);
    double miss = later->first * log1p(-share); /* ln q */
    return miss < 0 ? contrast / expm1(-miss) : 0;
}

/*
 * The least p that is taken for possible. A bar in each of many pixels side by side makes their samples vary, but none
 * of their means differs from those around it: by C and V alone it would be a speck, tiny and of immense contrast. But
 * k hits among the first n samples have given these the variance k / n (1 - k / n) c^2, at least (n - 1) / n^2 c^2,
 * which limits c^2, and V = p (1 - p) c^2. For a speck of which k was 1 the limit is p (1 - p), and half of it leaves
 * what C and V say, also if the pixels around it have a part of the speck.
 */
static double least_share(const struct later *later, const struct pixel_statistics *before)
{
    double n = later->first;
    double most = variance_of(before) * n * n / (n - 1); /* of c^2; above 0, as it varies */
    return later->variance / most / 2;
}

/* How much larger missed_for() would be if one more of the m later samples had hit the feature; it may be that none
 * has. This is about c^2 / (m n), and the halves of n first samples, one of which has hit it, show a squared error of
 * c^2 / n^2. */
static double shortfall_of(const struct later *later, const struct pixel_statistics *before)
{
    return later->first / later->count * own_error(before->difference);
}

/* Squared error of the first samples' mean: its squared distance from the later mean, less the error of the later one.
 * May be negative by chance. */
static double shown_by(const struct later *later)
{
    double shown = later->apart - later->error;
    return isfinite(shown) ? shown : 0;
}

static void record(struct hidden *hidden, uint32_t *number, const struct pixel_statistics *before)
{
    if (*number == 0) {
        hidden->records = grow(hidden->records, hidden->count, sizeof *hidden->records);
        *number = hidden->count++;
    }
    hidden->records[*number] = *before;
}

/* Whether the later samples are at least as many as the first ones. A last level that has not twice the samples of the
 * one before may add few. What the mean of 8 samples errs by after 64 is taken for a contrast that the 64 have missed:
 * with a max_samples of 72 the garden's error (200 x 150, target_error=0.006) would be estimated as 0.0100 where it is
 * 0.0051. So of pixels that leave such a level nothing is inferred, as of those that have max_samples. */
static bool tells_enough(const struct statistics *now, size_t pixel,
                         const struct pixel_statistics *before)
{
    double first = now->levels.samples[before->level];
    return now->levels.samples[now->level[pixel]] >= 2 * first;
}

/* Sums of equal samples are rounded, which makes a spread: 1.7e-8 of the colour after 4 samples, at most 9.5e-7 after
 * 32,768 (of 3000 sums), the most that are compared. */
#define ROUNDED 4e-6

/* Whether the samples of a pixel differ. */
static bool varies(const struct pixel_statistics *pixel)
{
    double squares = 0;
    for (size_t c = 0; c < 3; c++)
        squares += squared((double)pixel->mean[c]) / 3;
    return variance_of(pixel) > squared(ROUNDED) * squares;
}

void hidden_settle(struct hidden *hidden, const struct statistics *now, size_t pixel,
                   const struct pixel_statistics *before)
{
    if (hidden->state[pixel] == WARNED) hidden->state[pixel] = OPEN;
    if (!is_left(hidden, pixel)) return;
    if (!tells_enough(now, pixel, before)) {
        hidden->state[pixel] = OPEN;
        return;
    }
    double predicted = (double)hidden->state[pixel], much = SURPRISE * predicted * predicted;
    /* Halves may agree by chance, so the spread counts as well. It is about the squared error of one sample. Of that as
     * much is taken to be left as the prediction assumes: 1 / n^3/2. With 1 / n, which is left of it where samples are
     * random, from some hundred samples on all edges would seem to have met something. */
    double by_spread = squared((double)before->spread) / now->levels.power[before->level];
    bool met = varies(before) && fmax(own_error(before->difference), by_spread) > much;
    hidden->left[before->level]++;
    hidden->state[pixel] = met ? MET : OPEN;
    if (met) {
        record(hidden, &hidden->met[pixel], before);
    } else {
        struct later later = later_of(now, pixel, before);
        if (shown_by(&later) > much) record(hidden, &hidden->found[pixel], before);
    }
}

static void add_met(const struct statistics *now, size_t pixel,
                    const struct pixel_statistics *before, struct hidden_sum *sum)
{
    struct level_sum *level = &sum->levels[before->level];
    struct later later = later_of(now, pixel, before);
    double contrast = stands_out(now->canvas, pixel, later.mean);
    double missed = missed_for(&later, contrast, least_share(&later, before));
    level->expected += missed;
    /* missed^2: the feature itself might not have been hit. missed * contrast: the number of the others, missed /
     * contrast, scatters, too. */
    if (missed > 0) level->variance += missed * (missed + contrast);
    level->shortfall = fmax(level->shortfall, shortfall_of(&later, before));
}

/* Where the first samples missed something, the halves do not show their error. The pixel's mean still contains it,
 * weighted with the square of the first samples' share of all samples. */
static void add_found(const struct statistics *now, size_t pixel,
                      const struct pixel_statistics *before, struct hidden_sum *sum)
{
    struct later later = later_of(now, pixel, before);
    double carried = squared(later.first / (later.first + later.count)) * shown_by(&later);
    sum->carried.squares += carried;
    sum->carried.fourths += carried * carried;
}

void hidden_add(const struct hidden *hidden, const struct statistics *now, size_t pixel,
                struct hidden_sum *sum)
{
    uint32_t met = hidden->met[pixel], found = hidden->found[pixel];
    sum->levels[now->level[pixel]].pixels += is_left(hidden, pixel);
    sum->levels[now->level[pixel]].warned += hidden->state[pixel] == WARNED;
    if (met > 0) add_met(now, pixel, &hidden->records[met], sum);
    if (found > 0) add_found(now, pixel, &hidden->records[found], sum);
}

void hidden_join(struct hidden_sum *all, const struct hidden_sum *more)
{
    error_sum_add(&all->carried, &more->carried);
    for (unsigned k = 1; k <= LEVEL_MAX; k++) {
        struct level_sum *to = &all->levels[k];
        const struct level_sum *from = &more->levels[k];
        to->pixels += from->pixels;
        to->warned += from->warned;
        to->expected += from->expected;
        to->variance += from->variance;
        to->shortfall = fmax(to->shortfall, from->shortfall);
    }
}

/* Of the unwarned pixels that were at a level, the share that is still at it. */
static double part_there(const struct hidden *hidden, const struct hidden_sum *sum, unsigned level)
{
    double there = (double)sum->levels[level].pixels;
    return there > 0 ? there / (there + (double)hidden->left[level]) : 0;
}

/* Mean hidden squared error of one of these: what unwarned pixels had missed on average when a plan looked at them.
 * What has been found since in those that left the level is not subtracted: the difference would be mostly noise. */
static double hidden_in_one(const struct hidden *hidden, const struct hidden_sum *sum,
                            unsigned level)
{
    const struct level_sum *it = &sum->levels[level];
    return it->pixels > 0 ? part_there(hidden, sum, level) * it->expected / (double)it->pixels : 0;
}

/* Hidden squared error of all these, and of those left although warned, which are taken to have missed as much each. */
static double hidden_at(const struct hidden *hidden, const struct hidden_sum *sum, unsigned level)
{
    const struct level_sum *it = &sum->levels[level];
    return hidden_in_one(hidden, sum, level) * (double)(it->pixels + it->warned);
}

struct error_breakdown hidden_errors(const struct hidden *hidden, const struct hidden_sum *sum,
                                     struct error_sum halves)
{
    struct error_breakdown breakdown = {.sum = halves, .carried = sum->carried.squares};
    for (unsigned level = 1; level <= LEVEL_MAX; level++) {
        const struct level_sum *it = &sum->levels[level];
        double part = part_there(hidden, sum, level);
        breakdown.hidden += hidden_at(hidden, sum, level);
        breakdown.sum.fourths += part * part * (it->variance + it->shortfall * it->shortfall);
    }
    breakdown.sum.squares = fmax(halves.squares + sum->carried.squares, 0) + breakdown.hidden;
    breakdown.sum.fourths += sum->carried.fourths;
    return breakdown;
}

void hidden_share(struct hidden *hidden, const struct hidden_sum *sum)
{
    for (unsigned level = 1; level <= LEVEL_MAX; level++)
        hidden->share[level] = hidden_in_one(hidden, sum, level);
}

double hidden_of(const struct hidden *hidden, size_t pixel, unsigned level)
{
    bool was_left = is_left(hidden, pixel) || hidden->state[pixel] == WARNED;
    return was_left ? hidden->share[level] : 0;
}
