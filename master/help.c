#include "master/help.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/key.h"
#include "master/scene_sections.h"
#include "master/settings.h"

/* Columns. Where the output is no terminal, as many as the narrowest terminals in common use have. */
#define COLUMNS_UNKNOWN 80

/* Columns. If less than this is left for the texts beside the names, they stand below them. */
#define ROOM_MIN 20

/* Columns before the texts beside settings and keys, and below names. */
enum { SETTING_INDENT = 39, KEY_INDENT = 19, BELOW_INDENT = 8 };

/* Prints a padded name and a text beside it, whose further lines are indented as far; or, where columns are few, the
 * name and the text below it. */
static void print_row(FILE *out, int columns, const char *name, int indent, const char *text)
{
    bool below = columns - indent < ROOM_MIN;
    const char *join = below ? " " : "";
    int used = below ? columns : indent; /* below: the first word does not fit */
    if (below) indent = BELOW_INDENT;
    fprintf(out, "%-*s", below ? 0 : used, name);
    while (*text) {
        int length = (int)strcspn(text, " ");
        if (*join && used + 1 + length > columns) {
            used = fprintf(out, "\n%*s", indent, "") - 1;
            join = "";
        }
        used += fprintf(out, "%s%.*s", join, length, text);
        join = " ";
        text += length + (text[length] == ' ');
    }
    fputc('\n', out);
}

/* "  section.key = default" */
static void print_setting(FILE *out, int columns, const struct key *key)
{
    const char *value = key->fallback ? key->fallback : "";
    const char *equals = !key->fallback ? "" : *value ? " = " : " =";
    char *name = format_text("  %s.%s%s%s", key->section, key->name, equals, value);
    char *text = copy_text(key->help);
    for (size_t i = 0; key->choices && key->choices[i]; i++) {
        char *longer = format_text("%s%s %s", text, i ? "," : ":", key->choices[i]);
        free(text);
        text = longer;
    }
    print_row(out, columns, name, SETTING_INDENT, text);
    free(text);
    free(name);
}

static void print_scene_key(FILE *out, int columns, const struct key *key)
{
    /* The expected value of a text key is any text, which the help need not say. */
    bool help_is_all = key->help && key->type == VALUE_TEXT;
    char *expected = help_is_all ? copy_text("") : key_expected(key);
    char *name = format_text("    %s", key->name);
    char *text = format_text(
        "%s%s%s%s%s%s", key->help ? key->help : "", key->help && !help_is_all ? ": " : "", expected,
        key->fallback ? " (" : "", key->fallback ? key->fallback : "", key->fallback ? ")" : "");
    print_row(out, columns, name, KEY_INDENT, text);
    free(text);
    free(name);
    free(expected);
}

static void print_scene_keys(FILE *out, int columns)
{
    for (size_t i = 0; scene_section_kind(i); i++) {
        const struct section_kind *kind = scene_section_kind(i);
        fprintf(out, "  [%s NAME]\n", kind->name);
        for (size_t j = 0; j < kind->count; j++)
            print_scene_key(out, columns, &kind->keys[j]);
    }
}

static void print_usage(FILE *out, int columns)
{
    static const char *const options[][2] = {
        {"  --check",
         "read everything, say whether it is all right and how large the scene is, render nothing"},
        {"  --print-config", "print all settings in effect as an INI file, render nothing"},
        {"  --allow-outside", "read files that the scene names outside of its folder, too"},
        {"  --help, -h", "this text"},
        {"  --version", "the version, the MPI library's, and the kernel for this processor"},
        {"  --", "what follows is no option, also if it begins with '-'"},
    };
    print_row(out, columns, "farm:", 6,
              "one picture, ray-traced by as many processors as you have");
    fputc('\n', out);
    print_row(out, columns, "usage:", 7,
              "[mpiexec -n N] farm [OPTION ...] CONFIG [SECTION.KEY=VALUE ...]");
    fputc('\n', out);
    print_row(out, columns, "CONFIG", KEY_INDENT,
              "an INI file that describes picture and scene, or a scene file (.nff, .obj) that is "
              "rendered with default settings");
    print_row(out, columns, "SECTION.KEY=VALUE", KEY_INDENT, "overrides a setting");
    fputc('\n', out);
    for (size_t i = 0; i < sizeof options / sizeof *options; i++)
        print_row(out, columns, options[i][0], KEY_INDENT, options[i][1]);
}

void print_help(FILE *out, int columns)
{
    if (columns == 0) columns = COLUMNS_UNKNOWN;
    print_usage(out, columns);
    fputs("\nsettings and their defaults:\n", out);
    for (size_t i = 0; i < SETTINGS_KEYS; i++)
        print_setting(out, columns, &settings_keys[i]);
    fputs("\nsections of a scene and their keys:\n", out);
    print_scene_keys(out, columns);
    fputs("\n"
          "examples:\n"
          "  farm scene.ini\n"
          "  mpiexec -n 8 farm scene.ini image.width=1920 image.height=1080\n"
          "  mpiexec -f hosts -n 44 farm scene.nff sampling.samples=16 output.image=out.hdr\n"
          "\n"
          "exit status:\n"
          "  0   done\n"
          "  1   failed while running\n"
          "  2   the input is wrong\n"
          "  75  stopped early: the same command goes on\n",
          out);
}
