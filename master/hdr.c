#include "master/hdr.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"

/* With these, the encoder ends the job with a message when it runs out of memory, instead of crashing. */
#define STBIW_MALLOC(bytes)       allocate((size_t)(bytes), 1)
#define STBIW_REALLOC(old, bytes) reallocate(old, (size_t)(bytes), 1)
#define STBIW_FREE(block)         free(block)
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpragmas"
#pragma GCC diagnostic ignored "-Wunknown-warning-option"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wimplicit-int-conversion"
#pragma GCC diagnostic ignored "-Wdouble-promotion"
#pragma GCC diagnostic ignored "-Wcast-qual"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wundef"
#pragma GCC diagnostic ignored "-Wstrict-prototypes"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

/* Clamps a value to what a shared exponent of 8 bits can hold: for others the encoder has undefined behaviour. */
static float hdr_value(float value)
{
    if (!(value > 0)) return 0;
    return value < HDR_LARGEST ? value : HDR_LARGEST;
}

/* Rounds to the nearest that three 8-bit mantissas with a shared exponent can represent. The encoder itself
 * truncates, which would make pictures darker. */
static void hdr_round(const float *rgb, float rounded[3])
{
    for (int c = 0; c < 3; c++)
        rounded[c] = hdr_value(rgb[c]);
    float largest = fmaxf(rounded[0], fmaxf(rounded[1], rounded[2]));
    int exponent;
    (void)frexpf(largest, &exponent);
    if (ldexpf(largest, 8 - exponent) >= 255.5f) exponent++;
    for (int c = 0; c < 3; c++)
        rounded[c] = ldexpf(roundf(ldexpf(rounded[c], 8 - exponent)), exponent - 8);
}

void hdr_encode(const struct canvas *canvas, byte_sink *sink, void *context)
{
    size_t values = 3 * canvas_pixels(canvas);
    float *rgb = allocate(values, sizeof *rgb);
    for (size_t i = 0; i < values; i += 3)
        hdr_round(canvas->rgb + i, rgb + i);
    if (!stbi_write_hdr_to_func(sink, context, (int)canvas->width, (int)canvas->height, 3, rgb))
        fatal("cannot encode the Radiance picture");
    free(rgb);
}

void hdr_read_back(const float *rgb, float *back)
{
    float value[3];
    unsigned char bytes[4];
    hdr_round(rgb, value);
    stbiw__linear_to_rgbe(bytes, value);
    for (int c = 0; c < 3; c++)
        back[c] = ldexpf(bytes[c], bytes[3] - (128 + 8));
}
