#include "test/fuzz/fuzz.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/message.h"
#include "master/text_file.h"

/* Longer than all warnings and the one mistake of an input; cut text is not judged. */
static char said[1 << 16];

void fuzz_broken(const char *file, int line, const char *promise)
{
    message_capture(NULL, 0);
    fprintf(stderr, "%s:%d: broken: %s\n%s", file, line, promise, said);
    abort();
}

/* ---- files ---- */

#define FILES 4

static struct {
    char path[256];
    int descriptor;
} files[FILES];

static int open_file(const char *name, char *path, size_t size)
{
    const char *folder = getenv("FUZZ_FOLDER");
    snprintf(path, size, "%s/%s", folder ? folder : ".", name);
    int descriptor = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (descriptor >= 0) return descriptor;
    perror(path);
    exit(1);
}

const char *fuzz_file(const char *name, const void *bytes, size_t size)
{
    size_t i = 0, tail = strlen(name);
    while (i + 1 < FILES && files[i].path[0] &&
           strcmp(files[i].path + strlen(files[i].path) - tail, name) != 0)
        i++;
    if (!files[i].path[0])
        files[i].descriptor = open_file(name, files[i].path, sizeof files[i].path);
    int descriptor = files[i].descriptor;
    if (pwrite(descriptor, bytes, size, 0) == (ssize_t)size &&
        ftruncate(descriptor, (off_t)size) == 0)
        return files[i].path;
    perror(name);
    exit(1);
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
        .samples = 1};
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

/* Two bytes of offset, one of length, eight of value. */
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
