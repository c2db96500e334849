#include "master/image_file.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

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

/*
 * The encoders count in int. PNG: its buffers double, the last size below 2^31 is 1.5 * 2^30, and a
 * byte of a row becomes at most 9 bits: rows of 2^30 bytes are well inside.
 */
bool image_size_writable(const char *path, uint32_t width, uint32_t height)
{
    enum format format = image_format(path);
    uint64_t row = 3 * (uint64_t)width, limit;
    if (format == FORMAT_PNG) {
        row++; /* each row begins with the kind of its filter */
        limit = UINT64_C(1) << 30;
    } else if (format == FORMAT_HDR) {
        limit = INT_MAX;
    } else {
        return true;
    }
    if (height == 0 || row <= limit / height) return true;
    user_error(path, 0,
               "%u x %u pixels are too many for a %s file, expected a name that ends in .pfm",
               width, height, format == FORMAT_PNG ? ".png" : ".hdr");
    return false;
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

static void encode(enum format format, const struct canvas *canvas, struct output *output)
{
    if (format == FORMAT_PNG)
        png_encode(canvas, output_sink, output);
    else if (format == FORMAT_HDR)
        hdr_encode(canvas, output_sink, output);
    else
        pfm_encode(canvas, output);
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
    return value >= 0 && value <= (format == FORMAT_PNG ? 1 : 0x1.fep126f);
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
    if (!image_size_writable(path, canvas->width, canvas->height)) return false;
    int error = image_try(path, canvas);
    return error ? output_refused(path, key, error) : true;
}

bool image_write(const char *path, const struct canvas *canvas)
{
    return image_write_for("output.image", path, canvas);
}
