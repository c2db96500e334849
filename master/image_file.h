/*
 * Writes pictures to files; the extension, in upper or lower case, selects the format:
 *   .png  8 bit; values rounded to v * 255, clamped to 0..255; NaN becomes 0
 *   .hdr  Radiance RGBE, shared exponent; clamped to 0..2^127, NaN becomes 0
 *   .pfm  32-bit float, exact
 *
 * Files are written by master/output_file.h. Messages go through common/message.h.
 */
#ifndef FARM_MASTER_IMAGE_FILE_H
#define FARM_MASTER_IMAGE_FILE_H

#include <stdbool.h>

#include "common/thread_pool.h"
#include "master/canvas.h"

/* Whether the extension is one that image_write() knows. */
bool image_extension_known(const char *path);

/*
 * What a picture loses in a file of path's format. rmse, most: the root mean square and the largest rounding
 * error, of the components that are within the range of the format (.png: 0 to 1). Other components are clipped:
 * `clipped` is the number of pixels with such components, clipped_rmse the root of the mean, over all components
 * of the picture, of the squares of what is cut off. Components that are not finite count as clipped, but for .pfm,
 * which holds them; they are not part of any mean.
 */
struct quantisation {
    double rmse, most;
    uint64_t clipped;
    double clipped_rmse;
};
struct quantisation image_quantisation(const char *path, const struct canvas *canvas,
                                       struct thread_pool *pool);

/* The number of threads that are worth having for encoding and quantisation. */
unsigned image_threads(const struct canvas *canvas);

/*
 * Predicted seconds for encoding the picture with this number of threads, and for its quantisation if that is
 * wanted. This is measured with a small picture: of parts of this one if it is rendered, else one that is about
 * as hard to compress. Writing to disk is not included.
 */
double image_seconds(const char *path, const struct canvas *canvas, bool rendered,
                     bool with_quantisation, unsigned threads);

/* Prints that the picture is being written, if that is expected to take longer than `seconds`. */
void image_announce(const char *path, const struct canvas *canvas, unsigned threads,
                    double seconds);

/* Writes the picture; false after reporting why (disk full, ...) that failed. If it is expected to take longer than a
 * second, first prints that the picture is being written. The pool, which may be NULL, makes no difference to the
 * file. */
bool image_write(const char *path, const struct canvas *canvas, struct thread_pool *pool);

/* The same without messages, for a path and a size that can be written: returns errno, or 0. */
int image_try(const char *path, const struct canvas *canvas, struct thread_pool *pool);

/* The same as image_write() for a picture that another setting than output.image names. */
bool image_write_for(const char *key, const char *path, const struct canvas *canvas,
                     struct thread_pool *pool);

#endif
