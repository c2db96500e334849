#include "master/options.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/message.h"
#include "master/image_file.h"
#include "master/loader.h"
#include "master/nearest_name.h"
#include "master/number.h"
#include "master/path.h"
#include "master/scene_sections.h"
#include "master/settings.h"

static const struct {
    const char *name;
    enum action action;
} flags[] = {
    {"--help", ACTION_HELP},
    {"-h", ACTION_HELP},
    {"--version", ACTION_VERSION},
    {"--check", ACTION_CHECK},
    {"--print-config", ACTION_PRINT_CONFIG},
};

static const char allow_outside[] = "--allow-outside";

/* Only one thing is done; what follows --help or --version is ignored, as the GNU coding standards ask for. */
static bool set_action(enum action action, struct options *options)
{
    bool first = options->action == ACTION_RENDER || options->action == action;
    if (first || action == ACTION_HELP || action == ACTION_VERSION) {
        options->action = action;
        return true;
    }
    user_error(NULL, 0, "--check and --print-config at once, expected one of them");
    return false;
}

static bool has_scene_extension(const char *argument)
{
    return path_has_extension(argument, ".ini") || path_has_extension(argument, ".nff") ||
           path_has_extension(argument, ".obj");
}

/* Whether a name of this length is that of a key, perhaps with '-' in place of '_'. */
static bool is_key_name(const char *name, size_t length, const char *key)
{
    for (size_t i = 0; i < length; i++)
        if (name[i] != key[i] && !(name[i] == '-' && key[i] == '_')) return false;
    return key[length] == '\0';
}

/* "NAME" or "NAME=VALUE" with its section in front: "sampling.samples=4" of "samples=4"; NULL: no setting has this
 * name. The caller frees it. */
static char *with_section(const char *argument)
{
    size_t length = strcspn(argument, "=");
    const char *value = argument[length] ? argument + length : "=VALUE";
    for (size_t i = 0; i < SETTINGS_KEYS; i++) {
        const struct key *key = &settings_keys[i];
        if (is_key_name(argument, length, key->name))
            return format_text("%s.%s%s", key->section, key->name, value);
    }
    return NULL;
}

/* Behind what is probably a part of an override with spaces that the shell has split. */
#define NEEDS_QUOTES "settings with spaces need quotes, such as \"light key.color=1 1 1\""

/* The end of the message about an unknown option. The caller frees it. */
static char *hint_of_flag(const char *argument)
{
    double number;
    if (number_parse(argument, &number)) return copy_text(NEEDS_QUOTES);
    if (has_scene_extension(argument))
        return format_text("expected ./ in front of a file's name: ./%s", argument);
    if (strncmp(argument, "-n", 2) == 0) /* an option of mpiexec: -n 4, -np 4 */
        return copy_text("expected mpiexec in front of it: mpiexec -n N farm CONFIG");
    if (strcmp(argument, "-o") == 0 || strcmp(argument, "--output") == 0)
        return copy_text("did you mean 'output.image=FILE'?");
    struct nearest_name search = {.name = argument};
    for (size_t i = 0; i < sizeof flags / sizeof *flags; i++)
        if (flags[i].name[1] == '-') nearest_name_try(&search, flags[i].name);
    nearest_name_try(&search, allow_outside);
    char *setting = search.best ? NULL : with_section(argument + strspn(argument, "-"));
    const char *meant = search.best ? search.best : setting;
    char *hint = meant ? format_text("did you mean '%s'?", meant)
                       : copy_text("expected one of -h --help --version --check --print-config "
                                   "--allow-outside, or -- before a name that begins with -");
    free(setting);
    return hint;
}

static bool parse_flag(const char *argument, struct options *options)
{
    if (strcmp(argument, allow_outside) == 0) return options->allow_outside = true;
    for (size_t i = 0; i < sizeof flags / sizeof *flags; i++)
        if (strcmp(argument, flags[i].name) == 0) return set_action(flags[i].action, options);
    char *hint = hint_of_flag(argument);
    user_error(NULL, 0, "unknown option '%s', %s", argument, hint);
    free(hint);
    return false;
}

/* Whether a word of this length names a section of settings or of a scene. */
static bool is_section(const char *word, size_t length)
{
    char *kind = format_text("%.*s", (int)length, word);
    bool found = is_settings_section(kind) || scene_section_of(kind) != SCENE_SECTIONS;
    free(kind);
    return found;
}

/* Whether an argument with a '=', such as "./a=0.5/scene.ini", is the path of a scene. The file need not exist here if
 * a folder before the '=' shows that it names no section: other machines need not have the file. */
static bool is_scene(const char *argument, size_t before_equals)
{
    if (!has_scene_extension(argument)) return false;
    if (access(argument, F_OK) == 0) return true;
    return memchr(argument, '/', before_equals) && !is_section(argument, strcspn(argument, ". "));
}

/* Whether the argument is an override: it has a section, a dot and a key before its '='. A file name such as a=b.ini
 * has no dot there. */
static bool is_override(const char *argument)
{
    size_t before_equals = strcspn(argument, "=");
    return argument[before_equals] && memchr(argument, '.', before_equals) &&
           !is_scene(argument, before_equals);
}

/* "samples=4": meant as an override, unless a file has that name. */
static bool is_setting_without_section(const char *argument)
{
    size_t before_equals = strcspn(argument, "=");
    return argument[before_equals] && !is_scene(argument, before_equals) &&
           access(argument, F_OK) != 0;
}

/* Whether the argument is an override without a value, such as "image.width" or "sphere a.radius". The name of an
 * existing file is none, nor is one with the extension of a scene, such as "sphere.obj". */
static bool is_without_value(const char *argument)
{
    size_t length = strcspn(argument, ". ");
    return strchr(argument, '.') && !strchr(argument, '=') && is_section(argument, length) &&
           !has_scene_extension(argument) && access(argument, F_OK) != 0;
}

static void refuse_without_value(const char *argument)
{
    user_error(
        NULL, 0,
        "'%s' has no value, expected %s=VALUE without spaces beside '=', within quotes if VALUE "
        "has some",
        argument, argument);
}

static void refuse_without_section(const char *argument)
{
    size_t length = strcspn(argument, "=");
    char *meant = with_section(argument);
    if (meant)
        user_error(NULL, 0, "'%s' names no section, did you mean '%s'?", argument, meant);
    else if (is_section(argument, length))
        user_error(NULL, 0, "'%s' names no key, expected %.*s.KEY=VALUE", argument, (int)length,
                   argument);
    else
        user_error(NULL, 0,
                   "'%s' is neither a scene nor SECTION.KEY=VALUE, such as "
                   "sampling.samples=4",
                   argument);
    free(meant);
}

/* Reports a second scene. If it is the name of a section, or a number, the shell has probably split an override that
 * needs quotes. */
static void refuse_second_scene(const char *argument, const char *config)
{
    if (image_extension_known(argument)) {
        user_error(NULL, 0, "'%s' is no scene, did you mean 'output.image=%s'?", argument,
                   argument);
        return;
    }
    double number;
    bool part = is_section(argument, strlen(argument)) || number_parse(argument, &number);
    bool quotes = part && access(argument, F_OK) != 0;
    user_error(NULL, 0,
               "'%s' is a second scene after '%s', expected one CONFIG and section.key=value%s",
               argument, config, quotes ? "; " NEEDS_QUOTES : "");
}

bool options_parse(int argc, char **argv, struct options *options)
{
    size_t overrides = 0;
    bool flags_ended = false; /* by "--": arguments after it are names, however they begin */
    *options = (struct options){.action = ACTION_RENDER, .overrides = argv};
    for (int i = 1; i < argc; i++) {
        char *argument = argv[i];
        if (!flags_ended && strcmp(argument, "--") == 0) {
            flags_ended = true;
        } else if (!flags_ended && argument[0] == '-' && argument[1] != '\0') {
            if (!parse_flag(argument, options)) return false;
            if (options->action == ACTION_HELP || options->action == ACTION_VERSION) return true;
        } else if (is_override(argument)) {
            /* Gathered at the front of argv, over arguments that have been read. */
            argv[overrides++] = argument;
        } else if (is_setting_without_section(argument)) {
            refuse_without_section(argument);
            return false;
        } else if (is_without_value(argument)) {
            refuse_without_value(argument);
            return false;
        } else if (options->config) {
            refuse_second_scene(argument, options->config);
            return false;
        } else {
            options->config = argument;
        }
    }
    options->override_count = overrides;
    if (options->config && *options->config) return true;
    user_error(NULL, 0,
               "no scene given, expected: farm CONFIG [section.key=value ...] "
               "(farm --help tells more)");
    return false;
}
