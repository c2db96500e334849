/* Taking over what an earlier run has left in the journal, and keeping the journal for a later run. */
#include <stdlib.h>

#include "common/message.h"
#include "master/command_line.h"
#include "master/run.h"

static uint32_t use_found(void *found, const struct tile *tile)
{
    return found_use(found, tile);
}

double per_cent(const struct run *run, uint64_t pixels)
{
    return 100 * (double)pixels / (double)canvas_pixels(&run->canvas);
}

/* Prints what was taken over; found: pixels in the journal. */
static void tell_resumed(const struct run *run, uint64_t found)
{
    const struct resumed *resumed = &run->report.resumed;
    char again[128] = "";
    /* Under a static schedule, tiles are rendered as a whole. */
    if (resumed->pixels < found)
        snprintf(again, sizeof again, ", but %.1f %% of the pixels are rendered again%s",
                 per_cent(run, found - resumed->pixels),
                 schedule_is_static(run->job.settings.farm.schedule)
                     ? " (farm.schedule=dynamic keeps them)"
                     : "");
    char where[80] = "";
    unsigned passes = run->adaptive ? adaptive_passes(run->adaptive) : 0;
    if (passes)
        snprintf(where, sizeof where, " %s pass %u",
                 adaptive_is_complete(run->adaptive) ? "after" : "in", passes);
    /* In later passes all pixels have samples, and some get more. */
    char share[40] = "";
    if (passes < 2) snprintf(share, sizeof share, "%.1f %% of the pixels", per_cent(run, found));
    user_note("going on with %s%s: %s%s%s%.1f s of CPU time saved",
              run->job.settings.output.journal, where, share, again, passes < 2 ? ", " : "",
              resumed->cpu_s);
}

/* The number of pixels that have samples. */
static uint64_t pixels_in(const struct run *run)
{
    return canvas_pixels(&run->canvas) - adaptive_unsampled(run->adaptive);
}

/* Takes over what an earlier run has left. */
static void resume(struct run *run)
{
    struct found *found = save_found(run->save);
    /* After pass 0 nothing of it is rendered any more, even if it was cut off. */
    bool behind = run->adaptive && adaptive_passes(run->adaptive) > 1;
    if (!found->pixels && !behind) return;
    queue_skip(run->queue, use_found, found);
    if (behind) {
        found_use_all(found);
        queue_withdraw(run->queue);
    }
    struct queue_count count = queue_count(run->queue);
    struct found_sums used = found_sum(found);
    run->report.resumed = (struct resumed){
        .tiles = count.finished,
        .pixels = behind ? pixels_in(run) : count.pixels_finished,
        .records = found->count,
        .seconds = used.busy_s,
        .cpu_s = used.cpu_s,
        /* CPU time, as wall time would count the time slices of other ranks that shared cores then. */
        .render_s = used.cpu_s / run->crowd.processors,
        .repeated_s = used.repeated_s,
        .counts = used.counts,
    };
    tell_resumed(run, found->pixels);
}

/* Pixels that count as one tile when space is reserved for what a cut-off pass 0 has left. Most lattices have fewer
 * tiles than this assumes. */
#define TILE_OF_REST 256u

uint32_t tiles_left(const struct run *run)
{
    if (run->adaptive && adaptive_passes(run->adaptive) > 1)
        return (uint32_t)(pixels_left(run) / TILE_OF_REST);
    struct queue_count count = queue_count(run->queue);
    return count.tiles - count.finished;
}

uint64_t pixels_left(const struct run *run)
{
    if (run->adaptive) return adaptive_unsampled(run->adaptive);
    return canvas_pixels(&run->canvas) - queue_count(run->queue).pixels_finished;
}

bool open_run_journal(struct run *run, const struct scene *scene)
{
    const char *path = run->job.settings.output.journal;
    if (!*path) return true;
    run->save = save_open(path, scene, &run->canvas, run->adaptive, tiles_left(run));
    if (!run->save) return false;
    resume(run);
    if (save_has_room(run->save, tiles_left(run), pixels_left(run))) return true;
    struct save_kept kept = save_keep(run->save);
    save_kept_free(&kept);
    run->save = NULL;
    return false;
}

/* What is saved, in words; the caller frees the text. In passes after the first it does not count pixels, as such a
 * pass renders only some pixels of each tile. */
static char *what_is_saved(const struct run *run, uint64_t pixels)
{
    unsigned passes = run->adaptive ? adaptive_passes(run->adaptive) : 0;
    if (passes > 1 && adaptive_unsampled(run->adaptive) > 0)
        return format_text("the first samples of %.1f %% of the pixels are",
                           per_cent(run, pixels_in(run)));
    if (passes == 2) return format_text("pass 1 and what is finished of pass 2 are");
    if (passes > 2)
        return format_text("passes 1 %s %u and what is finished of pass %u are",
                           passes == 3 ? "and" : "to", passes - 1, passes);
    return format_text("%.1f %% of the pixels%s are", per_cent(run, pixels),
                       passes ? " of pass 1" : "");
}

/* Whether `mpiexec -n N` starts the same ranks again: with host files, other launchers or Slurm it would start
 * all of them on this machine. */
static bool starts_plainly(const struct run *run)
{
    return run->processes == 1 || (stop_has_launcher() && run->neighbour_count == run->processes);
}

bool keep_run_journal(struct run *run, const char *then)
{
    if (!run->save) {
        user_error(NULL, 0, "nothing is kept for another run, because output.journal is empty");
        return false;
    }
    struct save_kept kept = save_keep(run->save);
    run->save = NULL;
    char *journal = kept.moved ? format_text("output.journal=%s", kept.path) : NULL;
    bool plainly = starts_plainly(run);
    char *command = command_line(run->arguments, plainly ? run->processes : 1, journal);
    struct queue_count count = queue_count(run->queue);
    /* Lost tiles may include pieces that are not counted as finished. */
    uint64_t lost =
        kept.lost_pixels < count.pixels_finished ? kept.lost_pixels : count.pixels_finished;
    char *saved = what_is_saved(run, count.pixels_finished - lost);
    if (kept.is_gone)
        user_error(kept.path, 0, "the journal was removed, and could be saved nowhere else");
    else if (kept.lost)
        user_error(NULL, 0, "%llu finished tile%s (%.1f s of rendering) could be saved nowhere",
                   (unsigned long long)kept.lost, kept.lost > 1 ? "s" : "", kept.lost_s);
    char *place = printable_text(kept.path);
    const char *way = plainly ? "" : ", start it in the same way";
    /* Not user_note(), which would replace a newline between quotes and so change the command. */
    if (kept.is_bare)
        fprintf(stderr, "farm: nothing is saved%s; to begin again%s: %s\n",
                kept.lost || kept.is_gone ? "" : " yet", way, command);
    else
        fprintf(stderr, "farm: %s saved in %s; %s%s: %s\n", saved, place,
                kept.lost ? "to go on" : then, way, command);
    if (kept.original)
        user_note("%s stays, too: it holds less, and can be removed if its room is needed",
                  kept.original);
    free(place);
    free(saved);
    save_kept_free(&kept);
    free(journal);
    free(command);
    return true;
}
