/*
 * What the program says to its user, and the allocations that may end it.
 *
 * A user's mistake is one line on stderr, "file:line: what is wrong, what was expected"; the caller
 * then unwinds by returning false, and the job ends with status 2. A failure at run time is
 * fatal().
 */
#ifndef FARM_COMMON_MESSAGE_H
#define FARM_COMMON_MESSAGE_H

#include <stddef.h>

#define MESSAGE_FORMAT(text, first) __attribute__((format(printf, text, first)))

/*
 * Says what is wrong with the user's input. file may be NULL ("farm: text"), line 0 ("file: text").
 * Control characters of quoted input, and bytes that are no UTF-8, are shown as '?', so that a file
 * cannot write to the terminal.
 */
void user_error(const char *file, long line, const char *format, ...) MESSAGE_FORMAT(3, 4);

/* The same for something that is odd but harmless: "file:line: warning: text". */
void user_warning(const char *file, long line, const char *format, ...) MESSAGE_FORMAT(3, 4);

/* What is said of a run that goes as it should: "farm: text". */
void user_note(const char *format, ...) MESSAGE_FORMAT(1, 2);

/* Bytes of the first of these characters, in UTF-8 (RFC 3629: shortest form, no surrogates, up to U+10FFFF);
 * 0: it is none. A NUL, which is a character of one byte, ends every other one. */
size_t character_bytes(const char *characters);

/* The same of one that a terminal can show; 0: it is a control character, or none at all. */
size_t printable_bytes(const char *characters);

/* The digits of a limit, for a text that is a constant. */
#define DIGITS(limit)     DIGITS_OF(limit)
#define DIGITS_OF(digits) #digits

/* A copy of text, such as the name of a file, for a terminal: as in messages. The caller frees it. */
char *printable_text(const char *text) __attribute__((returns_nonnull));

/*
 * What takes something off the line that messages are about to be written on, such as a bar of progress;
 * NULL: there is nothing. Called with stderr locked (flockfile), in whichever thread speaks. Who changes
 * what stands on that line locks stderr meanwhile, too.
 */
void message_clear_line(void (*clear)(void *state), void *state);

/*
 * While text is not NULL, errors, warnings and notes for the user are appended there (cut at size) instead of being
 * printed: for tests, and where another rank says the same.
 */
void message_capture(char *text, size_t size);

/* A failure at run time: "farm: rank R: text" on stderr; the job ends with status 1. Any thread. */
_Noreturn void fatal(const char *format, ...) MESSAGE_FORMAT(1, 2);

/* Who we are, for fatal(), and how the whole job is ended (MPI_Abort); end may be NULL: exit. */
void message_set_rank(int rank, void (*end)(int status));

/*
 * count elements of size bytes; never NULL (fatal when memory is out, count * size overflows or is more
 * than there is: common/memory.h; a count of 0 gives a block that may be freed). allocate_zeroed() clears
 * them.
 */
void *allocate(size_t count, size_t size) __attribute__((alloc_size(1, 2), returns_nonnull));
void *allocate_zeroed(size_t count, size_t size) __attribute__((alloc_size(1, 2), returns_nonnull));
void *reallocate(void *old, size_t count, size_t size)
    __attribute__((alloc_size(2, 3), returns_nonnull));

/*
 * The same for one large block that is used all over: in huge pages where the system grants them, so
 * that the processor seldom has to look up where a page is. A small block has a part of a page only,
 * and is as from allocate().
 */
void *allocate_large(size_t bytes) __attribute__((alloc_size(1), returns_nonnull));

/* The same, cleared, so that all its pages are there before somebody else waits for who uses them. */
void *allocate_there(size_t count, size_t size) __attribute__((alloc_size(1, 2), returns_nonnull));

/* Room for one more element behind count: when count is a power of two, or 0, the array is made to have twice
 * as many. For arrays that get their room one by one, by this alone. count may go down in between: there is
 * always room up to the next power of two, and what an array that had more is cut by lies behind that. */
void *grow(void *items, size_t count, size_t size) __attribute__((returns_nonnull));

/* A copy of text that the caller frees. */
char *copy_text(const char *text) __attribute__((returns_nonnull));

/* printf into a new string that the caller frees. */
char *format_text(const char *format, ...) MESSAGE_FORMAT(1, 2) __attribute__((returns_nonnull));

/* "a, b or c", of names up to a NULL, one at least; the caller frees it. */
char *join_names(const char *const *names) __attribute__((returns_nonnull));

#endif
