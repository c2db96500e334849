/* Fuzzes OBJ files, as a part with every kind of smoothing and as CONFIG: an accepted one must make a valid scene. */
#include "test/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const double creases[] = {CREASE_OF_FILE, 0, 60, 180};
    struct fuzz_loading loading;
    const char *path = fuzz_file("fuzz.obj", data, size);
    if (size % 5 == 4) {
        fuzz_job(path, data, size);
        return 0;
    }
    fuzz_loading_start(&loading, path, size);
    struct mesh mesh = {.path = loading.part.path,
                        .root = loading.part.root,
                        .placement = loading.part.placement,
                        .material = default_material(&loading.loader),
                        .crease = creases[size / 2 % 4]};
    fuzz_loading_end(&loading, load_obj(&loading.part, &mesh));
    return 0;
}
