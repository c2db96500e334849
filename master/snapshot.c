#include "master/snapshot.h"

#include <string.h>

#include "common/extremes.h"
#include "common/message.h"
#include "master/image_file.h"

/* Reports a failure once: the next one is mostly for the same reason. */
static void tell_failure(struct snapshot *snapshot, int error)
{
    if (!snapshot->told_failure)
        user_warning(
            snapshot->path, 0,
            "the picture so far cannot be written (%s): rendering goes on, and it is tried "
            "again",
            strerror(error));
    snapshot->told_failure = true;
}

static void *write_copy(void *argument)
{
    struct snapshot *snapshot = argument;
    /* The file is replaced as a whole: readers see either the old or the new picture. */
    int error = image_try(snapshot->path, &snapshot->copy, NULL);
    if (error) tell_failure(snapshot, error);
    snapshot->is_written = true;
    return NULL;
}

static void copy_canvas(struct snapshot *snapshot, const struct canvas *canvas)
{
    struct canvas *copy = &snapshot->copy;
    if (!copy->rgb) canvas_init(copy, canvas->width, canvas->height);
    memcpy(copy->rgb, canvas->rgb, 3 * canvas_pixels(canvas) * sizeof *copy->rgb);
}

void snapshot_took(struct snapshot *snapshot, double seconds)
{
    snapshot->took_s = seconds;
}

static double next_due(const struct snapshot *snapshot, double now)
{
    return now + larger_number(snapshot->seconds, snapshot->took_s / SERVING_MOST);
}

bool snapshot_is_due(const struct snapshot *snapshot, double now)
{
    return snapshot->seconds > 0 && !snapshot->is_writing && now >= snapshot->due;
}

void snapshot_look(struct snapshot *snapshot, const struct canvas *canvas, double now)
{
    if (snapshot->is_writing && snapshot->is_written) {
        pthread_join(snapshot->thread, NULL);
        snapshot->is_writing = false;
        snapshot->due = next_due(snapshot, now);
    }
    if (!snapshot_is_due(snapshot, now)) return;
    copy_canvas(snapshot, canvas);
    snapshot->is_written = false;
    int error = pthread_create(&snapshot->thread, NULL, write_copy, snapshot);
    snapshot->is_writing = error == 0;
    if (!error) return;
    tell_failure(snapshot, error);
    snapshot->due = next_due(snapshot, now);
}

void snapshot_end(struct snapshot *snapshot)
{
    if (snapshot->is_writing) pthread_join(snapshot->thread, NULL);
    snapshot->is_writing = false;
    snapshot->seconds = 0;
    canvas_free(&snapshot->copy);
}
