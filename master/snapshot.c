#include "master/snapshot.h"

#include <string.h>

#include "common/message.h"
#include "master/image_file.h"

static void *write_copy(void *argument)
{
    struct snapshot *snapshot = argument;
    /* Whoever looks at it meanwhile sees the one or the other. */
    image_write(snapshot->path, &snapshot->copy);
    snapshot->is_written = true;
    return NULL;
}

static void copy_canvas(struct snapshot *snapshot, const struct canvas *canvas)
{
    struct canvas *copy = &snapshot->copy;
    if (!copy->rgb) canvas_init(copy, canvas->width, canvas->height);
    memcpy(copy->rgb, canvas->rgb, 3 * (size_t)canvas->width * canvas->height * sizeof *copy->rgb);
}

void snapshot_look(struct snapshot *snapshot, const struct canvas *canvas, double now)
{
    if (!(snapshot->seconds > 0)) return;
    if (snapshot->is_writing && snapshot->is_written) {
        pthread_join(snapshot->thread, NULL);
        snapshot->is_writing = false;
        snapshot->due = now + snapshot->seconds;
    }
    if (snapshot->is_writing || now < snapshot->due) return;
    copy_canvas(snapshot, canvas);
    snapshot->is_written = false;
    if (pthread_create(&snapshot->thread, NULL, write_copy, snapshot) != 0)
        fatal("cannot start the thread that writes the picture so far");
    snapshot->is_writing = true;
}

void snapshot_end(struct snapshot *snapshot)
{
    if (snapshot->is_writing) pthread_join(snapshot->thread, NULL);
    snapshot->is_writing = false;
    snapshot->seconds = 0;
    canvas_free(&snapshot->copy);
}
