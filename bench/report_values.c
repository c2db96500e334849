#include "bench/report_values.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"

char *report_text(const char *path)
{
    FILE *file = fopen(path, "r");
    if (!file || fseek(file, 0, SEEK_END) != 0) fatal("cannot read %s", path);
    long bytes = ftell(file);
    char *text = allocate_zeroed((size_t)bytes + 1, 1);
    rewind(file);
    if (fread(text, 1, (size_t)bytes, file) != (size_t)bytes) fatal("cannot read %s", path);
    fclose(file);
    return text;
}

double report_number(const char *text, const char *key)
{
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\":", key);
    const char *at = strstr(text, quoted);
    if (!at) fatal("the report has no %s", key);
    return strtod(at + strlen(quoted), NULL);
}
