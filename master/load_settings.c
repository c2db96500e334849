/* Reads the settings of CONFIG and applies the arguments that override them (declared in loader.h). */
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/loader.h"
#include "master/nearest_name.h"
#include "master/path.h"
#include "master/scene_sections.h"
#include "master/sections.h"

size_t setting_index(const char *section, const char *name)
{
    size_t i = 0;
    while (strcmp(settings_keys[i].section, section) != 0 ||
           strcmp(settings_keys[i].name, name) != 0)
        if (++i == SETTINGS_KEYS) fatal("no setting is called %s.%s", section, name);
    return i;
}

const struct origin *setting_origin(const struct loader *loader, const char *section,
                                    const char *name)
{
    return &loader->origins[setting_index(section, name)];
}

bool setting_is_set(const struct loader *loader, const char *section, const char *name)
{
    return setting_origin(loader, section, name)->file != NULL;
}

/* ---- the sections of CONFIG ---- */

bool is_settings_section(const char *kind)
{
    for (size_t i = 0; i < SETTINGS_KEYS; i++)
        if (strcmp(settings_keys[i].section, kind) == 0) return true;
    return false;
}

char *section_hint(const char *kind)
{
    struct nearest_name search = {.name = kind};
    for (size_t i = 0; i < SETTINGS_KEYS; i++)
        nearest_name_try(&search, settings_keys[i].section);
    for (size_t i = 0; scene_section_kind(i); i++)
        nearest_name_try(&search, scene_section_kind(i)->name);
    char *hint = nearest_name_hint(&search);
    if (*hint) return hint;
    free(hint);
    return copy_text(", expected one that 'farm --help' lists");
}

/* The keys of a section; they are contiguous in the table. */
static const struct key *settings_of(const char *kind, size_t *count)
{
    size_t first = 0;
    while (strcmp(settings_keys[first].section, kind) != 0)
        first++;
    size_t end = first;
    while (end < SETTINGS_KEYS && strcmp(settings_keys[end].section, kind) == 0)
        end++;
    *count = end - first;
    return &settings_keys[first];
}

static bool set_setting(struct loader *loader, const struct ini_section *section,
                        const struct ini_entry *entry)
{
    size_t count;
    const struct key *keys = settings_of(section->kind, &count);
    const struct key *key = key_of_entry(section, entry, keys, count);
    if (!key) return false;
    struct ini_entry local = *entry;
    bool is_path = key->type == VALUE_TEXT && *entry->value;
    if (is_path) local.value = path_in(entry->folder, entry->value);
    bool good = read_entry(section, &local, key, loader->settings);
    if (is_path) free(local.value);
    if (!good) return false;
    loader->origins[key - settings_keys] = (struct origin){entry->file, entry->line};
    if (strcmp(section->kind, "background") == 0) loader->background_set = true;
    return true;
}

#define TWO_BACKGROUNDS                                                                            \
    "[background] has a color as well as bottom or top, expected one or the other"

static bool read_settings_section(struct loader *loader, const struct ini *ini,
                                  const struct ini_section *section)
{
    if (*section->name) {
        user_error(ini->file, section->line, "[%s] takes no name, expected [%s]", section->kind,
                   section->kind);
        return false;
    }
    for (size_t i = 0; i < section->count; i++)
        if (!set_setting(loader, section, &section->entries[i])) return false;
    if (strcmp(section->kind, "background") != 0 || !ini_entry(section, "color")) return true;
    if (!ini_entry(section, "bottom") && !ini_entry(section, "top")) return true;
    struct ini_place place = ini_place_of(ini, section, "color");
    user_error(place.file, place.line, TWO_BACKGROUNDS);
    return false;
}

bool read_settings(struct loader *loader, const struct ini *ini)
{
    long first[SETTINGS_KEYS] = {0}; /* line of each section read, at the index of its first key */
    for (size_t i = 0; i < ini->count; i++) {
        const struct ini_section *section = &ini->sections[i];
        if (!is_settings_section(section->kind)) continue;
        size_t count;
        size_t which = (size_t)(settings_of(section->kind, &count) - settings_keys);
        if (first[which] > 0) {
            user_error(ini->file, section->line, "[%s] is already in line %ld, expected it once",
                       section->kind, first[which]);
            return false;
        }
        first[which] = section->line;
        if (!read_settings_section(loader, ini, section)) return false;
    }
    return true;
}

/* ---- overrides ---- */

/* An argument such as "material glass.ior=1.3", split into kind, name, key and value, which point into one copy. */
struct override {
    const char *argument;
    char *copy;
    char *kind, *name, *key, *value;
};

static char *trim(char *text)
{
    text += strspn(text, " \t");
    size_t length = strlen(text);
    while (length && strchr(" \t", text[length - 1]))
        text[--length] = '\0';
    return text;
}

static bool take_apart(const char *argument, struct override *override)
{
    *override = (struct override){.argument = argument, .copy = copy_text(argument)};
    char *equals = strchr(override->copy, '=');
    if (equals) *equals = '\0';
    char *dot = equals ? strrchr(override->copy, '.') : NULL;
    if (dot) {
        *dot = '\0';
        override->value = trim(equals + 1);
        override->key = trim(dot + 1);
        override->kind = trim(override->copy);
        size_t length = strcspn(override->kind, " \t");
        override->name = trim(override->kind + length);
        override->kind[length] = '\0';
        if (*override->key && *override->kind) return true;
    }
    user_error(argument, 0, "is no setting, expected SECTION.KEY=VALUE");
    free(override->copy);
    return false;
}

/* Refuses "light.key.color=1 0 0", which should be "light key.color=1 0 0". */
static bool refuse_dotted_name(const struct override *override)
{
    size_t length = strcspn(override->kind, ".");
    char *kind = format_text("%.*s", (int)length, override->kind);
    bool dotted = override->kind[length] == '.' && override->kind[length + 1] && !*override->name &&
                  scene_section_of(kind) != SCENE_SECTIONS;
    if (dotted)
        user_error(override->argument, 0,
                   "unknown section '%s', expected a name behind a space, in quotes: "
                   "\"%s %s.%s=...\"",
                   override->kind, kind, override->kind + length + 1, override->key);
    free(kind);
    return dotted;
}

/* Refuses "ball.radius=2", which should be "sphere ball.radius=2". */
static bool refuse_name_alone(const struct ini *ini, const struct override *override)
{
    for (size_t i = 0; i < ini->count; i++) {
        const struct ini_section *section = &ini->sections[i];
        size_t length = strlen(section->name);
        if (length == 0 || strncmp(override->argument, section->name, length) != 0 ||
            override->argument[length] != '.')
            continue;
        user_error(override->argument, 0, "unknown section '%s', did you mean \"%s %s\"?",
                   section->name, section->kind, override->argument);
        return true;
    }
    return false;
}

static bool refuse_override_section(const struct ini *ini, const struct override *override)
{
    if (refuse_dotted_name(override) || refuse_name_alone(ini, override)) return false;
    char *hint = section_hint(override->kind);
    user_error(override->argument, 0, "unknown section '%s'%s", override->kind, hint);
    free(hint);
    return false;
}

/* Whether the argument is to add a section. With an OBJ file as CONFIG the first argument for a material adds one, as
 * the MTL files have not been read yet. */
static bool begins_section(const struct ini *ini, const struct override *override)
{
    return path_has_extension(ini->file, ".obj") && strcmp(override->kind, "material") == 0 &&
           *override->name;
}

static void report_missing_section(const struct ini *ini, const struct override *override)
{
    struct nearest_name search = {.name = override->name};
    for (size_t i = 0; i < ini->count; i++)
        if (strcmp(ini->sections[i].kind, override->kind) == 0)
            nearest_name_try(&search, ini->sections[i].name);
    char *hint = nearest_name_hint(&search);
    const char *without = !*override->name && search.count > 0 ? " without a name" : "";
    user_error(override->argument, 0, "%s has no section [%s%s%s]%s%s", ini->file, override->kind,
               *override->name ? " " : "", override->name, without, hint);
    free(hint);
}

/* The single section that an override names; NULL after reporting that there is none, or more than one. */
static struct ini_section *overridden_section(struct ini *ini, const struct override *override)
{
    struct ini_section *found = NULL;
    size_t matches = 0;
    for (size_t i = 0; i < ini->count; i++) {
        struct ini_section *section = &ini->sections[i];
        if (strcmp(section->kind, override->kind) != 0) continue;
        if (strcmp(section->name, override->name) != 0) continue;
        found = section;
        matches++;
    }
    if (matches == 1) return found;
    if (matches > 1) {
        user_error(override->argument, 0,
                   "there are %zu sections [%s], expected one that has a name", matches,
                   override->kind);
        return NULL;
    }
    if (begins_section(ini, override)) return ini_add_section(ini, "material", override->name, 0);
    report_missing_section(ini, override);
    return NULL;
}

/*
 * A background has either a color, or bottom and top. An argument of one kind resets the keys of the other kind that
 * the file sets. false after reporting that another argument sets a key of the other kind.
 */
static bool replace_background(struct loader *loader, const struct override *override)
{
    size_t count;
    const struct key *keys = settings_of("background", &count);
    struct origin *origins = &loader->origins[keys - settings_keys];
    bool is_color = strcmp(override->key, "color") == 0;
    for (size_t i = 0; i < count; i++) {
        if ((strcmp(keys[i].name, "color") == 0) == is_color || !origins[i].file) continue;
        if (origins[i].line == 0) {
            user_error(override->argument, 0, TWO_BACKGROUNDS);
            return false;
        }
        origins[i] = (struct origin){NULL, 0};
        keys_set_fallbacks(keys, count, loader->settings);
    }
    return true;
}

static bool apply(struct loader *loader, struct ini *ini, const struct override *override)
{
    struct ini_entry entry = {
        .key = override->key, .value = override->value, .file = override->argument, .folder = ""};
    if (is_settings_section(override->kind) && !*override->name) {
        struct ini_section section = {.kind = override->kind, .name = override->name};
        if (strcmp(override->kind, "background") == 0 && !replace_background(loader, override))
            return false;
        return set_setting(loader, &section, &entry);
    }
    if (is_settings_section(override->kind)) {
        user_error(override->argument, 0, "[%s] takes no name, expected %s.%s=VALUE",
                   override->kind, override->kind, override->key);
        return false;
    }
    if (scene_section_of(override->kind) == SCENE_SECTIONS)
        return refuse_override_section(ini, override);
    struct ini_section *section = overridden_section(ini, override);
    if (!section) return false;
    ini_set(section, override->key, override->value, &entry);
    return true;
}

bool apply_overrides(struct loader *loader, struct ini *ini, char *const *overrides, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct override override;
        if (!take_apart(overrides[i], &override)) return false;
        bool good = apply(loader, ini, &override);
        free(override.copy);
        if (!good) return false;
    }
    return true;
}
