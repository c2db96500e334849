/* The end of a run on rank 0: writes the picture, the report and all other outputs, or keeps the journal. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "common/clock.h"
#include "common/message.h"
#include "master/image_file.h"
#include "master/output_file.h"
#include "master/path.h"
#include "master/run.h"
#include "master/start_times.h"
#include "master/terminal.h"
#include "master/timeline_output.h"

int close_output(const char *picture)
{
    if (fflush(stdout) == 0 && !ferror(stdout)) return STATUS_DONE;
    user_error(NULL, 0, "cannot write to standard output: %s%s%s", strerror(errno),
               picture ? "; the picture is in " : "", picture ? picture : "");
    return STATUS_FAILED;
}

void name_silent(const struct run *run)
{
    for (uint32_t i = 0; i < run->renderers; i++) {
        const struct renderer_stats *stats = &run->stats[i];
        if (!stats->silent) continue;
        bool known = stats->host[0];
        user_warning(NULL, 0,
                     "rank %u%s%s answers no more (stopped, hung, or cut off): the job ends "
                     "without it",
                     stats->rank, known ? " on " : "", stats->host);
    }
}

static void fill_report(struct run *run, const struct served *served)
{
    struct report *report = &run->report;
    const struct settings *settings = &run->job.settings;
    report->settings = settings;
    report->version = FARM_VERSION;
    report->config = run->options.config;
    report->image_file = settings->output.image;
    report->processes = run->processes;
    report->cores = run->crowd.cores;
    report->processors = run->crowd.processors;
    report->kernel = processor_resolve(settings->farm.kernel);
    report->schedule = settings->farm.schedule;
    struct queue_count count = queue_count(run->queue);
    report->tiles = count.tiles;
    report->repeated_tiles = count.repeated;
    report->wasted_s = count.wasted_s;
    report->time.render = served->render_s;
    report->renderers = run->stats;
    report->picture = served->counts;
    report->renderer_count = (int)run->renderers;
    report->master_cpu_s = served->master_cpu_s + thread_pool_cpu_s(run->pool);
    report->master_messages = served->messages;
    report->service_s = served->answers ? served->service_cpu_s / (double)served->answers : 0;
    report->answer_wait_s = served->messages ? served->answer_wait_s / (double)served->messages : 0;
    report->answer_wait_most_s = served->answer_wait_most_s;
    report->time.probe = served->probe_s / run->renderers;
}

static void fill_sampling(struct run *run, const struct served *served)
{
    struct report *report = &run->report;
    report->ended = ENDED_BY_SAMPLES;
    report->guessed_rmse = served->guessed_rmse;
    report->has_reference = run->reference.rgb != NULL;
    if (report->has_reference) report->truth = truth_of(&run->canvas, &run->reference);
    if (!run->adaptive) return;
    uint64_t pixels, samples;
    struct error_breakdown errors = adaptive_errors(run->adaptive, &pixels, &samples);
    report->unsampled = canvas_pixels(&run->canvas) - pixels;
    report->passes = adaptive_passes(run->adaptive);
    report->missing_share = adaptive_missing(run->adaptive);
    report->plan_s = served->plan_s;
    report->target = adaptive_target(run->adaptive);
    /* A time limit may leave no time for the plan that finds the target met. */
    report->ended = adaptive_is_met(run->adaptive) ? ENDED_BY_TARGET
                    : served->timed_out            ? ENDED_BY_TIME
                    : errors.sum.squares > 0       ? ENDED_BY_MAX_SAMPLES
                                                   : ENDED_WITHOUT_ERROR;
}

/* Which outputs have been written; false: writing failed, which has been reported. */
struct written {
    bool picture, timeline, report;
};

static struct written write_outputs(struct run *run)
{
    const struct settings *settings = &run->job.settings;
    struct report *report = &run->report;
    double start = clock_wall();
    struct written written = {.report = true};
    written.picture = image_write(settings->output.image, &run->canvas, run->pool);
    if (!written.picture) return written;
    report->quantisation = image_quantisation(report->image_file, &run->canvas, run->pool);
    written.timeline = timeline_write(&run->timeline, settings, report);
    report->time.write = clock_wall() - start;
    report->time.total = clock_wall() - run->start;
    if (!wants_report(settings)) return written;
    char *text = report_json(report);
    written.report = text_write("output.report", settings->output.report, text);
    free(text);
    return written;
}

/* Reports samples that the picture cannot show. With render.strict they end the run with status 1; picture and
 * report are written all the same. */
static int tell_bad_samples(const struct run *run)
{
    char *text = report_bad_samples(&run->report);
    if (!text) return STATUS_DONE;
    bool strict = run->job.settings.render.strict;
    if (strict)
        user_error(NULL, 0, "%s (render.strict = yes: exit status 1, the picture is written)",
                   text);
    else
        user_warning(NULL, 0, "%s", text);
    free(text);
    return strict ? STATUS_FAILED : STATUS_DONE;
}

static bool is_one_color(const struct canvas *canvas)
{
    size_t others = canvas_pixels(canvas) - 1;
    return others > 0 &&
           memcmp(canvas->rgb, canvas->rgb + 3, 3 * others * sizeof *canvas->rgb) == 0;
}

/* Prints a note if a whole picture shows nothing, or no light, which is seldom intended. */
static void note_emptiness(const struct run *run)
{
    const struct report *report = &run->report;
    const struct settings *settings = &run->job.settings;
    if (report->image_width < settings->image.width) return;
    if (report->image_height < settings->image.height || report->unsampled > 0) return;
    if (report_picture_counts(report).primary_hits == 0)
        user_note("nothing is in view: no ray from camera.eye has met anything");
    else if (is_one_color(&run->canvas))
        user_note("all pixels have the same colour: is what is in view lit?");
}

/* With fewer samples per pixel more pixels would have some, but the picture would have more error, as unsampled
 * pixels resemble their neighbours: the garden at 1280 x 960 under 2 s had an RMSE of 0.025 with 4 and of 0.033
 * with 2. */
#define SAMPLES_FEW 4

/* Advice for leaving fewer pixels without a sample: the end of a sentence, or empty. */
static const char *advice(const struct report *report)
{
    return report->min_samples > SAMPLES_FEW
               ? " (sampling.min_samples = " DIGITS(SAMPLES_FEW) " would leave fewer)"
               : "";
}

/* Warns of pixels that a time limit has left without any sample; false: all of them, so that there is no
 * picture. */
static bool tell_unsampled(const struct run *run, const struct served *served)
{
    double limit = run->job.settings.sampling.time_limit;
    uint64_t pixels = canvas_pixels(&run->canvas);
    uint64_t unsampled = run->report.unsampled;
    if (unsampled == pixels) {
        char *parts = start_times_text(&run->report.time);
        user_error(NULL, 0,
                   "sampling.time_limit = %g s was over before any sample was taken, expected "
                   "a longer one: rendering began after %.3g s (%s), %.3g s were kept for writing "
                   "and for telling the error",
                   limit, served->began_at - run->start, parts, served->reserved_s);
        free(parts);
        return false;
    }
    if (unsampled > 0)
        user_warning(
            NULL, 0,
            "sampling.time_limit = %g s has left %llu of %llu pixels without a sample: these "
            "are guessed from those around or, where none is near, from the pre-pass, or black "
            "where that has nothing%s",
            limit, (unsigned long long)unsampled, (unsigned long long)pixels, advice(&run->report));
    return true;
}

/* Keeps the journal if something could not be written; returns whether it was kept. It is not kept for trace,
 * heat map and ranks, which would be empty in a run that only writes what this one has rendered. Nor is it for
 * the report after a time limit: a later run would go on rendering, and get another picture. */
static bool keep_what_is_missing(struct run *run, struct written written, bool timed_out)
{
    if (!written.picture)
        return keep_run_journal(run, timed_out ? "to go on"
                                               : "to write the picture without rendering it again");
    if (!written.report && !timed_out)
        return keep_run_journal(run,
                                "to write the report, too, without rendering the picture again");
    save_drop(run->save);
    run->save = NULL;
    return false;
}

/* Prints where all other outputs are, below the table, which ends with the picture. */
static void tell_outputs(const struct run *run, struct written written)
{
    const struct settings *settings = &run->job.settings;
    const struct {
        const char *what, *path;
        bool there;
    } outputs[] = {
        {"report", settings->output.report, wants_report(settings) && written.report},
        {"error", settings->output.error, !run->watch.csv_error},
        {"trace", settings->output.trace, written.timeline},
        {"heatmap", settings->output.heatmap, written.timeline},
        {"ranks", settings->output.ranks, written.timeline},
    };
    for (size_t i = 0; i < sizeof outputs / sizeof *outputs; i++)
        if (outputs[i].there && *outputs[i].path)
            report_path(stdout, outputs[i].what, outputs[i].path);
}

int run_conclude(struct run *run, const struct served *served)
{
    fill_report(run, served);
    fill_sampling(run, served);
    if (!tell_unsampled(run, served)) {
        save_drop(run->save);
        run->save = NULL;
        return STATUS_FAILED;
    }
    save_finish(run->save);
    struct written written = write_outputs(run);
    bool kept = keep_what_is_missing(run, written, served->timed_out);
    int failed = kept && *stop_signal() ? STATUS_RESUMABLE : STATUS_FAILED;
    if (!written.picture) return failed;
    report_table(stdout, &run->report, terminal_columns(stdout));
    tell_outputs(run, written);
    int told = close_output(run->job.settings.output.image), samples = tell_bad_samples(run);
    note_emptiness(run);
    if (!written.timeline) return STATUS_FAILED; /* the same command would not write it either */
    if (!written.report) return failed;
    return told != STATUS_DONE ? told : samples;
}

/* Why the run ends, in words; owned by the caller. */
static char *reason(bool deserted)
{
    if (deserted) return copy_text("given up, as no renderer answers any more,");
    return format_text("stopped by %s", signal_name(*stop_signal()));
}

/* Prints a note if an old report exists: this run writes none, and the picture beside it has changed. */
static void note_old_report(const char *report)
{
    struct stat status;
    if (path_stream(report) < 0 && stat(report, &status) == 0 && S_ISREG(status.st_mode))
        user_note("%s is of an earlier run", report);
}

/* The journal is kept first: whoever sent the signal may not wait long. */
int end_early(struct run *run, bool deserted)
{
    const char *image = run->job.settings.output.image;
    uint64_t rendered = canvas_pixels(&run->canvas) - pixels_left(run);
    char *why = reason(deserted);
    if (run->adaptive)
        user_error(NULL, 0, "%s in pass %u of adaptive sampling", why,
                   adaptive_passes(run->adaptive));
    else
        user_error(NULL, 0, "%s at %.1f %% of the pixels", why, per_cent(run, rendered));
    free(why);
    bool resumable = keep_run_journal(run, "to go on");
    if (image_write(image, &run->canvas, run->pool))
        user_note("the picture so far is in %s", image);
    note_old_report(run->job.settings.output.report);
    return resumable ? STATUS_RESUMABLE : STATUS_FAILED;
}
