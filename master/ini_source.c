#include "master/ini_source.h"

#include <ini.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/path.h"
#include "master/text_file.h"

/* INI files are written by hand; large data belongs in meshes. */
#define INI_MAX_BYTES     ((size_t)64 << 20)
/* inih has 50 bytes for a section's name with its NUL, and 200 for a line; the limit for keys is our own. */
#define SECTION_MAX_BYTES 49
#define KEY_MAX_BYTES     49
#define LINE_MAX_BYTES    4096
/* Replaces the value in a line that is too long for inih. */
#define PLACEHOLDER       "=?"
/* More than any section needs, and few enough for a linear search. */
#define SECTION_MAX_KEYS  100

/*
 * A file being fed to inih line by line. inih reports a section only with its entries. So after every section heading
 * it is given a line "=", for which it returns an entry without name and value: this announces the section, so that
 * empty sections and repeated headings are noticed.
 */
struct feed {
    struct ini *ini;
    const char *at;   /* next byte of the file */
    long line;        /* number of the last line that was fed */
    bool announce;    /* the next line to feed is the "=" of a heading */
    bool announcing;  /* the last line that was fed is that "=" */
    bool expecting;   /* inih has not yet returned an entry for the last line */
    bool failed;      /* an error has been reported */
    bool placeholder; /* inih was given PLACEHOLDER for the value of the last line, which is: */
    char value[LINE_MAX_BYTES + 1];
};

/* ---- documents ---- */

void ini_create(const char *path, struct ini *ini)
{
    *ini = (struct ini){.file = copy_text(path), .folder = path_folder(path)};
}

void ini_free(struct ini *ini)
{
    for (size_t i = 0; i < ini->count; i++) {
        struct ini_section *section = &ini->sections[i];
        for (size_t j = 0; j < section->count; j++) {
            free(section->entries[j].key);
            free(section->entries[j].value);
        }
        free(section->entries);
        free(section->kind);
        free(section->name);
    }
    free(ini->sections);
    free(ini->file);
    free(ini->folder);
    *ini = (struct ini){0};
}

struct ini_section *ini_add_section(struct ini *ini, const char *kind, const char *name, long line)
{
    ini->sections = grow(ini->sections, ini->count, sizeof *ini->sections);
    struct ini_section *section = &ini->sections[ini->count++];
    *section = (struct ini_section){.kind = copy_text(kind), .name = copy_text(name), .line = line};
    return section;
}

static struct ini_entry *find_entry(const struct ini_section *section, const char *key)
{
    for (size_t i = 0; i < section->count; i++)
        if (strcmp(section->entries[i].key, key) == 0) return &section->entries[i];
    return NULL;
}

const struct ini_entry *ini_entry(const struct ini_section *section, const char *key)
{
    return find_entry(section, key);
}

void ini_set(struct ini_section *section, const char *key, const char *value,
             const struct ini_entry *origin)
{
    struct ini_entry *entry = find_entry(section, key);
    if (entry) {
        free(entry->key);
        free(entry->value);
    } else {
        section->entries = grow(section->entries, section->count, sizeof *section->entries);
        entry = &section->entries[section->count++];
    }
    *entry = *origin;
    entry->key = copy_text(key);
    entry->value = copy_text(value);
}

/* ---- what inih is fed ---- */

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

/* Takes the next line of the file, without blanks at its ends. */
static const char *next_line(struct feed *feed, size_t *length)
{
    const char *start = feed->at, *end = strchr(start, '\n');
    feed->line++;
    feed->at = end ? end + 1 : start + strlen(start);
    if (!end) end = feed->at;
    while (start < end && is_blank(*start))
        start++;
    while (end > start && is_blank(end[-1]))
        end--;
    *length = (size_t)(end - start);
    return start;
}

static bool refuse(struct feed *feed, const char *text)
{
    user_error(feed->ini->file, feed->line, "%s", text);
    feed->failed = true;
    return false;
}

/* Where a comment begins: at a ';' after a blank, as in inih; NULL: there is none. */
static const char *find_comment(const char *text, const char *end)
{
    for (const char *at = text; at + 1 < end; at++)
        if (is_blank(at[0]) && at[1] == ';') return at + 1;
    return NULL;
}

/* Checks a heading for text after it, which inih ignores, and for its length, to which inih truncates silently. */
static bool heading_good(struct feed *feed, const char *line, size_t length)
{
    const char *close = memchr(line, ']', length);
    const char *comment = find_comment(line, line + length);
    if (!close || (comment && comment < close))
        return refuse(feed, "a section without its ']', expected [kind] or [kind name]");
    if (close - line - 1 > SECTION_MAX_BYTES)
        return refuse(feed, "the section is too long, expected at most " DIGITS(
                                SECTION_MAX_BYTES) " bytes between [ and ]");
    const char *rest = close + 1, *end = line + length;
    while (rest < end && is_blank(*rest))
        rest++;
    if (rest < end && !(*rest == ';' && is_blank(rest[-1])))
        return refuse(feed, "text after the section's ']', expected the end of the line");
    return true;
}

static bool feed_heading(struct feed *feed, const char *line, size_t length, char *buffer)
{
    if (!heading_good(feed, line, length)) return false;
    size_t heading = (size_t)((const char *)memchr(line, ']', length) + 1 - line);
    memcpy(buffer, line, heading);
    buffer[heading] = '\0';
    feed->announce = true;
    return true;
}

/*
 * Feeds a line of any length as its key and a placeholder; take_entry() then takes the real value from the feed. The
 * value ends where it would end for inih.
 */
static bool feed_long_entry(struct feed *feed, const char *line, size_t length, char *buffer)
{
    const char *end = line + length, *comment = find_comment(line, end);
    if (comment) end = comment;
    const char *separator = line;
    while (separator < end && *separator != '=' && *separator != ':')
        separator++;
    if (separator == end) return refuse(feed, "expected 'key = value', a [section] or a comment");
    const char *key_end = separator;
    while (key_end > line && is_blank(key_end[-1]))
        key_end--;
    if (key_end - line > KEY_MAX_BYTES)
        return refuse(
            feed, "the key's name is too long, expected at most " DIGITS(KEY_MAX_BYTES) " bytes");
    const char *value = separator + 1;
    while (value < end && is_blank(*value))
        value++;
    while (end > value && is_blank(end[-1]))
        end--;
    memcpy(feed->value, value, (size_t)(end - value));
    feed->value[end - value] = '\0';
    size_t key = (size_t)(key_end - line);
    memcpy(buffer, line, key);
    memcpy(buffer + key, PLACEHOLDER, sizeof PLACEHOLDER);
    feed->expecting = feed->placeholder = true;
    return true;
}

static bool feed_entry(struct feed *feed, const char *line, size_t length, char *buffer, int size)
{
    /* inih takes a line that fills its buffer without a line end for a truncated one */
    if (length + 1 >= (size_t)size) return feed_long_entry(feed, line, length, buffer);
    memcpy(buffer, line, length);
    buffer[length] = '\0';
    feed->expecting = true;
    return true;
}

/* Called by inih in place of fgets(). */
static char *feed_line(char *buffer, int size, void *stream)
{
    struct feed *feed = stream;
    if (feed->failed) return NULL;
    if (feed->expecting) {
        refuse(feed, "expected 'key = value', a [section] or a comment");
        return NULL;
    }
    if (feed->announce) {
        feed->announce = false;
        feed->announcing = feed->expecting = true;
        memcpy(buffer, "=", sizeof "=");
        return buffer;
    }
    while (*feed->at) {
        size_t length;
        const char *line = next_line(feed, &length);
        if (length == 0 || *line == ';' || *line == '#') continue;
        if (length > LINE_MAX_BYTES) {
            refuse(feed, "the line is too long, expected at most " DIGITS(LINE_MAX_BYTES) " bytes");
            return NULL;
        }
        bool fed = *line == '[' ? feed_heading(feed, line, length, buffer)
                                : feed_entry(feed, line, length, buffer, size);
        return fed ? buffer : NULL;
    }
    return NULL;
}

bool ini_can_name(const char *kind, const char *name)
{
    return strlen(kind) + 1 + strlen(name) <= SECTION_MAX_BYTES && *name != ';' &&
           !strpbrk(name, "]\n") && !find_comment(name, name + strlen(name));
}

bool ini_can_hold(const char *key, const char *value)
{
    size_t length = strlen(value);
    if (strlen(key) + strlen(" = ") + length > LINE_MAX_BYTES) return false;
    if (length && (is_blank(value[0]) || is_blank(value[length - 1]))) return false;
    return *value != ';' && !strchr(value, '\n') && !find_comment(value, value + length);
}

/* ---- what inih hands back ---- */

/* "kind  some name" -> "kind" and "some name" */
static void begin_section(struct feed *feed, const char *heading)
{
    char text[SECTION_MAX_BYTES + 1];
    snprintf(text, sizeof text, "%s", heading);
    char *kind = text + strspn(text, " \t");
    char *name = kind + strcspn(kind, " \t");
    if (*name) *name++ = '\0';
    name += strspn(name, " \t");
    size_t length = strlen(name);
    while (length && is_blank(name[length - 1]))
        name[--length] = '\0';
    ini_add_section(feed->ini, kind, name, feed->line);
}

static bool add_entry(struct feed *feed, const char *key, const char *value)
{
    struct ini *ini = feed->ini;
    if (!*key) return refuse(feed, "a value without a key, expected 'key = value'");
    if (!ini->count)
        return refuse(feed, "a key outside of any section, expected a [section] first");
    struct ini_section *section = &ini->sections[ini->count - 1];
    if (section->count == SECTION_MAX_KEYS) return refuse(feed, "too many keys in one section");
    const struct ini_entry *old = ini_entry(section, key);
    if (old) {
        user_error(ini->file, feed->line, "%s is already set in line %ld, expected it once", key,
                   old->line);
        feed->failed = true;
        return false;
    }
    struct ini_entry origin = {.file = ini->file, .line = feed->line, .folder = ini->folder};
    ini_set(section, key, value, &origin);
    return true;
}

static int take_entry(void *user, const char *heading, const char *key, const char *value)
{
    struct feed *feed = user;
    if (feed->failed) return 0;
    feed->expecting = false;
    if (feed->announcing)
        begin_section(feed, heading);
    else
        add_entry(feed, key, feed->placeholder ? feed->value : value);
    feed->announcing = feed->placeholder = false;
    return !feed->failed;
}

static int compare_sections(const void *a, const void *b)
{
    const struct ini_section *x = *(const struct ini_section *const *)a;
    const struct ini_section *y = *(const struct ini_section *const *)b;
    int order = strcmp(x->kind, y->kind);
    if (!order) order = strcmp(x->name, y->name);
    return order ? order : (x->line > y->line) - (x->line < y->line);
}

static bool names_unique(const struct ini *ini)
{
    const struct ini_section **sorted = allocate(ini->count, sizeof *sorted);
    for (size_t i = 0; i < ini->count; i++)
        sorted[i] = &ini->sections[i];
    qsort(sorted, ini->count, sizeof *sorted, compare_sections);
    bool unique = true;
    for (size_t i = 1; unique && i < ini->count; i++) {
        const struct ini_section *a = sorted[i - 1], *b = sorted[i];
        unique = !*a->name || strcmp(a->kind, b->kind) != 0 || strcmp(a->name, b->name) != 0;
        if (!unique)
            user_error(ini->file, b->line, "[%s %s] is already in line %ld, expected another name",
                       b->kind, b->name, a->line);
    }
    free(sorted);
    return unique;
}

static bool feed_inih(struct ini *ini, const char *text)
{
    struct feed feed = {.ini = ini, .at = text};
    int status = ini_parse_stream(feed_line, &feed, take_entry, &feed);
    if (!feed.failed && feed.expecting)
        refuse(&feed, "expected 'key = value', a [section] or a comment");
    if (!feed.failed && status != 0) refuse(&feed, "cannot be read as an INI file");
    return !feed.failed;
}

bool ini_load(const char *path, struct ini *ini)
{
    struct text_file file;
    if (!text_file_read(path, INI_MAX_BYTES, &file)) return false;
    ini_create(path, ini);
    bool good = feed_inih(ini, file.text) && names_unique(ini);
    text_file_free(&file);
    if (!good) ini_free(ini);
    return good;
}
