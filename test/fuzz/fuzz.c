#include "test/fuzz/fuzz.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/message.h"

/* Messages; usually longer than all warnings and the one error of an input. A truncated text is not judged. */
static char said[1 << 16];

void fuzz_broken(const char *file, int line, const char *promise)
{
    message_capture(NULL, 0);
    fprintf(stderr, "%s:%d: broken: %s\n%s", file, line, promise, said);
}

/* ---- files ---- */

#define FILES 4

/* Files stay open from one input to the next. */
static struct {
    const char *name;
    char path[256];
    int descriptor;
} files[FILES];

static int open_file(const char *name, char *path, size_t size)
{
    const char *folder = getenv("FUZZ_FOLDER");
    snprintf(path, size, "%s/%s", folder ? folder : ".", name);
    return open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
}

static void write_file(const char *name, int descriptor, const void *bytes, size_t size)
{
    if (descriptor >= 0 && pwrite(descriptor, bytes, size, 0) == (ssize_t)size &&
        ftruncate(descriptor, (off_t)size) == 0)
        return;
    perror(name);
    exit(1);
}

const char *fuzz_file(const char *name, const void *bytes, size_t size)
{
    size_t i = 0;
    while (files[i].name && strcmp(files[i].name, name) != 0)
        i++;
    if (!files[i].name) {
        files[i].name = name;
        files[i].descriptor = open_file(name, files[i].path, sizeof files[i].path);
    }
    write_file(name, files[i].descriptor, bytes, size);
    return files[i].path;
}

const char *fuzz_new_file(const char *name, const void *bytes, size_t size)
{
    static char path[256];
    int descriptor = open_file(name, path, sizeof path);
    write_file(name, descriptor, bytes, size);
    close(descriptor);
    return path;
}

/* ---- messages ---- */

void fuzz_listen(void)
{
    message_capture(said, sizeof said);
}

const char *fuzz_said(void)
{
    return said;
}

/* "file: warning: ..." or "file:line: warning: ..." */
static bool is_warning(const char *line)
{
    const char *text = strstr(line, ": ");
    return text && strncmp(text, ": warning: ", 11) == 0;
}

void fuzz_judge(bool good)
{
    size_t mistakes = 0;
    message_capture(NULL, 0);
    if (strlen(said) + 1 == sizeof said) return;
    for (const char *line = said; *line; line = strchr(line, '\n') + 1)
        mistakes += !is_warning(line);
    PROMISE(mistakes == (good ? 0 : 1));
}

/* ---- loading ---- */

void fuzz_loading_start(struct fuzz_loading *loading, const char *path, size_t size)
{
    static const struct placement askew = {
        .rotation = {{0, -0.6, 0.8}, {1, 0, 0}, {0, 0.8, 0.6}}, .scale = 3, .translate = {5, 6, 7}};
    *loading = (struct fuzz_loading){0};
    settings_init(&loading->settings);
    loading->loader.builder = builder_create();
    loading->loader.settings = &loading->settings;
    loading->part = (struct part){.loader = &loading->loader,
                                  .path = path,
                                  .real_path = copy_text(path),
                                  .root = root_of(path),
                                  .placement = size % 2 ? askew : placement_identity};
    fuzz_listen();
}

static struct view some_view(void)
{
    return (struct view){
        .camera = {.eye = {0, 0, 9}, .forward = {0, 0, -1}, .right = {1, 0, 0}, .down = {0, -1, 0}},
        .background_up = {0, 1, 0},
        .width = 8,
        .height = 6,
        .region_w = 8,
        .region_h = 6,
        .max_depth = 5,
        .shadows = 1,
        .min_samples = 1,
        .max_samples = 1};
}

struct scene *fuzz_finish(struct builder *builder)
{
    struct view view = some_view();
    struct scene *scene = builder_finish(builder, &view);
    const char *why = "";
    bool valid = scene_valid(scene, scene->bytes, &why);
    if (!valid) fprintf(stderr, "%s\n", why);
    PROMISE(valid);
    return scene;
}

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
    /* Only a value of an argument may be impossible to write. */
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

void fuzz_job(const char *path, const uint8_t *data, size_t size)
{
    char *override = override_of(data, size);
    struct job job;
    fuzz_listen();
    bool good = load_job(path, &override, override ? 1 : 0, REACH_FOLDER, &job);
    if (good) check_printed(&job);
    /* A message quotes the argument, which may contain what looks like another message. */
    if (override)
        message_capture(NULL, 0);
    else
        fuzz_judge(good);
    if (good) job_free(&job);
    free(override);
}

void fuzz_loading_end(struct fuzz_loading *loading, bool good)
{
    fuzz_judge(good);
    if (good) free(fuzz_finish(loading->loader.builder));
    builder_destroy(loading->loader.builder);
    part_free(&loading->part);
    loader_free(&loading->loader);
    settings_free(&loading->settings);
}

/* ---- damage ---- */

/* Bytes of a triple: two of offset, one of length, eight of value. */
#define TRIPLE 11

size_t fuzz_damage(const uint8_t *data, size_t size, void *bytes, size_t count)
{
    size_t kept = count;
    for (; size >= TRIPLE; data += TRIPLE, size -= TRIPLE) {
        size_t offset = (data[0] | (size_t)data[1] << 8) % count;
        size_t length = data[2] % 10;
        if (length == 9) kept = offset;
        if (length > 8) continue;
        if (length > count - offset) length = count - offset;
        memcpy((char *)bytes + offset, data + 3, length);
    }
    return kept;
}
