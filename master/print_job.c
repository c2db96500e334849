/* Makes the text of --print-config (declared in load.h). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/load.h"
#include "master/loader.h"
#include "master/path.h"

/* The output stream, and whether the text can be read back. */
struct printing {
    FILE *out;
    const char *config;
    bool good;
};

/* Only the first value that cannot be written is reported. */
static void print_entry(struct printing *to, const char *key, const char *value)
{
    if (to->good && !ini_can_hold(key, value)) {
        user_error(to->config, 0,
                   "%s = %s cannot be written in an INI file, expected less than 4096 bytes, no "
                   "line end, no blank at an end and no ';' behind a blank",
                   key, value);
        to->good = false;
    }
    fprintf(to->out, "%s = %s\n", key, value);
}

static void print_setting(struct printing *to, const struct settings *settings,
                          const struct key *key)
{
    char *value = key_format(key, settings);
    if (key->type == VALUE_TEXT && *value) {
        char *absolute = path_unresolved(value);
        free(value);
        value = absolute;
    }
    print_entry(to, key->name, value);
    free(value);
}

/* Whether the name of an output is derived from other names. */
static bool is_derived(const struct job *job, const struct key *key)
{
    const struct settings *settings = &job->settings;
    const void *value = (const char *)settings + key->offset;
    return (value == &settings->output.image && !job->named.image) ||
           (value == &settings->output.report && !job->named.report) ||
           (value == &settings->output.journal && !job->named.journal);
}

static void print_settings(struct printing *to, const struct job *job)
{
    const struct settings *settings = &job->settings;
    for (size_t i = 0; i < SETTINGS_KEYS; i++) {
        const struct key *key = &settings_keys[i];
        if (i == 0 || strcmp(key->section, key[-1].section) != 0)
            fprintf(to->out, "%s[%s]\n", i ? "\n" : "", key->section);
        if (is_derived(job, key))
            fprintf(to->out, "; %s is not set: %s\n", key->name, key->help);
        else if (settings_lists(settings, key))
            print_setting(to, settings, key);
    }
}

static void print_section(struct printing *to, const struct ini_section *section)
{
    /* Materials of MTL files have names of any kind. */
    if (to->good && !ini_can_name(section->kind, section->name)) {
        user_error(to->config, 0,
                   "[%s %s] cannot be written in an INI file, expected a shorter name, without ']' "
                   "and ';'",
                   section->kind, section->name);
        to->good = false;
    }
    fprintf(to->out, "\n[%s%s%s]\n", section->kind, *section->name ? " " : "", section->name);
    for (size_t i = 0; i < section->count; i++) {
        const struct ini_entry *entry = &section->entries[i];
        char *value = NULL;
        if (strcmp(entry->key, "file") == 0) {
            char *path = path_in(entry->folder, entry->value);
            value = path_unresolved(path);
            free(path);
        }
        print_entry(to, entry->key, value ? value : entry->value);
        free(value);
    }
}

static bool names_files(const struct ini *ini)
{
    for (size_t i = 0; i < ini->count; i++)
        if (ini_entry(&ini->sections[i], "file")) return true;
    return false;
}

char *print_job(const struct job *job)
{
    const struct ini *ini = job->document;
    char *text = NULL;
    size_t bytes = 0;
    struct printing to = {open_memstream(&text, &bytes), ini->file, true};
    if (!to.out) fatal("out of memory");
    if (names_files(ini))
        fputs("; Paths begin at the root: farm --allow-outside renders this in any folder.\n",
              to.out);
    print_settings(&to, job);
    for (size_t i = 0; i < ini->count; i++)
        if (!is_settings_section(ini->sections[i].kind)) print_section(&to, &ini->sections[i]);
    if (fclose(to.out) != 0) fatal("out of memory");
    if (to.good) return text;
    free(text);
    return NULL;
}
