/*
 * What the fuzz targets have in common. Each fuzz_<name>.c is one libFuzzer program: its
 * LLVMFuzzerTestOneInput() hands arbitrary bytes to one parser or validator and aborts when a
 * promise of its header is broken; the sanitizers watch for the rest.
 */
#ifndef FARM_TEST_FUZZ_FUZZ_H
#define FARM_TEST_FUZZ_FUZZ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include "common/scene.h"
#include "master/builder.h"
#include "master/loader.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Ends the process, so that libFuzzer keeps the input, when a promise is broken. */
#define PROMISE(condition)                                                                         \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            fuzz_broken(__FILE__, __LINE__, #condition);                                           \
            abort();                                                                               \
        }                                                                                          \
    } while (0)
void fuzz_broken(const char *file, int line, const char *promise);

/*
 * A file that is rewritten for every input, in the folder that FUZZ_FOLDER names (the current one
 * otherwise), best in memory. Returns its path.
 */
const char *fuzz_file(const char *name, const void *bytes, size_t size);

/* The same for a file that the program may rename or remove: it is made anew each time. */
const char *fuzz_new_file(const char *name, const void *bytes, size_t size);

/* From here on, what the program says to its user is kept. */
void fuzz_listen(void);

/* A mistake is exactly one line; what is good is loaded without one. Warnings are free. */
void fuzz_judge(bool good);

/* What was said; warnings and mistakes. */
const char *fuzz_said(void);

/* The parts that a loader of a scene file asks for. */
struct fuzz_loading {
    struct settings settings;
    struct loader loader;
    struct part part;
};

/* Every second size of input is placed askew, so that both ways of placing are tried. */
void fuzz_loading_start(struct fuzz_loading *loading, const char *path, size_t size);

/* Frees it; when the loading was good, the scene that came out has to be a valid one. */
void fuzz_loading_end(struct fuzz_loading *loading, bool good);

/*
 * Loads the file at path, which holds these bytes, as CONFIG: what is accepted can be printed, and
 * what is printed is read back as the same scene. A first line "#!section.key=value" is an override.
 */
void fuzz_job(const char *path, const uint8_t *data, size_t size);

/* Frees the builder's contents; the block of all that it holds, for a fixed view, is valid. */
struct scene *fuzz_finish(struct builder *builder);

/*
 * Damages good bytes as the input says: any number of (offset, length, value) triples. Returns how
 * many of the bytes are left when the end is cut off, which the last triple may ask for.
 */
size_t fuzz_damage(const uint8_t *data, size_t size, void *bytes, size_t count);

#endif
