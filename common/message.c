#include "common/message.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "common/memory.h"

static int own_rank;
static void (*end_job)(int status);
static void (*clear_line)(void *state);
static void *line_state;
static char *capture_text;
static size_t capture_size;

void message_set_rank(int rank, void (*end)(int status))
{
    own_rank = rank;
    end_job = end;
}

void message_clear_line(void (*clear)(void *state), void *state)
{
    flockfile(stderr);
    clear_line = clear;
    line_state = state;
    funlockfile(stderr);
}

void message_capture(char *text, size_t size)
{
    capture_text = text;
    capture_size = size;
    if (text && size) text[0] = '\0';
}

size_t character_bytes(const char *characters)
{
    const unsigned char *text = (const unsigned char *)characters;
    unsigned char lead = text[0], low = 0x80, high = 0xbf;
    if (lead < 0x80) return 1;
    if (lead < 0xc2 || lead > 0xf4) return 0;
    size_t bytes = lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    if (lead == 0xe0) low = 0xa0;
    if (lead == 0xed) high = 0x9f;
    if (lead == 0xf0) low = 0x90;
    if (lead == 0xf4) high = 0x8f;
    if (text[1] < low || text[1] > high) return 0;
    for (size_t i = 2; i < bytes; i++)
        if ((text[i] & 0xc0) != 0x80) return 0;
    return bytes;
}

size_t printable_bytes(const char *characters)
{
    const unsigned char *text = (const unsigned char *)characters;
    bool control = text[0] < 0x20 || text[0] == 0x7f;
    bool control_1 = text[0] == 0xc2 && text[1] < 0xa0; /* U+0080 to U+009F */
    return control || control_1 ? 0 : character_bytes(characters);
}

static void make_printable(char *text)
{
    while (*text) {
        size_t bytes = printable_bytes(text);
        if (!bytes) *text = '?';
        text += bytes ? bytes : 1;
    }
}

char *printable_text(const char *text)
{
    char *copy = copy_text(text);
    make_printable(copy);
    return copy;
}

char *format_arguments(const char *format, va_list arguments)
{
    char *text;
    if (vasprintf(&text, format, arguments) < 0) abort();
    return text;
}

/* Locks stderr and removes what is drawn on its last line. */
static void begin_line(void)
{
    flockfile(stderr);
    if (clear_line) clear_line(line_state);
}

static void say(const char *file, long line, const char *kind, const char *format,
                va_list arguments)
{
    char *whole, *text = format_arguments(format, arguments);
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
        begin_line();
        fprintf(stderr, "%s\n", whole);
        funlockfile(stderr);
    }
    free(whole);
    free(text);
}

void user_error(const char *file, long line, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(file, line, "", format, arguments);
    va_end(arguments);
}

void user_warning(const char *file, long line, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(file, line, "warning: ", format, arguments);
    va_end(arguments);
}

void user_note(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(NULL, 0, "", format, arguments);
    va_end(arguments);
}

void fatal(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    begin_line();
    fprintf(stderr, "farm: rank %d: ", own_rank);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    funlockfile(stderr);
    va_end(arguments);
    if (end_job) end_job(1);
    exit(1);
}

/* Size of a block in bytes, at least 1; ends the job if memory cannot hold it. */
static size_t block_bytes(size_t count, size_t size)
{
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes))
        fatal("out of memory: %zu x %zu bytes were needed", count, size);
    if (!memory_holds(bytes))
        fatal("out of memory: %zu bytes were needed in one piece, there are %zu in all", bytes,
              memory_limit());
    return bytes ? bytes : 1;
}

void *allocate(size_t count, size_t size)
{
    return reallocate(NULL, count, size);
}

void *allocate_zeroed(size_t count, size_t size)
{
    size_t bytes = block_bytes(count, size);
    void *block = calloc(bytes, 1);
    if (!block) fatal("out of memory: %zu bytes were needed", bytes);
    return block;
}

void *reallocate(void *old, size_t count, size_t size)
{
    size_t bytes = block_bytes(count, size);
    void *block = realloc(old, bytes);
    if (!block) fatal("out of memory: %zu bytes were needed", bytes);
    return block;
}

/* Size on x86-64, and on AArch64 with pages of 4 KiB. */
#define HUGE_PAGE ((size_t)2 << 20)

void *allocate_large(size_t bytes)
{
    if (bytes < HUGE_PAGE) return allocate(bytes, 1);
    size_t whole = block_bytes(bytes / HUGE_PAGE + (bytes % HUGE_PAGE > 0), HUGE_PAGE);
    void *block = aligned_alloc(HUGE_PAGE, whole);
    if (!block) fatal("out of memory: %zu bytes were needed", whole);
    (void)madvise(block, whole, MADV_HUGEPAGE); /* if refused, small pages serve */
    return block;
}

void *allocate_prefaulted(size_t count, size_t size)
{
    size_t bytes = block_bytes(count, size);
    return memset(allocate_large(bytes), 0, bytes);
}

void *grow(void *items, size_t count, size_t size)
{
    if (count & (count - 1)) return items;
    return reallocate(items, count ? 2 * count : 1, size);
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

char *join_names(const char *const *names)
{
    char *text = copy_text(*names);
    while (*++names) {
        char *longer = format_text("%s%s %s", text, names[1] ? "," : " or", *names);
        free(text);
        text = longer;
    }
    return text;
}
