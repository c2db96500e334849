/* For tests of loaders: a folder of scene files, which is removed afterwards, and the messages of loading them. */
#ifndef FARM_TEST_SCRATCH_H
#define FARM_TEST_SCRATCH_H

#include <linux/magic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/vfs.h>
#include <unistd.h>

#include "common/message.h"
#include "master/load.h"
#include "test/files.h"
#include "test/unit.h"

struct scratch {
    char folder[64];
    char here[4096];  /* the folder that the tests were started in */
    char said[4096];  /* errors and warnings of the last load */
    enum reach reach; /* for all loads; REACH_FOLDER at first */
};

/* Group set-up: makes the folder and goes there, so that messages name files without a path. */
static inline int scratch_open(void **state)
{
    struct scratch *s = calloc(1, sizeof *s);
    snprintf(s->folder, sizeof s->folder, "/tmp/farm-test-XXXXXX");
    *state = s;
    return !getcwd(s->here, sizeof s->here) || !mkdtemp(s->folder) || chdir(s->folder) != 0;
}

static inline int scratch_close(void **state)
{
    struct scratch *s = *state;
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", s->folder);
    int failed = chdir(s->here) != 0 || system(command) != 0;
    free(s);
    return failed;
}

/* Whether the folder is in memory, so that what is in it is lost with the death of the machine. */
static inline bool scratch_in_memory(const char *folder)
{
    struct statfs system;
    return statfs(folder, &system) == 0 && system.f_type == TMPFS_MAGIC;
}

/* Loads a file with at most one override (NULL: none). Messages go to s->said. */
static inline bool scratch_load(struct scratch *s, const char *name, const char *override,
                                struct job *job)
{
    char *overrides[1] = {override ? copy_text(override) : NULL};
    message_capture(s->said, sizeof s->said);
    bool good = load_job(name, overrides, override ? 1 : 0, s->reach, job);
    message_capture(NULL, 0);
    free(overrides[0]);
    return good;
}

/* The scene block of a file, which must load, without omitting anything (VARIANT_FULL). The caller frees it. */
static inline struct scene *scratch_scene(struct scratch *s, const char *name, const char *override)
{
    struct job job;
    if (!scratch_load(s, name, override, &job)) fail_msg("%s", s->said);
    struct view view = settings_view(&job.settings);
    view.variant = VARIANT_FULL;
    struct scene *scene = builder_finish(job.builder, &view);
    job_free(&job);
    const char *why = "";
    if (!scene_valid(scene, scene->bytes, &why)) fail_msg("%s", why);
    return scene;
}

/* Asserts that loading fails with exactly this message. */
static inline void scratch_refused(struct scratch *s, const char *name, const char *override,
                                   const char *line)
{
    struct job job;
    char whole[4096];
    assert_false(scratch_load(s, name, override, &job));
    snprintf(whole, sizeof whole, "%s\n", line);
    assert_string_equal(s->said, whole);
}

#endif
