#include "master/ini_source.h"

#include <ini.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/text_file.h"

/* INI files are written by hand; large data belongs into meshes. */
#define INI_MAX_BYTES     ((size_t)64 << 20)
/* inih keeps a section's name in 50 bytes with its NUL, and lines in 200. */
#define SECTION_MAX_BYTES 49
#define LINE_MAX_BYTES    198
/* More than any section has, few enough to be searched one by one. */
#define SECTION_MAX_KEYS  100

/*
 * The feed. Behind every section heading inih is given a line "=", whose entry without name and
 * value says that a section begins, so that empty sections and repeated headings are seen.
 */
struct feed {
    struct ini *ini;
    const char *at;  /* next byte of the file */
    long line;       /* number of the line that was fed last */
    bool announce;   /* the next line to feed is the "=" of a heading */
    bool announcing; /* it is the one that was fed last */
    bool expecting;  /* inih owes an entry for the line that was fed last */
    bool failed;     /* an error has been told */
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

/* Room for one more: arrays grow when their count is a power of two (or 0). */
static void *grow(void *items, size_t count, size_t size)
{
    if (count & (count - 1)) return items;
    return reallocate(items, count ? 2 * count : 1, size);
}

struct ini_section *ini_add_section(struct ini *ini, const char *kind, const char *name, long line)
{
    ini->sections = grow(ini->sections, ini->count, sizeof *ini->sections);
    struct ini_section *section = &ini->sections[ini->count++];
    *section = (struct ini_section){.kind = copy_text(kind), .name = copy_text(name), .line = line};
    return section;
}

struct ini_section *ini_find(const struct ini *ini, const char *kind, const char *name)
{
    for (size_t i = 0; i < ini->count; i++)
        if (strcmp(ini->sections[i].kind, kind) == 0 && strcmp(ini->sections[i].name, name) == 0)
            return &ini->sections[i];
    return NULL;
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

/* Takes the next line off the file, without blanks at its ends. */
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

/* inih ignores what follows a heading and cuts long ones. */
static bool heading_good(struct feed *feed, const char *line, size_t length)
{
    const char *close = memchr(line, ']', length);
    const char *comment = memchr(line, ';', length);
    while (comment && comment > line && !is_blank(comment[-1]))
        comment = memchr(comment + 1, ';', length - (size_t)(comment + 1 - line));
    if (!close || (comment && comment < close))
        return refuse(feed, "a section without its ']', expected [kind] or [kind name]");
    if (close - line - 1 > SECTION_MAX_BYTES)
        return refuse(feed, "the section's name is too long, expected at most 49 bytes");
    const char *rest = close + 1, *end = line + length;
    while (rest < end && is_blank(*rest))
        rest++;
    if (rest < end && !(*rest == ';' && is_blank(rest[-1])))
        return refuse(feed, "text after the section's ']', expected the end of the line");
    return true;
}

static bool line_good(struct feed *feed, const char *line, size_t length)
{
    if (length > LINE_MAX_BYTES)
        return refuse(feed, "the line is too long, expected at most 198 bytes");
    return *line != '[' || heading_good(feed, line, length);
}

/* The fgets that inih calls. */
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
        return strcpy(buffer, "=");
    }
    while (*feed->at) {
        size_t length;
        const char *line = next_line(feed, &length);
        if (length == 0 || *line == ';' || *line == '#') continue;
        if (!line_good(feed, line, length)) return NULL;
        if (length >= (size_t)size) {
            refuse(feed, "the line is too long for inih");
            return NULL;
        }
        memcpy(buffer, line, length);
        buffer[length] = '\0';
        feed->announce = *line == '[';
        feed->expecting = !feed->announce;
        return buffer;
    }
    return NULL;
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
        add_entry(feed, key, value);
    feed->announcing = false;
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
    static const char byte_order_mark[] = "\xef\xbb\xbf";
    struct feed feed = {.ini = ini, .at = text};
    if (strncmp(text, byte_order_mark, 3) == 0) feed.at += 3;
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
