/* The start of a run on rank 0: loads the scene, makes the queue, tests the outputs and opens the journal. */
#include <math.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "common/clock.h"
#include "common/cores.h"
#include "common/message.h"
#include "master/enclosed.h"
#include "master/journal.h"
#include "master/late_note.h"
#include "master/number.h"
#include "master/outline.h"
#include "master/output_file.h"
#include "master/run.h"
#include "master/start_times.h"
#include "master/timeline_output.h"
#include "master/truth.h"

/* Edge of a tile in pixels; 0: the static schedules choose the height of their bands themselves. */
static uint32_t tile_edge(const struct settings *settings, const struct view *view,
                          uint32_t processors)
{
    enum schedule schedule = settings->farm.schedule;
    if (settings->farm.tile || schedule_is_static(schedule)) return settings->farm.tile;
    return queue_auto_edge(schedule, view->region_w, view->region_h, view->min_samples, processors);
}

/* The largest part of a time limit that a tile may be predicted to take. It is less than the 2 % by which a run
 * may be late, so that little is lost where the end of the limit cuts a tile off, however expensive samples are.
 * The prediction is that of probes: the other samples of a tile take down to a fifth of it. */
#define TILE_PART (1.0 / 64)

static struct queue_config queue_config_of(const struct run *run, const struct view *view,
                                           bool master_renders)
{
    const struct settings *settings = &run->job.settings;
    uint32_t processors = run->crowd.processors;
    return (struct queue_config){
        .schedule = settings->farm.schedule,
        .width = view->region_w,
        .height = view->region_h,
        .renderers = run->renderers,
        .master_renders = master_renders,
        .crowd = &run->crowd,
        .tile_edge = tile_edge(settings, view, processors),
        .probe_edge = queue_auto_probe_edge(view->region_w, view->region_h, view->min_samples),
        .samples = view->min_samples,
        .most_work = TILE_PART * settings->sampling.time_limit / view->min_samples};
}

/* Makes the queue for the renderers that there are; false after reporting that there are none, or too many tiles. */
static bool make_queue(struct run *run, const struct view *view)
{
    /* A single process with --check stands for a run with more of them. */
    bool alone = run->options.action == ACTION_CHECK && run->processes == 1;
    bool master_renders = run->job.settings.farm.master_renders || alone;
    uint32_t first = master_renders ? 0 : 1;
    run->renderers = (uint32_t)run->processes - first;
    if (run->renderers == 0) {
        user_error(
            NULL, 0,
            "nobody would render: with farm.master_renders = no, start at least 2 processes");
        return false;
    }
    crowd_init(&run->crowd, run->affinities + first, run->renderers);
    struct queue_config config = queue_config_of(run, view, master_renders);
    run->queue = queue_create(&config);
    if (run->queue) {
        run->report.tile_edge = queue_tile_edge(run->queue);
        return true;
    }
    user_error(NULL, 0,
               "the picture falls into more than %u tiles, expected fewer: a larger farm.tile",
               QUEUE_MAX_TILES);
    return false;
}

/* A folder is refused with the words that it is for other outputs. A link is not followed: journals are never behind
 * links. */
static bool journal_possible(const char *path)
{
    struct stat old;
    bool is_folder = lstat(path, &old) == 0 && S_ISDIR(old.st_mode);
    return is_folder ? output_writable(path, "output.journal") : journal_writable(path);
}

static bool outputs_writable(const struct settings *settings)
{
    if (!output_writable(settings->output.image, "output.image")) return false;
    if (*settings->output.error && !output_writable(settings->output.error, "output.error"))
        return false;
    if (*settings->output.journal && !journal_possible(settings->output.journal)) return false;
    if (!timeline_writable(settings)) return false;
    return !wants_report(settings) || output_writable(settings->output.report, "output.report");
}

static void describe_scene(struct report *report, const struct scene *scene)
{
    report->primitives = scene_primitive_count(scene);
    report->triangles = scene_triangle_count(scene);
    report->lights = scene->lights.count;
    report->scene_bytes = scene->bytes;
    report->features = scene_features(scene);
    report->image_width = scene->view.region_w;
    report->image_height = scene->view.region_h;
    report->min_samples = scene->view.min_samples;
    report->max_samples = scene->view.max_samples;
}

static void print_count(const char *before, uint64_t count, const char *name, const char *after)
{
    printf("%s%llu %s%s%s", before, (unsigned long long)count, name, count == 1 ? "" : "s", after);
}

/* Bounding box of all objects but planes. */
struct scene_box {
    bool any, planes; /* whether there are such objects, and planes */
    struct vec3 min, max;
};

static void find_box(const struct builder *builder, struct scene_box *box)
{
    struct outline *outline = outline_create(builder);
    box->any = outline_bounds(outline, &box->min, &box->max);
    box->planes = builder_kind_count(builder, PRIMITIVE_PLANE) > 0;
    outline_destroy(outline);
}

/* Significant digits: those of single precision, in which most meshes are made, and those that tell all doubles
 * apart. */
enum { BOX_DIGITS = 7, DOUBLE_DIGITS = 17 };

static double rounded(double value, int digits)
{
    char text[NUMBER_TEXT_SIZE];
    double shown = value; /* also where the text is no finite number */
    snprintf(text, sizeof text, "%.*g", digits, value);
    (void)number_parse(text, &shown);
    return shown;
}

/* The digits that show how far apart the ends are, to a thousandth: the box of a small thing far from the origin is not
 * flat. */
static int end_digits(double low, double high)
{
    double half = high / 2 - low / 2; /* which does not overflow */
    int digits = BOX_DIGITS;
    while (digits < DOUBLE_DIGITS &&
           !(fabs(rounded(high, digits) / 2 - rounded(low, digits) / 2 - half) <= half / 1000))
        digits++;
    return digits;
}

static void print_corner(const char *before, struct vec3 corner, const int digits[3])
{
    struct vec3 unsigned_zero = vec_add(corner, vec3(0, 0, 0));
    printf("%s %.*g %.*g %.*g", before, digits[0], unsigned_zero.x, digits[1], unsigned_zero.y,
           digits[2], unsigned_zero.z);
}

static void print_box(const struct scene_box *box)
{
    if (!box->any) return;
    const int digits[3] = {end_digits(box->min.x, box->max.x), end_digits(box->min.y, box->max.y),
                           end_digits(box->min.z, box->max.z)};
    printf("  bounding box%s:", box->planes ? " of all but planes" : "");
    print_corner(" from", box->min, digits);
    print_corner(" to", box->max, digits);
    putchar('\n');
}

/* Prints the result of --check for a valid scene. */
static int print_check(const struct run *run, const struct scene_box *box)
{
    const struct report *report = &run->report;
    char *name = printable_text(run->options.config);
    printf("%s: all right: ", name);
    print_count("", report->primitives, "primitive", "");
    print_count(" (", report->triangles, "triangle", ")");
    if (report->duplicates > 0) print_count(" without ", report->duplicates, "duplicate", "");
    print_count(", ", report->lights, "light", "");
    if (report->idle_lights > 0)
        printf(" and %llu that %s nothing", (unsigned long long)report->idle_lights,
               report->idle_lights == 1 ? "lights" : "light");
    printf(", %u x %u pixels\n", report->image_width, report->image_height);
    free(name);
    print_box(box);
    return close_output(NULL);
}

/* Whether rendering can start within the time limit; otherwise false after user_error(): the limit was over
 * while the scene was loaded, and no earlier run has left any sample either. Build and rendering would be in
 * vain. */
static bool starts_in_time(struct run *run)
{
    double limit = run->job.settings.sampling.time_limit, elapsed = clock_wall() - run->start;
    uint64_t pixels = canvas_pixels(&run->canvas);
    if (!(limit > 0) || elapsed < limit || adaptive_unsampled(run->adaptive) < pixels) return true;
    char *parts = start_times_text(&run->report.time);
    user_error(NULL, 0,
               "sampling.time_limit = %g s was over before any sample was taken, expected a longer "
               "one: scene and picture were in memory after %.3g s (%s)",
               limit, elapsed, parts);
    free(parts);
    save_drop(run->save);
    run->save = NULL;
    return false;
}

/* load(), make_scene() and open_rendering() return an exit status, or -1 to go on. */

static int load(struct run *run)
{
    const struct options *options = &run->options;
    enum reach reach = options->allow_outside ? REACH_ANYWHERE : REACH_FOLDER;
    if (!load_job(options->config, options->overrides, options->override_count, reach, &run->job))
        return STATUS_INPUT;
    if (options->action != ACTION_PRINT_CONFIG) return -1;
    char *text = print_job(&run->job);
    if (!text) return STATUS_INPUT;
    fputs(text, stdout);
    free(text);
    return close_output(NULL);
}

/* The caller frees *block in any case; NULL: there is none. */
static int make_scene(struct run *run, const struct view *view, struct scene **block)
{
    if (!make_queue(run, view)) return STATUS_INPUT;
    if (!outputs_writable(&run->job.settings)) return STATUS_INPUT;
    const char *reference = run->job.settings.sampling.reference;
    if (*reference && !truth_read(reference, view->region_w, view->region_h, &run->reference))
        return STATUS_INPUT;
    uint64_t added = builder_primitive_count(run->job.builder);
    uint64_t added_lights = builder_light_count(run->job.builder);
    *block = builder_finish(run->job.builder, view);
    const char *why;
    if (!scene_valid(*block, (*block)->bytes, &why)) {
        user_error(run->options.config, 0, "%s, expected a scene of ordinary size", why);
        return STATUS_INPUT;
    }
    warn_of_enclosed_lights(*block, run->options.config);
    describe_scene(&run->report, *block);
    run->report.duplicates = added - run->report.primitives;
    run->report.idle_lights = added_lights - run->report.lights;
    return -1;
}

/* Seconds for which nobody is told what they wait for. */
#define ROOM_PATIENCE 1.0

/* Clearing gigabytes takes seconds, and up to a minute where the system has to make room for them first. */
static void make_room(struct run *run, const struct view *view)
{
    const struct settings *settings = &run->job.settings;
    double start = clock_wall(), pixels = (double)view->region_w * view->region_h;
    size_t bytes = 3 * sizeof(float);
    if (settings_adaptive(settings)) bytes += adaptive_pixel_bytes();
    if (*settings->output.heatmap) bytes += sizeof *run->timeline.costs;
    char *text =
        format_text("preparing %.1f MB of memory for the picture", 1e-6 * (double)bytes * pixels);
    struct late_note note;
    late_note_start(&note, text, ROOM_PATIENCE);
    canvas_init(&run->canvas, view->region_w, view->region_h);
    if (settings_adaptive(settings))
        run->adaptive = adaptive_create(view, &run->canvas, settings->sampling.target_error);
    if (*settings->output.heatmap)
        timeline_record_costs(&run->timeline, view->region_w, view->region_h);
    late_note_end(&note);
    free(text);
    run->report.time.room = clock_wall() - start;
}

static int open_rendering(struct run *run, const struct view *view, const struct scene *block)
{
    const struct settings *settings = &run->job.settings;
    make_room(run, view);
    double start = clock_wall();
    bool opened = open_run_journal(run, block);
    run->report.time.resume = clock_wall() - start;
    if (!opened) return STATUS_INPUT;
    if (!starts_in_time(run)) return STATUS_FAILED;
    if (run->save && save_was_empty(run->save)) stop_removes(settings->output.journal);
    return -1;
}

int prepare(struct run *run, struct scene **block)
{
    double start = clock_wall();
    int status = load(run);
    if (status >= 0) return status;
    struct view view = settings_view(&run->job.settings);
    bool checks = run->options.action == ACTION_CHECK;
    struct scene_box box = {.any = false};
    if (checks) {
        output_only_warn();
        find_box(run->job.builder, &box); /* before builder_finish() takes the objects over */
    }
    status = make_scene(run, &view, block);
    run->report.time.load = clock_wall() - start;
    if (status < 0 && checks) status = print_check(run, &box);
    if (status < 0) status = open_rendering(run, &view, *block);
    if (status < 0) return status;
    free(*block);
    *block = NULL;
    return status;
}
