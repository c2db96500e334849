/* Fuzzes NFF files, as a part of a scene and as CONFIG: an accepted one must make a valid scene. */
#include "test/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_loading loading;
    const char *path = fuzz_file("fuzz.nff", data, size);
    if (size % 4 == 3) {
        fuzz_job(path, data, size);
        return 0;
    }
    fuzz_loading_start(&loading, path, size);
    fuzz_loading_end(&loading, load_nff(&loading.part));
    return 0;
}
