/* The materials of Wavefront MTL files, as far as they have a meaning here. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/loader.h"
#include "master/scan.h"
#include "master/text_file.h"

#define NAME_SIZE 256

struct mtl_material {
    char name[NAME_SIZE];
    struct material material;
    double mirror; /* max(Ks): the reflection if illum says so */
    double illum;
};

struct material_library {
    struct mtl_material *items;
    size_t count;
};

struct material_library *material_library_create(void)
{
    return allocate_zeroed(1, sizeof(struct material_library));
}

void material_library_destroy(struct material_library *library)
{
    free(library->items);
    free(library);
}

const struct material *material_library_find(const struct material_library *library,
                                             const char *name)
{
    /* The latest definition counts. */
    for (size_t i = library->count; i-- > 0;)
        if (strcmp(library->items[i].name, name) == 0) return &library->items[i].material;
    return NULL;
}

static void add_material(struct material_library *library, struct scan *scan)
{
    if ((library->count & (library->count - 1)) == 0)
        library->items = reallocate(library->items, library->count ? 2 * library->count : 1,
                                    sizeof *library->items);
    struct mtl_material *new = &library->items[library->count++];
    *new = (struct mtl_material){
        .material = {
            .color = {0.8, 0.8, 0.8}, .ambient = 0.1, .diffuse = 1, .shininess = 20, .ior = 1.5}};
    scan_rest(scan, new->name, sizeof new->name);
}

/* A colour of three numbers, or one for all three. Spectral curves and the like are refused. */
static bool read_color(struct scan *scan, struct vec3 *color)
{
    if (!scan_number(scan, &color->x)) return false;
    color->y = color->z = color->x;
    if (!scan_at_end(scan) && !(scan_number(scan, &color->y) && scan_number(scan, &color->z)))
        return false;
    return color->x >= 0 && color->y >= 0 && color->z >= 0;
}

static bool read_share(struct scan *scan, double *value)
{
    return scan_number(scan, value) && *value >= 0 && *value <= 1;
}

static bool read_value(struct mtl_material *m, const char *word, struct scan *scan)
{
    struct vec3 color;
    double number;
    if (strcmp(word, "Kd") == 0) return read_color(scan, &m->material.color);
    if (strcmp(word, "Ns") == 0)
        return scan_number(scan, &m->material.shininess) && m->material.shininess >= 0;
    if (strcmp(word, "Ni") == 0) return scan_number(scan, &m->material.ior) && m->material.ior > 0;
    if (strcmp(word, "Tr") == 0) return read_share(scan, &m->material.transmission);
    if (strcmp(word, "illum") == 0) return scan_number(scan, &m->illum);
    if (strcmp(word, "Ks") == 0) {
        if (!read_color(scan, &color)) return false;
        m->mirror = vec_max(color);
        m->material.specular = m->mirror;
    }
    if (strcmp(word, "d") == 0) {
        if (!read_share(scan, &number)) return false;
        m->material.transmission = 1 - number;
    }
    return true; /* what has no meaning here is passed over */
}

/* From illumination model 3 on, the highlight's colour is the mirror's as well. */
static void finish(struct material_library *library, size_t first)
{
    for (size_t i = first; i < library->count; i++) {
        struct mtl_material *m = &library->items[i];
        if (m->illum >= 3) m->material.reflection = fmin(m->mirror, 1);
    }
}

static bool read_lines(struct material_library *library, struct scan *scan)
{
    size_t first = library->count;
    while (scan_next_line(scan)) {
        char word[32];
        scan_word(scan, word, sizeof word);
        if (strcmp(word, "newmtl") == 0) {
            add_material(library, scan);
        } else if (library->count > first &&
                   !read_value(&library->items[library->count - 1], word, scan)) {
            user_error(scan->path, scan->line,
                       "'%s' is out of range, expected numbers such as a "
                       "colour >= 0 or a share from 0 to 1",
                       word);
            return false;
        }
        scan->at += strcspn(scan->at, "\n");
    }
    finish(library, first);
    return true;
}

bool material_library_read(struct material_library *library, const char *path)
{
    struct text_file file;
    if (!text_file_read(path, SCENE_MAX_BYTES, &file)) return false;
    struct scan scan = scan_start(file.text, path, false);
    bool good = read_lines(library, &scan);
    text_file_free(&file);
    return good;
}
