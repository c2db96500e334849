#include "common/message.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int own_rank;
static void (*end_job)(int status);
static char *capture_text;
static size_t capture_size;

void message_set_rank(int rank, void (*end)(int status))
{
    own_rank = rank;
    end_job = end;
}

void message_capture(char *text, size_t size)
{
    capture_text = text;
    capture_size = size;
    if (text && size) text[0] = '\0';
}

static void make_printable(char *text)
{
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        if (c < 0x20 || c == 0x7f) *text = '?';
    }
}

static char *format_arguments(const char *format, va_list arguments)
{
    char *text;
    if (vasprintf(&text, format, arguments) < 0) abort();
    return text;
}

static void say(const char *file, long line, const char *kind, char *text)
{
    char *whole;
    if (!file)
        whole = format_text("farm: %s%s", kind, text);
    else if (line > 0)
        whole = format_text("%s:%ld: %s%s", file, line, kind, text);
    else
        whole = format_text("%s: %s%s", file, kind, text);
    make_printable(whole);
    if (capture_text) {
        size_t used = strlen(capture_text);
        snprintf(capture_text + used, capture_size - used, "%s\n", whole);
    } else {
        fprintf(stderr, "%s\n", whole);
    }
    free(whole);
    free(text);
}

void user_error(const char *file, long line, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *text = format_arguments(format, arguments);
    va_end(arguments);
    say(file, line, "", text);
}

void user_warning(const char *file, long line, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *text = format_arguments(format, arguments);
    va_end(arguments);
    say(file, line, "warning: ", text);
}

void fatal(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fprintf(stderr, "farm: rank %d: ", own_rank);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    if (end_job) end_job(1);
    exit(1);
}

void *allocate(size_t count, size_t size)
{
    return reallocate(NULL, count, size);
}

void *allocate_zeroed(size_t count, size_t size)
{
    void *block = calloc(count ? count : 1, size ? size : 1);
    if (!block) fatal("out of memory: %zu x %zu bytes were needed", count, size);
    return block;
}

void *reallocate(void *old, size_t count, size_t size)
{
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes))
        fatal("out of memory: %zu x %zu bytes were needed", count, size);
    void *block = realloc(old, bytes ? bytes : 1);
    if (!block) fatal("out of memory: %zu bytes were needed", bytes);
    return block;
}

char *copy_text(const char *text)
{
    size_t bytes = strlen(text) + 1;
    return memcpy(allocate(bytes, 1), text, bytes);
}

char *format_text(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *text = format_arguments(format, arguments);
    va_end(arguments);
    return text;
}
