/* Fuzzes MTL files: an accepted material must be one that a scene can hold. */
#include "master/load_mtl.h"
#include "test/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const names[] = {"a", "red", ""};
    const char *path = fuzz_file("fuzz.mtl", data, size);
    struct material_library *library = material_library_create();
    struct builder *builder = builder_create();
    fuzz_listen();
    bool good = material_library_read(library, path);
    fuzz_judge(good);
    for (size_t i = 0; good && i < sizeof names / sizeof *names; i++) {
        uint32_t index;
        const struct material *material = material_library_find(library, names[i]);
        if (material) PROMISE(builder_add_material(builder, material, &index) == NULL);
    }
    builder_destroy(builder);
    material_library_destroy(library);
    return 0;
}
