#include "master/sections.h"

#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/nearest_name.h"
#include "master/scene_sections.h"
#include "master/settings.h"

char *section_title(const struct ini_section *section)
{
    return format_text("[%s%s%s]", section->kind, *section->name ? " " : "", section->name);
}

/* The section of settings that has the key or, for a section of the scene, whether materials have it, as those have
 * that objects are often given; NULL: none. */
static const char *home_of_key(const struct ini_section *section, const char *key)
{
    const struct section_kind *material = scene_section_kind(SECTION_MATERIAL);
    bool in_scene = scene_section_of(section->kind) != SCENE_SECTIONS;
    const struct key *keys = in_scene ? material->keys : settings_keys;
    size_t count = in_scene ? material->count : SETTINGS_KEYS;
    for (size_t i = 0; i < count; i++)
        if (strcmp(keys[i].name, key) == 0) return keys[i].section;
    return NULL;
}

/* The end of the message about an unknown key. The caller frees it. */
static char *hint_of_key(const struct ini_section *section, const char *key, const struct key *keys,
                         size_t count)
{
    const char *home = home_of_key(section, key);
    if (home) return format_text(", it belongs to [%s]", home);
    struct nearest_name search = {.name = key};
    for (size_t i = 0; i < count; i++)
        nearest_name_try(&search, keys[i].name);
    return nearest_name_hint(&search);
}

const struct key *key_of_entry(const struct ini_section *section, const struct ini_entry *entry,
                               const struct key *keys, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (strcmp(keys[i].name, entry->key) == 0) return &keys[i];
    char *title = section_title(section);
    char *hint = hint_of_key(section, entry->key, keys, count);
    user_error(entry->file, entry->line, "unknown key '%s' in %s%s", entry->key, title, hint);
    free(title);
    free(hint);
    return NULL;
}

bool is_quoted(const char *value)
{
    return *value && (strchr("\"'", *value) || strchr("\"'", value[strlen(value) - 1]));
}

const char *comment_hint(const char *value)
{
    bool comment = strstr(value, " #") || strstr(value, "\t#") || strchr(value, ';');
    return comment ? "; a comment behind a value begins with ' ;'" : "";
}

bool read_entry(const struct ini_section *section, const struct ini_entry *entry,
                const struct key *key, void *base)
{
    if (key_parse(key, entry->value, base)) return true;
    char *title = section_title(section), *expected = key_expected(key);
    const char *hint = entry->line > 0 ? comment_hint(entry->value) : "";
    char *what = *hint       ? copy_text(hint)
                 : key->help ? format_text("; %s: %s", key->name, key->help)
                             : copy_text("");
    if (entry->line > 0)
        user_error(entry->file, entry->line, "%s = %s in %s, expected %s%s", entry->key,
                   entry->value, title, expected, what);
    else /* an argument: entry->file is its whole text, so the message need not repeat it */
        user_error(entry->file, 0, "expected %s%s", expected, what);
    free(what);
    free(title);
    free(expected);
    return false;
}

static bool nothing_missing(const struct ini *ini, const struct ini_section *section,
                            const struct key *keys, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (!keys[i].required || ini_entry(section, keys[i].name)) continue;
        /* What a text is to be, only its help tells. */
        bool told = keys[i].type == VALUE_TEXT && keys[i].help;
        char *title = section_title(section), *expected = key_expected(&keys[i]);
        user_error(ini->file, section->line, "%s has no %s, expected %s%s%s", title, keys[i].name,
                   told ? "" : expected, !told && keys[i].help ? ": " : "",
                   keys[i].help ? keys[i].help : "");
        free(title);
        free(expected);
        return false;
    }
    return true;
}

bool read_section(const struct ini *ini, const struct ini_section *section, const struct key *keys,
                  size_t count, void *base)
{
    keys_set_fallbacks(keys, count, base);
    for (size_t i = 0; i < section->count; i++) {
        const struct ini_entry *entry = &section->entries[i];
        const struct key *key = key_of_entry(section, entry, keys, count);
        if (!key || !read_entry(section, entry, key, base)) return false;
    }
    return nothing_missing(ini, section, keys, count);
}

struct ini_place ini_place_of(const struct ini *ini, const struct ini_section *section,
                              const char *key)
{
    const struct ini_entry *entry = ini_entry(section, key);
    if (entry) return (struct ini_place){entry->file, entry->line};
    return (struct ini_place){ini->file, section->line};
}
