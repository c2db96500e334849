/* NFF files: what is accepted makes a valid scene. */
#include "test/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_loading loading;
    fuzz_loading_start(&loading, fuzz_file("fuzz.nff", data, size), size);
    fuzz_loading_end(&loading, load_nff(&loading.part));
    return 0;
}
