/*
 * Writes JSON (RFC 8259) into memory or a file. Containers are opened and closed in pairs. key is NULL inside an array
 * and at the top. The job ends if memory is exhausted.
 */
#ifndef FARM_MASTER_JSON_H
#define FARM_MASTER_JSON_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

struct json {
    FILE *file; /* a stream into text */
    char *text;
    size_t bytes;
    unsigned depth;        /* containers that are open */
    unsigned inline_depth; /* from this depth on, all is written on one line; 0: no such depth */
    bool follows;          /* the next value is not the first one of its container */
};

/* Starts a text, which json_end() returns. */
void json_begin(struct json *json);

/* The same, but writes to a file of the caller's, who checks it for errors and closes it. json_end() is not called. */
void json_begin_in(struct json *json, FILE *file);

/* The finished text, a newline at its end, that the caller frees. */
char *json_end(struct json *json);

void json_open(struct json *json, const char *key, char bracket);        /* '{' or '[' */
void json_open_inline(struct json *json, const char *key, char bracket); /* on a single line */
void json_close(struct json *json, char bracket);                        /* '}' or ']' */

/* Writes a string; bytes that are not UTF-8 become U+FFFD. */
void json_string(struct json *json, const char *key, const char *value);
void json_null(struct json *json, const char *key);
void json_count(struct json *json, const char *key, uint64_t value);

/* Writes a number as number_format() does; null when it is infinite or NaN. */
void json_number(struct json *json, const char *key, double value);

/* Writes a number with `decimals` decimals; null when it is infinite or NaN. */
void json_fixed(struct json *json, const char *key, double value, int decimals);

/* Writes seconds to the microsecond; null when they are infinite or NaN. */
void json_seconds(struct json *json, const char *key, double seconds);

#endif
