/* Fuzzes reference pictures: an accepted one must be a PFM of the right size, all of whose floats are taken over. */
#include <math.h>
#include <string.h>

#include "master/truth.h"
#include "test/fuzz/fuzz.h"

#define WIDTH  3u
#define HEIGHT 2u
#define VALUES ((size_t)WIDTH * HEIGHT * 3)

static bool same_float(const uint8_t *bytes, float value, bool swapped)
{
    uint32_t there, here;
    memcpy(&there, bytes, sizeof there);
    memcpy(&here, &value, sizeof here);
    return (swapped ? __builtin_bswap32(there) : there) == here;
}

/* The file's rows come from the bottom. */
static bool same_picture(const uint8_t *floats, const struct canvas *canvas, bool swapped)
{
    const size_t row = (size_t)WIDTH * 3;
    for (size_t i = 0; i < VALUES; i++) {
        size_t at = (HEIGHT - 1 - i / row) * row + i % row;
        if (!same_float(floats + 4 * at, canvas->rgb[i], swapped)) return false;
    }
    return true;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *path = fuzz_file("fuzz.pfm", data, size);
    struct canvas canvas;
    fuzz_listen();
    bool good = truth_read(path, WIDTH, HEIGHT, &canvas);
    fuzz_judge(good);
    if (!good) return 0;
    PROMISE(size > 4 * VALUES && memcmp(data, "PF", 2) == 0);
    const uint8_t *floats = data + size - 4 * VALUES;
    PROMISE(same_picture(floats, &canvas, false) || same_picture(floats, &canvas, true));
    for (size_t i = 0; i < VALUES; i++)
        PROMISE(isfinite(canvas.rgb[i]));
    canvas_free(&canvas);
    return 0;
}
