/*
 * INI files and overrides, with all that they include: what is accepted can be printed, and what is
 * printed is read back as the same scene. A first line "#!section.key=value" is also an override.
 */
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "test/fuzz/fuzz.h"

static char *override_of(const uint8_t *data, size_t size)
{
    if (size < 2 || memcmp(data, "#!", 2) != 0) return NULL;
    const uint8_t *end = memchr(data, '\n', size);
    size_t length = end ? (size_t)(end - data) - 2 : size - 2;
    char *text = allocate(length + 1, 1);
    memcpy(text, data + 2, length);
    text[length] = '\0';
    return text;
}

static struct scene *block_of(struct job *job)
{
    struct view view = settings_view(&job->settings);
    return builder_finish(job->builder, &view);
}

static void check_printed(struct job *job)
{
    char *text = print_job(job);
    /* Only what an argument holds cannot be written. */
    if (!text) return;
    struct job again;
    const char *path = fuzz_file("printed.ini", text, strlen(text));
    bool good = load_job(path, NULL, 0, REACH_ANYWHERE, &again);
    PROMISE(good);
    struct scene *first = block_of(job), *second = block_of(&again);
    PROMISE(first->bytes == second->bytes && memcmp(first, second, first->bytes) == 0);
    free(first);
    free(second);
    free(text);
    job_free(&again);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *path = fuzz_file("fuzz.ini", data, size);
    char *override = override_of(data, size);
    struct job job;
    fuzz_listen();
    bool good = load_job(path, &override, override ? 1 : 0, REACH_FOLDER, &job);
    if (good) check_printed(&job);
    /* What a message says of an argument may look like anything. */
    if (override)
        message_capture(NULL, 0);
    else
        fuzz_judge(good);
    if (good) job_free(&job);
    free(override);
    return 0;
}
