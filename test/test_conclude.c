/* The end of a run: what of its figures comes into the report, and how. */
#include "test/scratch.h"

#include <fcntl.h>
#include <math.h>

#include "common/clock.h"
#include "common/message.h"
#include "master/run.h"
#include "master/text_file.h"

enum { RENDERERS = 4, EDGE = 8 };

static void set_text(char **setting, const char *text)
{
    free(*setting);
    *setting = copy_text(text);
}

/* The report of a run of RENDERERS with these figures, as text that the caller frees. */
static char *report_of(struct service *service)
{
    const struct queue_config config = {
        .width = EDGE, .height = EDGE, .renderers = RENDERERS, .tile_edge = EDGE};
    const struct view view = {.min_samples = 4, .max_samples = 4};
    struct renderer_stats stats[RENDERERS] = {0};
    struct run run = {.options.config = "a.ini",
                      .queue = queue_create(&config),
                      .start = clock_wall(),
                      .processes = RENDERERS,
                      .renderers = RENDERERS};
    settings_init(&run.job.settings);
    set_text(&run.job.settings.output.image, "a.pfm");
    set_text(&run.job.settings.output.report, "a.json");
    canvas_init(&run.canvas, EDGE, EDGE);
    service->stats = stats;
    /* The table is not for the output of a test. */
    int table = open("table", O_WRONLY | O_CREAT | O_TRUNC, 0600), out = dup(STDOUT_FILENO);
    fflush(stdout);
    dup2(table, STDOUT_FILENO);
    int status = run_conclude(&run, service, &view);
    fflush(stdout);
    dup2(out, STDOUT_FILENO);
    close(table);
    close(out);
    assert_int_equal(status, 0);
    canvas_free(&run.canvas);
    queue_destroy(run.queue);
    settings_free(&run.job.settings);
    struct text_file text;
    assert_true(text_file_read("a.json", 1 << 16, &text));
    return text.text;
}

static void assert_has(const char *text, const char *part)
{
    if (strstr(text, part)) return;
    fprintf(stderr, "missing: %s\nin: %s\n", part, text); /* print_error() cuts */
    fail();
}

/* The pre-pass is told of as one renderer's, service as of one answer that was measured, waiting as of one
 * message. */
static void test_means(void **state)
{
    (void)state;
    struct service service = {.render_s = 3,
                              .guessed_rmse = (double)NAN,
                              .probe_s = 1.5,
                              .master_cpu_s = 0.013,
                              .messages = 35,
                              .answers = 5,
                              .service_cpu_s = 0.0015,
                              .answer_wait_s = 0.007,
                              .answer_wait_most_s = 0.0031};
    char *text = report_of(&service);
    assert_has(text, "\"render_s\": 3.000000,\n    \"probe_s\": 0.375000,\n");
    assert_has(text, "\"master\": {\n    \"cpu_s\": 0.013000,\n    \"messages\": 35,\n"
                     "    \"service_s\": 0.000300000,\n    \"answer_wait_s\": 0.000200,\n"
                     "    \"answer_wait_most_s\": 0.003100\n");
    free(text);
}

/* Of a renderer alone there are no messages. */
static void test_no_messages(void **state)
{
    (void)state;
    struct service service = {.render_s = 3, .guessed_rmse = (double)NAN};
    char *text = report_of(&service);
    assert_has(text, "\"messages\": 0,\n    \"service_s\": 0.000000000,\n"
                     "    \"answer_wait_s\": 0.000000,\n");
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_means),
        cmocka_unit_test(test_no_messages),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
