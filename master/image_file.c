#include "master/image_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/clock.h"
#include "common/hash.h"
#include "common/message.h"
#include "common/whole.h"
#include "master/hdr.h"
#include "master/output_file.h"
#include "master/path.h"
#include "master/png.h"

enum format { FORMAT_NONE, FORMAT_PNG, FORMAT_HDR, FORMAT_PFM };

static enum format image_format(const char *path)
{
    if (path_has_extension(path, ".png")) return FORMAT_PNG;
    if (path_has_extension(path, ".hdr")) return FORMAT_HDR;
    if (path_has_extension(path, ".pfm")) return FORMAT_PFM;
    return FORMAT_NONE;
}

bool image_extension_known(const char *path)
{
    return image_format(path) != FORMAT_NONE;
}

static void output_sink(void *context, void *data, int bytes)
{
    output_put(context, data, (size_t)bytes);
}

/* PFM has rows from the bottom; a negative scale says that the floats are little-endian. */
static void pfm_encode(const struct canvas *canvas, struct output *output)
{
    const char *scale = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ ? "-1.0" : "1.0";
    size_t row = (size_t)canvas->width * 3;
    char *header = format_text("PF\n%u %u\n%s\n", canvas->width, canvas->height, scale);
    output_put(output, header, strlen(header));
    free(header);
    for (uint32_t y = canvas->height; y-- > 0;)
        output_put(output, canvas->rgb + y * row, row * sizeof *canvas->rgb);
}

static void encode(enum format format, const struct canvas *canvas, struct thread_pool *pool,
                   struct output *output)
{
    if (format == FORMAT_PFM)
        pfm_encode(canvas, output);
    else if (format == FORMAT_PNG)
        png_encode(canvas, pool, output_sink, output);
    else
        hdr_encode(canvas, output_sink, output);
}

/* The values that a reader of the file gets for a pixel. */
static void read_back(enum format format, const float *rgb, float *back)
{
    if (format == FORMAT_HDR) {
        hdr_read_back(rgb, back);
        return;
    }
    for (int c = 0; c < 3; c++)
        back[c] = format == FORMAT_PNG ? png_read_back(rgb[c]) : rgb[c];
}

/* Whether the value is within the range of the format. */
static bool has_room(enum format format, float value)
{
    if (format == FORMAT_PFM) return true;
    return value >= 0 && value <= (format == FORMAT_PNG ? 1 : HDR_LARGEST);
}

/* Errors are summed in parts of PART_PIXELS pixels, so that the order of summation does not depend on the
 * threads. */
#define PART_PIXELS 65536u

struct loss {
    double squares, most, cut; /* sums of squares of rounding errors and of what is clipped */
    uint64_t rounded, clipped; /* rounded values; clipped pixels */
};

struct losses {
    enum format format;
    const struct canvas *canvas;
    struct loss *parts;
};

static void add_pixel(struct loss *loss, enum format format, const float *rgb)
{
    float back[3];
    bool clipped = false;
    read_back(format, rgb, back);
    for (int c = 0; c < 3; c++) {
        double miss = fabs((double)rgb[c] - (double)back[c]);
        bool room = has_room(format, rgb[c]);
        clipped |= !room;
        if (!(miss < HUGE_VAL)) continue;
        *(room ? &loss->squares : &loss->cut) += miss * miss;
        loss->rounded += room;
        if (room && miss > loss->most) loss->most = miss;
    }
    loss->clipped += clipped;
}

static void find_loss(void *context, uint32_t iteration)
{
    const struct losses *losses = context;
    uint32_t begin = iteration * PART_PIXELS;
    size_t left = canvas_pixels(losses->canvas) - begin;
    uint32_t count = left < PART_PIXELS ? (uint32_t)left : PART_PIXELS;
    struct loss loss = {0};
    for (uint32_t i = 0; i < count; i++)
        add_pixel(&loss, losses->format, losses->canvas->rgb + 3 * ((size_t)begin + i));
    losses->parts[iteration] = loss;
}

struct quantisation image_quantisation(const char *path, const struct canvas *canvas,
                                       struct thread_pool *pool)
{
    uint32_t parts = divide_up((uint32_t)canvas_pixels(canvas), PART_PIXELS);
    struct losses losses = {image_format(path), canvas, allocate(parts, sizeof *losses.parts)};
    struct loss all = {0};
    thread_pool_for(pool, parts, find_loss, &losses);
    for (uint32_t i = 0; i < parts; i++) {
        const struct loss *part = &losses.parts[i];
        all.squares += part->squares;
        all.cut += part->cut;
        all.most = fmax(all.most, part->most);
        all.rounded += part->rounded;
        all.clipped += part->clipped;
    }
    free(losses.parts);
    struct quantisation result = {.most = all.most, .clipped = all.clipped};
    if (all.rounded > 0) result.rmse = sqrt(all.squares / (double)all.rounded);
    result.clipped_rmse = sqrt(all.cut / (3 * (double)canvas_pixels(canvas)));
    return result;
}

/* The edge, in pixels, of the trial picture by which encoding times are predicted: it takes some ms. Once the real
 * picture is rendered, the trial consists of blocks of it, of edge TRIAL_BLOCK: their rows are long enough to compress
 * as they do in the real picture. */
#define TRIAL_EDGE  192u
#define TRIAL_BLOCK 32u

/* Before anything is rendered, the trial picture is a gradient with noise of a fifth of 1/255. The time predicted by it
 * is 0.8 to 1.0 (garden), 1.0 to 1.2 (lantern) and 1.4 to 1.5 (hello) times what a PNG of 3840 x 2160 took. */
#define TRIAL_NOISE (0.2f / 255)

static void fill_with_noise(struct canvas *trial)
{
    const uint32_t values = 3 * TRIAL_EDGE * TRIAL_EDGE;
    for (uint32_t i = 0; i < values; i++) {
        float noise = (float)(hash64(&i, sizeof i, 0) >> 40) * 0x1p-24f;
        trial->rgb[i] = 0.5f * (float)i / (float)values + TRIAL_NOISE * noise;
    }
}

/* Fills the trial picture with blocks that are spread over the real one. */
static void fill_from(const struct canvas *canvas, struct canvas *trial)
{
    float rgb[3 * TRIAL_BLOCK * TRIAL_BLOCK];
    struct tile to = {.w = TRIAL_BLOCK, .h = TRIAL_BLOCK, .step = 1}, from = to;
    const uint32_t columns = TRIAL_EDGE / TRIAL_BLOCK;
    for (uint32_t i = 0; i < columns * columns; i++) {
        uint32_t column = i % columns, row = i / columns;
        to.x = column * TRIAL_BLOCK;
        to.y = row * TRIAL_BLOCK;
        from.x = (canvas->width - TRIAL_BLOCK) * column / (columns - 1);
        from.y = (canvas->height - TRIAL_BLOCK) * row / (columns - 1);
        canvas_get(canvas, &from, rgb);
        canvas_put(trial, &to, rgb);
    }
}

static void no_sink(void *context, void *data, int bytes)
{
    (void)context, (void)data, (void)bytes;
}

/* Pixels per thread, which take some 10 ms: for fewer it is not worth waking a thread. */
#define THREAD_PIXELS (1u << 18)

unsigned image_threads(const struct canvas *canvas)
{
    return (unsigned)(canvas_pixels(canvas) / THREAD_PIXELS) + 1;
}

double image_seconds(const char *path, const struct canvas *canvas, bool rendered,
                     bool with_quantisation, unsigned threads)
{
    enum format format = image_format(path);
    double pixels = (double)canvas_pixels(canvas);
    bool small = canvas->width < TRIAL_BLOCK || canvas->height < TRIAL_BLOCK;
    struct canvas trial;
    canvas_init(&trial, TRIAL_EDGE, TRIAL_EDGE);
    if (rendered && !small)
        fill_from(canvas, &trial);
    else
        fill_with_noise(&trial);
    double start = clock_thread_cpu();
    if (with_quantisation) (void)image_quantisation(path, &trial, NULL);
    if (format == FORMAT_PNG) png_encode(&trial, NULL, no_sink, NULL);
    double shared = clock_thread_cpu() - start;
    if (format == FORMAT_HDR) hdr_encode(&trial, no_sink, NULL);
    double alone = clock_thread_cpu() - start - shared;
    canvas_free(&trial);
    return (shared / threads + alone) * pixels / ((double)TRIAL_EDGE * TRIAL_EDGE);
}

int image_try(const char *path, const struct canvas *canvas, struct thread_pool *pool)
{
    struct output output = {.path = path};
    encode(image_format(path), canvas, pool, &output);
    return output_close(&output);
}

bool image_write_for(const char *key, const char *path, const struct canvas *canvas,
                     struct thread_pool *pool)
{
    if (!image_extension_known(path)) {
        user_error(path, 0,
                   "unknown kind of picture, expected a name that ends in .png, .hdr or .pfm");
        return false;
    }
    int error = image_try(path, canvas, pool);
    return error ? output_refused(path, key, error) : true;
}

/* Bytes per second that a disk takes, or the page cache: 0.7e9 were measured. */
#define DISK_BYTES 1e9

void image_announce(const char *path, const struct canvas *canvas, unsigned threads, double seconds)
{
    double bytes =
        3.0 * sizeof(float) * (double)canvas_pixels(canvas); /* as a PFM, others are shorter */
    double disk = image_format(path) == FORMAT_PFM ? bytes / DISK_BYTES : 0;
    double expected = disk + image_seconds(path, canvas, true, false, threads);
    if (expected > seconds) user_note("writing %s takes about %.0f s", path, fmax(expected, 1));
}

/* Pictures of fewer pixels are written without a trial and an announcement: nobody waits noticeably for them. 100 to
 * 160 ns per pixel were measured for a Radiance picture, 30 to 45 for a PNG. */
#define ANNOUNCE_PIXELS 4e6

bool image_write(const char *path, const struct canvas *canvas, struct thread_pool *pool)
{
    if ((double)canvas_pixels(canvas) > ANNOUNCE_PIXELS)
        image_announce(path, canvas, thread_pool_size(pool), 1);
    return image_write_for("output.image", path, canvas, pool);
}
