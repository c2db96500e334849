#include "master/figure.h"

#include <stddef.h>
#include <stdio.h>

struct figure figure_count(double value)
{
    static const char units[] = "kMGT";
    struct figure figure = {"> 999T"};
    if (value < 999.5) { /* the limits are where the rounded figure would get a digit more */
        snprintf(figure.text, sizeof figure.text, "%.0f", value);
        return figure;
    }
    for (size_t i = 0; units[i]; i++) {
        value /= 1000;
        if (!(value < 999.95)) continue;
        snprintf(figure.text, sizeof figure.text, "%.1f%c", value, units[i]);
        break;
    }
    return figure;
}

struct figure figure_span(double seconds)
{
    struct figure figure = {"> 999 h"};
    if (!(seconds < 1000 * 3600.0)) return figure;
    unsigned whole = (unsigned)(seconds + 0.5);
    unsigned hours = whole / 3600, minutes = whole / 60 % 60;
    if (hours)
        snprintf(figure.text, sizeof figure.text, "%u:%02u:%02u", hours, minutes, whole % 60);
    else
        snprintf(figure.text, sizeof figure.text, "%u:%02u", minutes, whole % 60);
    return figure;
}
