/* Fuzzes INI files, which may include others, and overrides: see fuzz_job(). */
#include "test/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_job(fuzz_file("fuzz.ini", data, size), data, size);
    return 0;
}
