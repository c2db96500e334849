/*
 * Writing JSON (RFC 8259), into memory or a file. Containers are opened and closed in pairs; key is NULL
 * inside an array and at the top. Memory that runs out ends the job.
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
    unsigned inline_depth; /* from this depth on, all stands on one line; 0: nowhere */
    bool follows;          /* something precedes in the same container */
};

void json_begin(struct json *json);

/* The same to a file of the caller's, who closes it and looks for its errors; without json_end(). */
void json_begin_in(struct json *json, FILE *file);

/* The finished text, a newline at its end, that the caller frees. */
char *json_end(struct json *json);

void json_open(struct json *json, const char *key, char bracket);        /* '{' or '[' */
void json_open_inline(struct json *json, const char *key, char bracket); /* on a single line */
void json_close(struct json *json, char bracket);                        /* '}' or ']' */

/* Bytes that are not UTF-8 become U+FFFD. */
void json_string(struct json *json, const char *key, const char *value);
void json_null(struct json *json, const char *key);
void json_count(struct json *json, const char *key, uint64_t value);

/* As number_format() has it; null when it is infinite or NaN. */
void json_number(struct json *json, const char *key, double value);

/* With so many decimals; null when it is infinite or NaN. */
void json_fixed(struct json *json, const char *key, double value, int decimals);

/* To the microsecond; null when it is infinite or NaN. */
void json_seconds(struct json *json, const char *key, double seconds);

#endif
