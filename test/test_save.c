/* Tests of saving: what a run has finished is there for the next one, with each pixel and second counted once, and
 * nothing else is. */
#include "test/save_fixture.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "common/clock.h"

static struct save *open_at(struct scratch *s, const char *path, struct canvas *canvas,
                            struct adaptive *adaptive)
{
    message_capture(s->said, sizeof s->said);
    struct save *save = save_open(path, scene, canvas, adaptive, TILES);
    message_capture(NULL, 0);
    assert_non_null(save);
    return save;
}

static struct save *open_save(struct scratch *s, struct canvas *canvas, struct adaptive *adaptive)
{
    return open_at(s, PATH, canvas, adaptive);
}

/* Ends the save; everything so far is in the journal. */
static void keep(struct save *save)
{
    struct save_kept kept = save_keep(save);
    assert_true(!kept.moved && !kept.original && kept.lost == 0 && kept.lost_pixels == 0 &&
                kept.lost_s == 0);
    assert_string_equal(kept.path, PATH);
    save_kept_free(&kept);
}

/* ---- all samples of a pixel at once ---- */

/* Fills a picture with values that are all different. */
static void fill(struct canvas *canvas)
{
    canvas_init(canvas, WIDTH, EDGE);
    for (int i = 0; i < 3 * PIXELS; i++)
        canvas->rgb[i] = (float)(i + 1);
}

/* Saves a tile that took 2 s, and one second more for each tile to the left of it. */
static void save_at(struct save *save, uint32_t x, uint32_t w)
{
    struct tile tile = tile_at(x, w, 0);
    struct result_header header = result_of(tile_pixels(&tile));
    header.busy_s += x / EDGE;
    save_tile(save, &tile, &header);
}

/* Checks that exactly these columns have come back. */
static void check_columns(const struct canvas *found, const struct canvas *whole, uint32_t begin,
                          uint32_t end)
{
    for (uint32_t i = 0; i < 3 * PIXELS; i++) {
        uint32_t x = i / 3 % WIDTH;
        assert_true(found->rgb[i] == (x >= begin && x < end ? whole->rgb[i] : 0));
    }
}

static void test_tiles_come_back(void **state)
{
    struct canvas whole, again;
    fill(&whole);
    canvas_init(&again, WIDTH, EDGE);
    struct save *save = open_save(*state, &whole, NULL);
    save_start(save, TILES, PIXELS);
    save_at(save, 0, EDGE);
    save_at(save, EDGE, EDGE);
    save_at(save, 0, 2 * EDGE); /* it brings nothing new: the same pixels as the others together */
    clock_sleep(0.02);          /* the thread has begun to wait */
    double begin = clock_wall();
    keep(save);
    assert_true(clock_wall() - begin < 0.9); /* the thread would have looked after a second */
    save = open_save(*state, &again, NULL);
    struct found *found = save_found(save);
    assert_true(found->count == 3 && found->pixels == 2 * EDGE * EDGE);
    check_columns(&again, &whole, 0, 2 * EDGE);
    struct tile first = tile_at(0, EDGE, 0), wider = tile_at(EDGE, EDGE + 1, 0);
    assert_int_equal(found_use(found, &first), EDGE * EDGE);
    assert_int_equal(found_use(found, &wider), EDGE * EDGE);
    /* A tile that is not there completely is rendered again, and its earlier time is not counted. */
    struct found_sums sums = found_sum(found);
    assert_true(sums.busy_s == 1 && sums.cpu_s == 0.5 && sums.repeated_s == 1);
    assert_true(sums.counts.rays[0] == 10 * EDGE * EDGE);
    save_start(save, 1, EDGE * EDGE);
    /* But its pixels are in the picture. */
    struct tile all = tile_at(0, WIDTH, 0);
    assert_int_equal(coverage_count(&found->all, &wider), EDGE * EDGE);
    assert_int_equal(coverage_count(&found->all, &all), 2 * EDGE * EDGE);
    save_drop(save);
    assert_int_equal(access(PATH, F_OK), -1);
    canvas_free(&whole);
    canvas_free(&again);
}

/* ---- adaptive sampling ---- */

/* A run that ends without a word: its journal is open until it is kept. */
struct run {
    struct canvas canvas;
    struct adaptive *adaptive;
    struct save *save;
};

static void run_open(struct run *run, struct scratch *s, double target)
{
    canvas_init(&run->canvas, WIDTH, EDGE);
    run->adaptive = adaptive_create(&view, &run->canvas, target);
    run->save = open_save(s, &run->canvas, run->adaptive);
}

static void run_close(struct run *run)
{
    adaptive_destroy(run->adaptive);
    canvas_free(&run->canvas);
}

static void render(struct run *run, uint32_t x, uint32_t w, bool saved)
{
    render_part(saved ? run->save : NULL, run->adaptive, x, w);
}

/* Passes are planned again as they were, also if the time for one was limited. Tiles that overlap count with their
 * share of the time. */
static void check_passes(struct scratch *s, double left_s)
{
    struct run first, next;
    run_open(&first, s, 1e-3);
    save_start(first.save, TILES, PIXELS);
    render(&first, 0, EDGE, true);
    render(&first, EDGE / 2, EDGE, true); /* one half of it is there already */
    render(&first, EDGE, 2 * EDGE, true); /* a quarter */
    render(&first, 0, EDGE, true);        /* all */
    assert_true(adaptive_plan(first.adaptive, left_s));
    render(&first, 0, EDGE, true);
    render(&first, EDGE, 2 * EDGE, true);
    assert_true(adaptive_plan(first.adaptive, HUGE_VAL));
    render(&first, 0, EDGE, true);
    keep(first.save);
    run_open(&next, s, 1e-3);
    const struct found *found = save_found(next.save);
    assert_true(found->count == 7 && found->pixels == PIXELS);
    assert_int_equal(adaptive_passes(next.adaptive), 3);
    assert_memory_equal(next.canvas.rgb, first.canvas.rgb, 3 * PIXELS * sizeof(float));
    assert_true(fabs(adaptive_seconds(next.adaptive) - (1 + 0.5 + 0.75 + 3)) < 1e-12);
    assert_true(found_sum(save_found(next.save)).busy_s ==
                3 * 2); /* pass 0 is asked for tile by tile */
    save_drop(next.save);
    run_close(&first);
    run_close(&next);
}

static void test_passes_come_back(void **state)
{
    check_passes(*state, HUGE_VAL);
    check_passes(*state, 3);
}

/* A pass 0 that was cut off, and passes for lattices after it: nothing of them is lost or rendered again. */
static void test_lattices_come_back(void **state)
{
    struct scratch *s = *state;
    struct run first, next;
    run_open(&first, s, 1e-3);
    save_start(first.save, TILES, PIXELS);
    render(&first, 0, EDGE, true);
    adaptive_cut(first.adaptive, 1000);
    assert_true(adaptive_plan(first.adaptive, 0));
    render(&first, 0, TILES * EDGE, true);
    assert_true(adaptive_plan(first.adaptive, HUGE_VAL));
    render(&first, EDGE, EDGE, true);
    keep(first.save);
    uint64_t unsampled = adaptive_unsampled(first.adaptive);
    assert_true(unsampled > 0 && unsampled < PIXELS - 2 * EDGE * EDGE);
    run_open(&next, s, 1e-3);
    const struct found *found = save_found(next.save);
    assert_true(found->count == 3 && found->pixels == EDGE * EDGE);
    assert_int_equal(adaptive_passes(next.adaptive), 3);
    assert_int_equal(adaptive_unsampled(next.adaptive), unsampled);
    assert_memory_equal(next.canvas.rgb, first.canvas.rgb, 3 * PIXELS * sizeof(float));
    found_use_all(save_found(next.save));
    assert_true(found_sum(save_found(next.save)).busy_s == 3 * 2 &&
                found_sum(save_found(next.save)).repeated_s == 0);
    save_drop(next.save);
    run_close(&first);
    run_close(&next);
}

/* If nothing of pass 0 is left, the samples of lattices elsewhere still count. */
static void test_lattices_alone_come_back(void **state)
{
    struct scratch *s = *state;
    struct run first, next;
    run_open(&first, s, 1e-3);
    save_start(first.save, TILES, PIXELS);
    render(&first, 0, EDGE, false);
    adaptive_cut(first.adaptive, 1000);
    assert_true(adaptive_plan(first.adaptive, 0));
    render(&first, 0, EDGE, true); /* by a plan that assumes pixels of pass 0 */
    render(&first, EDGE, EDGE, true);
    keep(first.save);
    run_open(&next, s, 1e-3);
    const struct found *found = save_found(next.save);
    assert_true(found->count == 1 && found->pixels == 0);
    assert_int_equal(adaptive_passes(next.adaptive), 2);
    uint64_t unsampled = adaptive_unsampled(next.adaptive);
    assert_true(unsampled < PIXELS && unsampled > PIXELS - EDGE * EDGE);
    save_drop(next.save);
    run_close(&first);
    run_close(&next);
}

/* A part is added to the samples that it was planned with, and not used if these are lost. */
static void test_lost_below(void **state)
{
    struct scratch *s = *state;
    struct run first, next;
    run_open(&first, s, 1e-3);
    save_start(first.save, TILES, PIXELS);
    render(&first, 0, EDGE, false);
    render(&first, EDGE / 2, EDGE, true);
    render(&first, 2 * EDGE, EDGE, true);
    keep(first.save);
    run_open(&next, s, 1e-3);
    assert_int_equal(save_found(next.save)->pixels, EDGE * EDGE);
    assert_non_null(strstr(s->said, "cannot be used"));
    save_drop(next.save);
    run_close(&first);
    run_close(&next);
}

/* ---- records are checked like messages ---- */

/* Makes a header that no run writes. */
static void make_strange(struct result_header *header, int way)
{
    if (way == 0) header->cpu_s = -1;
    if (way == 1) header->cpu_s = (double)NAN;
    if (way == 2) header->counts.truncation = (double)NAN;
}

/* Checks that a record with such a header, position and pass is not used by a run with a picture of this width. */
static void check_refused(struct scratch *s, bool adaptive, uint32_t x, uint32_t pass, int way,
                          uint32_t width)
{
    static float part[REFINED_FLOATS * PIXELS];
    struct tile tile = tile_at(x, EDGE, pass);
    struct result_header header = result_of(tile_pixels(&tile));
    make_strange(&header, way);
    for (int again = 0; again < 2; again++) {
        struct canvas canvas;
        canvas_init(&canvas, again ? width : WIDTH, EDGE);
        struct adaptive *plan = adaptive ? adaptive_create(&view, &canvas, 1e-3) : NULL;
        struct save *save = open_save(s, &canvas, plan);
        assert_int_equal(save_found(save)->count, 0);
        assert_int_equal(strstr(s->said, "cannot be used") != NULL, again);
        save_start(save, TILES, PIXELS);
        if (again)
            save_drop(save);
        else if (adaptive)
            save_part(save, &tile, &header, part), keep(save);
        else
            save_tile(save, &tile, &header), keep(save);
        adaptive_destroy(plan);
        canvas_free(&canvas);
    }
}

static void test_strange_records(void **state)
{
    for (int adaptive = 0; adaptive < 2; adaptive++) {
        for (int way = 0; way < 3; way++)
            check_refused(*state, adaptive, 0, 0, way, WIDTH);
        check_refused(*state, adaptive, EDGE, 0, -1, EDGE); /* outside of the picture */
        check_refused(*state, adaptive, 0, 1, -1, WIDTH);   /* of a pass that is not due */
    }
}

/* A disk without enough room is noticed before anything is rendered. */
static void test_room_is_looked_for(void **state)
{
    struct scratch *s = *state;
    struct canvas canvas;
    canvas_init(&canvas, WIDTH, EDGE);
    struct save *save = open_save(s, &canvas, NULL);
    assert_true(save_has_room(save, TILES, PIXELS));
    message_capture(s->said, sizeof s->said);
    assert_false(save_has_room(save, TILES, UINT64_C(1) << 58));
    message_capture(NULL, 0);
    assert_non_null(strstr(s->said, "free some space"));
    save_drop(save);
    canvas_free(&canvas);
}

/* Plans depend on the target, so a journal belongs to one target. */
static void test_other_target(void **state)
{
    struct scratch *s = *state;
    struct run first, next;
    run_open(&first, s, 1e-3);
    save_start(first.save, TILES, PIXELS);
    render(&first, 0, WIDTH, true);
    keep(first.save);
    run_open(&next, s, 2e-3);
    assert_int_equal(save_found(next.save)->count, 0);
    assert_non_null(strstr(s->said, "another picture"));
    save_drop(next.save);
    assert_int_equal(unlink(PATH ".1"), 0);
    run_close(&first);
    run_close(&next);
}

/* ---- where nothing can be written ---- */

/* The number of copies of a.journal in all folders that are tried. */
static unsigned count_copies(void)
{
    unsigned copies = 0;
    const char *folders[] = {".", "tmp", "/var/tmp", "/dev/shm"};
    for (int i = 0; i < 4; i++) {
        char path[64];
        snprintf(path, sizeof path, "%s/a-%ld.journal", folders[i], (long)getpid());
        copies += access(path, F_OK) == 0;
    }
    return copies;
}

/* No file may be larger than one tile of three: the loss is reported, and the rest stays in its file, as no other
 * place has more room. */
static void test_no_room_anywhere(void **state)
{
    struct scratch *s = *state;
    struct canvas whole, again;
    struct rlimit before;
    fill(&whole);
    canvas_init(&again, WIDTH, EDGE);
    assert_int_equal(mkdir("tmp", 0700) + setenv("TMPDIR", "tmp", 1), 0);
    struct save *save = open_save(s, &whole, NULL);
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &(struct rlimit){2 * EDGE * EDGE * 3 * sizeof(float),
                                                              before.rlim_max}),
                     0);
    message_capture(s->said, sizeof s->said);
    save_start(save, 0, 0); /* no space is reserved */
    for (uint32_t i = 0; i < TILES; i++)
        save_at(save, i * EDGE, EDGE);
    struct save_kept kept = save_keep(save);
    message_capture(NULL, 0);
    setrlimit(RLIMIT_FSIZE, &before);
    assert_false(kept.moved);
    assert_true(kept.lost == 2 && kept.lost_pixels == 2 * EDGE * EDGE && kept.lost_s == 3 + 4);
    assert_int_equal(count_copies(), 0);
    save = open_at(s, kept.path, &again, NULL);
    check_columns(&again, &whole, 0, EDGE);
    save_drop(save);
    save_kept_free(&kept);
    canvas_free(&whole);
    canvas_free(&again);
}

/* If the journal's folder was removed, everything is written to another one. */
static void test_folder_is_gone(void **state)
{
    struct scratch *s = *state;
    struct canvas whole, again;
    fill(&whole);
    canvas_init(&again, WIDTH, EDGE);
    assert_int_equal(mkdir("there", 0700), 0);
    struct save *save = save_open("there/" PATH, scene, &whole, NULL, TILES);
    assert_non_null(save);
    save_start(save, TILES, PIXELS);
    save_at(save, 0, WIDTH);
    assert_int_equal(unlink("there/" PATH) + rmdir("there"), 0);
    struct save_kept kept = save_keep(save);
    assert_true(kept.moved && !kept.original && kept.lost == 0 && count_copies() == 1);
    assert_int_equal(strncmp(kept.path, "./", 2), 0); /* the first folder that can be written to */
    save = open_at(s, kept.path, &again, NULL);
    check_columns(&again, &whole, 0, WIDTH);
    save_drop(save);
    save_kept_free(&kept);
    canvas_free(&whole);
    canvas_free(&again);
}

/* Writes to the file at this inode fail, as if its disk were full. */
static ino_t full;

ssize_t __real_pwrite(int file, const void *bytes, size_t count, off_t offset);
ssize_t __wrap_pwrite(int file, const void *bytes, size_t count, off_t offset);
ssize_t __wrap_pwrite(int file, const void *bytes, size_t count, off_t offset)
{
    struct stat status;
    if (full && fstat(file, &status) == 0 && status.st_ino == full) {
        errno = ENOSPC;
        return -1;
    }
    return __real_pwrite(file, bytes, count, offset);
}

/* Saves a picture, the last two thirds of which find no room at path. */
static struct save_kept keep_on_full_disk(struct scratch *s, struct canvas *whole, const char *path)
{
    struct stat status;
    struct save *save = open_at(s, path, whole, NULL);
    save_start(save, TILES, PIXELS);
    save_at(save, 0, EDGE);
    struct save_kept first = save_keep(save);
    save_kept_free(&first);
    save = open_at(s, path, whole, NULL);
    assert_int_equal(stat(path, &status), 0);
    save_start(save, TILES, PIXELS);
    save_at(save, EDGE, 2 * EDGE);
    full = status.st_ino;
    message_capture(s->said, sizeof s->said);
    struct save_kept kept = save_keep(save);
    message_capture(NULL, 0);
    full = 0;
    return kept;
}

/* Where the journal's own disk is full, everything is written elsewhere, and the part of it on that disk is removed:
 * the picture may need the room. */
static void test_disk_is_full(void **state)
{
    struct scratch *s = *state;
    struct canvas whole, again;
    fill(&whole);
    canvas_init(&again, WIDTH, EDGE);
    struct save_kept kept = keep_on_full_disk(s, &whole, PATH);
    assert_true(kept.moved && kept.lost == 0 && count_copies() == 1);
    assert_null(kept.original);
    assert_int_equal(access(PATH, F_OK), -1);
    struct save *save = open_at(s, kept.path, &again, NULL);
    check_columns(&again, &whole, 0, WIDTH);
    save_drop(save);
    save_kept_free(&kept);
    canvas_free(&whole);
    canvas_free(&again);
}

static struct stat status_of(const char *path)
{
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    return status;
}

/* Saves a tile of a run of 2000 tiles, and waits until the thread has written it. */
static struct save *begin_long_run(struct scratch *s, struct canvas *whole)
{
    struct save *save = open_save(s, whole, NULL);
    off_t bare = status_of(PATH).st_size;
    save_start(save, 2000, PIXELS);
    save_at(save, 0, EDGE);
    while (status_of(PATH).st_size == bare)
        clock_sleep(0.01);
    return save;
}

/* At the end of a run all that has come is in the journal, and the space that was reserved for more is free again. */
static void test_space_is_given_back(void **state)
{
    struct canvas whole, again;
    fill(&whole);
    canvas_init(&again, WIDTH, EDGE);
    struct save *save = begin_long_run(*state, &whole);
    blkcnt_t reserved = status_of(PATH).st_blocks;
    save_at(save, EDGE, 2 * EDGE);
    save_finish(save);
    if (reserved * 512 >= 2000 * 64) /* else this file system reserves nothing */
        assert_true(status_of(PATH).st_blocks < reserved / 4);
    keep(save);
    save = open_save(*state, &again, NULL);
    check_columns(&again, &whole, 0, WIDTH);
    save_drop(save);
    canvas_free(&whole);
    canvas_free(&again);
}

/* On a full disk the end of a run warns of nothing: the picture may be written all the same. */
static void test_full_at_the_end(void **state)
{
    struct scratch *s = *state;
    struct canvas whole;
    struct rlimit before;
    fill(&whole);
    struct save *save = open_save(s, &whole, NULL);
    rlim_t bare = (rlim_t)status_of(PATH).st_size;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &(struct rlimit){bare, before.rlim_max}), 0);
    message_capture(s->said, sizeof s->said);
    save_start(save, 0, 0); /* no space is reserved */
    save_at(save, 0, EDGE);
    save_finish(save);
    message_capture(NULL, 0);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_string_equal(s->said, "");
    save_drop(save);
    canvas_free(&whole);
}

/* A run of less than a second writes nothing at its end, either. */
static void test_short_run_writes_nothing(void **state)
{
    struct canvas whole;
    fill(&whole);
    struct save *save = open_save(*state, &whole, NULL);
    off_t bare = status_of(PATH).st_size;
    save_start(save, TILES, PIXELS);
    save_at(save, 0, EDGE);
    save_finish(save);
    assert_int_equal(status_of(PATH).st_size, bare);
    keep(save);
    assert_true(status_of(PATH).st_size > bare);
    save_finish(NULL);
    canvas_free(&whole);
}

/* A copy in memory, as the current folder is there, replaces no file on a disk: that is named. */
static void test_saved_in_memory(void **state)
{
    struct scratch *s = *state;
    struct canvas whole;
    char folder[] = "/dev/shm/farm-test-XXXXXX";
    if (!scratch_in_memory("/dev/shm") || scratch_in_memory(".")) skip();
    fill(&whole);
    char *path = format_text("%s/%s", s->folder, PATH);
    assert_true(mkdtemp(folder) && chdir(folder) == 0);
    struct save_kept kept = keep_on_full_disk(s, &whole, path);
    assert_true(kept.moved && kept.lost == 0);
    assert_string_equal(kept.original, path);
    assert_int_equal(unlink(kept.path) + unlink(path), 0);
    assert_int_equal(chdir(s->folder) + rmdir(folder), 0);
    save_kept_free(&kept);
    free(path);
    canvas_free(&whole);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tiles_come_back),
        cmocka_unit_test(test_strange_records),
        cmocka_unit_test(test_room_is_looked_for),
        cmocka_unit_test(test_passes_come_back),
        cmocka_unit_test(test_lattices_come_back),
        cmocka_unit_test(test_lattices_alone_come_back),
        cmocka_unit_test(test_lost_below),
        cmocka_unit_test(test_other_target),
        cmocka_unit_test(test_no_room_anywhere),
        cmocka_unit_test(test_folder_is_gone),
        cmocka_unit_test(test_disk_is_full),
        cmocka_unit_test(test_saved_in_memory),
        cmocka_unit_test(test_space_is_given_back),
        cmocka_unit_test(test_full_at_the_end),
        cmocka_unit_test(test_short_run_writes_nothing),
    };
    return cmocka_run_group_tests(tests, scene_open, scene_close);
}
