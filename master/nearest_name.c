#include "master/nearest_name.h"

#include <dirent.h>
#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "common/message.h"
#include "master/path.h"

/* Longer names get no suggestion; an INI name has at most 49 bytes. */
#define LONGEST 63

static size_t least(size_t a, size_t b)
{
    return a < b ? a : b;
}

/*
 * The least number of insertions, deletions, substitutions and swaps of neighbours that turn a into b (optimal string
 * alignment distance). Both have at most LONGEST bytes.
 */
static size_t distance(const char *a, const char *b)
{
    size_t rows[3][LONGEST + 1];
    size_t *before = rows[0], *last = rows[1], *row = rows[2];
    size_t length = strlen(b);
    for (size_t j = 0; j <= length; j++)
        last[j] = j;
    for (size_t i = 1; a[i - 1]; i++) {
        row[0] = i;
        for (size_t j = 1; j <= length; j++) {
            size_t change = last[j - 1] + (a[i - 1] != b[j - 1]);
            row[j] = least(change, least(last[j], row[j - 1]) + 1);
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = least(row[j], before[j - 2] + 1);
        }
        size_t *oldest = before;
        before = last;
        last = row;
        row = oldest;
    }
    return last[length];
}

static bool is_listed(const struct nearest_name *search, const char *candidate)
{
    for (size_t i = 0; i < search->count && i < NAMES_LISTED; i++)
        if (strcmp(search->tried[i], candidate) == 0) return true;
    return false;
}

void nearest_name_try(struct nearest_name *search, const char *candidate)
{
    size_t length = strlen(search->name);
    if (!*candidate || is_listed(search, candidate)) return;
    if (search->count < NAMES_LISTED) search->tried[search->count] = candidate;
    search->count++;
    if (length > LONGEST || strlen(candidate) > LONGEST) return;
    /* Another case is a single error, however many letters have it. */
    bool other_case = strcasecmp(search->name, candidate) == 0;
    size_t errors = other_case ? 1 : distance(search->name, candidate);
    /* With more than one error per three letters it is taken to be another word. */
    if (errors > (length + 2) / 3 || errors >= strlen(candidate)) return;
    if (search->best && errors >= search->errors) return;
    search->best = candidate;
    search->errors = errors;
}

char *nearest_name_hint(const struct nearest_name *search)
{
    if (search->best) return format_text(", did you mean '%s'?", search->best);
    if (search->count == 0 || search->count > NAMES_LISTED) return copy_text("");
    char *text = copy_text(", expected one of");
    for (size_t i = 0; i < search->count; i++) {
        char *longer = format_text("%s %s", text, search->tried[i]);
        free(text);
        text = longer;
    }
    return text;
}

/* ---- files ---- */

/* Considers a name if it ends with the extension, which is cut off. */
static void try_file(struct nearest_name *search, char *name, const char *extension)
{
    size_t length = strlen(name), tail = strlen(extension);
    if (length <= tail || strcmp(name + length - tail, extension) != 0) return;
    name[length - tail] = '\0';
    nearest_name_try(search, name);
}

char *nearest_file(const char *path)
{
    struct stat status;
    /* A link that leads nowhere has the right name, and so may a file in a folder that must not be searched. */
    if (lstat(path, &status) == 0 || errno != ENOENT) return NULL;
    char *folder = path_folder(path), *directory = path_directory(path), *stem = path_stem(path);
    const char *extension = path_name(path) + strlen(stem);
    struct nearest_name search = {.name = stem};
    struct dirent **entries = NULL;
    int count = scandir(directory, &entries, NULL, alphasort);
    for (int i = 0; i < count; i++)
        if (entries[i]->d_type != DT_DIR) try_file(&search, entries[i]->d_name, extension);
    /* Folders have many files of short names: a third of the letters must not be exceeded, not even by rounding. */
    bool is_near = search.best && search.errors <= strlen(stem) / 3;
    char *near = is_near ? format_text("%s%s%s", folder, search.best, extension) : NULL;
    for (int i = 0; i < count; i++)
        free(entries[i]);
    free(entries);
    free(stem);
    free(directory);
    free(folder);
    return near;
}
