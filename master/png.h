/*
 * PNG files of 8 bits, byte by byte to a sink (W3C, "Portable Network Graphics", 2003).
 *
 * zlib compresses them, and not the encoder that writes Radiance files: it takes half of the time for files that are 12
 * to 34 % smaller (garden, hello, of 3840 x 2160), and bands of rows can be shared out to several threads. A picture of
 * 33 million pixels took 2 s to be written, which many processors had rendered in less.
 */
#ifndef FARM_MASTER_PNG_H
#define FARM_MASTER_PNG_H

#include "common/crew.h"
#include "master/byte_sink.h"
#include "master/canvas.h"

/* What a reader makes of the byte of a value. */
float png_read_back(float value);

/* The same bytes for any crew, which may be NULL. They go to the sink when all are there. */
void png_encode(const struct canvas *canvas, struct crew *crew, byte_sink *sink, void *context);

#endif
