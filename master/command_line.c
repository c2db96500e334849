#include "master/command_line.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "common/message.h"

/* Whether a shell takes the text as it is, without quotes. */
static bool is_plain(const char *text)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                "-_=+,./:@%";
    return *text && text[strspn(text, plain)] == '\0';
}

static void put_quoted(FILE *out, const char *text)
{
    if (is_plain(text)) {
        fputs(text, out);
        return;
    }
    fputc('\'', out);
    while (*text) {
        size_t bytes = printable_bytes(text);
        if (*text == '\'')
            fputs("'\\''", out);
        else if (bytes || *text == '\n')
            fwrite(text, 1, bytes ? bytes : 1, out);
        else
            fprintf(out, "'\"$(printf '\\%03o')\"'", (unsigned)(unsigned char)*text);
        text += bytes ? bytes : 1;
    }
    fputc('\'', out);
}

char *command_line(char *const *arguments, int processes, const char *extra)
{
    char *text = NULL;
    size_t bytes = 0;
    FILE *out = open_memstream(&text, &bytes);
    if (!out) fatal("out of memory");
    if (processes > 1) fprintf(out, "mpiexec -n %d ", processes);
    for (size_t i = 0; arguments[i]; i++) {
        if (i) fputc(' ', out);
        put_quoted(out, arguments[i]);
    }
    if (extra) {
        fputc(' ', out);
        put_quoted(out, extra);
    }
    if (fclose(out) != 0) fatal("out of memory");
    return text;
}
