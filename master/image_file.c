#include "master/image_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/clock.h"
#include "common/hash.h"
#include "common/message.h"
#include "master/output_file.h"
#include "master/path.h"
#include "master/png_hdr.h"

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

/* Rows from the bottom; a negative scale says that the floats are little-endian. */
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

/* A format whose bytes have to be worked out. */
static void pack(enum format format, const struct canvas *canvas, byte_sink *sink, void *context)
{
    if (format == FORMAT_PNG)
        png_encode(canvas, sink, context);
    else
        hdr_encode(canvas, sink, context);
}

static void encode(enum format format, const struct canvas *canvas, struct output *output)
{
    if (format == FORMAT_PFM)
        pfm_encode(canvas, output);
    else
        pack(format, canvas, output_sink, output);
}

/* What a reader of the file has for a pixel. */
static void read_back(enum format format, const float *rgb, float *back)
{
    if (format == FORMAT_HDR) {
        hdr_read_back(rgb, back);
        return;
    }
    for (int c = 0; c < 3; c++)
        back[c] = format == FORMAT_PNG ? png_read_back(rgb[c]) : rgb[c];
}

/* Whether the format has room for the value. */
static bool has_room(enum format format, float value)
{
    if (format == FORMAT_PFM) return true;
    return value >= 0 && value <= (format == FORMAT_PNG ? 1 : HDR_LARGEST);
}

struct quantisation image_quantisation(const char *path, const struct canvas *canvas)
{
    enum format format = image_format(path);
    struct quantisation result = {0};
    double squares = 0, cut = 0;
    uint64_t rounded = 0, pixels = (uint64_t)canvas->width * canvas->height;
    for (uint64_t i = 0; i < pixels; i++) {
        const float *rgb = canvas->rgb + 3 * i;
        float back[3];
        bool clipped = false;
        read_back(format, rgb, back);
        for (int c = 0; c < 3; c++) {
            double miss = fabs((double)rgb[c] - (double)back[c]);
            bool room = has_room(format, rgb[c]);
            clipped |= !room;
            if (!(miss < HUGE_VAL)) continue;
            *(room ? &squares : &cut) += miss * miss;
            rounded += room;
            if (room && miss > result.most) result.most = miss;
        }
        result.clipped += clipped;
    }
    if (rounded > 0) result.rmse = sqrt(squares / (double)rounded);
    result.clipped_rmse = sqrt(cut / (3 * (double)pixels));
    return result;
}

/* The edge of the picture that tells how long another one takes, which are some ms, and of the blocks of that one
 * that it is made of: a row of a block is long enough to be packed as it is there. */
#define TRIAL_EDGE  192u
#define TRIAL_BLOCK 32u

/* Where nothing else is there it is a slope with noise of a fifth of 1/255: what that foretells is 1.2 (lantern,
 * also of 1920 x 1440) to 1.5 times what a PNG took (hello, of 3840 x 2880), and half of it for the garden, which
 * is hard to pack. */
#define TRIAL_NOISE (0.2f / 255)

static void fill_with_noise(struct canvas *trial)
{
    const uint32_t values = 3 * TRIAL_EDGE * TRIAL_EDGE;
    for (uint32_t i = 0; i < values; i++) {
        float noise = (float)(hash64(&i, sizeof i, 0) >> 40) * 0x1p-24f;
        trial->rgb[i] = 0.5f * (float)i / (float)values + TRIAL_NOISE * noise;
    }
}

/* With blocks that are spread over the picture. */
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

double image_seconds(const char *path, const struct canvas *canvas, bool rendered,
                     bool with_quantisation)
{
    enum format format = image_format(path);
    double pixels = (double)canvas->width * canvas->height;
    bool small = canvas->width < TRIAL_BLOCK || canvas->height < TRIAL_BLOCK;
    struct canvas trial;
    canvas_init(&trial, TRIAL_EDGE, TRIAL_EDGE);
    if (rendered && !small)
        fill_from(canvas, &trial);
    else
        fill_with_noise(&trial);
    double start = clock_thread_cpu();
    if (with_quantisation) (void)image_quantisation(path, &trial);
    if (format != FORMAT_PFM) pack(format, &trial, no_sink, NULL);
    double seconds = clock_thread_cpu() - start;
    canvas_free(&trial);
    return seconds * pixels / ((double)TRIAL_EDGE * TRIAL_EDGE);
}

int image_try(const char *path, const struct canvas *canvas)
{
    struct output output = {.path = path};
    encode(image_format(path), canvas, &output);
    return output_close(&output);
}

bool image_write_for(const char *key, const char *path, const struct canvas *canvas)
{
    if (!image_extension_known(path)) {
        user_error(path, 0,
                   "unknown kind of picture, expected a name that ends in .png, .hdr or .pfm");
        return false;
    }
    int error = image_try(path, canvas);
    return error ? output_refused(path, key, error) : true;
}

/* Bytes that a disk takes in a second, or memory that is written to it later: 0.7e9 were measured. */
#define DISK_BYTES 1e9

void image_announce(const char *path, const struct canvas *canvas, double seconds)
{
    double bytes =
        3.0 * sizeof(float) * canvas->width * canvas->height; /* as a PFM, others are shorter */
    double disk = image_format(path) == FORMAT_PFM ? bytes / DISK_BYTES : 0;
    double expected = disk + image_seconds(path, canvas, true, false);
    if (expected > seconds) user_note("writing %s takes about %.0f s", path, fmax(expected, 1));
}

/* Of a picture of fewer pixels nobody waits for a file, nor is to wait for a trial of one: 100 to 140 ns a pixel were
 * measured. */
#define ANNOUNCE_PIXELS 4e6

bool image_write(const char *path, const struct canvas *canvas)
{
    if ((double)canvas->width * canvas->height > ANNOUNCE_PIXELS) image_announce(path, canvas, 1);
    return image_write_for("output.image", path, canvas);
}
