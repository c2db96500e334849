/* Tests the end of a run: which of its figures are in the report, and how they are computed. */
#include "test/scratch.h"

#include <fcntl.h>
#include <math.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include "common/clock.h"
#include "common/message.h"
#include "master/run.h"
#include "master/start_times.h"
#include "master/text_file.h"
#include "test/text.h"

enum { RENDERERS = 4, EDGE = 8 };

static const struct view adaptive_view = {.min_samples = 4, .max_samples = 64};

/* A run with RENDERERS renderers and a master that only serves. Freed by run_close(). */
static struct run run_open(void)
{
    const struct queue_config config = {
        .width = EDGE, .height = EDGE, .renderers = RENDERERS, .tile_edge = EDGE / 2};
    struct run run = {.options.config = "a.ini",
                      .report = {.min_samples = 4, .max_samples = 4},
                      .queue = queue_create(&config),
                      .start = clock_wall(),
                      .processes = RENDERERS + 1,
                      .renderers = RENDERERS};
    settings_init(&run.job.settings);
    set_text(&run.job.settings.output.image, "a.pfm");
    set_text(&run.job.settings.output.report, "a.json");
    canvas_init(&run.canvas, EDGE, EDGE);
    return run;
}

static void run_close(struct run *run)
{
    if (run->adaptive) adaptive_destroy(run->adaptive);
    canvas_free(&run->canvas);
    queue_destroy(run->queue);
    settings_free(&run->job.settings);
}

/* Makes the run adaptive, with first samples, whose halves are equal, in this number of rows. */
static void sample_rows(struct run *run, uint32_t rows)
{
    const struct tile tile = {.w = EDGE, .h = rows, .step = 1};
    static const float part[EDGE * EDGE * REFINED_FLOATS];
    run->adaptive = adaptive_create(&adaptive_view, &run->canvas, 0.01);
    run->report.max_samples = adaptive_view.max_samples;
    adaptive_put(run->adaptive, &tile, part, 1);
    if (rows < EDGE) adaptive_cut(run->adaptive, 0);
}

/* The report of the run with these figures, as text that the caller frees. */
static char *report_of(struct run *run, struct served *served)
{
    struct renderer_stats stats[RENDERERS] = {0};
    run->stats = stats;
    /* The table must not appear in the output of the test. */
    int table = open("table", O_WRONLY | O_CREAT | O_TRUNC, 0600), out = dup(STDOUT_FILENO);
    fflush(stdout);
    dup2(table, STDOUT_FILENO);
    int status = run_conclude(run, served);
    fflush(stdout);
    dup2(out, STDOUT_FILENO);
    close(table);
    close(out);
    assert_int_equal(status, 0);
    struct text_file text;
    assert_true(text_file_read("a.json", 1 << 16, &text));
    return text.text;
}

/* The pre-pass is told of as one renderer's, service as of one answer that was measured, waiting as of one
 * message. */
static void test_means(void **state)
{
    struct served served = {.render_s = 3,
                            .guessed_rmse = (double)NAN,
                            .probe_s = 1.5,
                            .master_cpu_s = 0.013,
                            .messages = 35,
                            .answers = 5,
                            .service_cpu_s = 0.0015,
                            .answer_wait_s = 0.007,
                            .answer_wait_most_s = 0.0031};
    struct run run = run_open();
    char *text = report_of(&run, &served);
    assert_has(text, "\"processes\": 5,");
    assert_has(text, "\"render_s\": 3.000000,\n    \"probe_s\": 0.375000,\n");
    assert_has(text, "\"master\": {\n    \"cpu_s\": 0.013000,\n    \"messages\": 35,\n"
                     "    \"service_s\": 0.000300000,\n    \"answer_wait_s\": 0.000200,\n"
                     "    \"answer_wait_most_s\": 0.003100\n");
    free(text);
    run_close(&run);
}

/* A single renderer sends no messages. */
static void test_no_messages(void **state)
{
    struct served served = {.render_s = 3, .guessed_rmse = (double)NAN};
    struct run run = run_open();
    char *text = report_of(&run, &served);
    assert_has(text, "\"messages\": 0,\n    \"service_s\": 0.000000000,\n"
                     "    \"answer_wait_s\": 0.000000,\n");
    free(text);
    run_close(&run);
}

/* If the target is met, it ends the run even if the time is over, too: more time would not improve the picture. */
static void test_target_and_time(void **state)
{
    struct served served = {.guessed_rmse = (double)NAN, .timed_out = true};
    struct run run = run_open();
    sample_rows(&run, EDGE);
    assert_false(adaptive_plan(run.adaptive, HUGE_VAL));
    char *text = report_of(&run, &served);
    assert_has(text, "\"ended\": \"target\"");
    free(text);
    run_close(&run);
}

/* What has used up a time limit is told, the longest part first. */
static void test_no_samples(void **state)
{
    struct scratch *s = *state;
    struct run run = run_open();
    struct served served = {.timed_out = true, .began_at = run.start + 7.35, .reserved_s = 1.5};
    run.job.settings.sampling.time_limit = 8;
    run.report.time = (struct run_times){
        .init = 0.06, .load = 1.25, .room = 4, .resume = 0.5, .broadcast = 0.04, .build = 1.5};
    sample_rows(&run, 0);
    message_capture(s->said, sizeof s->said);
    int status = run_conclude(&run, &served);
    message_capture(NULL, 0);
    assert_int_equal(status, STATUS_FAILED);
    assert_has(s->said,
               ": rendering began after 7.35 s (picture memory 4 s, building the BVH 1.5 s, "
               "loading 1.25 s), 1.5 s were kept for writing and for telling the error\n");
    run_close(&run);
}

/* None is told that hardly counts. */
static void test_short_start(void **state)
{
    const struct run_times time = {.init = 0.03, .load = 1.2, .room = 50, .build = 0.1};
    char *text = start_times_text(&time);
    assert_string_equal(text, "picture memory 50 s, loading 1.2 s");
    free(text);
}

/* The time of planning is that of the passes that have brought samples. */
static void test_time_of_planning(void **state)
{
    struct served served = {.guessed_rmse = (double)NAN, .plan_s = 0.25, .timed_out = true};
    struct run run = run_open();
    sample_rows(&run, EDGE);
    char *text = report_of(&run, &served);
    assert_has(text, "\"plan_s\": 0.250000,");
    free(text);
    run_close(&run);
}

/* Pixels that a time limit has left without samples are reported, and nothing is said of what is not in view, which is
 * not known then. */
static void test_pixels_without_samples(void **state)
{
    struct scratch *s = *state;
    struct served served = {.guessed_rmse = 0.5, .timed_out = true};
    struct run run = run_open();
    run.job.settings.sampling.time_limit = 2;
    run.report.image_width = run.job.settings.image.width;
    run.report.image_height = run.job.settings.image.height;
    sample_rows(&run, EDGE - 1);
    message_capture(s->said, sizeof s->said);
    char *text = report_of(&run, &served);
    message_capture(NULL, 0);
    assert_has(s->said,
               "sampling.time_limit = 2 s has left 8 of 64 pixels without a sample: these "
               "are guessed from those around or, where none is near, from the pre-pass, or black "
               "where that has nothing\n");
    assert_null(strstr(s->said, "in view"));
    free(text);
    run_close(&run);
}

/* The time of writing includes that of the trace, which is written to a pipe without a reader at first. */
static void test_time_of_writing(void **state)
{
    struct scratch *s = *state;
    struct served served = {.guessed_rmse = (double)NAN};
    struct run run = run_open();
    set_text(&run.job.settings.output.trace, "trace.json");
    assert_int_equal(mkfifo("trace.json", 0600), 0);
    pid_t reader = fork();
    if (reader == 0) {
        char bytes[4096];
        clock_sleep(0.1);
        int trace = open("trace.json", O_RDONLY);
        while (read(trace, bytes, sizeof bytes) > 0)
            ;
        _exit(0);
    }
    message_capture(s->said, sizeof s->said);
    char *text = report_of(&run, &served);
    message_capture(NULL, 0);
    int status;
    assert_int_equal(waitpid(reader, &status, 0), reader);
    assert_int_equal(status, 0);
    const char *write_s = strstr(text, "\"write_s\": ");
    assert_true(write_s && atof(write_s + strlen("\"write_s\": ")) > 0.05);
    free(text);
    run_close(&run);
}

/* How far it has come, not how far it has to go. */
static void test_given_up(void **state)
{
    struct scratch *s = *state;
    struct run run = run_open();
    struct tile lot[LOT_TILES];
    assert_true(queue_next(run.queue, 0, 0, lot) > 0);
    queue_finish(run.queue, 0, lot[0].id, 1, 1);
    uint64_t done = queue_count(run.queue).pixels_finished;
    assert_true(done > 0 && done < EDGE * EDGE / 2);
    char expected[64];
    snprintf(expected, sizeof expected, " at %.1f %% of the pixels\n",
             100 * (double)done / (EDGE * EDGE));
    message_capture(s->said, sizeof s->said);
    assert_int_equal(end_early(&run, true), STATUS_FAILED);
    message_capture(NULL, 0);
    assert_has(s->said, expected);
    run_close(&run);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_means),
        cmocka_unit_test(test_no_messages),
        cmocka_unit_test(test_no_samples),
        cmocka_unit_test(test_short_start),
        cmocka_unit_test(test_target_and_time),
        cmocka_unit_test(test_pixels_without_samples),
        cmocka_unit_test(test_time_of_writing),
        cmocka_unit_test(test_given_up),
        cmocka_unit_test(test_time_of_planning),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
