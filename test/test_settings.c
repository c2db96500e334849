/* Tests of the table of settings: defaults, values, ranges, and printing values. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "master/settings.h"
#include "test/unit.h"

static const struct key *key_of(const char *section, const char *name)
{
    for (size_t i = 0; i < SETTINGS_KEYS; i++)
        if (!strcmp(settings_keys[i].section, section) && !strcmp(settings_keys[i].name, name))
            return &settings_keys[i];
    fail_msg("no key %s.%s", section, name);
    return NULL;
}

static void check_good(const char *section, const char *name, const char *text, const char *printed)
{
    struct settings settings;
    settings_init(&settings);
    const struct key *key = key_of(section, name);
    if (!key_parse(key, text, &settings)) fail_msg("%s.%s = %s was refused", section, name, text);
    char *back = key_format(key, &settings);
    assert_string_equal(back, printed);
    free(back);
    settings_free(&settings);
}

static void check_bad(const char *section, const char *name, const char *text)
{
    struct settings settings;
    settings_init(&settings);
    const struct key *key = key_of(section, name);
    char *before = key_format(key, &settings);
    if (key_parse(key, text, &settings)) fail_msg("%s.%s = %s was accepted", section, name, text);
    char *after = key_format(key, &settings);
    assert_string_equal(before, after);
    free(before);
    free(after);
    settings_free(&settings);
}

/* A word of a vector may have up to 511 characters: there is no room for longer ones. */
static void test_long_words(void **state)
{
    char text[600], word[513];
    memset(word, '0', sizeof word);
    word[512] = '\0';
    snprintf(text, sizeof text, "%s 2 3", word + 1);
    check_good("camera", "eye", text, "0 2 3");
    snprintf(text, sizeof text, "%s 2 3", word);
    check_bad("camera", "eye", text);
}

static void test_defaults(void **state)
{
    struct settings s;
    settings_init(&s);
    assert_int_equal(s.image.width, 640);
    assert_int_equal(s.image.height, 480);
    assert_int_equal(s.image.region[2], 0);
    assert_true(s.camera.fov == 45 && s.camera.up.y == 1);
    assert_int_equal(s.render.max_depth, 20);
    assert_true(s.render.cutoff == 1.0 / 512);
    assert_true(s.render.shadows && s.farm.master_renders && !s.render.strict);
    assert_int_equal(s.render.formulas, FORMULAS_EXACT);
    assert_int_equal(s.sampling.samples, 1);
    assert_int_equal(s.farm.schedule, SCHEDULE_DYNAMIC);
    assert_int_equal(s.farm.tile, 0);
    assert_int_equal(s.farm.variant, VARIANT_AUTO);
    assert_true(s.farm.patience == 60);
    assert_int_equal(s.sampling.min_samples, 4);
    assert_int_equal(s.sampling.max_samples, 4096);
    assert_true(s.sampling.target_error == 0 && s.sampling.time_limit == 0);
    assert_true(s.background.bottom.x == 0.04 && s.background.bottom.y == 0.04);
    assert_true(s.background.bottom.z == 0.05 && s.background.top.x == 0.2);
    assert_true(s.background.top.y == 0.26 && s.background.top.z == 0.36);
    assert_null(s.output.image);
    assert_true(s.output.preview == 0);
    settings_free(&s);
}

static void test_values(void **state)
{
    check_good("image", "width", "65535", "65535");
    check_bad("image", "width", "0");
    check_bad("image", "width", "65536");
    check_bad("image", "width", "12.5");
    check_bad("image", "width", "-3");
    check_good("image", "region", "0  1 2\t3", "0 1 2 3");
    check_bad("image", "region", "0 1 2");
    check_bad("image", "region", "0 1 0 3");
    check_bad("image", "region", "0 1 2 0");
    check_bad("image", "region", "0 1 2 3 4");
    check_good("camera", "eye", "1 -2.5 3e2", "1 -2.5 300");
    check_bad("camera", "eye", "1 2");
    check_bad("camera", "eye", "1 2 3 4");
    check_bad("camera", "eye", "1 2 nan");
    check_good("camera", "fov", "179.999", "179.999");
    check_bad("camera", "fov", "0");
    check_bad("camera", "fov", "180");
    check_good("background", "top", "0 2 0.5", "0 2 0.5");
    check_bad("background", "top", "0 -1 0");
    check_good("render", "max_depth", "0", "0");
    check_bad("render", "max_depth", "1000001");
    check_good("render", "cutoff", "0", "0");
    check_bad("render", "cutoff", "-1");
    check_bad("render", "cutoff", "inf");
    check_good("render", "shadows", "FALSE", "no");
    check_good("render", "shadows", "On", "yes");
    check_good("render", "shadows", "0", "no");
    check_bad("render", "shadows", "maybe");
    check_good("render", "formulas", "Paper", "paper");
    check_bad("render", "formulas", "naive");
    check_good("render", "strict", "yes", "yes");
    check_bad("render", "strict", "2");
    check_bad("sampling", "samples", "0");
    check_bad("sampling", "samples", "65537");
    check_good("farm", "schedule", "Cyclic", "cyclic");
    check_bad("farm", "schedule", "static");
    check_good("farm", "tile", "Auto", "auto");
    check_good("farm", "tile", "1024", "1024");
    check_bad("farm", "tile", "0");
    check_bad("farm", "tile", "1025");
    check_good("farm", "kernel", "Portable", "portable");
    check_bad("farm", "kernel", "sse2");
}

static void test_color_sets_both_ends(void **state)
{
    struct settings s;
    settings_init(&s);
    assert_true(key_parse(key_of("background", "color"), "0.1 0.2 0.3", &s));
    assert_true(s.background.bottom.x == 0.1 && s.background.top.z == 0.3);
    settings_free(&s);
}

static void test_expectations(void **state)
{
    static const struct {
        const char *section, *name, *text;
    } cases[] = {
        {"image", "width", "a whole number from 1 to 65535"},
        {"camera", "fov", "a number > 0 and < 180"},
        {"render", "cutoff", "a finite number >= 0"},
        {"farm", "schedule", "dynamic, tiles, strips, cyclic or cyclic-rows"},
        {"farm", "tile", "auto or a whole number from 1 to 1024"},
        {"farm", "kernel", "auto, portable, avx2 or avx512"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char *text = key_expected(key_of(cases[i].section, cases[i].name));
        assert_string_equal(text, cases[i].text);
        free(text);
    }
}

static void test_schedule_names(void **state)
{
    assert_string_equal(schedule_names[SCHEDULE_DYNAMIC], "dynamic");
    assert_string_equal(schedule_names[SCHEDULE_STRIPS], "strips");
    assert_string_equal(schedule_names[SCHEDULE_CYCLIC], "cyclic");
    assert_string_equal(schedule_names[SCHEDULE_CYCLIC_ROWS], "cyclic-rows");
    assert_string_equal(schedule_names[SCHEDULE_TILES], "tiles");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults),     cmocka_unit_test(test_long_words),
        cmocka_unit_test(test_values),       cmocka_unit_test(test_color_sets_both_ends),
        cmocka_unit_test(test_expectations), cmocka_unit_test(test_schedule_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
