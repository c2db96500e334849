/*
 * The main program of farm. Rank 0 reads the scene and serves the work queue (master/), every rank renders
 * (worker/). This file alone knows both sides, and starts them.
 */
#include <fcntl.h>
#include <math.h>
#include <mpi.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/build.h"
#include "common/clock.h"
#include "common/cores.h"
#include "common/message.h"
#include "common/nap.h"
#include "common/orphan.h"
#include "common/processor.h"
#include "master/bands.h"
#include "master/help.h"
#include "master/image_file.h"
#include "master/path.h"
#include "master/run.h"
#include "master/terminal.h"
#include "master/timeline_output.h"
#include "worker/collective.h"
#include "worker/node_scene.h"
#include "worker/render.h"
#include "worker/work.h"

/* Aborts without the message of MPI_Abort: it adds nothing, and where all is well it would look like a failure. */
static void abort_quietly(int status)
{
    int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (nowhere >= 0) dup2(nowhere, STDERR_FILENO);
    MPI_Abort(MPI_COMM_WORLD, status);
}

/* Ends the job so that the last messages are still printed: see stop_job(). Only the main thread may call MPI. */
static void end_job(int status)
{
    stop_job(status, gettid() == getpid() ? abort_quietly : NULL);
}

static bool render_own_tile(void *renderer, const struct tile *tile,
                            const struct refinement *refinements, struct cpu_time *time,
                            float *floats, struct result_header *header)
{
    return work_on_tile(renderer, tile, refinements, time, floats, header);
}

static bool gives_up(void *state)
{
    const struct service *service = state;
    return *stop_signal() != 0 || service->ending || service->given_up;
}

/* When sampling.time_limit is over: a time of common/clock.h, or HUGE_VAL. */
static double deadline_of(const struct run *run)
{
    double limit = run->job.settings.sampling.time_limit;
    return limit > 0 ? run->start + limit : HUGE_VAL;
}

/* Seconds between previews. There are none in a pipe or a device: what was written there cannot be replaced. */
static double preview_seconds(const struct settings *settings)
{
    return path_is_written_in_place(settings->output.image) ? 0 : settings->output.preview;
}

/* Starts monitoring; what an earlier run has rendered counts from the start. */
static void begin_watch(struct run *run, const struct view *view)
{
    const struct settings *settings = &run->job.settings;
    run->watch = (struct watch){
        .canvas = &run->canvas,
        .reference = run->reference.rgb ? &run->reference : NULL,
        .adaptive = run->adaptive,
        .samples = view->max_samples,
        .begin = run->start,
        .snapshot = {.path = settings->output.image, .seconds = preview_seconds(settings)}};
    if (!watch_start(&run->watch, settings->output.error)) {
        if (run->save && save_was_empty(run->save)) save_drop(run->save);
        end_job(STATUS_FAILED);
    }
    if (!run->save) return;
    const struct resumed *resumed = &run->report.resumed;
    struct result_header header = {.cpu_s = resumed->cpu_s, .counts = resumed->counts};
    watch_add(&run->watch, resumed->pixels, &header);
}

/* Bytes of scene and BVH that are at least sent and built in a second: a hundredth of what a slow network and a
 * slow processor do. */
#define START_BYTES 1e6

/* Seconds within which all ranks have to have the scene, and to report for work after that. */
static unsigned start_limit(const struct run *run, const struct scene *scene)
{
    double bytes = (double)scene->bytes + (double)bvh_bytes_bound(scene);
    return (unsigned)ceil(fmin(run->job.settings.farm.patience + bytes / START_BYTES, 1e9));
}

/* The input of serve(); own: rank 0's renderer. */
static struct service service_of(struct run *run, const struct node_scene *shared,
                                 const struct tile_renderer *own)
{
    const struct settings *settings = &run->job.settings;
    return (struct service){
        .queue = run->queue,
        .canvas = &run->canvas,
        .save = run->save,
        .watch = &run->watch,
        .adaptive = run->adaptive,
        .deadline = deadline_of(run),
        .processors = run->crowd.processors,
        .limit = settings->sampling.time_limit,
        .pool = run->pool,
        .images = {settings->output.image, settings->output.heatmap, settings->output.ranks},
        .only_limit = settings->sampling.target_error == 0 && !run->job.named.max_samples,
        .timeline = timeline_wanted(settings) ? &run->timeline : NULL,
        .own = settings->farm.master_renders ? own : NULL,
        .stop = stop_signal(),
        .bell = shared->bell,
        .all_ring = shared->process_count == run->processes,
        .trays = shared->trays,
        .arrivals = shared->arrivals,
        .patience = settings->farm.patience,
        .start_patience = start_limit(run, shared->scene),
        .stats = run->stats};
}

/* Creates a pool of at most `most` threads, on the cores of all ranks of this node: these ranks all wait for the next
 * plan of adaptive sampling, and in the end for the picture to be written. */
static void create_pool(struct run *run, unsigned most)
{
    struct core_set own;
    unsigned threads = cores_borrow(run->neighbours, run->neighbour_count, &own);
    if (threads > most) threads = most;
    if (threads > 1) run->pool = thread_pool_create(threads);
    cores_return(&own);
}

static void destroy_pool(struct run *run)
{
    if (run->adaptive) adaptive_set_pool(run->adaptive, NULL);
    if (run->pool) thread_pool_destroy(run->pool);
    run->pool = NULL;
}

/* Ends a run whose picture is complete or whose time is over. Returns the exit status. */
static int end_complete(struct run *run, const struct served *served,
                        const struct node_scene *shared)
{
    /* For the whole picture, as if a single run had rendered it. */
    double render_s = served->render_s + run->report.resumed.render_s;
    /* Not the present time, as the master may have waited for silent renderers since. */
    double ended = served->began_at + served->render_s;
    bool watched = watch_end(&run->watch, ended, render_s, &run->report.forecast);
    forecast_set_scatter(&run->report.forecast, served->last_plan_s);
    run->report.errors = &run->watch.log;
    run->report.bvh_bytes = shared->bvh->bytes;
    run->report.time.broadcast = shared->broadcast_s;
    run->report.time.build = shared->build_s;
    if (!run->pool) create_pool(run, image_threads(&run->canvas));
    int status = run_conclude(run, served);
    return status == STATUS_DONE && !watched ? STATUS_FAILED : status;
}

static int render_as_master(struct run *run, const struct node_scene *shared,
                            struct renderer *renderer)
{
    struct progress progress;
    struct tile_renderer own = {.state = renderer, .render = render_own_tile};
    begin_watch(run, &shared->scene->view);
    run->stats = allocate_zeroed(run->renderers, sizeof *run->stats);
    struct service service = service_of(run, shared, &own);
    service.progress = &progress;
    double now = clock_wall();
    progress_start(&progress, stderr, now, now - run->start);
    renderer_on_wave(renderer, gives_up, &service);
    stop_defer();
    if (run->save) save_start(run->save, tiles_left(run), pixels_left(run));
    struct served served;
    bool complete = serve(&service, &served);
    progress_end(&progress);
    snapshot_end(&run->watch.snapshot); /* from now on the file is written here */
    run->silent = served.silent;
    name_silent(run);
    return complete ? end_complete(run, &served, shared) : end_early(run, served.deserted);
}

struct preparation {
    const struct scene *scene;
    struct renderer *renderer;
};

static void *prepare_renderer(void *argument)
{
    struct preparation *it = argument;
    it->renderer = renderer_prepare(it->scene);
    return NULL;
}

/* Prepares the renderer. What needs no BVH is done while that is built: on the first rank of a node in a second
 * thread, if other ranks lend it their cores. */
static struct renderer *start_renderer(struct node_scene *shared)
{
    pthread_t thread;
    struct preparation it = {shared->scene, NULL};
    bool beside = shared->leads && shared->process_count > 1 &&
                  pthread_create(&thread, NULL, prepare_renderer, &it) == 0;
    if (!beside) (void)prepare_renderer(&it);
    share_bvh(shared);
    if (beside) pthread_join(thread, NULL);
    renderer_begin(it.renderer, shared->bvh);
    return it.renderer;
}

/* Renders; returns the exit status, on ranks other than 0 STATUS_DONE. */
static int render(struct run *run, int rank, const struct node_scene *shared,
                  struct renderer *renderer)
{
    if (rank > 0) {
        work(renderer, shared);
        return STATUS_DONE;
    }
    if (run->adaptive) {
        create_pool(run, band_count(&run->canvas));
        adaptive_set_pool(run->adaptive, run->pool);
    }
    int status = render_as_master(run, shared, renderer);
    destroy_pool(run);
    return status;
}

/* Seconds within which all ranks have to start, before the settings are read: thousands of them take a minute. */
#define LAUNCH_PATIENCE 300

/* Whether mpiexec would not return this status. After a signal that it has received, too, it often returns 0 for
 * one or two ranks, whatever these return (MPICH 4.0.2). A run that was complete all the same ends in the usual
 * way. */
static bool mpiexec_forgets(int status)
{
    if (status == STATUS_DONE || !stop_has_launcher()) return false;
    return status == STATUS_RESUMABLE || *stop_signal() != 0;
}

/* Prepares the run on rank 0. Returns what the other ranks are told; *block: the scene, NULL if nothing is rendered. */
static struct welcome prepare_welcome(struct run *run, struct scene **block)
{
    struct welcome welcome = {.magic = WELCOME_MAGIC};
    snprintf(welcome.build, sizeof welcome.build, "%s", farm_build);
    run->report.time.init = clock_wall() - run->start;
    int status = prepare(run, block);
    if (status < 0) {
        welcome.scene_bytes = (*block)->bytes;
        welcome.bvh_bytes = bvh_bytes_bound(*block);
        welcome.status = STATUS_DONE;
        stop_watch_the_start(start_limit(run, *block));
    } else {
        welcome.status = (uint32_t)status;
        stop_watch_the_end(status);
    }
    return welcome;
}

/* A rank's part of the run, between the start and the end of MPI; returns its exit status. */
static int run_rank(struct run *run, int rank)
{
    struct node_scene shared;
    struct welcome welcome = {0};
    struct scene *block = NULL;
    if (rank == 0) welcome = prepare_welcome(run, &block);
    int status = share_scene(rank == 0 ? &welcome : NULL, block, &shared);
    if (status >= 0) return status;
    struct renderer *renderer = start_renderer(&shared);
    if (rank == 0) stop_unwatch_the_start();
    run->neighbours = shared.processes;
    run->neighbour_count = shared.process_count;
    status = render(run, rank, &shared, renderer);
    renderer_destroy(renderer);
    if (run->silent || mpiexec_forgets(status)) {
        /* Everything is written, and MPI_Finalize would wait for a rank that does not answer any more. */
        fflush(NULL);
        stop_job(status, abort_quietly);
    }
    /* Everything is written: a rank that is stopped from here on holds nothing up. */
    if (rank == 0) stop_watch_the_end(status);
    unshare_scene(&shared);
    return status;
}

static void free_run(struct run *run)
{
    job_free(&run->job);
    queue_destroy(run->queue);
    crowd_free(&run->crowd);
    canvas_free(&run->canvas);
    canvas_free(&run->reference);
    adaptive_destroy(run->adaptive);
    watch_free(&run->watch);
    timeline_free(&run->timeline);
    free(run->stats);
    free(run->arguments);
    free(run->neighbours);
    free(run->affinities);
}

/*
 * Whether this process prints messages for the job before MPI has started. The launcher tells each rank its
 * number, in an environment variable that this MPI understands. Processes without one are jobs of their own:
 * each task of srun has a SLURM_PROCID, but only with --mpi=pmi2 a PMI_RANK.
 */
static bool speaks_first(void)
{
    char library[MPI_MAX_LIBRARY_VERSION_STRING];
    int length;
    const char *rank = getenv("PMI_RANK");
    MPI_Get_library_version(library, &length);
    /* A PMI_RANK without a connection to a launcher is inherited from elsewhere: such a process is a job of its
     * own. */
    if (rank && !getenv("PMI_FD") && !getenv("PMI_PORT")) rank = NULL;
    if (!rank && strstr(library, "pmix")) rank = getenv("PMIX_RANK");
    return !rank || strcmp(rank, "0") == 0;
}

/* Prints versions. Only the first line of that of the MPI library is printed, which has its name and version. */
static void print_version(void)
{
    char library[MPI_MAX_LIBRARY_VERSION_STRING];
    int length;
    MPI_Get_library_version(library, &length);
    library[strcspn(library, "\n")] = '\0';
    for (char *tab = library; (tab = strchr(tab, '\t')) != NULL;)
        *tab = ' ';
    printf("farm " FARM_VERSION "\nMPI: %s\nkernel: %s\n", library,
           processor_level_names[processor_resolve(PROCESSOR_AUTO)]);
}

/* Parses the arguments and answers --help and --version. Returns the exit status, or -1 to go on with a scene. */
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
        print_help(stdout, terminal_columns(stdout));
    else
        print_version();
    return close_output(NULL);
}

/* A copy of the arguments, which options_parse() permutes. */
static char **copy_arguments(int argc, char **argv)
{
    char **copy = allocate((size_t)argc + 1, sizeof *copy);
    memcpy(copy, argv, ((size_t)argc + 1) * sizeof *copy);
    return copy;
}

/* Opens /dev/null in the place of each closed standard descriptor. Otherwise MPI would open a connection there,
 * and the table would be written into it. Writing to the replacement fails, which is reported. */
static void occupy_standard_descriptors(void)
{
    int nowhere;
    do
        nowhere = open("/dev/null", O_RDONLY);
    while (nowhere >= 0 && nowhere <= STDERR_FILENO);
    if (nowhere >= 0) close(nowhere);
}

/* A launcher of another MPI starts as many farms as it was to start processes, each of which is alone. So is the one
 * that MPICH's mpiexec was asked for, also where the environment tells of another launcher. */
static void warn_of_other_launcher(void)
{
    static const char *const counts[] = {"OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS"};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        const char *count = getenv(counts[i]);
        if (!count || strtol(count, NULL, 10) <= 1) continue;
        user_warning(NULL, 0,
                     "%s is %s, but each of these processes is alone, and renders the whole "
                     "picture: start them by the mpiexec of MPICH, or by srun --mpi=pmi2",
                     counts[i], count);
        return;
    }
}

int main(int argc, char **argv)
{
    occupy_standard_descriptors();
    orphan_watch();
    stop_ignore_file_limit();
    struct run run = {.start = clock_wall(), .arguments = copy_arguments(argc, argv)};
    int status = answer_without_mpi(argc, argv, &run.options);
    if (status >= 0) return status;
    int rank, level;
    if (speaks_first()) stop_watch_the_start(LAUNCH_PATIENCE);
    stop_hold_signal();
    MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &level);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &run.processes);
    nap_sharpen();
    message_set_rank(rank, end_job);
    run.affinities = gather_affinities();
    stop_unwatch_the_start();
    stop_install(rank);
    if (level < MPI_THREAD_FUNNELED) fatal("this MPI library does not support threads");
    if (run.processes == 1 && !stop_has_launcher()) warn_of_other_launcher();
    status = agree_on_status(run_rank(&run, rank));
    stop_watch_the_end(status);
    MPI_Finalize();
    if (run.neighbours) stop_wait_for_exits(run.neighbours, run.neighbour_count);
    free_run(&run);
    return status;
}
