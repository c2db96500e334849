#include "master/json.h"

#include <assert.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

#include "common/message.h"

void json_begin(struct json *json)
{
    *json = (struct json){0};
    json->file = open_memstream(&json->text, &json->bytes);
    if (!json->file) fatal("out of memory for the report");
}

void json_begin_in(struct json *json, FILE *file)
{
    *json = (struct json){.file = file};
}

char *json_end(struct json *json)
{
    assert(json->depth == 0);
    fputc('\n', json->file);
    bool failed = ferror(json->file) != 0;
    if (fclose(json->file) || failed) fatal("out of memory for the report");
    return json->text;
}

static bool on_one_line(const struct json *json)
{
    return json->inline_depth && json->depth >= json->inline_depth;
}

static void new_line(struct json *json)
{
    if (on_one_line(json)) return;
    fprintf(json->file, "\n%*s", (int)(2 * json->depth), "");
}

/*
 * The length of the UTF-8 sequence at text (RFC 3629: shortest form, no surrogates, up to
 * U+10FFFF), 0 when there is none. A NUL ends every sequence, so that nothing beyond it is read.
 */
static int utf8_length(const unsigned char *text)
{
    unsigned char lead = text[0], low = 0x80, high = 0xbf;
    if (lead < 0x80) return 1;
    if (lead < 0xc2 || lead > 0xf4) return 0;
    int length = lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    if (lead == 0xe0) low = 0xa0;
    if (lead == 0xed) high = 0x9f;
    if (lead == 0xf0) low = 0x90;
    if (lead == 0xf4) high = 0x8f;
    if (text[1] < low || text[1] > high) return 0;
    for (int i = 2; i < length; i++)
        if (text[i] < 0x80 || text[i] > 0xbf) return 0;
    return length;
}

static void put_character(FILE *file, const unsigned char *text, int length)
{
    if (length == 0)
        fputs("\\ufffd", file);
    else if (*text == '"' || *text == '\\')
        fprintf(file, "\\%c", *text);
    else if (*text < 0x20 || *text == 0x7f)
        fprintf(file, "\\u%04x", *text);
    else
        fwrite(text, 1, (size_t)length, file);
}

static void put_string(FILE *file, const char *value)
{
    const unsigned char *text = (const unsigned char *)value;
    fputc('"', file);
    while (*text) {
        int length = utf8_length(text);
        put_character(file, text, length);
        text += length ? length : 1;
    }
    fputc('"', file);
}

/* What stands before a value: comma, place, key. */
static void begin_value(struct json *json, const char *key)
{
    if (json->follows) fputs(on_one_line(json) ? ", " : ",", json->file);
    if (json->depth) new_line(json);
    if (key) {
        put_string(json->file, key);
        fputs(": ", json->file);
    }
    json->follows = true;
}

void json_open(struct json *json, const char *key, char bracket)
{
    begin_value(json, key);
    fputc(bracket, json->file);
    json->depth++;
    json->follows = false;
}

void json_open_inline(struct json *json, const char *key, char bracket)
{
    json_open(json, key, bracket);
    if (!json->inline_depth) json->inline_depth = json->depth;
}

void json_close(struct json *json, char bracket)
{
    bool one_line = on_one_line(json);
    if (json->inline_depth == json->depth) json->inline_depth = 0;
    json->depth--;
    if (json->follows && !one_line) new_line(json);
    fputc(bracket, json->file);
    json->follows = true;
}

void json_string(struct json *json, const char *key, const char *value)
{
    begin_value(json, key);
    put_string(json->file, value);
}

void json_count(struct json *json, const char *key, uint64_t value)
{
    begin_value(json, key);
    fprintf(json->file, "%" PRIu64, value);
}

void json_null(struct json *json, const char *key)
{
    begin_value(json, key);
    fputs("null", json->file);
}

void json_number(struct json *json, const char *key, double value)
{
    char text[32] = "null";
    /* 15 digits are always kept by a double, 17 always tell it from its neighbours. */
    for (int digits = 15; isfinite(value) && digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        if (strtod(text, NULL) == value) break;
    }
    begin_value(json, key);
    fputs(text, json->file);
}

void json_fixed(struct json *json, const char *key, double value, int decimals)
{
    begin_value(json, key);
    if (isfinite(value))
        fprintf(json->file, "%.*f", decimals, value);
    else
        fputs("null", json->file);
}

void json_seconds(struct json *json, const char *key, double seconds)
{
    json_fixed(json, key, seconds, 6);
}
