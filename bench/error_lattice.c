#include "bench/error_lattice.h"

#include <math.h>
#include <stdlib.h>

#include "bench/scenes.h"
#include "common/message.h"
#include "test/renderer_fixture.h"

struct lattice lattice_create(const struct view *view, uint32_t pixels)
{
    uint32_t columns = view->region_w / LATTICE_BLOCK_W, rows = view->region_h / LATTICE_BLOCK_H;
    double all = (double)columns * rows * LATTICE_PIXELS;
    uint32_t stride = (uint32_t)fmax(1, round(sqrt(all / pixels)));
    struct lattice lattice = {allocate((size_t)columns * rows, sizeof *lattice.blocks), 0};
    for (uint32_t y = stride / 2; y < rows; y += stride)
        for (uint32_t x = stride / 2; x < columns; x += stride)
            lattice.blocks[lattice.count++] = (struct tile){.x = x * LATTICE_BLOCK_W,
                                                            .y = y * LATTICE_BLOCK_H,
                                                            .w = LATTICE_BLOCK_W,
                                                            .h = LATTICE_BLOCK_H,
                                                            .step = 1};
    return lattice;
}

void lattice_free(struct lattice *lattice)
{
    free(lattice->blocks);
}

void lattice_renumber(struct view *view)
{
    view->width += 2 * view->region_w;
    view->region_x += view->region_w;
}

/* The sum of squared differences between a block of the picture and these means. */
static double block_squares(const struct canvas *picture, const struct tile *block,
                            const float *mean)
{
    float rgb[3 * LATTICE_PIXELS];
    double squares = 0;
    canvas_get(picture, block, rgb);
    for (uint32_t i = 0; i < 3 * LATTICE_PIXELS; i++) {
        double miss = (double)rgb[i] - (double)mean[i];
        squares += miss * miss;
    }
    return squares;
}

/* Sums over blocks of their squared differences, and of the squares of these. */
struct square_sum {
    double sum, squares;
};

/* The relative error of a root mean square is half of that of the mean square; blocks are assumed to be
 * independent. */
static struct lattice_error root_mean(const struct square_sum *sum, double blocks)
{
    double mean = sum->sum / blocks, variance = sum->squares / blocks - mean * mean;
    double rmse = sqrt(mean / (3 * LATTICE_PIXELS));
    double deviation = mean > 0 ? rmse / 2 * sqrt(fmax(variance, 0) / blocks) / mean : 0;
    return (struct lattice_error){.rmse = rmse, .deviation = deviation};
}

void lattice_compare(struct scene *scene, uint32_t pixels, uint32_t samples,
                     const struct canvas *pictures, uint32_t count, struct lattice_error *errors)
{
    lattice_renumber(&scene->view);
    scene->view.min_samples = scene->view.max_samples = samples;
    struct bvh *bvh = scene_tree(scene);
    struct renderer *renderer = renderer_create(scene, bvh);
    struct lattice lattice = lattice_create(&scene->view, pixels);
    struct square_sum *sums = allocate_zeroed(count, sizeof *sums);
    double own = 0;
    for (uint32_t i = 0; i < lattice.count; i++) {
        float mean[3 * LATTICE_PIXELS], difference[3 * LATTICE_PIXELS];
        struct task task = {
            .tile = &lattice.blocks[i], .to.mean = mean, .to.difference = difference};
        struct render_counts counts;
        renderer_task(renderer, &task, &counts);
        own += counts.sampling.squares;
        for (uint32_t k = 0; k < count; k++) {
            double squares = block_squares(&pictures[k], &lattice.blocks[i], mean);
            sums[k].sum += squares;
            sums[k].squares += squares * squares;
        }
    }
    for (uint32_t k = 0; k < count; k++) {
        errors[k] = root_mean(&sums[k], lattice.count);
        errors[k].reference = sqrt(own / ((double)lattice.count * LATTICE_PIXELS));
    }
    free(sums);
    lattice_free(&lattice);
    renderer_destroy(renderer);
    free(bvh);
}
