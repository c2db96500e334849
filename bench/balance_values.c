/* Named numbers that are kept in a file between calls of the bench. */
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "bench/balance.h"
#include "bench/outside.h"
#include "common/message.h"

#define VALUES_FILE KEPT_FOLDER "/values.txt"
#define NAME_SIZE   96

struct value {
    char name[NAME_SIZE];
    double value;
};

static struct value *values;
static size_t value_count;

static struct value *find(const char *name)
{
    for (size_t i = 0; i < value_count; i++)
        if (strcmp(values[i].name, name) == 0) return &values[i];
    return NULL;
}

static void set(const char *name, double value)
{
    struct value *old = find(name);
    if (!old) {
        values = grow(values, value_count, sizeof *values);
        old = &values[value_count++];
        snprintf(old->name, sizeof old->name, "%s", name);
    }
    old->value = value;
}

void value_set(double value, const char *format, ...)
{
    char name[NAME_SIZE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(name, sizeof name, format, arguments);
    va_end(arguments);
    set(name, value);
}

double value_get(const char *format, ...)
{
    char name[NAME_SIZE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(name, sizeof name, format, arguments);
    va_end(arguments);
    const struct value *value = find(name);
    return value ? value->value : (double)NAN;
}

void values_read(void)
{
    FILE *file = fopen(VALUES_FILE, "r");
    char name[NAME_SIZE];
    double value;
    if (!file) return;
    while (fscanf(file, "%95s %lf", name, &value) == 2)
        set(name, value);
    fclose(file);
}

void values_write(void)
{
    FILE *file = open_to_write(VALUES_FILE);
    for (size_t i = 0; i < value_count; i++)
        fprintf(file, "%s %.9g\n", values[i].name, values[i].value);
    close_written(file);
}
