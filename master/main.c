/*
 * farm: the program. Rank 0 reads the scene and serves the work queue (master/), every rank renders
 * (worker/); this file alone knows both sides and starts either.
 */
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <mpi.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/clock.h"
#include "common/message.h"
#include "master/command_line.h"
#include "master/image_file.h"
#include "master/load.h"
#include "master/options.h"
#include "master/report.h"
#include "master/save.h"
#include "master/serve.h"
#include "master/stop.h"
#include "master/timeline_output.h"
#include "master/truth.h"
#include "worker/render.h"
#include "worker/survey.h"
#include "worker/work.h"

/* STATUS_RESUMABLE: stopped before the end, the same command goes on (EX_TEMPFAIL of sysexits.h). */
enum { STATUS_DONE = 0, STATUS_FAILED = 1, STATUS_INPUT = 2, STATUS_RESUMABLE = 75 };

/* What rank 0 carries through the run. */
struct run {
    char **arguments; /* argv as it was given; owned */
    struct options options;
    struct job job;
    struct queue *queue;
    struct canvas canvas;
    struct canvas reference; /* rgb is NULL: there is none */
    struct watch watch;
    struct adaptive *adaptive; /* NULL: it is not */
    struct save *save;         /* NULL: output.journal is empty, or the work on it is done */
    struct timeline timeline;
    struct renderer_stats *stats;
    struct report report;
    double start;
    int processes;
    uint32_t renderers;
    uint32_t silent; /* ranks that answered no more in the end */
};

/* MPI may be called from the main thread alone; mpiexec ends the others when a rank just leaves. */
static void end_job(int status)
{
    if (gettid() != getpid()) _exit(status);
    MPI_Abort(MPI_COMM_WORLD, status);
}

/* Whether what was printed reached its reader; says so otherwise. */
static int close_output(void)
{
    if (fflush(stdout) == 0 && !ferror(stdout)) return STATUS_DONE;
    user_error(NULL, 0, "cannot write to standard output: %s", strerror(errno));
    return STATUS_FAILED;
}

/* ---- before rendering ---- */

static const char *schedule_unfit(const struct run *run)
{
    if (run->renderers == 0)
        return "nobody would render: with farm.master_renders = no, start at least 2 processes";
    return NULL;
}

/* Pixels; 0: the static schedules choose the height of their bands themselves. */
static uint32_t tile_edge(const struct settings *settings, const struct view *view,
                          uint32_t renderers)
{
    enum schedule schedule = settings->farm.schedule;
    if (settings->farm.tile || (schedule != SCHEDULE_DYNAMIC && schedule != SCHEDULE_TILES))
        return settings->farm.tile;
    return queue_auto_edge(schedule, view->region_w, view->region_h, renderers);
}

static bool make_queue(struct run *run, const struct view *view)
{
    const struct settings *settings = &run->job.settings;
    run->renderers = (uint32_t)run->processes - (settings->farm.master_renders ? 0 : 1);
    const char *unfit = schedule_unfit(run);
    if (unfit) {
        user_error(NULL, 0, "%s", unfit);
        return false;
    }
    struct queue_config config = {.schedule = settings->farm.schedule,
                                  .width = view->region_w,
                                  .height = view->region_h,
                                  .renderers = run->renderers,
                                  .tile_edge = tile_edge(settings, view, run->renderers)};
    config.probe_edge = queue_auto_probe_edge(view->region_w, view->region_h, view->min_samples);
    run->queue = queue_create(&config);
    if (run->queue) {
        run->report.tile_edge = config.tile_edge;
        return true;
    }
    user_error(NULL, 0,
               "the picture falls into more than %u tiles, expected fewer: a larger farm.tile",
               QUEUE_MAX_TILES);
    return false;
}

/* An empty name asks for no report. */
static bool wants_report(const struct settings *settings)
{
    return settings->output.report[0] != '\0';
}

static bool outputs_writable(const struct settings *settings, const struct view *view)
{
    if (!output_writable(settings->output.image, "output.image")) return false;
    if (!image_size_writable(settings->output.image, view->region_w, view->region_h)) return false;
    if (settings->output.error && settings->output.error[0] &&
        !output_writable(settings->output.error, "output.error"))
        return false;
    if (!timeline_writable(settings, view->region_w, view->region_h)) return false;
    return !wants_report(settings) || output_writable(settings->output.report, "output.report");
}

static void describe_scene(struct report *report, const struct scene *scene)
{
    report->primitives = scene_primitive_count(scene);
    report->triangles =
        scene->primitives[PRIMITIVE_TRIANGLE].count + scene->primitives[PRIMITIVE_PATCH].count;
    report->lights = scene->lights.count;
    report->scene_bytes = scene->bytes;
    report->features = scene_features(scene);
    report->image_width = scene->view.region_w;
    report->image_height = scene->view.region_h;
}

static int print_check(const struct run *run)
{
    const struct report *report = &run->report;
    printf("%s: all right: %llu primitives (%llu triangles), %llu lights, %u x %u pixels\n",
           run->options.config, (unsigned long long)report->primitives,
           (unsigned long long)report->triangles, (unsigned long long)report->lights,
           report->image_width, report->image_height);
    return close_output();
}

/* ---- what is kept ---- */

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

/* What is still to be rendered. */
static uint32_t tiles_left(const struct run *run)
{
    struct queue_count count = queue_count(run->queue);
    return count.tiles - count.finished;
}

static uint64_t pixels_left(const struct run *run)
{
    return (uint64_t)run->canvas.width * run->canvas.height -
           queue_count(run->queue).pixels_finished;
}

/* Opens the journal, if one is wanted; false after saying why it cannot be. */
static bool open_save(struct run *run, const struct scene *scene)
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

/* Leaves the journal to a later run and tells how to start that; returns whether it can be. */
static bool keep(struct run *run, const char *then)
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

static void discard(struct scene **block)
{
    free(*block);
    *block = NULL;
}

/*
 * Everything that can go wrong because of the input, before any process starts to render. Returns
 * the exit status, or -1 to go on with *block.
 */
static int prepare(struct run *run, struct scene **block)
{
    double start = clock_wall();
    const struct options *options = &run->options;
    enum reach reach = options->allow_outside ? REACH_ANYWHERE : REACH_FOLDER;
    if (!load_job(options->config, options->overrides, options->override_count, reach, &run->job))
        return STATUS_INPUT;
    if (options->action == ACTION_PRINT_CONFIG) {
        char *text = print_job(&run->job);
        if (!text) return STATUS_INPUT;
        fputs(text, stdout);
        free(text);
        return close_output();
    }
    struct view view = settings_view(&run->job.settings);
    if (!make_queue(run, &view)) return STATUS_INPUT;
    if (!outputs_writable(&run->job.settings, &view)) return STATUS_INPUT;
    const char *reference = run->job.settings.sampling.reference;
    if (*reference && !truth_read(reference, view.region_w, view.region_h, &run->reference))
        return STATUS_INPUT;
    *block = builder_finish(run->job.builder, &view);
    const char *why;
    if (!scene_valid(*block, (*block)->bytes, &why)) {
        user_error(options->config, 0, "%s, expected a scene of ordinary size", why);
        discard(block);
        return STATUS_INPUT;
    }
    describe_scene(&run->report, *block);
    run->report.time.load = clock_wall() - start;
    if (options->action == ACTION_CHECK) {
        discard(block);
        return print_check(run);
    }
    canvas_init(&run->canvas, view.region_w, view.region_h);
    if (open_save(run, *block)) return -1;
    discard(block);
    return STATUS_INPUT;
}

/* ---- after rendering ---- */

static int write_outputs(struct run *run)
{
    const struct settings *settings = &run->job.settings;
    struct report *report = &run->report;
    double start = clock_wall();
    if (!image_write(settings->output.image, &run->canvas)) return STATUS_FAILED;
    if (!timeline_write(&run->timeline, settings, report)) return STATUS_FAILED;
    report->time.write = clock_wall() - start;
    report->time.total = clock_wall() - run->start;
    if (!wants_report(settings)) return STATUS_DONE;
    char *text = report_json(report);
    bool written = text_write(settings->output.report, text, strlen(text));
    free(text);
    return written ? STATUS_DONE : STATUS_FAILED;
}

/* What cannot be seen in the picture is said; with render.strict it ends the run with status 1, the
 * picture and the report being written all the same. */
static int judge_samples(const struct run *run)
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

static int conclude(struct run *run)
{
    const struct settings *settings = &run->job.settings;
    int status = write_outputs(run);
    if (status != STATUS_DONE) {
        keep(run, "to write the picture without rendering it again");
        return status;
    }
    save_drop(run->save);
    run->save = NULL;
    int columns = terminal_columns(stderr);
    report_table(stdout, &run->report, columns);
    if (wants_report(settings)) printf("report  %s\n", settings->output.report);
    status = close_output();
    int judged = judge_samples(run);
    return status != STATUS_DONE ? status : judged;
}

/* The journal first: whoever sent the signal may not wait long. */
static int end_early(struct run *run)
{
    const char *image = run->job.settings.output.image;
    const char *signal = strsignal(*stop_signal());
    double pixels = (double)run->canvas.width * run->canvas.height;
    if (run->adaptive)
        user_error(NULL, 0, "stopped by %s in pass %u of adaptive sampling", signal,
                   adaptive_passes(run->adaptive));
    else
        user_error(NULL, 0, "stopped by %s at %.0f %% of the picture", signal,
                   100 - 100 * (double)pixels_left(run) / pixels);
    bool resumable = keep(run, "to go on");
    if (image_write(image, &run->canvas))
        fprintf(stderr, "farm: the picture so far is in %s\n", image);
    return resumable ? STATUS_RESUMABLE : STATUS_FAILED;
}

/* ---- the run ---- */

static bool render_own_tile(void *state, const struct tile *tile,
                            const struct refinement *refinements, float *mean, float *difference,
                            float *rays, struct render_counts *counts)
{
    struct task task = {.tile = tile,
                        .refinements = refinements,
                        .mean = mean,
                        .difference = difference,
                        .rays = rays};
    return renderer_task(state, &task, counts);
}

static bool probe_own_tile(void *state, const struct tile *tile, float *rgb, float *seconds)
{
    return survey(state, tile, rgb, seconds);
}

static bool is_over(void *service)
{
    return *stop_signal() != 0 || ((struct service *)service)->ending;
}

static void fill_report(struct run *run, const struct service *service,
                        const struct node_scene *shared)
{
    struct report *report = &run->report;
    const struct settings *settings = &run->job.settings;
    report->version = FARM_VERSION;
    report->config = run->options.config;
    report->image_file = settings->output.image;
    report->processes = run->processes;
    report->kernel = processor_resolve(settings->farm.kernel);
    report->schedule = settings->farm.schedule;
    struct queue_count count = queue_count(run->queue);
    report->tiles = count.tiles;
    report->repeated_tiles = count.repeated;
    report->wasted_s = count.wasted_s;
    report->bvh_bytes = shared->bvh->bytes;
    report->time.broadcast = shared->broadcast_s;
    report->time.build = shared->build_s;
    report->time.render = service->render_s;
    report->renderers = service->stats;
    report->renderer_count = (int)run->renderers;
    report->master_cpu_s = service->master_cpu_s;
    report->master_messages = service->messages;
    report->answer_wait_s =
        service->messages ? service->answer_wait_s / (double)service->messages : 0;
    report->answer_wait_most_s = service->answer_wait_most_s;
    report->time.probe = service->probe_s / run->renderers;
}

/* When sampling.time_limit is over. */
static double deadline_of(const struct run *run)
{
    double limit = run->job.settings.sampling.time_limit;
    return limit > 0 ? run->start + limit : HUGE_VAL;
}

static void fill_sampling(struct run *run, const struct service *service, const struct view *view)
{
    struct report *report = &run->report;
    report->min_samples = view->min_samples;
    report->max_samples = view->max_samples;
    report->ended = "samples";
    report->has_reference = run->reference.rgb != NULL;
    if (report->has_reference) report->truth = truth_of(&run->canvas, &run->reference);
    if (!run->adaptive) return;
    uint64_t pixels, samples;
    adaptive_errors(run->adaptive, &pixels, &samples);
    report->unsampled = (uint64_t)run->canvas.width * run->canvas.height - pixels;
    report->passes = adaptive_passes(run->adaptive);
    report->ended = service->timed_out               ? "time"
                    : adaptive_is_met(run->adaptive) ? "target"
                                                     : "max_samples";
}

static void name_silent(const struct run *run)
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

/* All is written. MPI_Finalize would wait for a rank that answers no more; this ends it. */
static void leave_the_silent(int status)
{
    fflush(NULL);
    /* What MPI_Abort says would look like a failure. */
    int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (nowhere >= 0) dup2(nowhere, STDERR_FILENO);
    MPI_Abort(MPI_COMM_WORLD, status);
}

static int render_as_master(struct run *run, const struct node_scene *shared,
                            struct renderer *renderer)
{
    const struct settings *settings = &run->job.settings;
    const struct view *view = &shared->scene->view;
    struct progress progress;
    struct tile_renderer own = {
        .state = renderer, .render = render_own_tile, .probe = probe_own_tile};
    if (settings_adaptive(settings))
        run->adaptive = adaptive_create(view, &run->canvas, settings->sampling.target_error);
    run->watch = (struct watch){.canvas = &run->canvas,
                                .reference = run->reference.rgb ? &run->reference : NULL,
                                .adaptive = run->adaptive,
                                .samples = view->max_samples,
                                .begin = run->start,
                                .preview = settings->output.image,
                                .preview_s = settings->output.preview};
    if (!watch_start(&run->watch, settings->output.error)) end_job(STATUS_FAILED);
    if (run->save) {
        const struct save_found *found = save_found(run->save);
        struct result_header header = {.cpu_s = found->seconds, .counts = found->counts};
        watch_add(&run->watch, found->pixels, &header);
    }
    run->stats = allocate_zeroed(run->renderers, sizeof *run->stats);
    struct service service = {.comm = MPI_COMM_WORLD,
                              .queue = run->queue,
                              .canvas = &run->canvas,
                              .save = run->save,
                              .progress = &progress,
                              .watch = &run->watch,
                              .first_samples = view->min_samples,
                              .adaptive = run->adaptive,
                              .deadline = deadline_of(run),
                              .timeline = timeline_wanted(settings) ? &run->timeline : NULL,
                              .own = settings->farm.master_renders ? &own : NULL,
                              .stop = stop_signal(),
                              .stats = run->stats};
    progress_start(&progress, stderr, clock_wall());
    renderer_on_wave(renderer, is_over, &service);
    stop_is_served();
    if (run->save) save_start(run->save, tiles_left(run), pixels_left(run));
    bool complete = serve(&service);
    progress_end(&progress);
    run->silent = service.silent;
    name_silent(run);
    if (!complete) return end_early(run);
    bool watched = watch_end(&run->watch, clock_wall(), service.render_s, &run->report.forecast);
    run->report.errors = &run->watch.log;
    fill_report(run, &service, shared);
    fill_sampling(run, &service, view);
    int status = conclude(run);
    return status == STATUS_DONE && !watched ? STATUS_FAILED : status;
}

/* Returns the exit status; on ranks other than 0 that of a rank that has done its part. */
static int render(struct run *run, int rank, const struct node_scene *shared)
{
    int status = STATUS_DONE;
    struct renderer *renderer = renderer_create(shared->scene, shared->bvh);
    if (rank == 0)
        status = render_as_master(run, shared, renderer);
    else
        work(MPI_COMM_WORLD, renderer, shared->scene);
    renderer_destroy(renderer);
    return status;
}

static int run_rank(struct run *run, int rank)
{
    struct node_scene shared;
    struct welcome welcome = {.magic = WELCOME_MAGIC, .build = FARM_VERSION};
    struct scene *block = NULL;
    if (rank == 0) {
        run->report.time.init = clock_wall() - run->start;
        int status = prepare(run, &block);
        if (status < 0) {
            welcome.scene_bytes = block->bytes;
            welcome.bvh_bytes = bvh_bytes_bound(block);
        }
        welcome.status = status < 0 ? STATUS_DONE : (uint32_t)status;
    }
    int status = share_scene(MPI_COMM_WORLD, rank == 0 ? &welcome : NULL, block, &shared);
    if (status >= 0) return status;
    status = render(run, rank, &shared);
    if (run->silent) leave_the_silent(status);
    /* All is written: a rank that stops from here on holds nobody up. */
    if (rank == 0) stop_watch_the_end(status);
    unshare_scene(&shared);
    return status;
}

static void free_run(struct run *run)
{
    job_free(&run->job);
    queue_destroy(run->queue);
    canvas_free(&run->canvas);
    canvas_free(&run->reference);
    adaptive_destroy(run->adaptive);
    watch_free(&run->watch);
    timeline_free(&run->timeline);
    free(run->stats);
    free(run->arguments);
}

/* Whether this process speaks for the job before MPI has started: mpiexec and Slurm tell the rank.
 */
static bool speaks_first(void)
{
    const char *names[] = {"PMI_RANK", "PMIX_RANK", "SLURM_PROCID"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        const char *rank = getenv(names[i]);
        if (rank) return strcmp(rank, "0") == 0;
    }
    return true;
}

/* Returns the exit status, or -1 when there is a scene to go on with. */
static int answer_without_mpi(int argc, char **argv, struct options *options)
{
    static char unheard[256];
    if (!speaks_first()) message_capture(unheard, sizeof unheard);
    bool understood = options_parse(argc, argv, options);
    message_capture(NULL, 0);
    if (!understood) return STATUS_INPUT;
    if (options->action != ACTION_HELP && options->action != ACTION_VERSION) return -1;
    if (!speaks_first()) return STATUS_DONE;
    if (options->action == ACTION_HELP)
        options_help(stdout);
    else
        puts("farm " FARM_VERSION);
    return close_output();
}

/* What options_parse() puts into another order. */
static char **copy_arguments(int argc, char **argv)
{
    char **copy = allocate((size_t)argc + 1, sizeof *copy);
    memcpy(copy, argv, ((size_t)argc + 1) * sizeof *copy);
    return copy;
}

int main(int argc, char **argv)
{
    struct run run = {.start = clock_wall(), .arguments = copy_arguments(argc, argv)};
    int status = answer_without_mpi(argc, argv, &run.options);
    if (status >= 0) return status;
    int rank, level;
    MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &level);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &run.processes);
    message_set_rank(rank, end_job);
    stop_install(rank);
    if (level < MPI_THREAD_FUNNELED) fatal("this MPI library does not support threads");
    status = agree_on_status(MPI_COMM_WORLD, run_rank(&run, rank));
    free_run(&run);
    stop_watch_the_end(status);
    MPI_Finalize();
    return status;
}
