#include "bench/error_allocation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench/error_lattice.h"
#include "bench/scenes.h"
#include "common/clock.h"
#include "common/message.h"
#include "test/renderer_fixture.h"

/*
 * How the gain is computed. Let n samples of pixel i cost c_i n and leave a squared error of v_i n^-p. The error
 * for a given cost is least where the errors of all pixels fall by the same amount per second,
 *
 *   p v_i n_i^(-p-1) / c_i = lambda,
 *
 * which leaves sum v_i n_i^-p = S^(p+1) C^-p, S = sum v_i^(1/(p+1)) c_i^(p/(p+1)), for a cost of C. The same n
 * for all pixels leaves V n^-p, V = sum v_i, for a cost of n sum c_i. To reach the same error, uniform sampling
 * takes longer by the factor
 *
 *   sum(c) V^(1/p) / S^((p+1)/p).
 *
 * This allows any n, down to fractions of a sample, and assumes one p for all pixels. So the allocation is also
 * made from measured errors, for the numbers of samples that the farm has: each pixel takes the one of 2, 4, 8,
 * ... samples for which e_i(n) + lambda c_i n is least. An allocator does not know true errors: here it chooses
 * by the errors of one half of the runs, and the result is evaluated with the other half, so that no pixel is
 * chosen for its luck. The formula therefore errs upward, as errors of pixels that scatter look uneven; and the
 * measured allocation errs downward, as choices by a noisy variance are poor.
 */

/* A lattice of blocks of the picture, of about PIXELS pixels together, is rendered RUNS times with different random
 * numbers, and its CPU time is measured block by block. */
#define PIXELS    6000u
#define RUNS      16u
#define HALF_RUNS (RUNS / 2)

#define LEVELS 8u /* 2 .. 256 samples */

struct pixel {
    double error[2][LEVELS]; /* squared error, mean of components: by each half of the runs */
    double cost;             /* CPU seconds of a sample */
};

struct block {
    /* CPU seconds of the highest level, over all runs */
    double seconds;
    float mean[RUNS][LEVELS][LATTICE_PIXELS][3]; /* means of all samples up to a level */
};

static double samples_of(uint32_t level)
{
    return ldexp(2, (int)level);
}

/* Renders all levels of a block, in the run-th run. */
static void render_block(struct renderer *renderer, const struct tile *tile, struct block *block,
                         uint32_t run)
{
    struct refinement refinements[LATTICE_PIXELS];
    float mean[LATTICE_PIXELS][3], difference[LATTICE_PIXELS][3];
    for (uint32_t level = 0; level < LEVELS; level++) {
        for (uint32_t k = 0; k < LATTICE_PIXELS; k++)
            refinements[k] = (struct refinement){(uint8_t)level, (uint8_t)(level + 1)};
        struct render_counts counts;
        struct task task = {.tile = tile,
                            .refinements = refinements,
                            .to.mean = mean[0],
                            .to.difference = difference[0]};
        double start = clock_thread_cpu();
        renderer_task(renderer, &task, &counts);
        if (level + 1 == LEVELS) block->seconds += clock_thread_cpu() - start;
        for (uint32_t i = 0; i < 3 * LATTICE_PIXELS; i++) {
            float new = mean[i / 3][i % 3];
            block->mean[run][level][i / 3][i % 3] =
                level == 0 ? new : (block->mean[run][level - 1][i / 3][i % 3] + new) / 2;
        }
    }
}

/* Each run renders the same part of a picture that is wider by a different amount: with other random numbers. */
static void render_runs(struct scene *scene, const struct bvh *bvh, const struct lattice *lattice,
                        struct block *blocks)
{
    scene->view.min_samples = 2;
    scene->view.max_samples = (uint32_t)samples_of(LEVELS - 1);
    for (uint32_t run = 0; run < RUNS; run++) {
        lattice_renumber(&scene->view);
        struct renderer *renderer = renderer_create(scene, bvh);
        for (uint32_t i = 0; i < lattice->count; i++)
            render_block(renderer, &lattice->blocks[i], &blocks[i], run);
        renderer_destroy(renderer);
    }
}

/* The variance of a pixel over HALF_RUNS runs. */
static double variance(const struct block *block, uint32_t first, uint32_t level, uint32_t k)
{
    double squares = 0;
    for (uint32_t c = 0; c < 3; c++) {
        double sum = 0;
        for (uint32_t run = first; run < first + HALF_RUNS; run++)
            sum += (double)block->mean[run][level][k][c];
        for (uint32_t run = first; run < first + HALF_RUNS; run++) {
            double miss = (double)block->mean[run][level][k][c] - sum / HALF_RUNS;
            squares += miss * miss;
        }
    }
    return squares / (3 * (HALF_RUNS - 1));
}

static struct pixel *measure_pixels(const struct block *blocks, uint32_t count)
{
    struct pixel *pixels = allocate(count, sizeof *pixels);
    double samples = RUNS * samples_of(LEVELS - 2) * LATTICE_PIXELS;
    for (uint32_t i = 0; i < count; i++) {
        const struct block *block = &blocks[i / LATTICE_PIXELS];
        pixels[i].cost = block->seconds / samples;
        for (uint32_t half = 0; half < 2; half++)
            for (uint32_t level = 0; level < LEVELS; level++)
                pixels[i].error[half][level] =
                    variance(block, half * HALF_RUNS, level, i % LATTICE_PIXELS);
    }
    return pixels;
}

/* ---- allocations ---- */

/* Sums over pixels: squared error, CPU seconds, samples. */
struct total {
    double error, cost, samples;
};

static struct total uniform(const struct pixel *pixels, uint32_t count, uint32_t level)
{
    struct total total = {0, 0, 0};
    for (uint32_t i = 0; i < count; i++) {
        total.error += (pixels[i].error[0][level] + pixels[i].error[1][level]) / 2;
        total.cost += pixels[i].cost * samples_of(level);
        total.samples += samples_of(level);
    }
    return total;
}

/* The level with the least error + lambda cost, by the errors of one half of the runs; lowest: the lowest level
 * that is allowed. */
static uint32_t choose(const struct pixel *pixel, uint32_t half, uint32_t lowest, double lambda)
{
    uint32_t best = lowest;
    double least = HUGE_VAL;
    for (uint32_t level = lowest; level < LEVELS; level++) {
        double sum = pixel->error[half][level] + lambda * pixel->cost * samples_of(level);
        if (sum < least) {
            least = sum;
            best = level;
        }
    }
    return best;
}

static struct total allocated(const struct pixel *pixels, uint32_t count, uint32_t lowest,
                              double lambda)
{
    struct total total = {0, 0, 0};
    for (uint32_t i = 0; i < count; i++) {
        for (uint32_t half = 0; half < 2; half++) {
            uint32_t level = choose(&pixels[i], half, lowest, lambda);
            total.error += pixels[i].error[1 - half][level] / 2;
            total.cost += pixels[i].cost * samples_of(level) / 2;
            total.samples += samples_of(level) / 2;
        }
    }
    return total;
}

/* The allocation that leaves this error. */
static struct total allocated_to(const struct pixel *pixels, uint32_t count, uint32_t lowest,
                                 double error)
{
    double low = -120, high = 60; /* bounds of log2(lambda); low leaves a small error */
    for (int i = 0; i < 30; i++) {
        double middle = (low + high) / 2;
        if (allocated(pixels, count, lowest, exp2(middle)).error <= error)
            low = middle;
        else
            high = middle;
    }
    return allocated(pixels, count, lowest, exp2(low));
}

/* The gain by the formula, for errors v n^-p. */
static double formula(const struct pixel *pixels, uint32_t count, uint32_t level, double p)
{
    double costs = 0, errors = 0, roots = 0;
    for (uint32_t i = 0; i < count; i++) {
        double error = (pixels[i].error[0][level] + pixels[i].error[1][level]) / 2;
        costs += pixels[i].cost;
        errors += error;
        roots += pow(error, 1 / (p + 1)) * pow(pixels[i].cost, p / (p + 1));
    }
    return costs * pow(errors, 1 / p) / pow(roots, (p + 1) / p);
}

/* Prints a row: the error that uniform sampling of one level leaves, and the lower costs at which it could have
 * been reached. */
static void put_row(const char *name, const struct pixel *pixels, uint32_t count, uint32_t level)
{
    struct total even = uniform(pixels, count, level);
    struct total more = uniform(pixels, count, level + 1);
    double p = log2(even.error / more.error);
    printf("| %s | %.0f | %.3g | %.2f | %.2f |", name, samples_of(level), sqrt(even.error / count),
           p, formula(pixels, count, level, p));
    for (uint32_t lowest = 0; lowest <= 1; lowest++) {
        struct total best = allocated_to(pixels, count, lowest, even.error);
        printf(" %.2f (%.1f samples) |", even.cost / best.cost, best.samples / count);
    }
    putchar('\n');
}

void allocation_measure(struct scene *scene, const char *name)
{
    struct bvh *bvh = scene_tree(scene);
    struct lattice lattice = lattice_create(&scene->view, PIXELS);
    struct block *blocks = allocate_zeroed(lattice.count, sizeof *blocks);
    render_runs(scene, bvh, &lattice, blocks);
    uint32_t count = lattice.count * LATTICE_PIXELS;
    struct pixel *pixels = measure_pixels(blocks, count);
    for (uint32_t level = 1; level + 2 < LEVELS; level++)
        put_row(name, pixels, count, level);
    free(pixels);
    free(blocks);
    lattice_free(&lattice);
    free(bvh);
}
