/* What a run takes over from the journal of an earlier one, what it says of that, and of what it leaves itself. */
#include "test/save_fixture.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/syscall.h>

#include "master/journal.h"
#include "master/run.h"
#include "master/text_file.h"
#include "test/text.h"

/* ---- a disk that this file controls, by defining functions of the C library ---- */

/* Free bytes. */
static unsigned long room = ULONG_MAX;

int fstatvfs(int file, struct statvfs *system)
{
    (void)file;
    *system = (struct statvfs){.f_bsize = 4096, .f_frsize = 1, .f_bfree = ULONG_MAX};
    system->f_bavail = room;
    return 0;
}

/* Nothing can be written to the file at this inode; full_everywhere: to none. */
static ino_t full;
static bool full_everywhere;

ssize_t pwrite(int file, const void *bytes, size_t count, off_t offset)
{
    struct stat status;
    if (full_everywhere || (full && fstat(file, &status) == 0 && status.st_ino == full)) {
        errno = ENOSPC;
        return -1;
    }
    return syscall(SYS_pwrite64, file, bytes, count, offset);
}

/* The number of the sync that fails, from now on; 0: none. */
static unsigned failing_sync;

int fdatasync(int file)
{
    if (failing_sync > 0 && --failing_sync == 0) {
        errno = EIO;
        return -1;
    }
    return (int)syscall(SYS_fdatasync, file);
}

/* ---- runs ---- */

static const struct queue_config by_tiles = {
    .width = WIDTH, .height = EDGE, .renderers = 2, .tile_edge = EDGE};

/* Four times as many. */
static const struct queue_config by_small_tiles = {
    .width = WIDTH, .height = EDGE, .renderers = 2, .tile_edge = EDGE / 2};

/* Strips of half the height, each a band. */
static const struct queue_config by_strips = {.schedule = SCHEDULE_STRIPS,
                                              .width = WIDTH,
                                              .height = EDGE,
                                              .renderers = 2,
                                              .tile_edge = EDGE / 2};

/* A run before it has looked for its journal. Eight renderers share four cores. Freed by run_close(). */
static void run_open(struct run *run, const struct queue_config *config, bool adaptive)
{
    static char program[] = "farm", scene_file[] = "a.ini";
    static char *arguments[] = {program, scene_file, NULL};
    *run = (struct run){.arguments = arguments,
                        .crowd = {.renderers = 8, .processors = 4},
                        .queue = queue_create(config),
                        .processes = 1};
    settings_init(&run->job.settings);
    run->job.settings.farm.schedule = config->schedule;
    set_text(&run->job.settings.output.journal, PATH);
    canvas_init(&run->canvas, WIDTH, EDGE);
    if (adaptive) run->adaptive = adaptive_create(&view, &run->canvas, 1e-3);
}

static void run_close(struct run *run)
{
    adaptive_destroy(run->adaptive);
    canvas_free(&run->canvas);
    queue_destroy(run->queue);
    settings_free(&run->job.settings);
}

static bool open_journal(struct scratch *s, struct run *run)
{
    message_capture(s->said, sizeof s->said);
    bool opened = open_run_journal(run, scene);
    message_capture(NULL, 0);
    return opened;
}

/* Keeps the journal, or not; returns what is printed, which the caller frees. */
static char *keep(struct run *run, bool kept)
{
    struct text_file text;
    int printed = open("printed", O_WRONLY | O_CREAT | O_TRUNC, 0600), error = dup(STDERR_FILENO);
    dup2(printed, STDERR_FILENO);
    bool done = keep_run_journal(run, "to end it");
    dup2(error, STDERR_FILENO);
    close(printed);
    close(error);
    assert_int_equal(done, kept);
    assert_null(run->save);
    assert_true(text_file_read("printed", 1 << 16, &text));
    return text.text;
}

/* The run ends, and prints exactly this. */
static void check_kept(struct run *run, const char *expected)
{
    char *text = keep(run, true);
    assert_string_equal(text, expected);
    free(text);
    run_close(run);
}

/* ---- earlier runs ---- */

static void leave(struct save *save)
{
    struct save_kept kept = save_keep(save);
    assert_false(kept.moved);
    save_kept_free(&kept);
}

/* Leaves a journal with these tiles, of which the i-th has taken i times as long as result_of() says. */
static void leave_tiles(const struct tile *tiles, unsigned count)
{
    struct canvas canvas;
    canvas_init(&canvas, WIDTH, EDGE);
    struct save *save = save_open(PATH, scene, &canvas, NULL, TILES);
    assert_non_null(save);
    save_start(save, TILES, PIXELS);
    for (unsigned i = 0; i < count; i++) {
        struct result_header header = result_of(tile_pixels(&tiles[i]));
        header.busy_s *= i + 1;
        header.cpu_s *= i + 1;
        save_tile(save, &tiles[i], &header);
    }
    leave(save);
    canvas_free(&canvas);
}

static void leave_first_tiles(unsigned count)
{
    const struct tile tiles[] = {tile_at(0, EDGE, 0), tile_at(EDGE, EDGE, 0)};
    leave_tiles(tiles, count);
}

/* A run with adaptive sampling whose journal is open. */
struct sampling {
    struct canvas canvas;
    struct adaptive *adaptive;
    struct save *save;
};

static void begin_sampling(struct sampling *sampling)
{
    canvas_init(&sampling->canvas, WIDTH, EDGE);
    sampling->adaptive = adaptive_create(&view, &sampling->canvas, 1e-3);
    sampling->save = save_open(PATH, scene, &sampling->canvas, sampling->adaptive, TILES);
    assert_non_null(sampling->save);
    save_start(sampling->save, TILES, PIXELS);
}

/* Returns how many pixels have samples. */
static uint64_t end_sampling(struct sampling *sampling)
{
    uint64_t sampled = PIXELS - adaptive_unsampled(sampling->adaptive);
    leave(sampling->save);
    adaptive_destroy(sampling->adaptive);
    canvas_free(&sampling->canvas);
    return sampled;
}

/* Leaves a journal with so many whole passes, and a part of the next one that has this width. */
static void leave_passes(unsigned passes, uint32_t width)
{
    struct sampling sampling;
    begin_sampling(&sampling);
    for (unsigned i = 0; i < passes; i++) {
        render_part(sampling.save, sampling.adaptive, 0, WIDTH);
        assert_true(adaptive_plan(sampling.adaptive, HUGE_VAL));
    }
    render_part(sampling.save, sampling.adaptive, 0, width);
    end_sampling(&sampling);
}

/* Leaves a journal with a tile of pass 0, which was cut off, and the pass for a lattice after it. Returns how many
 * pixels have samples. */
static uint64_t leave_lattice(uint32_t width)
{
    struct sampling sampling;
    begin_sampling(&sampling);
    render_part(sampling.save, sampling.adaptive, 0, width);
    adaptive_cut(sampling.adaptive, 1000);
    assert_true(adaptive_plan(sampling.adaptive, 0));
    render_part(sampling.save, sampling.adaptive, 0, WIDTH);
    return end_sampling(&sampling);
}

/* The same without the tile, of which only a part of the lattice beside it is left. */
static void leave_lattice_alone(void)
{
    struct sampling sampling;
    begin_sampling(&sampling);
    render_part(NULL, sampling.adaptive, 0, EDGE);
    adaptive_cut(sampling.adaptive, 1000);
    assert_true(adaptive_plan(sampling.adaptive, 0));
    render_part(sampling.save, sampling.adaptive, EDGE, EDGE);
    end_sampling(&sampling);
}

/* ---- taking over ---- */

static void test_no_journal(void **state)
{
    struct scratch *s = *state;
    struct run run;
    run_open(&run, &by_tiles, false);
    set_text(&run.job.settings.output.journal, "");
    assert_true(open_journal(s, &run));
    assert_true(!run.save && !*s->said);
    char *text = keep(&run, false);
    assert_string_equal(text,
                        "farm: nothing is kept for another run, because output.journal is empty\n");
    free(text);
    run_close(&run);
}

/* Without an earlier run everything is left to do. */
static void test_nothing_found(void **state)
{
    struct scratch *s = *state;
    static const struct resumed nothing;
    for (int adaptive = 0; adaptive < 2; adaptive++) {
        struct run run;
        run_open(&run, &by_small_tiles, adaptive);
        assert_true(open_journal(s, &run));
        assert_true(run.save && !*s->said);
        assert_memory_equal(&run.report.resumed, &nothing, sizeof nothing);
        assert_true(tiles_left(&run) == 4 * TILES && pixels_left(&run) == PIXELS);
        save_drop(run.save);
        run_close(&run);
    }
}

static void test_tiles(void **state)
{
    struct scratch *s = *state;
    leave_first_tiles(2);
    struct run run;
    run_open(&run, &by_tiles, false);
    assert_true(open_journal(s, &run));
    assert_string_equal(s->said, "farm: going on with " PATH ": 66.7 % of the pixels, "
                                 "3.0 s of CPU time saved\n");
    const struct resumed *resumed = &run.report.resumed;
    assert_true(resumed->tiles == 2 && resumed->pixels == 2 * EDGE * EDGE && resumed->records == 2);
    assert_true(resumed->seconds == 6 && resumed->cpu_s == 3 && resumed->repeated_s == 0);
    assert_true(resumed->render_s == 3. / 4); /* on four cores */
    assert_int_equal(resumed->counts.rays[0], 10 * 2 * EDGE * EDGE);
    assert_true(tiles_left(&run) == 1 && pixels_left(&run) == EDGE * EDGE);
    check_kept(&run, "farm: 66.7 % of the pixels are saved in " PATH "; to end it: farm a.ini\n");
    assert_int_equal(unlink(PATH), 0);
}

/* What is found only in part is rendered again as a whole: of a fixed share each tile, otherwise the smallest. */
static void test_again(void **state)
{
    struct scratch *s = *state;
    const struct tile whole = {.w = WIDTH, .h = EDGE / 2, .step = 1};
    const struct tile part = {.y = EDGE / 2, .w = EDGE, .h = EDGE / 2, .step = 1};
    leave_tiles((struct tile[]){whole, part}, 2);
    struct run run;
    run_open(&run, &by_strips, false);
    assert_true(open_journal(s, &run));
    assert_string_equal(s->said,
                        "farm: going on with " PATH ": 66.7 % of the pixels, but 16.7 % of the "
                        "pixels are rendered again (farm.schedule=dynamic keeps them), 1.0 s of "
                        "CPU time saved\n");
    assert_int_equal(run.report.resumed.pixels, WIDTH * EDGE / 2);
    assert_true(run.report.resumed.seconds == 2 && run.report.resumed.repeated_s == 4);
    assert_int_equal(pixels_left(&run), WIDTH * EDGE / 2);
    save_drop(run.save);
    run_close(&run);
    leave_tiles(&(struct tile){.w = 1, .h = EDGE, .step = 1}, 1);
    run_open(&run, &by_tiles, false);
    assert_true(open_journal(s, &run));
    assert_string_equal(s->said,
                        "farm: going on with " PATH ": 2.1 % of the pixels, but 2.1 % of the "
                        "pixels are rendered again, 0.0 s of CPU time saved\n");
    assert_int_equal(pixels_left(&run), PIXELS);
    save_drop(run.save);
    run_close(&run);
}

/* What is found after the first pass is in pixels that all have samples. */
static void test_passes(void **state)
{
    struct scratch *s = *state;
    static const struct {
        unsigned passes;
        uint32_t width;
        const char *found, *kept;
    } runs[] = {
        {0, EDGE, "in pass 1: 33.3 % of the pixels, 1.0 s", "33.3 % of the pixels of pass 1 are"},
        {0, WIDTH, "after pass 1: 100.0 % of the pixels, 1.0 s",
         "100.0 % of the pixels of pass 1 are"},
        {1, EDGE, "in pass 2: 2.0 s", "pass 1 and what is finished of pass 2 are"},
        {1, WIDTH, "after pass 2: 2.0 s", "pass 1 and what is finished of pass 2 are"},
        {2, EDGE, "in pass 3: 3.0 s", "passes 1 and 2 and what is finished of pass 3 are"}};
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        char expected[256];
        bool all = runs[i].passes > 0 || runs[i].width == WIDTH;
        leave_passes(runs[i].passes, runs[i].width);
        struct run run;
        run_open(&run, &by_tiles, true);
        assert_true(open_journal(s, &run));
        snprintf(expected, sizeof expected, "farm: going on with " PATH " %s of CPU time saved\n",
                 runs[i].found);
        assert_string_equal(s->said, expected);
        assert_int_equal(run.report.resumed.pixels, all ? PIXELS : EDGE * EDGE);
        assert_int_equal(run.report.resumed.tiles, all ? TILES : 1);
        assert_int_equal(run.report.resumed.records, runs[i].passes + 1);
        assert_int_equal(tiles_left(&run), all ? 0 : TILES - 1);
        assert_int_equal(pixels_left(&run), all ? 0 : PIXELS - EDGE * EDGE);
        snprintf(expected, sizeof expected, "farm: %s saved in " PATH "; to end it: farm a.ini\n",
                 runs[i].kept);
        check_kept(&run, expected);
        assert_int_equal(unlink(PATH), 0);
    }
}

static void check_lattice(struct scratch *s, uint32_t width)
{
    char expected[256];
    uint64_t sampled = leave_lattice(width), left = PIXELS - sampled;
    struct run run;
    run_open(&run, &by_tiles, true);
    assert_true(open_journal(s, &run));
    assert_string_equal(s->said,
                        "farm: going on with " PATH " after pass 2: 2.0 s of CPU time saved\n");
    assert_true(queue_complete(run.queue));
    assert_int_equal(run.report.resumed.pixels, sampled);
    assert_true(left >= 256 && pixels_left(&run) == left);
    assert_int_equal(tiles_left(&run), left / 256);
    snprintf(expected, sizeof expected,
             "farm: the first samples of %.1f %% of the pixels are saved in " PATH
             "; to end it: farm a.ini\n",
             100 * (double)sampled / PIXELS);
    check_kept(&run, expected);
    assert_int_equal(unlink(PATH), 0);
}

/* After a pass 0 that was cut off, what is left of it is not rendered any more, and all that was found is used, be it
 * less than the smallest tile. */
static void test_lattice(void **state)
{
    check_lattice(*state, EDGE);
    check_lattice(*state, 1);
}

static void test_not_opened(void **state)
{
    struct scratch *s = *state;
    assert_int_equal(mkdir(PATH, 0700), 0);
    struct run run;
    run_open(&run, &by_tiles, false);
    assert_false(open_journal(s, &run));
    assert_null(run.save);
    assert_has(s->said, "is no regular file");
    run_close(&run);
    assert_int_equal(rmdir(PATH), 0);
}

/* Whether the journal can be opened on a disk with this room; it is closed again, and its file stays. */
static bool opens_with(struct scratch *s, bool adaptive, unsigned long bytes)
{
    struct run run;
    run_open(&run, &by_tiles, adaptive);
    room = bytes;
    bool opened = open_journal(s, &run);
    room = ULONG_MAX;
    assert_true(opened == (run.save != NULL));
    assert_true(opened == !strstr(s->said, "free some space"));
    if (opened) leave(run.save);
    run_close(&run);
    return opened;
}

/* The head of a part in a record (master/save.c), which is the longest. */
struct part_head {
    double cpu_s;
    struct render_counts counts;
    uint64_t plan;
    double limit;
};

/* Without room for the rest nothing is rendered; what an earlier run has left stays. */
static void test_no_room(void **state)
{
    struct scratch *s = *state;
    struct stat before, after;
    unsigned long tile =
        4 * journal_record_bytes(sizeof(struct part_head)) + EDGE * EDGE * 3 * sizeof(float);
    assert_true(opens_with(s, false, 3 * tile));
    assert_int_equal(access(PATH, F_OK), -1); /* nothing was saved */
    assert_false(opens_with(s, false, 3 * tile - 1));
    assert_int_equal(access(PATH, F_OK), -1);
    leave_first_tiles(2);
    assert_int_equal(stat(PATH, &before), 0);
    assert_true(opens_with(s, false, tile));
    assert_false(opens_with(s, false, tile - 1));
    assert_int_equal(stat(PATH, &after), 0);
    assert_true(after.st_size == before.st_size && after.st_size > EDGE * EDGE * 2);
    assert_int_equal(unlink(PATH), 0);
    /* Also where all of pass 0 is lost: what a later pass has brought counts. */
    leave_lattice_alone();
    assert_false(opens_with(s, true, 0));
    assert_has(s->said, "farm: going on with " PATH " in pass 2: 1.0 s of CPU time saved\n");
    assert_int_equal(unlink(PATH), 0);
}

/* ---- keeping ---- */

/* A run that goes on with one tile finds no room for the last `tiles` of three, anywhere or in the journal's own file.
 * counted: its queue knows that all three are finished. */
static void fill_disk(struct scratch *s, struct run *run, bool everywhere, uint32_t tiles,
                      bool counted)
{
    struct stat status;
    struct tile lot[LOT_TILES];
    leave_first_tiles(1);
    assert_int_equal(stat(PATH, &status), 0);
    run_open(run, &by_tiles, false);
    assert_true(open_journal(s, run));
    save_start(run->save, TILES, PIXELS);
    for (uint32_t i = TILES - tiles; i < TILES; i++) {
        struct tile tile = tile_at(i * EDGE, EDGE, 0);
        struct result_header header = result_of(tile_pixels(&tile));
        save_tile(run->save, &tile, &header);
    }
    for (uint32_t count; counted && (count = queue_next(run->queue, 0, 0, lot)) > 0;)
        for (uint32_t i = 0; i < count; i++)
            queue_finish(run->queue, 0, lot[i].id, 1, 1);
    full = status.st_ino;
    full_everywhere = everywhere;
}

static void empty_disk(struct run *run)
{
    full = 0;
    full_everywhere = false;
    run_close(run);
}

/* Tiles that could be saved nowhere are told, and not counted as saved. */
static void test_lost(void **state)
{
    static const struct {
        uint32_t tiles;
        bool counted;
        const char *lost, *saved;
    } runs[] = {{2, true, "2 finished tiles (4.0 s", "33.3 %"},
                {2, false, "2 finished tiles (4.0 s", "0.0 %"},
                {1, true, "1 finished tile (2.0 s", "66.7 %"}};
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        struct run run;
        fill_disk(*state, &run, true, runs[i].tiles, runs[i].counted);
        char *text = keep(&run, true);
        char *expected =
            format_text("\nfarm: %s of rendering) could be saved nowhere\n"
                        "farm: %s of the pixels are saved in " PATH "; to go on: farm a.ini\n",
                        runs[i].lost, runs[i].saved);
        assert_has(text, expected);
        free(text);
        free(expected);
        empty_disk(&run);
        assert_int_equal(unlink(PATH), 0);
    }
}

/* Where that is so of all tiles, no journal is left. */
static void test_all_lost(void **state)
{
    struct run run;
    run_open(&run, &by_tiles, false);
    assert_true(open_journal(*state, &run));
    save_start(run.save, TILES, PIXELS);
    full_everywhere = true;
    const struct tile tile = tile_at(0, EDGE, 0);
    const struct result_header header = result_of(tile_pixels(&tile));
    save_tile(run.save, &tile, &header);
    char *text = keep(&run, true);
    assert_has(text, "\nfarm: 1 finished tile (2.0 s of rendering) could be saved nowhere\n"
                     "farm: nothing is saved; to begin again: farm a.ini\n");
    assert_int_equal(access(PATH, F_OK), -1);
    free(text);
    empty_disk(&run);
}

/* Nor is anything saved where the journal was removed, with what was in it, and there is no room for a copy. */
static void test_removed(void **state)
{
    for (uint32_t tiles = 0; tiles < 2; tiles++) { /* beside the one in the file */
        struct run run;
        fill_disk(*state, &run, true, tiles, true);
        assert_int_equal(unlink(PATH), 0);
        char *text = keep(&run, true);
        assert_has(text, PATH ": the journal was removed, and could be saved nowhere else\n"
                              "farm: nothing is saved; to begin again: farm a.ini\n");
        free(text);
        empty_disk(&run);
    }
}

/* The command names the place that the journal was moved to. Where the original could not be removed, it is named,
 * too. */
static void test_moved(void **state)
{
    for (int stays = 0; stays < 2; stays++) {
        struct run run;
        fill_disk(*state, &run, false, TILES - 1, true);
        failing_sync = stays ? 2 : 0; /* the first one is that of the copy */
        char *text = keep(&run, true);
        failing_sync = 0;
        char *path = format_text("./a-%ld.journal", (long)getpid());
        char *line = format_text("farm: 100.0 %% of the pixels are saved in %s; to end it: farm "
                                 "a.ini output.journal=%s\n",
                                 path, path);
        assert_has(text, line);
        bool told = strstr(text, "\nfarm: " PATH " stays, too: it holds less, and can be removed "
                                 "if its room is needed\n");
        assert_int_equal(told, stays);
        assert_null(strstr(text, "nowhere"));
        assert_int_equal(unlink(path), 0);
        assert_int_equal(unlink(PATH), stays ? 0 : -1);
        free(text);
        free(line);
        free(path);
        empty_disk(&run);
    }
}

/* A name that a terminal would take for a command is shown without it. */
static void test_strange_name(void **state)
{
    struct scratch *s = *state;
    struct run run;
    run_open(&run, &by_tiles, false);
    set_text(&run.job.settings.output.journal, "a\033c.journal");
    assert_true(open_journal(s, &run));
    const struct tile tile = tile_at(0, EDGE, 0);
    const struct result_header header = result_of(tile_pixels(&tile));
    save_start(run.save, TILES, PIXELS);
    save_tile(run.save, &tile, &header); /* the queue does not know */
    check_kept(&run, "farm: 0.0 % of the pixels are saved in a?c.journal; to end it: farm a.ini\n");
    assert_int_equal(unlink("a\033c.journal"), 0);
}

static void check_command(struct scratch *s, int processes, int neighbours, const char *command)
{
    char expected[256];
    struct run run;
    leave_first_tiles(1);
    run_open(&run, &by_tiles, false);
    run.processes = processes;
    run.neighbour_count = neighbours;
    assert_true(open_journal(s, &run));
    snprintf(expected, sizeof expected, "farm: 33.3 %% of the pixels are saved in " PATH "; %s\n",
             command);
    check_kept(&run, expected);
    assert_int_equal(unlink(PATH), 0);
}

/* A run that is ended before any tile is finished leaves no journal. */
static void test_nothing_saved(void **state)
{
    struct run run;
    run_open(&run, &by_tiles, false);
    assert_true(open_journal(*state, &run));
    save_start(run.save, TILES, PIXELS);
    check_kept(&run, "farm: nothing is saved yet; to begin again: farm a.ini\n");
    assert_int_equal(access(PATH, F_OK), -1);
}

/* Nor does it look for another place, if the file is gone from its own. */
static void test_nothing_to_rescue(void **state)
{
    struct run run;
    run_open(&run, &by_tiles, false);
    assert_true(open_journal(*state, &run));
    save_start(run.save, TILES, PIXELS);
    assert_int_equal(unlink(PATH), 0);
    check_kept(&run, "farm: nothing is saved yet; to begin again: farm a.ini\n");
}

/* The command starts as many processes as there were, if mpiexec on this machine did. */
static void test_command(void **state)
{
    static const char *const same_way = "to end it, start it in the same way: farm a.ini";
    check_command(*state, 3, 3, same_way);
    setenv("PMI_FD", "1000", 1);
    setenv("HYDI_CONTROL_FD", "1000", 1);
    stop_install(0);
    check_command(*state, 3, 3, "to end it: mpiexec -n 3 farm a.ini");
    check_command(*state, 3, 2, same_way);
    check_command(*state, 1, 0, "to end it: farm a.ini");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_journal),
        cmocka_unit_test(test_nothing_found),
        cmocka_unit_test(test_tiles),
        cmocka_unit_test(test_again),
        cmocka_unit_test(test_passes),
        cmocka_unit_test(test_lattice),
        cmocka_unit_test(test_not_opened),
        cmocka_unit_test(test_no_room),
        cmocka_unit_test(test_lost),
        cmocka_unit_test(test_all_lost),
        cmocka_unit_test(test_removed),
        cmocka_unit_test(test_moved),
        cmocka_unit_test(test_strange_name),
        cmocka_unit_test(test_nothing_saved),
        cmocka_unit_test(test_nothing_to_rescue),
        cmocka_unit_test(test_command),
    };
    return cmocka_run_group_tests(tests, scene_open, scene_close);
}
