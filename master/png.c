#include "master/png.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <zlib.h>

#include "common/message.h"
#include "common/whole.h"

static unsigned char png_value(float value)
{
    double scaled = (double)value * 255 + 0.5; /* floor of this is the nearest integer */
    if (!(scaled >= 1)) return 0;              /* NaN too */
    return scaled >= 255 ? 255 : (unsigned char)scaled;
}

float png_read_back(float value)
{
    return (float)png_value(value) / 255;
}

/* ---- bands ---- */

/* Bytes of a band, which is compressed independently, in 1 to 3 ms; this makes files 0.03 to 0.3 % larger
 * (garden, hello). */
#define BAND_BYTES (1u << 19)

/* The filter used for all rows: of the five, it compresses nearly all rows of rendered pictures best. Trying all
 * for each row gained 0 to 2 % (garden, lantern). */
#define FILTER_PAETH 4

struct band {
    unsigned char *bytes; /* compressed; owned */
    size_t size;
    size_t filtered; /* bytes before compression */
    uLong adler;     /* Adler-32 checksum of these */
};

struct encoder {
    const struct canvas *canvas;
    uint32_t rows; /* of a band; the last one may have fewer */
    uint32_t count;
    struct band *bands;
};

static size_t row_bytes(const struct canvas *canvas)
{
    return 3 * (size_t)canvas->width;
}

/* A row is preceded by three bytes of 0, which stand for the pixel to the left of the first one. */
#define LEFT 3

static void fill_row(const struct canvas *canvas, uint32_t y, unsigned char *row)
{
    const float *rgb = canvas->rgb + y * row_bytes(canvas);
    for (size_t i = 0; i < row_bytes(canvas); i++)
        row[LEFT + i] = png_value(rgb[i]);
}

/* The Paeth predictor: of left, above and above left (corner), the one that is nearest to left + above - corner. */
static inline int paeth(int left, int above, int corner)
{
    int by_left = abs(above - corner), by_above = abs(left - corner);
    int by_corner = abs(left + above - 2 * corner);
    if (by_left <= by_above && by_left <= by_corner) return left;
    return by_above <= by_corner ? above : corner;
}

static void filter_row(const unsigned char *row, const unsigned char *above, size_t bytes,
                       unsigned char *filtered)
{
    filtered[0] = FILTER_PAETH;
    for (size_t i = 0; i < bytes; i++)
        filtered[1 + i] = (unsigned char)(row[LEFT + i] - paeth(row[i], above[LEFT + i], above[i]));
}

/* The filtered rows from y on; owned by the caller. */
static unsigned char *filter_rows(const struct canvas *canvas, uint32_t y, uint32_t rows)
{
    size_t bytes = row_bytes(canvas);
    unsigned char *filtered = allocate(rows, 1 + bytes);
    unsigned char *lines[2] = {allocate_zeroed(LEFT + bytes, 1), allocate_zeroed(LEFT + bytes, 1)};
    if (y > 0) fill_row(canvas, y - 1, lines[1]);
    for (uint32_t i = 0; i < rows; i++) {
        unsigned char *row = lines[i % 2], *above = lines[(i + 1) % 2];
        fill_row(canvas, y + i, row);
        filter_row(row, above, bytes, filtered + i * (1 + bytes));
    }
    free(lines[0]);
    free(lines[1]);
    return filtered;
}

/* Arguments of deflateInit2(): no zlib header, as the picture has only one, and the largest window. */
#define RAW_WINDOW (-15)
#define MEMORY     8

/* Bytes that Z_SYNC_FLUSH may need beyond deflateBound(). */
#define FLUSH_ROOM 16

/* Compresses a band. Only runs of one byte are searched for, of which filtered rows are full: with all matches
 * it takes up to five times as long, for files of the same size. The last band ends the stream, the others end
 * at a byte boundary. */
static void compress_band(struct band *band, unsigned char *filtered, bool last)
{
    z_stream stream = {0};
    if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, RAW_WINDOW, MEMORY, Z_RLE) != Z_OK)
        fatal("out of memory: there is no room to compress a picture");
    size_t room = deflateBound(&stream, band->filtered) + FLUSH_ROOM;
    band->bytes = allocate(room, 1);
    stream.next_in = filtered;
    stream.avail_in = (uInt)band->filtered;
    stream.next_out = band->bytes;
    stream.avail_out = (uInt)room;
    int end = deflate(&stream, last ? Z_FINISH : Z_SYNC_FLUSH);
    if (end != (last ? Z_STREAM_END : Z_OK) || stream.avail_in > 0 || stream.avail_out == 0)
        fatal("cannot encode the PNG picture");
    band->size = room - stream.avail_out;
    (void)deflateEnd(&stream);
}

static void encode_band(void *context, uint32_t iteration)
{
    const struct encoder *encoder = context;
    struct band *band = &encoder->bands[iteration];
    uint32_t y = iteration * encoder->rows, left = encoder->canvas->height - y;
    uint32_t rows = left < encoder->rows ? left : encoder->rows;
    unsigned char *filtered = filter_rows(encoder->canvas, y, rows);
    band->filtered = rows * (1 + row_bytes(encoder->canvas));
    band->adler = adler32_z(1, filtered, band->filtered);
    compress_band(band, filtered, iteration + 1 == encoder->count);
    free(filtered);
}

/* ---- the file ---- */

static void put_number(unsigned char bytes[4], uLong number)
{
    for (int i = 0; i < 4; i++)
        bytes[i] = (unsigned char)(number >> (24 - 8 * i) & 255);
}

static void put_chunk(byte_sink *sink, void *context, const char type[4], unsigned char *data,
                      size_t size)
{
    unsigned char begin[8], end[4];
    put_number(begin, size);
    for (int i = 0; i < 4; i++)
        begin[4 + i] = (unsigned char)type[i];
    uLong crc = crc32(0, begin + 4, 4);
    if (size > 0) crc = crc32_z(crc, data, size);
    put_number(end, crc);
    sink(context, begin, sizeof begin);
    if (size > 0) sink(context, data, (int)size);
    sink(context, end, sizeof end);
}

/* 8 bits, red, green and blue; deflated, filtered, not interlaced. */
static void put_header(byte_sink *sink, void *context, const struct canvas *canvas)
{
    unsigned char signature[] = {137, 'P', 'N', 'G', 13, 10, 26, 10};
    unsigned char header[13] = {[8] = 8, [9] = 2};
    put_number(header, canvas->width);
    put_number(header + 4, canvas->height);
    sink(context, signature, sizeof signature);
    put_chunk(sink, context, "IHDR", header, sizeof header);
}

/* One zlib stream (RFC 1950); each band is a chunk. */
static void put_bands(byte_sink *sink, void *context, const struct encoder *encoder)
{
    unsigned char begin[2] = {0x78, 0x01}, end[4];
    uLong adler = 1;
    put_chunk(sink, context, "IDAT", begin, sizeof begin);
    for (uint32_t i = 0; i < encoder->count; i++) {
        struct band *band = &encoder->bands[i];
        put_chunk(sink, context, "IDAT", band->bytes, band->size);
        adler = adler32_combine(adler, band->adler, (z_off_t)band->filtered);
        free(band->bytes);
    }
    put_number(end, adler);
    put_chunk(sink, context, "IDAT", end, sizeof end);
}

void png_encode(const struct canvas *canvas, struct thread_pool *pool, byte_sink *sink,
                void *context)
{
    struct encoder encoder = {.canvas = canvas};
    encoder.rows = (uint32_t)(BAND_BYTES / (1 + row_bytes(canvas))) + 1;
    encoder.count = divide_up(canvas->height, encoder.rows);
    encoder.bands = allocate(encoder.count, sizeof *encoder.bands);
    thread_pool_for(pool, encoder.count, encode_band, &encoder);
    put_header(sink, context, canvas);
    put_bands(sink, context, &encoder);
    put_chunk(sink, context, "IEND", NULL, 0);
    free(encoder.bands);
}
