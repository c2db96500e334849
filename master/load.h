/*
 * Loads files into settings and a scene under construction. Only rank 0 calls these functions.
 *
 * All return false after reporting why in one line (common/message.h). Paths inside a file are relative to that
 * file. Units and conventions: common/scene.h.
 */
#ifndef FARM_MASTER_LOAD_H
#define FARM_MASTER_LOAD_H

#include <stdbool.h>
#include <stddef.h>

#include "master/builder.h"
#include "master/settings.h"
#include "master/view.h"

struct ini;

/* Whether the user has set them. Outputs that are not set are named after CONFIG or the picture. */
struct named_settings {
    bool image, report, journal, max_samples;
};

/* Everything that a run needs to know. */
struct job {
    struct settings settings;
    struct named_settings named;
    struct builder *builder;
    struct ini *document; /* the scene's sections as they were read; owned */
};

/* Where the files that a scene is made of may lie. */
enum reach {
    REACH_FOLDER,  /* in CONFIG's folder or below it, symbolic links followed */
    REACH_ANYWHERE /* anywhere: the user has given --allow-outside */
};

/*
 * Loads CONFIG, whose extension is .ini, .nff or .obj (anything else is refused), and applies the overrides
 * "section.key=value" in their order. Checks what can be checked without rendering, including camera and region. A file
 * that an override names may be anywhere; its folder then takes the place of CONFIG's for all files that it names
 * itself. On success the caller owns *job and frees it with job_free().
 */
bool load_job(const char *path, char *const *overrides, size_t count, enum reach reach,
              struct job *job);
void job_free(struct job *job);

/*
 * The text of --print-config: an INI file that gives the same picture, with all settings in effect, the scene's
 * sections and absolute paths. Outputs that the user has not named are left to their defaults, so that another file's
 * picture is not overwritten. The caller frees it. NULL, after reporting it, when a value cannot be written in an
 * INI file (which only an argument or a very long path can be).
 */
char *print_job(const struct job *job);

#endif
