/* The report as a table: where the time went, what each renderer did, and how the table fits into a terminal. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "test/report_fixture.h"
#include "test/unit.h"

/* Renderer 0 has half of the pixels that it would have, renderer 1 the others; renderer 2 is busy half as long. */
static struct report uneven_report(struct renderer_stats renderers[4])
{
    struct report report = sample_report(renderers, 4);
    renderers[0].pixels /= 2;
    renderers[1].pixels += renderers[0].pixels;
    renderers[2].busy_s = 1.5;
    return report;
}

static void test_table(void **state)
{
    struct renderer_stats renderers[4];
    struct report report = uneven_report(renderers);
    char *text = table_text(&report, 80);
    assert_has(text, "  rendering           4.000 s   80.0 %  ###################\n");
    assert_has(text, "  writing             0.312 s    6.2 %  ##\n"
                     "  other               0.000 s    0.0 %\n"
                     "  total               5.000 s\n");
    assert_has(text, "  intersection        2.000 s   50.0 %  ############\n");
    assert_has(text, "  waiting             0.500 s   12.5 %  ###\n");
    assert_has(text,
               "     0     75   259200   12.5 %    0.500    3.000  ########################\n");
    assert_has(text, "     2     75   518400   25.0 %    0.500    1.500  ############\n");
    assert_has(text, "  mean     75   518400   25.0 %    0.500    2.635  #####################\n");
    assert_has(text, "efficiency 65.9 %, imbalance 1.150, tail 0.030 s\n");
    assert_has(text, "13.2M rays, 3.3M per second\n4.0M primary, 8.0M shadow, 1.2M reflection, "
                     "20 more for the truncation bound\n");
    assert_has(text, "picture lantern.png\n");
    assert_null(strstr(text, "NaN"));
    assert_null(strstr(text, "node"));
    assert_null(strstr(text, "CPU"));
    free(text);
    for (int i = 0; i < 4; i++)
        renderers[i].counts = (struct render_counts){.rays = {i == 0}};
    assert_table_has(&report, 80, "\n1 ray, ");
}

/* All renderers wait while a pass is planned. Planning has no more time than renderers have waited. */
static void test_table_planning(void **state)
{
    struct renderer_stats renderers[4];
    struct report report = uneven_report(renderers);
    assert_table_lacks(&report, 80, "planning");
    report.plan_s = 0.3;
    assert_table_has(&report, 80,
                     "  planning passes     0.300 s    7.5 %  ##\n"
                     "  waiting             0.200 s    5.0 %  #\n");
    report.plan_s = 9;
    assert_table_has(&report, 80,
                     "  planning passes     0.500 s   12.5 %  ###\n"
                     "  waiting             0.000 s    0.0 %\n");
}

/* What has a row of its own is not counted under `other`, too. */
static void test_table_other(void **state)
{
    struct renderer_stats renderers[4];
    struct report report = uneven_report(renderers);
    report.time.total = 8;
    char *text = table_text(&report, 80);
    assert_has(
        text, "  other               3.000 s   37.5 %  #########\n  total               8.000 s\n");
    free(text);
    report.resumed.records = 1;
    report.time.resume = 1;
    assert_table_has(&report, 80, "  reading journal     1.000 s   12.5 %  ###\n");
    assert_table_has(&report, 80, "  other               2.000 s   25.0 %  ######\n");
    assert_table_lacks(&report, 80, "picture memory");
    report.time.room = 1;
    assert_table_has(&report, 80, "  picture memory      1.000 s   12.5 %  ###\n");
    assert_table_has(&report, 80, "  other               1.000 s   12.5 %  ###\n");
}

/* A journal from which nothing is read takes its time, too. */
static void test_table_opening_journal(void **state)
{
    struct renderer_stats renderers[4];
    struct report report = uneven_report(renderers);
    report.time.total = 8;
    report.time.resume = 1;
    assert_table_has(&report, 80, "  opening journal     1.000 s   12.5 %  ###\n");
    assert_table_has(&report, 80, "  other               2.000 s   25.0 %  ######\n");
    report.time.resume = 0.07;
    assert_table_lacks(&report, 80, "journal");
}

static void test_table_cpu_imbalance(void **state)
{
    struct renderer_stats renderers[4];
    struct report report = uneven_report(renderers);
    renderers[3].cpu_s = 0;
    char *text = table_text(&report, 80);
    assert_has(
        text,
        "\nCPU time is 85 % of busy time, as cores were shared, imbalance of CPU time 1.333\n");
    free(text);
}

/* The seconds in the line of the second table that begins so; 0: there is none. */
static double seconds_of(const char *text, const char *label)
{
    char *start = format_text("\n  %s  ", label), *line = strstr(text, start);
    double seconds = line ? strtod(line + strlen(start), NULL) : 0;
    free(start);
    return seconds;
}

static double sum_of_parts(const char *text)
{
    static const char *const labels[] = {"pre-pass",       "intersection", "shading",
                                         "without a core", "waiting",      "sending, other"};
    double sum = 0;
    for (size_t i = 0; i < sizeof labels / sizeof *labels; i++)
        sum += seconds_of(text, labels[i]);
    return sum;
}

/* The pre-pass has a line of its own, and so has the time in which others had the core: they are not in the rest. */
static void test_table_parts(void **state)
{
    struct renderer_stats renderers[2];
    struct report report = sample_report(renderers, 2);
    for (int i = 0; i < 2; i++) {
        renderers[i].busy_s = renderers[i].cpu_s = 3.375;
        renderers[i].wait_s = 0.5;
    }
    report.time.probe = 0.25;
    assert_table_has(&report, 80,
                     "renderers\n  pre-pass            0.250 s    6.2 %  ##\n"
                     "  intersection        2.000 s   50.0 %");
    /* 0.125 s in tiles given up */
    assert_table_has(&report, 80, "  sending, other      0.250 s    6.2 %  ##\n");
    assert_table_lacks(&report, 80, "without a core");
    /* 0.65 of 3.25 s of tiles, and of 3.375 s that were busy. */
    renderers[0].cpu_s = 1;
    renderers[1].cpu_s = 0.3;
    char *text = table_text(&report, 80);
    assert_has(text, "  pre-pass            0.050 s    1.2 %\n"
                     "  intersection        0.400 s   10.0 %  ##\n"
                     "  shading             0.200 s    5.0 %  #\n"
                     "  without a core      2.725 s   68.1 %  ################\n"
                     "  waiting             0.500 s   12.5 %  ###\n"
                     "  sending, other      0.125 s    3.1 %  #\n");
    assert_true(fabs(sum_of_parts(text) - 4) < 0.002);
    free(text);
    /* The pre-pass has no more time than the rest leaves, as where a time limit cuts it off. */
    report.time.probe = 3;
    renderers[0].cpu_s = renderers[1].cpu_s = 3.375;
    text = table_text(&report, 80);
    assert_has(text, "  pre-pass            0.375 s    9.4 %");
    assert_true(fabs(sum_of_parts(text) - 4) < 0.002);
    free(text);
    report.time.probe = 0;
    assert_table_lacks(&report, 80, "pre-pass");
}

/* More renderers than cores are no faster than the cores. With a single renderer no imbalance is shown. */
static void test_table_cores(void **state)
{
    struct renderer_stats renderers[8];
    struct report report = sample_report(renderers, 8);
    assert_table_lacks(&report, 80, " core");
    report.cores = report.processors = 2;
    for (int i = 0; i < 8; i++)
        renderers[i].cpu_s = 0.75;
    char *text = table_text(&report, 80);
    assert_has(
        text, "\n8 renderers on 2 cores: at most 2 times as fast as one\n"
              "CPU time is 25 % of busy time, as cores were shared, imbalance of CPU time 1.000\n");
    free(text);
    report.cores = 9;
    report.processors = 5;
    assert_table_has(&report, 80,
                     "\n8 renderers, 5 on a core at a time: at most 5 times as fast as one\n");
    report.cores = report.processors = 1;
    assert_table_has(&report, 80, "\n8 renderers on 1 core: no faster than one\n");
    report.renderer_count = 1;
    assert_table_has(&report, 80, "\nCPU time is 25 % of busy time, as cores were shared\n");
    assert_table_lacks(&report, 80, "1 renderers");
}

/* If an earlier run has finished the whole picture, there is nothing to say of the renderers. */
static void test_table_nothing_rendered(void **state)
{
    struct renderer_stats renderers[2] = {0};
    struct report report = sample_report(renderers, 0);
    report.renderer_count = 2;
    report.resumed.records = report.resumed.tiles = 300;
    report.resumed.pixels = 2073600;
    char *text = table_text(&report, 40);
    assert_fits(text, 40);
    assert_has(text, "  total               5.000 s\n\n"
                     "nothing was rendered\n  all was in the journal\n");
    assert_null(strstr(text, "efficiency"));
    assert_null(strstr(text, " rays"));
    free(text);
    renderers[1].counts.rays[RAY_PRIMARY] = 1;
    assert_table_has(&report, 80, "efficiency");
}

/* In a narrow terminal the column of pixels is the first to be left out: a share and its bar say more. */
static void test_table_narrow(void **state)
{
    struct renderer_stats renderers[2];
    struct report report = sample_report(renderers, 2);
    char *text = table_text(&report, 50);
    assert_fits(text, 50);
    assert_has(text, "farm 1.2.3, 1920 x 1080 pixels, 2 renderers\n  dynamic schedule, 300 ");
    assert_has(text, "  rank  tiles    share   wait s   busy s\n"
                     "     0     75   50.0 %    0.500    3.000  ########\n");
    free(text);
    assert_table_has(&report, 57, "     0     75   518400   50.0 %    0.500    3.000  ######\n");
    assert_table_has(&report, 40, "     0     75   50.0 %    0.500    3.000\n");
}

/* Clipped pixels, which a PNG cannot show, are mentioned where there are any. */
static void test_table_clipped(void **state)
{
    struct renderer_stats renderers[1];
    struct report report = sample_report(renderers, 1);
    assert_table_lacks(&report, 80, "clipped");
    report.quantisation = (struct quantisation){.clipped = 435, .clipped_rmse = 0.00651};
    assert_table_has(&report, 80,
                     "\nclipped: 435 pixels beyond what the file can hold, RMSE 0.0065\n");
    assert_table_has(&report, 40, "\n  beyond what the file can hold\n  RMSE 0.0065\n");
}

/* What truncated paths may add to a pixel at most is shown where it is not 0. */
static void test_table_truncation(void **state)
{
    struct renderer_stats renderers[1];
    static const struct {
        double most;
        const char *text; /* rounded up */
    } bounds[] = {{0.0321, "0.033"},
                  {0.032, "0.032"},
                  {0.0401358, "0.041"},
                  {0.996, "1.0"},
                  {0.0996, "0.10"},
                  {0.9901, "1.0"},
                  {0.07, "0.070"},
                  {1, "1.0"},
                  {1.01, "1.1"},
                  {12.1, "13"},
                  {99.5, "100"},
                  {121, "130"},
                  {0.0000100001, "0.000011"},
                  {3.21e-12, "3.3e-12"}};
    struct report report = sample_report(renderers, 1);
    for (size_t i = 0; i < sizeof bounds / sizeof *bounds; i++) {
        char line[64];
        report.picture.truncation = bounds[i].most;
        snprintf(line, sizeof line, "\ntruncation: at most %s anywhere\n", bounds[i].text);
        char *text = table_text(&report, 80);
        assert_has(text, line);
        free(text);
    }
    report.resumed.counts.truncation = HUGE_VAL;
    assert_table_has(&report, 80, "\ntruncation: without bound\n");
    report.picture.truncation = report.resumed.counts.truncation = 0;
    assert_table_lacks(&report, 80, "truncation:");
}

enum { RANKS = 100 };

static void test_table_fits(void **state)
{
    static struct renderer_stats renderers[RANKS];
    for (int count = 0; count <= RANKS; count = 2 * count + 1) {
        struct report report = sample_report(renderers, count);
        if (count > 1) memset(renderers[1].host, 'h', 60);
        for (int columns = 40; columns < 130; columns++) {
            char *text = table_text(&report, columns);
            assert_fits(text, (size_t)columns);
            free(text);
        }
    }
}

static void test_table_extremes(void **state)
{
    struct renderer_stats renderers[1];
    struct report report = sample_report(renderers, 1);
    renderers[0].busy_s = renderers[0].wait_s = report.time.total = report.time.render = 1e7;
    renderers[0].pixels = renderers[0].counts.rays[0] = UINT64_MAX;
    renderers[0].tiles = UINT32_MAX;
    report.picture.nonfinite = 12;
    report.picture.rays[RAY_PRIMARY] = 345;
    char *text = table_text(&report, 40);
    assert_fits(text, 40);
    free(text);
    assert_table_has(&report, 80, "\n12 of 345 samples are not finite, or too bright for floats\n");
    report.time = (struct run_times){0};
    report.image_file = "a\033[2J\xc2\x9b\x9bé.png";
    text = table_text(&report, 0);
    assert_fits(text, 80);
    assert_has(text, "picture a?[2J???é.png\n");
    assert_null(strstr(text, "inf "));
    assert_null(strstr(text, "nan"));
    free(text);
}

static void test_table_of_open_glass(void **state)
{
    struct renderer_stats renderers[1];
    struct report report = sample_report(renderers, 1);
    char *text = table_text(&report, 80);
    assert_null(strstr(text, "glass"));
    free(text);
    report.picture.open_media = 2345;
    assert_table_has(&report, 80, "\n2.3k rays never came out of glass\n");
    report.picture.unmatched_media = 12;
    assert_table_has(&report, 80,
                     "\nrays left glass unentered 12 times, 2.3k rays never came out of glass\n");
    report.picture.unmatched_media = report.picture.open_media = 1;
    assert_table_has(&report, 80,
                     "\nrays left glass unentered 1 time, 1 ray never came out of glass\n");
}

static void test_table_of_very_many_rays(void **state)
{
    struct renderer_stats renderers[1];
    struct report report = sample_report(renderers, 1);
    uint64_t *rays = renderers[0].counts.rays;
    rays[RAY_PRIMARY] = 20;
    rays[RAY_REFLECTION] = 500;
    rays[RAY_REFRACTION] = 1499;
    char *text = table_text(&report, 80);
    assert_null(strstr(text, "per sample"));
    free(text);
    rays[RAY_REFRACTION] = 45600;
    assert_table_has(
        &report, 80,
        "\n2.3k reflected and refracted rays per sample: a larger render.cutoff takes fewer\n");
}

static void test_table_of_many(void **state)
{
    static struct renderer_stats renderers[RANKS];
    struct report report = sample_report(renderers, RANKS);
    strcpy(renderers[7].host, "other");
    char *text = table_text(&report, 80);
    assert_has(text, "\n    99     75   518400    1.0 %    0.500    3.990");
    assert_has(text, "\n    96     75");
    assert_has(text, "\n   ...  92 more, then the idlest\n     3     75");
    assert_has(text, "\n     0     75");
    assert_null(strstr(text, "\n    95 "));
    assert_null(strstr(text, "\n     4 "));
    assert_has(text, "  mean     75   518400    1.0 %    0.500    3.495");
    assert_has(text, "  host\n");
    assert_has(text, "  node ");
    free(text);
    *renderers[7].host = '\0'; /* a renderer that has never reported has no known host */
    assert_table_lacks(&report, 80, "  host\n");
}

/* Of a few ranks all are shown, in their order. */
static void test_table_of_some(void **state)
{
    enum { SOME = 16 };
    struct renderer_stats renderers[SOME];
    struct report report = sample_report(renderers, SOME);
    char *text = table_text(&report, 80);
    const char *at = text;
    for (int i = 0; i < SOME; i++) {
        char rank[32];
        snprintf(rank, sizeof rank, "\n%6d     75 ", i);
        at = strstr(at, rank);
        assert_non_null(at);
    }
    assert_null(strstr(text, " more, then the idlest"));
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_table),
        cmocka_unit_test(test_table_planning),
        cmocka_unit_test(test_table_other),
        cmocka_unit_test(test_table_opening_journal),
        cmocka_unit_test(test_table_cpu_imbalance),
        cmocka_unit_test(test_table_parts),
        cmocka_unit_test(test_table_cores),
        cmocka_unit_test(test_table_nothing_rendered),
        cmocka_unit_test(test_table_narrow),
        cmocka_unit_test(test_table_clipped),
        cmocka_unit_test(test_table_truncation),
        cmocka_unit_test(test_table_fits),
        cmocka_unit_test(test_table_extremes),
        cmocka_unit_test(test_table_of_open_glass),
        cmocka_unit_test(test_table_of_very_many_rays),
        cmocka_unit_test(test_table_of_many),
        cmocka_unit_test(test_table_of_some),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
