#include "master/print_job.h"

#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/load.h"
#include "master/loader.h"
#include "master/scene_sections.h"
#include "master/text_file.h"

/* inih's limit for a line, and what it takes for a comment. */
static void print_entry(FILE *out, const char *key, const char *value, const char *config)
{
    if (strlen(key) + 3 + strlen(value) > 198 || strstr(value, " ;") || strpbrk(value, "\n\r"))
        user_warning(config, 0, "%s = %s cannot be read back from a file", key, value);
    fprintf(out, "%s = %s\n", key, value);
}

static bool is_printed(const struct settings *settings, const struct key *key)
{
    if (key->type == VALUE_COLORS) return false; /* bottom and top say the same */
    return key->type != VALUE_REGION || settings->image.region[2];
}

static void print_setting(FILE *out, const struct settings *settings, const struct key *key,
                          const char *config)
{
    char *value = key_format(key, settings);
    if (key->type == VALUE_TEXT && *value) {
        char *absolute = path_absolute(value);
        free(value);
        value = absolute;
    }
    print_entry(out, key->name, value, config);
    free(value);
}

static void print_settings(FILE *out, const struct settings *settings, const char *config)
{
    for (size_t i = 0; i < SETTINGS_KEYS; i++) {
        const struct key *key = &settings_keys[i];
        if (i == 0 || strcmp(key->section, key[-1].section) != 0)
            fprintf(out, "%s[%s]\n", i ? "\n" : "", key->section);
        if (is_printed(settings, key)) print_setting(out, settings, key, config);
    }
}

static void print_section(FILE *out, const struct ini_section *section, const char *config)
{
    fprintf(out, "\n[%s%s%s]\n", section->kind, *section->name ? " " : "", section->name);
    for (size_t i = 0; i < section->count; i++) {
        const struct ini_entry *entry = &section->entries[i];
        char *value = NULL;
        if (strcmp(entry->key, "file") == 0) {
            char *path = path_in(entry->folder, entry->value);
            value = path_absolute(path);
            free(path);
        }
        print_entry(out, entry->key, value ? value : entry->value, config);
        free(value);
    }
}

char *print_job(const struct settings *settings, const struct ini *ini)
{
    char *text = NULL;
    size_t bytes = 0;
    FILE *out = open_memstream(&text, &bytes);
    if (!out) fatal("out of memory");
    print_settings(out, settings, ini->file);
    for (size_t i = 0; i < ini->count; i++)
        if (!is_settings_section(ini->sections[i].kind))
            print_section(out, &ini->sections[i], ini->file);
    if (fclose(out) != 0) fatal("out of memory");
    return text;
}

/* ---- help ---- */

static void print_key_help(FILE *out, const struct key *key)
{
    char *expected = key_expected(key);
    fprintf(out, "    %-14s %s%s%s", key->name, key->help ? key->help : "", key->help ? ": " : "",
            expected);
    if (key->fallback) fprintf(out, " (%s)", key->fallback);
    fputc('\n', out);
    free(expected);
}

void print_scene_keys(FILE *out)
{
    for (size_t i = 0; scene_section_kind(i); i++) {
        const struct section_kind *kind = scene_section_kind(i);
        fprintf(out, "  [%s NAME]\n", kind->name);
        for (size_t j = 0; j < kind->count; j++)
            print_key_help(out, &kind->keys[j]);
    }
}
