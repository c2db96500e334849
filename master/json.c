#include "master/json.h"

#include <assert.h>
#include <inttypes.h>
#include <math.h>

#include "common/message.h"
#include "master/number.h"

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

static void put_character(FILE *file, const char *text, size_t bytes)
{
    if (bytes == 0)
        fputs("\\ufffd", file);
    else if (*text == '"' || *text == '\\')
        fprintf(file, "\\%c", *text);
    else if ((unsigned char)*text < 0x20 || *text == 0x7f)
        fprintf(file, "\\u%04x", (unsigned)*text);
    else
        fwrite(text, 1, bytes, file);
}

static void put_string(FILE *file, const char *text)
{
    fputc('"', file);
    while (*text) {
        size_t bytes = character_bytes(text);
        put_character(file, text, bytes);
        text += bytes ? bytes : 1;
    }
    fputc('"', file);
}

/* Writes what precedes a value: comma, line break and indentation, key. */
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
    char text[NUMBER_TEXT_SIZE];
    begin_value(json, key);
    fputs(isfinite(value) ? number_format(value, text) : "null", json->file);
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
