/*
 * Messages to the user, and memory allocation that ends the job on failure.
 *
 * A user's mistake is one line on stderr, "file:line: what is wrong, what was expected". The caller then
 * returns false up to main(), and the job ends with status 2. A failure at run time calls fatal().
 */
#ifndef FARM_COMMON_MESSAGE_H
#define FARM_COMMON_MESSAGE_H

#include <stdarg.h>
#include <stddef.h>

#define MESSAGE_FORMAT(text, first) __attribute__((format(printf, text, first)))

/*
 * Reports an error in the user's input. file may be NULL ("farm: text"), line may be 0 ("file: text").
 * Control characters and invalid UTF-8 in quoted input are shown as '?', so that a file cannot send control
 * sequences to the terminal.
 */
void user_error(const char *file, long line, const char *format, ...) MESSAGE_FORMAT(3, 4);

/* The same for something that is odd but harmless: "file:line: warning: text". */
void user_warning(const char *file, long line, const char *format, ...) MESSAGE_FORMAT(3, 4);

/* An informative message: "farm: text". */
void user_note(const char *format, ...) MESSAGE_FORMAT(1, 2);

/*
 * The number of bytes of the first character of a string in UTF-8 (RFC 3629: shortest form, no surrogates, up
 * to U+10FFFF); 0 if it is not valid. Does not read beyond a NUL, which itself is a character of one byte.
 */
size_t character_bytes(const char *characters);

/* The same for a character that a terminal can show; 0 if it is a control character or not valid. */
size_t printable_bytes(const char *characters);

/* The value of a macro as a string literal. */
#define DIGITS(limit)     DIGITS_OF(limit)
#define DIGITS_OF(digits) #digits

/*
 * A copy of text, such as a file name, that is safe to print: characters are replaced as by user_error(). The
 * caller frees it.
 */
char *printable_text(const char *text) __attribute__((returns_nonnull));

/*
 * Registers a function that removes a progress bar or the like from the terminal's last line before a message
 * is written; NULL: none. It is called by the thread that writes the message, with stderr locked (flockfile).
 * Code that draws on that line must lock stderr as well.
 */
void message_clear_line(void (*clear)(void *state), void *state);

/*
 * While text is not NULL, errors, warnings and notes are appended to it (truncated at size bytes) and not
 * printed. For tests, and for ranks whose messages another rank prints.
 */
void message_capture(char *text, size_t size);

/* Reports a failure at run time, "farm: rank R: text" on stderr, and ends the job with status 1. Any thread
 * may call it. */
_Noreturn void fatal(const char *format, ...) MESSAGE_FORMAT(1, 2);

/* Sets the rank that fatal() prints, and how it ends the whole job (MPI_Abort). end may be NULL: exit(). */
void message_set_rank(int rank, void (*end)(int status));

/*
 * Allocate count elements of size bytes. They never return NULL: fatal() if memory is exhausted, if count *
 * size overflows or exceeds memory_limit() (common/memory.h). A count of 0 gives a block that may be freed.
 * allocate_zeroed() clears the elements.
 */
void *allocate(size_t count, size_t size) __attribute__((alloc_size(1, 2), returns_nonnull));
void *allocate_zeroed(size_t count, size_t size) __attribute__((alloc_size(1, 2), returns_nonnull));
void *reallocate(void *old, size_t count, size_t size)
    __attribute__((alloc_size(2, 3), returns_nonnull));

/*
 * Allocates one large block that is accessed all over, in huge pages where the system grants them, so that
 * TLB misses are rare. A block smaller than a huge page is allocated as by allocate().
 */
void *allocate_large(size_t bytes) __attribute__((alloc_size(1), returns_nonnull));

/*
 * Like allocate_large(), but cleared: all pages are faulted in here, rather than later while another thread
 * or process waits for the user of the block.
 */
void *allocate_prefaulted(size_t count, size_t size)
    __attribute__((alloc_size(1, 2), returns_nonnull));

/*
 * Returns the array with room for an element after the first count: if count is 0 or a power of two, the
 * capacity is set to 1 or 2 * count. The array must get its room by this function alone, one element at a
 * time. count may decrease in between: the capacity is at least the next power of two at all times, and a
 * call that makes a larger array smaller cuts only elements after that.
 */
void *grow(void *items, size_t count, size_t size) __attribute__((returns_nonnull));

/* A copy of text that the caller frees. */
char *copy_text(const char *text) __attribute__((returns_nonnull));

/* Formats as printf() does into a new string, which the caller frees. */
char *format_text(const char *format, ...) MESSAGE_FORMAT(1, 2) __attribute__((returns_nonnull));
char *format_arguments(const char *format, va_list arguments) MESSAGE_FORMAT(1, 0)
    __attribute__((returns_nonnull));

/* Joins the names, at least one and up to a NULL, as "a, b or c"; the caller frees the text. */
char *join_names(const char *const *names) __attribute__((returns_nonnull));

#endif
