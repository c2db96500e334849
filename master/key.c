#include "master/key.h"

#include <assert.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "common/message.h"
#include "master/number.h"

/* The dihedral angle up to which smooth = yes rounds an edge, degrees. */
#define CREASE_YES 60.0

#define WORD_SIZE 512

/* Reads the next blank-separated word and advances *text past it; false if none is left or it is too long. */
static bool next_word(const char **text, char word[WORD_SIZE])
{
    *text += strspn(*text, " \t");
    size_t length = strcspn(*text, " \t");
    if (length == 0 || length >= WORD_SIZE) return false;
    memcpy(word, *text, length);
    word[length] = '\0';
    *text += length;
    return true;
}

static bool at_end(const char *text)
{
    return text[strspn(text, " \t")] == '\0';
}

static bool in_range(const struct key *key, double value)
{
    bool above = key->flags & KEY_ABOVE_MIN ? value > key->min : value >= key->min;
    bool below = key->flags & KEY_BELOW_MAX ? value < key->max : value <= key->max;
    return above && below;
}

static bool parse_vector(const struct key *key, const char *text, struct vec3 *out)
{
    char word[WORD_SIZE];
    double n[3];
    for (int i = 0; i < 3; i++)
        if (!next_word(&text, word) || !number_parse(word, &n[i])) return false;
    if (!at_end(text)) return false;
    if (key->type != VALUE_VECTOR && !(n[0] >= 0 && n[1] >= 0 && n[2] >= 0)) return false;
    out[0] = vec3(n[0], n[1], n[2]);
    if (key->type == VALUE_COLORS) out[1] = out[0];
    return true;
}

static bool parse_unsigned(const struct key *key, const char *text, uint32_t *out)
{
    uint32_t value;
    if (!number_parse_unsigned(text, &value) || !in_range(key, value)) return false;
    *out = value;
    return true;
}

static bool parse_number(const struct key *key, const char *text, double *out)
{
    double value;
    if (!number_parse(text, &value) || !in_range(key, value)) return false;
    *out = value;
    return true;
}

static bool parse_boolean(const char *text, bool *out)
{
    static const char *const words[] = {"no", "yes", "false", "true", "off", "on", "0", "1"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (strcasecmp(text, words[i]) == 0) {
            *out = i % 2;
            return true;
        }
    return false;
}

static bool parse_choice(const struct key *key, const char *text, uint32_t *out)
{
    for (uint32_t i = 0; key->choices[i]; i++)
        if (strcasecmp(text, key->choices[i]) == 0) {
            *out = i;
            return true;
        }
    return false;
}

static bool parse_auto(const struct key *key, const char *text, uint32_t *out)
{
    if (strcasecmp(text, "auto") != 0) return parse_unsigned(key, text, out);
    *out = 0;
    return true;
}

static bool parse_region(const char *text, uint32_t out[4])
{
    uint32_t region[4];
    char word[WORD_SIZE];
    for (int i = 0; i < 4; i++)
        if (!next_word(&text, word) || !number_parse_unsigned(word, &region[i])) return false;
    if (!at_end(text) || !region[2] || !region[3]) return false;
    memcpy(out, region, sizeof region);
    return true;
}

static bool parse_crease(const struct key *key, const char *text, double *out)
{
    bool yes;
    if (parse_number(key, text, out)) return true;
    if (!parse_boolean(text, &yes)) return false;
    *out = yes ? CREASE_YES : 0;
    return true;
}

static bool parse_text(const char *text, char **out)
{
    free(*out);
    *out = copy_text(text);
    return true;
}

bool key_parse(const struct key *key, const char *text, void *base)
{
    void *out = (char *)base + key->offset;
    switch (key->type) {
    case VALUE_UNSIGNED:
        return parse_unsigned(key, text, out);
    case VALUE_NUMBER:
        return parse_number(key, text, out);
    case VALUE_VECTOR:
    case VALUE_COLOR:
    case VALUE_COLORS:
        return parse_vector(key, text, out);
    case VALUE_BOOLEAN:
        return parse_boolean(text, out);
    case VALUE_CHOICE:
        return parse_choice(key, text, out);
    case VALUE_AUTO:
        return parse_auto(key, text, out);
    case VALUE_REGION:
        return parse_region(text, out);
    case VALUE_CREASE:
        return parse_crease(key, text, out);
    case VALUE_TEXT:
        return parse_text(text, out);
    }
    return false;
}

/* "a number > 0", "a whole number from 1 to 1024", ... */
static char *expected_number(const struct key *key, const char *noun)
{
    char low[NUMBER_TEXT_SIZE], high[NUMBER_TEXT_SIZE];
    bool bounded = isfinite(key->max);
    number_format(key->min, low);
    if (bounded) number_format(key->max, high);
    const char *above = key->flags & KEY_ABOVE_MIN ? ">" : ">=";
    if (!bounded) return format_text("%s %s %s", noun, above, low);
    if (!key->flags) return format_text("%s from %s to %s", noun, low, high);
    return format_text("%s %s %s and %s %s", noun, above, low,
                       key->flags & KEY_BELOW_MAX ? "<" : "<=", high);
}

char *key_expected(const struct key *key)
{
    switch (key->type) {
    case VALUE_UNSIGNED:
        return expected_number(key, "a whole number");
    case VALUE_NUMBER:
        return expected_number(key, isfinite(key->max) ? "a number" : "a finite number");
    case VALUE_VECTOR:
        return copy_text("three finite numbers separated by spaces");
    case VALUE_COLOR:
    case VALUE_COLORS:
        return copy_text("a colour: three finite numbers >= 0 separated by spaces");
    case VALUE_BOOLEAN:
        return copy_text("yes or no");
    case VALUE_CHOICE:
        return join_names(key->choices);
    case VALUE_AUTO:
        return expected_number(key, "auto or a whole number");
    case VALUE_REGION:
        return copy_text("four whole numbers: x y width height, the last two not 0");
    case VALUE_CREASE:
        return expected_number(key, "yes, no or an angle");
    case VALUE_TEXT:
        return copy_text("text");
    }
    return copy_text("");
}

char *format_vector(struct vec3 v)
{
    char x[NUMBER_TEXT_SIZE], y[NUMBER_TEXT_SIZE], z[NUMBER_TEXT_SIZE];
    return format_text("%s %s %s", number_format(v.x, x), number_format(v.y, y),
                       number_format(v.z, z));
}

static char *format_number(const double *value)
{
    char text[NUMBER_TEXT_SIZE];
    return copy_text(number_format(*value, text));
}

char *key_format(const struct key *key, const void *base)
{
    const void *value = (const char *)base + key->offset;
    const uint32_t *whole = value;
    switch (key->type) {
    case VALUE_UNSIGNED:
        return format_text("%u", *whole);
    case VALUE_NUMBER:
    case VALUE_CREASE:
        return format_number(value);
    case VALUE_VECTOR:
    case VALUE_COLOR:
    case VALUE_COLORS:
        return format_vector(*(const struct vec3 *)value);
    case VALUE_BOOLEAN:
        return copy_text(*(const bool *)value ? "yes" : "no");
    case VALUE_CHOICE:
        return copy_text(key->choices[*whole]);
    case VALUE_AUTO:
        return *whole ? format_text("%u", *whole) : copy_text("auto");
    case VALUE_REGION:
        return format_text("%u %u %u %u", whole[0], whole[1], whole[2], whole[3]);
    case VALUE_TEXT:
        return copy_text(*(char *const *)value ? *(char *const *)value : "");
    }
    return copy_text("");
}

void keys_set_fallbacks(const struct key *keys, size_t count, void *base)
{
    for (size_t i = 0; i < count; i++)
        if (keys[i].fallback) {
            bool good = key_parse(&keys[i], keys[i].fallback, base);
            assert(good);
            (void)good;
        }
}

void keys_free(const struct key *keys, size_t count, void *base)
{
    for (size_t i = 0; i < count; i++)
        if (keys[i].type == VALUE_TEXT) {
            char **text = (char **)(void *)((char *)base + keys[i].offset);
            free(*text);
            *text = NULL;
        }
}
