/* Loads the [material] sections of INI files, and does for materials what all formats need (declared in loader.h). */
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/load_objects.h"
#include "master/sections.h"

uint32_t default_material(struct loader *loader)
{
    if (loader->has_default_material) return loader->default_material;
    const struct section_kind *keys = scene_section_kind(SECTION_MATERIAL);
    struct material material = {0};
    keys_set_fallbacks(keys->keys, keys->count, &material);
    if (builder_add_material(loader->builder, &material, &loader->default_material))
        fatal("too many materials");
    loader->has_default_material = true;
    return loader->default_material;
}

static int compare_name(const void *name, const void *material)
{
    return strcmp(name, ((const struct named_material *)material)->name);
}

bool find_material(const struct part *part, const char *name, uint32_t *index)
{
    for (; part; part = part->outer) {
        if (!part->material_count) continue;
        const struct named_material *found = bsearch(name, part->materials, part->material_count,
                                                     sizeof *part->materials, compare_name);
        if (!found) continue;
        *index = found->index;
        return true;
    }
    return false;
}

void try_materials(const struct part *part, struct nearest_name *search)
{
    for (; part; part = part->outer)
        for (size_t i = 0; i < part->material_count; i++)
            nearest_name_try(search, part->materials[i].name);
}

bool warn_of_gain(const struct material *material, const char *file, long line, const char *others)
{
    /* A sum slightly above 1 comes from rounded decimals in the file. */
    bool gives = material->reflection + material->transmission > 1.0000001;
    if (gives)
        user_warning(file, line,
                     "reflection and transmission together are %g, more than 1: the surface "
                     "gives off more light than it gets%s",
                     material->reflection + material->transmission, others);
    return gives;
}

bool warn_of_bright_color(const struct material *material, const char *file, long line,
                          const char *others)
{
    bool bright = vec_max(material->color) > 1;
    if (bright)
        user_warning(file, line,
                     "a component of the color is more than 1: the surface may give off more "
                     "light than it gets (full white is 1 1 1)%s",
                     others);
    return bright;
}

static bool read_material(const struct ini *ini, const struct ini_section *section,
                          struct material *material)
{
    const struct section_kind *keys = scene_section_kind(SECTION_MATERIAL);
    *material = (struct material){0};
    if (!read_section(ini, section, keys->keys, keys->count, material)) return false;
    struct ini_place color = ini_place_of(ini, section, "color");
    struct ini_place transmission = ini_place_of(ini, section, "transmission");
    warn_of_gain(material, transmission.file, transmission.line, "");
    warn_of_bright_color(material, color.file, color.line, "");
    return true;
}

/* Adds the keys that the section lacks, with the material's values. The complete section then replaces the material
 * wherever it is used, and is what --print-config prints. */
static void complete_section(struct ini_section *section, const char *file,
                             const struct material *material)
{
    const struct section_kind *keys = scene_section_kind(SECTION_MATERIAL);
    struct ini_entry origin = {.file = file, .folder = ""};
    for (size_t i = 0; i < keys->count; i++) {
        const struct key *key = &keys->keys[i];
        if (ini_entry(section, key->name)) continue;
        char *text = key_format(key, material);
        ini_set(section, key->name, text, &origin);
        free(text);
    }
}

bool amend_material(const struct loader *loader, const char *name, struct material *material)
{
    const struct ini *amended = &loader->amended;
    for (size_t i = 0; i < amended->count; i++) {
        struct ini_section *section = &amended->sections[i];
        if (strcmp(section->name, name) != 0) continue;
        complete_section(section, amended->file, material);
        return read_material(amended, section, material);
    }
    return true;
}

static bool load_material(const struct reading *at, uint32_t *index)
{
    struct material material;
    if (!*at->section->name)
        return refuse_section_key(at, "", "a material needs a name, expected [material NAME]");
    if (!read_material(at->ini, at->section, &material)) return false;
    return accept_section(at, builder_add_material(at->part->loader->builder, &material, index));
}

static int compare_materials(const void *a, const void *b)
{
    return strcmp(((const struct named_material *)a)->name,
                  ((const struct named_material *)b)->name);
}

bool load_materials(struct part *part, const struct ini *ini)
{
    part->materials = allocate(ini->count, sizeof *part->materials);
    for (size_t i = 0; i < ini->count; i++) {
        struct reading at = {part, ini, &ini->sections[i]};
        struct named_material *material = &part->materials[part->material_count];
        if (strcmp(at.section->kind, "material") != 0) continue;
        if (!load_material(&at, &material->index)) return false;
        material->name = copy_text(at.section->name);
        part->material_count++;
    }
    qsort(part->materials, part->material_count, sizeof *part->materials, compare_materials);
    return true;
}
