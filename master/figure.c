#include "master/figure.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

struct figure figure_digits(double value, int digits)
{
    struct figure figure;
    snprintf(figure.text, sizeof figure.text, "%.*e", digits - 1, value);
    double rounded = strtod(figure.text, NULL);
    if (rounded == 0 || !isfinite(rounded)) {
        snprintf(figure.text, sizeof figure.text, "%g", rounded);
        return figure;
    }
    int exponent = (int)strtol(strchr(figure.text, 'e') + 1, NULL, 10);
    int decimals = digits - 1 - exponent;
    if (exponent >= -7 && exponent < 6)
        snprintf(figure.text, sizeof figure.text, "%.*f", decimals > 0 ? decimals : 0, rounded);
    return figure;
}

#define ROUND_DIGITS 6

struct figure figure_round(double value)
{
    struct figure figure = figure_digits(value, ROUND_DIGITS);
    if (strchr(figure.text, 'e')) {
        snprintf(figure.text, sizeof figure.text, "%.*g", ROUND_DIGITS, value);
    } else if (strchr(figure.text, '.')) {
        size_t end = strlen(figure.text);
        while (figure.text[end - 1] == '0')
            end--;
        if (figure.text[end - 1] == '.') end--;
        figure.text[end] = '\0';
    }
    return figure;
}
