#include "master/scan.h"

#include <math.h>
#include <string.h>
#include <strings.h>

#include "master/number.h"

struct scan scan_start(const char *text, const char *path, bool joins)
{
    return (struct scan){.at = text, .path = path, .line = 1, .joins = joins};
}

/* Length of a backslash and line end at `at`, 0 if there is none. */
static size_t joint(const struct scan *scan, const char *at)
{
    if (!scan->joins || *at != '\\') return 0;
    if (at[1] == '\n') return 2;
    return at[1] == '\r' && at[2] == '\n' ? 3 : 0;
}

static void skip_blanks(struct scan *scan)
{
    for (;;) {
        while (*scan->at == ' ' || *scan->at == '\t' || *scan->at == '\r')
            scan->at++;
        size_t length = joint(scan, scan->at);
        if (!length) return;
        scan->at += length;
        scan->line++;
    }
}

bool scan_at_end(struct scan *scan)
{
    skip_blanks(scan);
    return *scan->at == '\n' || *scan->at == '\0' || *scan->at == '#';
}

bool scan_next_line(struct scan *scan)
{
    /* The first line has not been left when nothing of it has been taken yet. */
    while (scan_at_end(scan)) {
        if (*scan->at == '#') scan->at += strcspn(scan->at, "\n");
        if (*scan->at == '\0') return false;
        scan->at++;
        scan->line++;
    }
    return true;
}

static bool ends_word(const struct scan *scan, const char *at)
{
    switch (*at) {
    case ' ':
    case '\t':
    case '\r':
    case '\n':
    case '\0':
    case '#':
        return true;
    default:
        return joint(scan, at) != 0;
    }
}

/* The end of the word at `at` if C libraries write it for a number that is not finite, or else NULL: nan, -inf,
 * Infinity, -nan(ind), 1.#QNAN0. */
static const char *not_finite_end(const struct scan *scan, const char *at)
{
    static const struct {
        const char *begin;
        enum { NOTHING, BRACKET, ANYTHING } end; /* what the word ends in */
    } spellings[] = {{"nan", NOTHING},     {"inf", NOTHING},     {"infinity", NOTHING},
                     {"nan(", BRACKET},    {"inf(", BRACKET},    {"1.#ind", ANYTHING},
                     {"1.#inf", ANYTHING}, {"1.#nan", ANYTHING}, {"1.#qnan", ANYTHING},
                     {"1.#snan", ANYTHING}};
    if (*at == '-' || *at == '+') at++;
    for (size_t i = 0; i < sizeof spellings / sizeof *spellings; i++) {
        size_t length = strlen(spellings[i].begin);
        if (strncasecmp(at, spellings[i].begin, length) != 0) continue;
        const char *rest = at + length, *end = rest;
        while (!ends_word(scan, end))
            end++;
        if (spellings[i].end == NOTHING && end > rest) continue;
        if (spellings[i].end == BRACKET && end[-1] != ')') continue;
        return end;
    }
    return NULL;
}

bool scan_not_finite(struct scan *scan)
{
    skip_blanks(scan);
    const char *end = not_finite_end(scan, scan->at);
    if (end) scan->at = end;
    return end;
}

bool scan_number(struct scan *scan, double *value)
{
    skip_blanks(scan);
    const char *end = number_scan(scan->at, value);
    if (!end || !ends_word(scan, end)) return false;
    if (*end == '#' && not_finite_end(scan, scan->at)) return false; /* no comment behind a 1. */
    if (isinf(*value)) {
        scan->too_large = true;
        return false;
    }
    scan->at = end;
    return true;
}

bool scan_vector(struct scan *scan, struct vec3 *value)
{
    return scan_number(scan, &value->x) && scan_number(scan, &value->y) &&
           scan_number(scan, &value->z);
}

bool scan_take(struct scan *scan, const char *word)
{
    skip_blanks(scan);
    const char *at = scan->at;
    while (*word && *at == *word)
        at++, word++;
    if (*word || !ends_word(scan, at)) return false;
    scan->at = at;
    return true;
}

bool scan_word(struct scan *scan, char *word, size_t size)
{
    if (scan_at_end(scan)) return false;
    size_t length = 0;
    for (; !ends_word(scan, scan->at); scan->at++)
        if (length < size - 1) word[length++] = *scan->at;
    word[length] = '\0';
    return true;
}

bool scan_unsigned(struct scan *scan, uint32_t *value)
{
    uint32_t number;
    skip_blanks(scan);
    const char *end = number_scan_unsigned(scan->at, &number);
    if (!end || !ends_word(scan, end)) return false;
    *value = number;
    scan->at = end;
    return true;
}

bool scan_rest(struct scan *scan, char *text, size_t size)
{
    skip_blanks(scan);
    size_t length = 0, end = 0; /* end: behind the last character that is no blank */
    for (;;) {
        size_t skipped = joint(scan, scan->at);
        char next = *scan->at;
        if (skipped)
            next = ' ';
        else if (strchr("\r\n", next)) /* or the end of the text */
            break;
        if (length < size - 1) text[length++] = next;
        if (next != ' ' && next != '\t') end = length;
        scan->line += skipped > 0;
        scan->at += skipped ? skipped : 1;
    }
    text[end] = '\0';
    return end > 0;
}
