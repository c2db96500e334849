/*
 * Pictures as files, by extension in any case:
 *   .png  8 bit; values rounded to v * 255, clamped to 0..255; NaN becomes 0
 *   .hdr  Radiance RGBE, shared exponent; clamped to 0..2^127, NaN becomes 0
 *   .pfm  32-bit float, exact
 *
 * They are written as master/output_file.h has it. Messages go through common/message.h.
 */
#ifndef FARM_MASTER_IMAGE_FILE_H
#define FARM_MASTER_IMAGE_FILE_H

#include <stdbool.h>

#include "common/crew.h"
#include "master/canvas.h"

/* Whether the extension is one that image_write() knows. */
bool image_extension_known(const char *path);

/*
 * What a picture loses in a file of path's format. Of components that the format has room for (.png: 0
 * to 1) the rounding: root of the mean square, and the largest. The others are clipped: in so many pixels,
 * and the root of the mean, over all components of the picture, of the squares of what is cut off; what is
 * not finite is clipped, too, but in no mean.
 */
struct quantisation {
    double rmse, most;
    uint64_t clipped;
    double clipped_rmse;
};
struct quantisation image_quantisation(const char *path, const struct canvas *canvas,
                                       struct crew *crew);

/* So many threads are worth having for all that. */
unsigned image_threads(const struct canvas *canvas);

/*
 * Seconds to work out the bytes of the picture's file by so many threads, and its quantisation if that is told of, as
 * tried on a small one: of parts of this one if it is rendered, else on one that is about as hard to pack. What the
 * disk takes is not in it.
 */
double image_seconds(const char *path, const struct canvas *canvas, bool rendered,
                     bool with_quantisation, unsigned threads);

/* Says that the picture is being written where that is expected to take longer than so many seconds. */
void image_announce(const char *path, const struct canvas *canvas, unsigned threads,
                    double seconds);

/* false, after saying why (disk full, ...), when the picture could not be written. Where it takes longer than a
 * second, that it is being written is said first. The crew, which may be NULL, makes no difference to the file. */
bool image_write(const char *path, const struct canvas *canvas, struct crew *crew);

/* The same without a word, for a path and a size that can be written: errno of what failed, or 0. */
int image_try(const char *path, const struct canvas *canvas, struct crew *crew);

/* The same for a picture that another setting than output.image names. */
bool image_write_for(const char *key, const char *path, const struct canvas *canvas,
                     struct crew *crew);

#endif
