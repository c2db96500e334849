/* PNG and Radiance files, byte by byte to a sink. */
#ifndef FARM_MASTER_PNG_HDR_H
#define FARM_MASTER_PNG_HDR_H

#include "master/canvas.h"

/* The largest value in a Radiance file, 255/256 * 2^127: mantissa and exponent byte are both 255. */
#define HDR_LARGEST 0x1.fep126f

/* Takes the next bytes of the file; remembers its own errors. */
typedef void byte_sink(void *context, void *data, int bytes);

/* What a reader makes of the bytes of a value; of the four bytes of three. */
float png_read_back(float value);
void hdr_read_back(const float *rgb, float *back);

void png_encode(const struct canvas *canvas, byte_sink *sink, void *context);
void hdr_encode(const struct canvas *canvas, byte_sink *sink, void *context);

#endif
