/* Encodes Radiance files (RGBE), which go to a sink. */
#ifndef FARM_MASTER_HDR_H
#define FARM_MASTER_HDR_H

#include "master/byte_sink.h"
#include "master/canvas.h"

/* The largest value in a Radiance file, 255/256 * 2^127: mantissa and exponent byte are both 255. */
#define HDR_LARGEST 0x1.fep126f

/* The values, 3 in back, that a reader gets back from the four bytes of these three in rgb. */
void hdr_read_back(const float *rgb, float *back);

/* Passes the file to sink(context, ...), part by part. What the format cannot hold is clamped. */
void hdr_encode(const struct canvas *canvas, byte_sink *sink, void *context);

#endif
