#include <stdlib.h>

#include "common/message.h"
#include "master/command_line.h"
#include "master/run.h"

static uint32_t saved_pixels(void *save, const struct tile *tile)
{
    return save_holds(save, tile);
}

/* Takes over what an earlier run has left. */
static void resume(struct run *run)
{
    const struct save_found *found = save_found(run->save);
    if (!found->pixels) return;
    queue_skip(run->queue, saved_pixels, run->save);
    struct queue_count count = queue_count(run->queue);
    run->report.resumed = (struct resumed){
        .tiles = count.finished,
        .pixels = count.pixels_finished,
        .records = found->records,
        .seconds = found->seconds * (double)count.pixels_finished / (double)found->pixels,
        .counts = found->counts,
    };
    run->report.resumed.again_s = found->seconds - run->report.resumed.seconds;
    fprintf(stderr,
            "farm: going on with %s: %u of %u tiles, %llu pixels, %.1f s of rendering saved\n",
            run->job.settings.output.journal, count.finished, count.tiles,
            (unsigned long long)count.pixels_finished, run->report.resumed.seconds);
}

uint32_t tiles_left(const struct run *run)
{
    struct queue_count count = queue_count(run->queue);
    return count.tiles - count.finished;
}

uint64_t pixels_left(const struct run *run)
{
    return (uint64_t)run->canvas.width * run->canvas.height -
           queue_count(run->queue).pixels_finished;
}

bool open_save(struct run *run, const struct scene *scene)
{
    const char *path = run->job.settings.output.journal;
    /* The journal holds finished tiles: adaptive ones are not before the last pass. */
    if (!*path || settings_adaptive(&run->job.settings)) return true;
    run->save = save_open(path, scene, &run->canvas);
    if (!run->save) return false;
    resume(run);
    if (save_has_room(run->save, tiles_left(run), pixels_left(run))) return true;
    if (save_found(run->save)->tiles)
        free(save_keep(run->save).path);
    else
        save_drop(run->save);
    run->save = NULL;
    return false;
}

bool keep(struct run *run, const char *then)
{
    if (!run->save) {
        user_error(NULL, 0, "nothing is kept for another run, because %s",
                   run->adaptive ? "adaptive sampling keeps no journal"
                                 : "output.journal is empty");
        return false;
    }
    struct save_kept kept = save_keep(run->save);
    run->save = NULL;
    char *journal = kept.moved ? format_text("output.journal=%s", kept.path) : NULL;
    char *command = command_line(run->arguments, run->processes, journal);
    struct queue_count count = queue_count(run->queue);
    uint64_t tiles = count.finished - kept.lost;
    if (kept.lost)
        user_error(NULL, 0, "%llu finished tiles (%.1f s of rendering) could be saved nowhere",
                   (unsigned long long)kept.lost, kept.lost_s);
    fprintf(stderr, "farm: %llu of %u tiles are saved in %s; %s: %s\n", (unsigned long long)tiles,
            count.tiles, kept.path, then, command);
    free(kept.path);
    free(journal);
    free(command);
    return true;
}
