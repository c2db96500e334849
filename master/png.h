/*
 * Encodes 8-bit PNG files, which go to a sink (W3C, "Portable Network Graphics", 2003).
 *
 * They are compressed by zlib, and not by the encoder that writes Radiance files: zlib takes half of the time
 * for files that are 12 to 34 % smaller (garden, hello, of 3840 x 2160), and bands of rows can be distributed to
 * several threads. Writing a picture of 33 million pixels took 2 s, which many processors had rendered in less.
 */
#ifndef FARM_MASTER_PNG_H
#define FARM_MASTER_PNG_H

#include "common/thread_pool.h"
#include "master/byte_sink.h"
#include "master/canvas.h"

/* The value that a reader gets back from the byte of this value. */
float png_read_back(float value);

/* Encodes a picture. The pool, which may be NULL, makes no difference to the bytes. They go to the sink when all
 * are encoded. */
void png_encode(const struct canvas *canvas, struct thread_pool *pool, byte_sink *sink,
                void *context);

#endif
