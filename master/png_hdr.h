/* PNG and Radiance files, byte by byte to a sink. */
#ifndef FARM_MASTER_PNG_HDR_H
#define FARM_MASTER_PNG_HDR_H

#include "master/canvas.h"

/* Takes the next bytes of the file; remembers its own errors. */
typedef void byte_sink(void *context, void *data, int bytes);

/* The largest sizes are image_size_writable()'s. */
void png_encode(const struct canvas *canvas, byte_sink *sink, void *context);
void hdr_encode(const struct canvas *canvas, byte_sink *sink, void *context);

#endif
