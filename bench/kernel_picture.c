#include "bench/kernel_picture.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "master/image_file.h"

#define EDGE_MAX 16384u

/* Reads the data of a PFM file: rows from the bottom to the top, numbers in this machine's byte order. */
static bool read_floats(FILE *file, struct canvas *picture)
{
    size_t row = 3 * (size_t)picture->width;
    for (uint32_t y = picture->height; y-- > 0;)
        if (fread(picture->rgb + y * row, sizeof *picture->rgb, row, file) != row) return false;
    return true;
}

static bool read_integers(FILE *file, struct canvas *picture, double largest)
{
    size_t values = 3 * (size_t)picture->width * picture->height;
    for (size_t i = 0; i < values; i++) {
        int value = getc(file);
        if (largest > 255) value = value << 8 | getc(file);
        if (value < 0) return false;
        picture->rgb[i] = (float)(value / largest);
    }
    return true;
}

/* The next number of a head, in which POV-Ray may have put comments. */
static bool head_number(FILE *file, double *value)
{
    int c;
    while ((c = getc(file)) == '#' || c == ' ' || c == '\n' || c == '\t')
        if (c == '#')
            while ((c = getc(file)) != '\n' && c != EOF) {
            }
    ungetc(c, file);
    return fscanf(file, "%lf", value) == 1;
}

static bool read_from(FILE *file, struct canvas *picture)
{
    char kind[3];
    double width, height, largest;
    if (fscanf(file, "%2s", kind) != 1 || kind[0] != 'P' || (kind[1] != 'F' && kind[1] != '6'))
        return false;
    if (!head_number(file, &width) || !head_number(file, &height) || !head_number(file, &largest))
        return false;
    if (!(width >= 1 && width <= EDGE_MAX && height >= 1 && height <= EDGE_MAX)) return false;
    getc(file); /* the one byte that ends the head */
    canvas_init(picture, (uint32_t)width, (uint32_t)height);
    return kind[1] == 'F' ? read_floats(file, picture) : read_integers(file, picture, largest);
}

bool picture_read(const char *path, struct canvas *picture)
{
    FILE *file = fopen(path, "rb");
    *picture = (struct canvas){0};
    bool good = file && read_from(file, picture);
    if (file) fclose(file);
    if (good) return true;
    fprintf(stderr, "kernel: %s is no picture that can be read\n", path);
    canvas_free(picture);
    *picture = (struct canvas){0};
    return false;
}

static double clamped(float value)
{
    return fmin(fmax((double)value, 0), 1);
}

struct picture_difference picture_compare(const struct canvas *a, const struct canvas *b)
{
    struct picture_difference difference = {0, 0};
    size_t pixels = (size_t)a->width * a->height;
    if (a->width != b->width || a->height != b->height || pixels == 0)
        return (struct picture_difference){HUGE_VAL, 1};
    for (size_t i = 0; i < pixels; i++) {
        double largest = 0;
        for (size_t k = 3 * i; k < 3 * i + 3; k++) {
            double apart = fabs(clamped(a->rgb[k]) - clamped(b->rgb[k]));
            difference.rmse += apart * apart;
            largest = fmax(largest, apart);
        }
        difference.differing += largest > 16.0 / 255;
    }
    difference.rmse = sqrt(difference.rmse / (3 * (double)pixels));
    difference.differing /= (double)pixels;
    return difference;
}

static void put_half(struct canvas *all, const struct canvas *picture, uint32_t x0, uint32_t y0)
{
    for (uint32_t y = 0; y < picture->height / 2; y++)
        for (uint32_t x = 0; x < 3 * (picture->width / 2); x++) {
            uint32_t from = x / 3 * 6 + x % 3;
            const float *above = picture->rgb + (size_t)2 * y * 3 * picture->width + from;
            const float *below = above + 3 * (size_t)picture->width;
            double sum =
                clamped(above[0]) + clamped(above[3]) + clamped(below[0]) + clamped(below[3]);
            all->rgb[((size_t)(y0 + y) * all->width + x0) * 3 + x] = (float)(sum / 4);
        }
}

bool picture_montage(const char *path, const struct canvas *pictures, unsigned count,
                     unsigned columns)
{
    uint32_t width = 0, height = 0;
    for (unsigned i = 0; i < count; i++) {
        if (pictures[i].width > width) width = pictures[i].width;
        if (pictures[i].height > height) height = pictures[i].height;
    }
    uint32_t step_x = width / 2 + 2, step_y = height / 2 + 2;
    struct canvas all;
    canvas_init(&all, columns * step_x, (count + columns - 1) / columns * step_y);
    for (unsigned i = 0; i < count; i++)
        if (pictures[i].rgb)
            put_half(&all, &pictures[i], i % columns * step_x, i / columns * step_y);
    bool good = image_write(path, &all, NULL);
    canvas_free(&all);
    return good;
}
