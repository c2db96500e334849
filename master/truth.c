#include "master/truth.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/path.h"

/* ---- reading ---- */

/* Reads a word of the header and the one white space character that ends it. */
static bool read_word(FILE *file, char *word, size_t size)
{
    size_t length = 0;
    for (int c; (c = getc(file)) != EOF;) {
        if (c == ' ' || c == '\n' || c == '\t' || c == '\r') {
            word[length] = '\0';
            return length > 0;
        }
        if (length + 1 == size) return false;
        word[length++] = (char)c;
    }
    return false;
}

/* The words of a header, and the byte order that its scale gives. */
struct header {
    char width[32], height[32];
    bool swapped; /* the byte order is not that of this machine */
};

static bool read_header(FILE *file, struct header *header)
{
    char kind[4], scale_word[32], *end;
    if (!read_word(file, kind, sizeof kind) || strcmp(kind, "PF") != 0 ||
        !read_word(file, header->width, sizeof header->width) ||
        !read_word(file, header->height, sizeof header->height) ||
        !read_word(file, scale_word, sizeof scale_word))
        return false;
    double scale = strtod(scale_word, &end);
    if (*end || !(scale != 0) || !isfinite(scale)) return false;
    header->swapped = (scale < 0) != (__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
    return true;
}

static bool has_size(const struct header *header, uint32_t width, uint32_t height)
{
    char size[2][32];
    snprintf(size[0], sizeof size[0], "%u", width);
    snprintf(size[1], sizeof size[1], "%u", height);
    return !strcmp(header->width, size[0]) && !strcmp(header->height, size[1]);
}

static void swap_bytes(float *values, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        bits = __builtin_bswap32(bits);
        memcpy(&values[i], &bits, sizeof bits);
    }
}

/* Returns NULL, or what is wrong. */
static const char *read_rows(FILE *file, struct canvas *canvas, bool swapped)
{
    size_t row = (size_t)canvas->width * 3;
    for (uint32_t y = canvas->height; y-- > 0;) {
        float *values = canvas->rgb + y * row;
        if (fread(values, sizeof *values, row, file) != row) return "is cut";
        if (swapped) swap_bytes(values, row);
        for (size_t i = 0; i < row; i++)
            if (!isfinite(values[i])) return "has a pixel that is not finite";
    }
    return getc(file) == EOF ? NULL : "goes on behind its pixels";
}

/* Returns NULL, or what is wrong with the file, to be freed. */
static char *read_reference(FILE *file, struct canvas *canvas)
{
    struct header header;
    if (!read_header(file, &header)) return format_text("is no colour PFM");
    if (!has_size(&header, canvas->width, canvas->height)) {
        char *size = format_text("%s x %s", header.width, header.height);
        char *shown = printable_text(size), *wrong = format_text("has %s pixels", shown);
        free(shown);
        free(size);
        return wrong;
    }
    const char *wrong = read_rows(file, canvas, header.swapped);
    return wrong ? copy_text(wrong) : NULL;
}

bool truth_read(const char *path, uint32_t width, uint32_t height, struct canvas *canvas)
{
    if (path_is_device(path)) { /* a pipe's writer may never come */
        user_error(path, 0, "is not a regular file, expected one");
        return false;
    }
    if (path_is_folder(path)) {
        user_error(path, 0, "is a folder, expected a colour PFM");
        return false;
    }
    FILE *file = fopen(path, "rb");
    if (!file) {
        user_error(path, 0, "cannot be opened: %s", strerror(errno));
        return false;
    }
    canvas_init(canvas, width, height);
    char *wrong = read_reference(file, canvas);
    fclose(file);
    if (!wrong) return true;
    canvas_free(canvas);
    user_error(path, 0, "%s, expected a colour PFM of %u x %u pixels, all finite", wrong, width,
               height);
    free(wrong);
    return false;
}

/* ---- comparing ---- */

static double difference(const struct canvas *canvas, const struct canvas *reference, size_t i)
{
    return fabs((double)canvas->rgb[i] - (double)reference->rgb[i]);
}

double truth_rmse(const struct canvas *canvas, const struct canvas *reference)
{
    double sum = 0;
    size_t count = 3 * canvas_pixels(canvas);
    for (size_t i = 0; i < count; i++) {
        double miss = difference(canvas, reference, i);
        sum += miss * miss;
    }
    return sqrt(sum / (double)count);
}

static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* Finds, in a histogram of 16-bit halves of values, the half of the k-th smallest value. *k becomes that value's rank
 * among those with the same half. */
#define HALVES 65536u

static uint32_t find_half(const size_t counts[HALVES], size_t *k)
{
    uint32_t half = 0;
    while (*k >= counts[half])
        *k -= counts[half++];
    return half;
}

/* The k-th smallest, from 0 on, of nonnegative values, whose bits have the same order as the values. This is a radix
 * selection by half of the bits at a time, in a fraction of the time of sorting, which counts as a time limit has to
 * leave room for it. */
static float kth_smallest(const float *values, size_t count, size_t k)
{
    size_t *counts = allocate_zeroed(HALVES, sizeof *counts);
    for (size_t i = 0; i < count; i++)
        counts[bits_of(values[i]) / HALVES]++;
    uint32_t high = find_half(counts, &k);
    memset(counts, 0, HALVES * sizeof *counts);
    for (size_t i = 0; i < count; i++)
        if (bits_of(values[i]) / HALVES == high) counts[bits_of(values[i]) % HALVES]++;
    uint32_t bits = high * HALVES + find_half(counts, &k);
    free(counts);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

struct truth truth_of(const struct canvas *canvas, const struct canvas *reference)
{
    size_t pixels = canvas_pixels(canvas);
    float *largest = allocate(pixels, sizeof *largest), most = 0;
    for (size_t i = 0; i < pixels; i++) {
        double worst = 0;
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            double miss = difference(canvas, reference, c);
            worst = fmax(worst, isnan(miss) ? HUGE_VAL : miss); /* fmax() would ignore a NaN */
        }
        largest[i] = (float)worst;
        most = fmaxf(most, largest[i]);
    }
    size_t k = (size_t)(0.999 * (double)(pixels - 1));
    struct truth truth = {.rmse = truth_rmse(canvas, reference),
                          .most = (double)most,
                          .p999 = (double)kth_smallest(largest, pixels, k)};
    free(largest);
    return truth;
}
