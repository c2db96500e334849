#include "test/scratch.h"

#include <math.h>

#include "master/rank_colors.h"
#include "master/timeline.h"
#include "master/timeline_output.h"
#include "test/text.h"

static void add(struct timeline *timeline, enum timeline_kind kind, uint32_t renderer,
                struct tile tile, double start_s, double cpu_s)
{
    struct result_header header = {.start_s = start_s, .busy_s = 2 * cpu_s, .cpu_s = cpu_s};
    header.pixels = kind == TIMELINE_WASTED ? RESULT_DROPPED : tile_pixels(&tile);
    if (kind == TIMELINE_TILE) header.counts.rays[RAY_PRIMARY] = 4 * tile_pixels(&tile);
    timeline_add(timeline, kind, renderer, &tile, &header);
    if (kind == TIMELINE_TILE && timeline->costs) timeline_spread(timeline, &tile, cpu_s);
}

/* A timeline and a canvas for the heat map of a picture of this size. */
static struct timeline heated(uint32_t width, uint32_t height, struct canvas *canvas)
{
    struct timeline timeline = {0};
    timeline_record_costs(&timeline, width, height);
    canvas_init(canvas, width, height);
    return timeline;
}

static struct tile square(uint32_t x, uint32_t y, uint32_t edge)
{
    return (struct tile){.x = x, .y = y, .w = edge, .h = edge, .step = 1};
}

static char *trace_of(const struct timeline *timeline, const struct renderer_stats *stats,
                      uint32_t count, double render_s)
{
    char *text = NULL;
    size_t bytes = 0;
    FILE *file = open_memstream(&text, &bytes);
    assert_non_null(file);
    timeline_trace(timeline, stats, count, render_s, file);
    assert_int_equal(fclose(file), 0);
    return text;
}

static unsigned count_of(const char *text, const char *part)
{
    unsigned count = 0;
    for (const char *at = text; (at = strstr(at, part)); at += strlen(part))
        count++;
    return count;
}

/* Rank 1 renders two tiles with a pause in between, rank 2 probes and a tile that is wasted. They are added in the
 * order in which they end. */
static void test_trace(void **state)
{
    struct timeline timeline = {0};
    const struct renderer_stats stats[] = {{.rank = 1, .host = "a"}, {.rank = 2, .host = "b\"\\"}};
    add(&timeline, TIMELINE_PROBES, 1, square(0, 0, 32), 0, 0.125);
    add(&timeline, TIMELINE_TILE, 0, square(8, 16, 4), 0.5, 0.25);
    add(&timeline, TIMELINE_TILE, 0, square(0, 0, 4), 0, 0.125);
    add(&timeline, TIMELINE_WASTED, 1, square(4, 4, 4), 0.25, 0.375);
    char *text = trace_of(&timeline, stats, 2, 1.00005);
    assert_has(text, "{\n  \"displayTimeUnit\": \"ms\",\n  \"traceEvents\": [\n");
    assert_has(text, "{\"name\": \"process_name\", \"ph\": \"M\", \"pid\": 0, \"tid\": 0, "
                     "\"args\": {\"name\": \"farm\"}}");
    assert_has(text, "{\"name\": \"thread_name\", \"ph\": \"M\", \"pid\": 0, \"tid\": 2, "
                     "\"args\": {\"name\": \"rank 2, b\\\"\\\\\"}},\n");
    assert_has(text,
               "{\"name\": \"tile 8,16\", \"ph\": \"X\", \"pid\": 0, \"tid\": 1, \"cat\": \"tile\","
               " \"ts\": 500000.000, \"dur\": 500000.000, \"args\": {\"x\": 8, \"y\": 16, "
               "\"w\": 4, \"h\": 4, \"pixels\": 16, \"pass\": 0, \"samples\": 64, "
               "\"cpu_us\": 250000.000, "
               "\"cpu_us_per_pixel\": 15625.000}},\n");
    assert_has(text, "{\"name\": \"thread_sort_index\", \"ph\": \"M\", \"pid\": 0, \"tid\": 2, "
                     "\"args\": {\"sort_index\": 2}},\n");
    assert_has(text, "\"pre-pass 0,0\", \"ph\": \"X\", \"pid\": 0, \"tid\": 2");
    assert_has(text,
               "\"h\": 4, \"pixels\": 0, \"pass\": 0, \"samples\": 0, \"cpu_us\": 375000.000}}");
    /* Rank 1 from 0.25 to 0.5; nobody at the end: that is below a tenth of a millisecond. */
    assert_int_equal(count_of(text, "\"waiting\", \"ph\""), 1);
    assert_has(text, "\"tid\": 1, \"cat\": \"waiting\", \"ts\": 250000.000, \"dur\": 250000.000, "
                     "\"args\": {\"for\": \"work\"}}");
    assert_has(text, "}\n  ]\n}\n");
    free(text);
    timeline_free(&timeline);
}

/* A pass is planned while rank 1 waits, and while rank 2 still works at first; a pause that is too short is not
 * shown. */
static void test_trace_of_passes(void **state)
{
    struct timeline timeline = {0};
    const struct renderer_stats stats[] = {{.rank = 1, .host = "a"}, {.rank = 2, .host = "b"}};
    struct tile again = square(0, 0, 8);
    again.pass = 1;
    add(&timeline, TIMELINE_TILE, 0, square(0, 0, 4), 0, 0.125);
    add(&timeline, TIMELINE_TILE, 1, square(4, 0, 4), 0, 0.25);
    timeline_add_plan(&timeline, &(struct timeline_plan){0.5, 0.75, 1});
    add(&timeline, TIMELINE_TILE, 0, again, 0.75, 0.125);
    char *text = trace_of(&timeline, stats, 2, 1);
    assert_has(text, "\"pixels\": 64, \"pass\": 1, \"samples\": 256, ");
    assert_has(text, "\"tid\": 1, \"cat\": \"waiting\", \"ts\": 250000.000, \"dur\": 250000.000, "
                     "\"args\": {\"for\": \"end of the pass\"}}");
    for (int rank = 1; rank <= 2; rank++) {
        char *plan = format_text("\"tid\": %d, \"cat\": \"planning\", \"ts\": 500000.000, "
                                 "\"dur\": 250000.000, \"args\": {\"pass\": 1}}",
                                 rank);
        assert_has(text, plan);
        free(plan);
    }
    assert_has(text, "\"tid\": 2, \"cat\": \"waiting\", \"ts\": 750000.000, \"dur\": 250000.000, "
                     "\"args\": {\"for\": \"end of the run\"}}");
    assert_int_equal(count_of(text, "\"cat\": \"planning\""), 2);
    assert_int_equal(count_of(text, "\"cat\": \"waiting\""), 2);
    free(text);
    timeline_free(&timeline);
}

/* Rank 0 has waited, also for a plan, and then worked on a tile until the end; rank 1 has only waited. */
static void test_trace_of_what_was_given_up(void **state)
{
    struct timeline timeline = {0};
    const struct renderer_stats stats[] = {
        {.rank = 0, .host = "a", .busy_s = 0.5, .finish_s = 1},
        {.rank = 1, .host = "a", .busy_s = 0.25, .finish_s = 0.25}};
    add(&timeline, TIMELINE_TILE, 0, square(0, 0, 4), 0, 0.125);
    add(&timeline, TIMELINE_TILE, 1, square(4, 0, 4), 0, 0.125);
    timeline_add_plan(&timeline, &(struct timeline_plan){0.5, 0.625, 1});
    char *text = trace_of(&timeline, stats, 2, 1);
    assert_has(text, "\"tid\": 0, \"cat\": \"waiting\", \"ts\": 250000.000, \"dur\": 250000.000, "
                     "\"args\": {\"for\": \"end of the pass\"}}");
    assert_has(text, "\"tid\": 0, \"cat\": \"planning\", \"ts\": 500000.000, \"dur\": 125000.000,");
    assert_has(text, "\"tid\": 0, \"cat\": \"waiting\", \"ts\": 625000.000, \"dur\": 125000.000, "
                     "\"args\": {\"for\": \"work\"}}");
    assert_has(text, "\"tid\": 0, \"cat\": \"given up\", \"ts\": 750000.000, \"dur\": 250000.000}");
    assert_has(text, "\"tid\": 1, \"cat\": \"waiting\", \"ts\": 625000.000, \"dur\": 375000.000, "
                     "\"args\": {\"for\": \"end of the run\"}}");
    assert_int_equal(count_of(text, "given up\", \"ph\""), 1);
    assert_int_equal(count_of(text, "\"cat\": \"waiting\""), 4); /* rank 0: not at the end */
    free(text);
    timeline_free(&timeline);
}

/* What rank 0's serving takes is a counter, which is 0 from the end of rendering on. */
static void test_trace_of_serving(void **state)
{
    struct timeline timeline = {0};
    const struct renderer_stats stats[] = {{.rank = 1, .host = "a"}};
    timeline_add_service(&timeline, &(struct timeline_service){0, 0.25, 0.0625});
    timeline_add_service(&timeline, &(struct timeline_service){0.25, 0.75, 0.005});
    timeline_add_service(&timeline, &(struct timeline_service){0.75, 1.25, 0});
    timeline_add_service(&timeline, &(struct timeline_service){1.25, 1.5, 0.25});
    char *text = trace_of(&timeline, stats, 1, 1);
    assert_has(text, "{\"name\": \"rank 0 serves\", \"ph\": \"C\", \"pid\": 0, \"tid\": 0, "
                     "\"ts\": 0.000, \"args\": {\"% of a core\": 25.00}}");
    assert_has(text, "\"ts\": 250000.000, \"args\": {\"% of a core\": 1.00}}");
    assert_has(text, "\"ts\": 750000.000, \"args\": {\"% of a core\": 0.00}}");
    assert_has(text, "\"ts\": 1000000.000, \"args\": {\"% of a core\": 0.00}}");
    assert_int_equal(count_of(text, "\"ph\": \"C\""), 4);
    free(text);
    timeline_free(&timeline);
}

/* However long a renderer says that it was busy, that bar does not cover those of its tiles. */
static void test_trace_of_more_than_all(void **state)
{
    struct timeline timeline = {0};
    const struct renderer_stats stats[] = {{.rank = 0, .host = "a", .busy_s = 2, .finish_s = 1}};
    add(&timeline, TIMELINE_TILE, 0, square(0, 0, 4), 0, 0.25);
    char *text = trace_of(&timeline, stats, 1, 1);
    assert_has(text, "\"tid\": 0, \"cat\": \"given up\", \"ts\": 500000.000, \"dur\": 500000.000}");
    free(text);
    timeline_free(&timeline);
}

/* A wasted tile that continues after the end of rendering is shown up to that end. */
static void test_trace_ends_with_rendering(void **state)
{
    struct timeline timeline = {0};
    const struct renderer_stats stats[] = {{.rank = 1, .host = "a", .busy_s = 1, .finish_s = 1}};
    add(&timeline, TIMELINE_TILE, 0, square(0, 0, 4), 0, 0.25);
    add(&timeline, TIMELINE_WASTED, 0, square(4, 4, 4), 0.5, 0.375);
    add(&timeline, TIMELINE_WASTED, 0, square(8, 8, 4), 1.25, 0.125);
    char *text = trace_of(&timeline, stats, 1, 1);
    assert_has(text, "\"cat\": \"wasted\", \"ts\": 500000.000, \"dur\": 500000.000, ");
    assert_int_equal(count_of(text, "\"cat\": "), 2);
    free(text);
    timeline_free(&timeline);
}

static void test_trace_of_shares(void **state)
{
    struct timeline timeline = {0};
    const struct renderer_stats stats[] = {{.rank = 0, .host = "a"}};
    struct tile tile = {.x = 4, .y = 8, .w = 5, .h = 3, .phase = 7, .step = 3};
    add(&timeline, TIMELINE_TILE, 0, tile, 0, 0.25);
    char *text = trace_of(&timeline, stats, 1, 1);
    assert_has(text, "\"name\": \"tile 6,9\"");
    assert_has(text, "\"h\": 3, \"phase\": 7, \"step\": 3, \"pixels\": 3,");
    free(text);
    timeline_free(&timeline);
}

static void test_heatmap_of_passes(void **state)
{
    struct canvas canvas;
    struct timeline timeline = heated(8, 4, &canvas);
    add(&timeline, TIMELINE_TILE, 0, square(0, 0, 4), 0, 16e-6);
    add(&timeline, TIMELINE_TILE, 0, square(4, 0, 4), 0, 16e-6);
    add(&timeline, TIMELINE_TILE, 0, square(4, 0, 4), 1, 48e-6);
    struct heat_range range = timeline_heatmap(&timeline, canvas.height, &canvas);
    assert_true(fabs(range.highest / 4e-6 - 1) < 1e-5);
    canvas_free(&canvas);
    timeline_free(&timeline);
}

/* A renderer without tiles has waited all the time; a trace without any tiles is valid. */
static void test_trace_of_nothing(void **state)
{
    const struct timeline none = {0};
    const struct renderer_stats stats[] = {{.rank = 0, .host = "a"}};
    char *text = trace_of(&none, stats, 1, 2);
    assert_has(text, "\"ts\": 0.000, \"dur\": 2000000.000, "
                     "\"args\": {\"for\": \"end of the run\"}}");
    free(text);
    text = trace_of(&none, stats, 0, 2);
    assert_has(text, "\"args\": {\"name\": \"farm\"}}\n  ]\n}\n");
    assert_int_equal(count_of(text, "\"name\": "), 2);
    free(text);
}

static double lightness(const struct canvas *canvas, uint32_t x, uint32_t y)
{
    const float *rgb = canvas->rgb + 3 * ((size_t)y * canvas->width + x);
    return 0.2 * (double)rgb[0] + 0.7 * (double)rgb[1] + 0.1 * (double)rgb[2];
}

/* A colour in Oklab (B. Ottosson, "A perceptual color space for image processing", 2020). */
struct perceived {
    double lightness, a, b;
};

static double linear(float encoded)
{
    double value = (double)encoded;
    return value <= 0.04045 ? value / 12.92 : pow((value + 0.055) / 1.055, 2.4);
}

static struct perceived perceived(const float rgb[3])
{
    double r = linear(rgb[0]), g = linear(rgb[1]), b = linear(rgb[2]);
    double l = cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
    double m = cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
    double s = cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
    return (struct perceived){0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s,
                              1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s,
                              0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s};
}

/* Turns from one hue to another, less than half a turn either way. */
static double turns_between(double from, double to)
{
    return remainder(to - from, 1);
}

static double hue_of(struct perceived color)
{
    return atan2(color.b, color.a) / (2 * acos(-1));
}

/* Heat is lightness, in even steps; hues go from violet over red to yellow. Both ends are grey. */
static void test_heat_colors(void **state)
{
    double last = 0.78;
    for (int step = 0; step <= 100; step++) {
        double heat = step / 100.0;
        float rgb[3];
        timeline_heat_color(heat, rgb);
        struct perceived color = perceived(rgb);
        assert_true(fabs(color.lightness - heat) < 2e-4);
        double chroma = hypot(color.a, color.b);
        assert_true(step > 0 && step < 100 ? chroma > 0.003 : chroma < 1e-4);
        if (step >= 24 && step <= 90) assert_true(chroma > 0.1);
        if (step == 0 || step == 100) continue;
        double hue = hue_of(color), on = turns_between(last, hue);
        assert_true(on > 0.005 && on < 0.0055);
        last = hue;
    }
    assert_true(fabs(turns_between(last, 1.30)) < 0.006);
}

static void test_heatmap(void **state)
{
    struct canvas canvas;
    struct timeline timeline = heated(16, 4, &canvas);
    double cost = 16e-6; /* of the cheapest tile: 1 us a pixel, then ten times as much each */
    for (uint32_t i = 0; i < 3; i++, cost *= 10)
        add(&timeline, TIMELINE_TILE, i, square(4 * i, 0, 4), 0, cost);
    add(&timeline, TIMELINE_PROBES, 0, square(0, 0, 4), 0, 100);
    add(&timeline, TIMELINE_WASTED, 0, square(4, 0, 4), 0, 100);
    struct heat_range range = timeline_heatmap(&timeline, canvas.height, &canvas);
    assert_true(fabs(range.lowest / 1e-6 - 1) < 1e-5 && fabs(range.highest / 1e-4 - 1) < 1e-5);
    assert_true(lightness(&canvas, 0, 0) < 0.01);
    assert_true(lightness(&canvas, 4, 3) > 0.1 && lightness(&canvas, 7, 0) < 0.6);
    assert_true(lightness(&canvas, 11, 3) > 0.98);
    assert_true(lightness(&canvas, 15, 3) < 0.01); /* not rendered */
    canvas_free(&canvas);
    timeline_free(&timeline);
}

/* Every second pixel of a band; the scale does not turn noise into a picture. */
static void test_heatmap_of_cyclic_shares(void **state)
{
    struct canvas canvas;
    struct timeline timeline = heated(3, 3, &canvas);
    for (uint32_t i = 0; i < 2; i++) {
        struct tile tile = {.w = 3, .h = 3, .phase = i, .step = 2};
        add(&timeline, TIMELINE_TILE, i, tile, 0, i == 0 ? 5e-6 : 4.2e-6);
    }
    struct heat_range range = timeline_heatmap(&timeline, canvas.height, &canvas);
    assert_true(fabs(range.highest / 1.05e-6 - 1) < 1e-5);
    assert_true(fabs(range.lowest / (range.highest / 2) - 1) < 1e-5);
    assert_true(lightness(&canvas, 1, 0) > 0.98 && lightness(&canvas, 2, 1) > 0.98);
    assert_true(lightness(&canvas, 0, 0) > 0.7 && lightness(&canvas, 0, 0) < 0.98);
    canvas_free(&canvas);
    timeline_free(&timeline);
}

/* Pixels that cost next to nothing do not use up the colours of all others. */
static void test_heatmap_of_extremes(void **state)
{
    struct canvas canvas;
    struct timeline timeline = heated(8, 4, &canvas);
    add(&timeline, TIMELINE_TILE, 0, square(0, 0, 4), 0, 16e-9);
    add(&timeline, TIMELINE_TILE, 0, square(4, 0, 4), 0, 16e-3);
    struct heat_range range = timeline_heatmap(&timeline, canvas.height, &canvas);
    assert_true(fabs(range.highest / range.lowest / 1000 - 1) < 1e-9);
    assert_true(lightness(&canvas, 0, 0) == 0 && lightness(&canvas, 7, 3) > 0.98);
    canvas_free(&canvas);
    timeline_free(&timeline);
}

static void test_heatmap_of_nothing(void **state)
{
    struct canvas canvas;
    struct timeline none = heated(2, 2, &canvas);
    struct heat_range range = timeline_heatmap(&none, canvas.height, &canvas);
    assert_true(range.lowest == 0 && range.highest == 0);
    for (int i = 0; i < 12; i++)
        assert_true(canvas.rgb[i] == 0);
    canvas_free(&canvas);
    timeline_free(&none);
}

/* The colours of all 44 ranks differ in 8 bits per channel, and none is that of a pixel that is not rendered. */
static void test_ranks(void **state)
{
    struct timeline timeline = {0};
    struct canvas canvas;
    enum { RANKS = 44 };
    float colors[RANKS][3];
    rank_colors(RANKS, colors);
    canvas_init(&canvas, RANKS + 1, 1);
    for (uint32_t i = 0; i < RANKS; i++)
        add(&timeline, TIMELINE_TILE, i, square(i, 0, 1), 0, 1);
    add(&timeline, TIMELINE_WASTED, 7, square(0, 0, 1), 0, 1);
    timeline_ranks(&timeline, colors, &canvas);
    for (int i = 0; i <= RANKS; i++) {
        for (int k = 0; k < i; k++) {
            double distance = 0;
            for (int c = 0; c < 3; c++)
                distance += fabs((double)canvas.rgb[3 * i + c] - (double)canvas.rgb[3 * k + c]);
            assert_true(distance > 6.0 / 255);
        }
    }
    canvas_free(&canvas);
    timeline_free(&timeline);
}

/* The legend has numbers of ranks, not of renderers: rank 0 may render nothing. */
static void test_legend_names_ranks(void **state)
{
    const struct timeline none = {0};
    enum { MOST = 12 * 100 * 200 };
    static char bytes[2][MOST];
    for (uint32_t rank = 0; rank < 2; rank++) {
        struct renderer_stats stats = {.rank = rank};
        struct report report = {
            .renderers = &stats, .renderer_count = 1, .image_width = 100, .image_height = 100};
        struct settings settings;
        settings_init(&settings);
        free(settings.output.ranks);
        settings.output.ranks = copy_text("ranks.pfm");
        assert_true(timeline_write(&none, &settings, &report));
        settings_free(&settings);
        FILE *file = fopen("ranks.pfm", "rb");
        assert_non_null(file);
        assert_true(fread(bytes[rank], 1, MOST, file) > 0);
        fclose(file);
    }
    assert_memory_not_equal(bytes[0], bytes[1], MOST);
}

/* Each of the three files is reason enough to keep a timeline, and is refused before rendering if it cannot be
 * written. */
static void test_each_output(void **state)
{
    struct scratch *s = *state;
    static const char *const keys[] = {"output.trace", "output.heatmap", "output.ranks"};
    struct settings settings;
    settings_init(&settings);
    assert_true(!timeline_wanted(&settings) && timeline_writable(&settings));
    char **paths[] = {&settings.output.trace, &settings.output.heatmap, &settings.output.ranks};
    for (size_t i = 0; i < 3; i++) {
        char *none = *paths[i];
        *paths[i] = copy_text("new.png");
        assert_true(timeline_wanted(&settings) && timeline_writable(&settings));
        free(*paths[i]);
        *paths[i] = copy_text("none/new.png");
        message_capture(s->said, sizeof s->said);
        bool writable = timeline_writable(&settings);
        message_capture(NULL, 0);
        assert_false(writable);
        assert_has(s->said, keys[i]);
        free(*paths[i]);
        *paths[i] = none;
    }
    settings_free(&settings);
}

static float white[1][3] = {{1, 1, 1}};

/* A tile's upper and left edge are darker, so that tiles of one rank can be told apart. */
static void test_outlines(void **state)
{
    struct timeline timeline = {0};
    struct canvas canvas;
    canvas_init(&canvas, 16, 8);
    add(&timeline, TIMELINE_TILE, 0, square(0, 0, 8), 0, 1);
    add(&timeline, TIMELINE_TILE, 0, square(8, 0, 8), 0, 1);
    timeline_ranks(&timeline, white, &canvas);
    assert_true(lightness(&canvas, 8, 4) < 0.8 * lightness(&canvas, 7, 4));
    assert_true(lightness(&canvas, 7, 4) == lightness(&canvas, 12, 7));
    assert_true(lightness(&canvas, 12, 0) == lightness(&canvas, 8, 4));
    canvas_free(&canvas);
    timeline_free(&timeline);
}

/* Neither shares of every n-th pixel nor narrow tiles have outlines. */
static void test_no_outlines(void **state)
{
    const struct tile tiles[] = {{.w = 7, .h = 16, .step = 1},
                                 {.w = 16, .h = 7, .step = 1},
                                 {.w = 16, .h = 16, .step = 2},
                                 {.w = 7, .h = 7, .step = 1}};
    for (size_t i = 0; i < 4; i++) {
        struct timeline timeline = {0};
        struct canvas canvas;
        canvas_init(&canvas, 16, 16);
        add(&timeline, TIMELINE_TILE, 0, tiles[i], 0, 1);
        timeline_ranks(&timeline, white, &canvas);
        assert_true(lightness(&canvas, 0, 0) == lightness(&canvas, 4, 4));
        assert_true(lightness(&canvas, 0, 4) == lightness(&canvas, 4, 4));
        canvas_free(&canvas);
        timeline_free(&timeline);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_trace_ends_with_rendering),
        cmocka_unit_test(test_trace_of_shares),
        cmocka_unit_test(test_heatmap_of_passes),
        cmocka_unit_test(test_trace),
        cmocka_unit_test(test_trace_of_passes),
        cmocka_unit_test(test_trace_of_what_was_given_up),
        cmocka_unit_test(test_trace_of_more_than_all),
        cmocka_unit_test(test_trace_of_serving),
        cmocka_unit_test(test_trace_of_nothing),
        cmocka_unit_test(test_heat_colors),
        cmocka_unit_test(test_heatmap),
        cmocka_unit_test(test_heatmap_of_cyclic_shares),
        cmocka_unit_test(test_heatmap_of_extremes),
        cmocka_unit_test(test_heatmap_of_nothing),
        cmocka_unit_test(test_ranks),
        cmocka_unit_test(test_legend_names_ranks),
        cmocka_unit_test(test_each_output),
        cmocka_unit_test(test_outlines),
        cmocka_unit_test(test_no_outlines),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
