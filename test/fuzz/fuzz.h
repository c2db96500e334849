/*
 * Shared by the fuzz targets. Each fuzz_<name>.c is one libFuzzer program: its LLVMFuzzerTestOneInput() passes
 * arbitrary bytes to one parser or validator, and aborts if this breaks a promise of its header. The sanitizers find
 * other errors.
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

/* Aborts if a promise is broken, so that libFuzzer keeps the input. */
#define PROMISE(condition)                                                                         \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            fuzz_broken(__FILE__, __LINE__, #condition);                                           \
            abort();                                                                               \
        }                                                                                          \
    } while (0)
void fuzz_broken(const char *file, int line, const char *promise);

/*
 * Writes a file that is rewritten for every input, and returns its path. It is in the folder named by FUZZ_FOLDER, best
 * one in memory, or else in the current folder.
 */
const char *fuzz_file(const char *name, const void *bytes, size_t size);

/* The same for a file that the program may rename or remove: it is opened anew each time. */
const char *fuzz_new_file(const char *name, const void *bytes, size_t size);

/* From here on, messages to the user are captured. */
void fuzz_listen(void);

/* Promises that a good input was loaded without an error and a bad one with exactly one, of one line. Any number of
 * warnings is allowed. Ends the capture. */
void fuzz_judge(bool good);

/* The captured errors and warnings. */
const char *fuzz_said(void);

/* The structures that the loader of a scene file needs. */
struct fuzz_loading {
    struct settings settings;
    struct loader loader;
    struct part part;
};

/* Prepares to load the file at path. Inputs of odd size get a placement with rotation, scale and translation, others
 * get none, so that both are tried. */
void fuzz_loading_start(struct fuzz_loading *loading, const char *path, size_t size);

/* Frees it, after fuzz_judge(). Promises that the scene is valid if loading succeeded (good). */
void fuzz_loading_end(struct fuzz_loading *loading, bool good);

/*
 * Loads the file at path, which holds these bytes, as CONFIG. Promises that what is accepted can be printed
 * (print_job()), and that this is read back as the same scene. A first line "#!section.key=value" is an override.
 */
void fuzz_job(const char *path, const uint8_t *data, size_t size);

/* Finishes the builder's scene for a fixed view, and promises that the block is valid. The caller frees the block. */
struct scene *fuzz_finish(struct builder *builder);

/*
 * Damages good bytes as the input says, which is any number of (offset, length, value) triples. Returns how many bytes
 * are left: a triple may also ask for the end to be cut off.
 */
size_t fuzz_damage(const uint8_t *data, size_t size, void *bytes, size_t count);

#endif
