/*
 * The report of a run.
 *
 *   report.c        figures derived from it, and the message about samples that are not finite
 *   report_json.c   the JSON file
 *   report_table.c  the table that is printed at the end, with the bars of report_times.c
 */
#ifndef FARM_MASTER_REPORT_H
#define FARM_MASTER_REPORT_H

#include <stdio.h>

#include "common/protocol.h"
#include "master/forecast.h"
#include "master/image_file.h"
#include "master/settings.h"
#include "master/timeline.h"
#include "master/truth.h"

/* Wall seconds of the parts of a run on rank 0. They add up to total except for short moments in between. */
struct run_times {
    double total, init, load, broadcast, build, render, write;
    double probe;  /* the pre-pass: part of render, mean of the renderers */
    double resume; /* looking for an earlier run's journal and reading it */
    double room;   /* allocating the memory of picture and adaptive sampling */
};

/* What this run has used of an earlier run's journal. */
struct resumed {
    uint32_t tiles;    /* of this run that needed no rendering */
    uint64_t pixels;   /* of these tiles */
    uint64_t records;  /* valid ones in the journal */
    double seconds;    /* wall seconds that the pixels took to render, sum of all renderers */
    double cpu_s;      /* CPU seconds that they took */
    double render_s;   /* wall seconds that this run was spared: cpu_s divided by its processors */
    double repeated_s; /* wall seconds of what was saved, too, but is rendered again */
    struct render_counts counts; /* of what needed no rendering, by found_sum() */
};

/* What ended the sampling. */
enum sampling_end {
    ENDED_BY_SAMPLES, /* uniform sampling: every pixel has its samples */
    ENDED_BY_TARGET,
    ENDED_BY_MAX_SAMPLES,
    ENDED_BY_TIME,
    ENDED_WITHOUT_ERROR /* no target is set, and the samples show no error that more could lower */
};

struct report {
    const struct settings *settings; /* that are in effect */
    const char *version;             /* of the program */
    const char *config;              /* path as the user gave it */
    const char *image_file;          /* path */
    uint32_t image_width, image_height;
    int processes;
    uint32_t cores;              /* that the renderers may use, on all machines together */
    uint32_t processors;         /* renderers that can work at the same time, each on a core */
    enum processor_level kernel; /* instructions that rank 0's kernel uses */
    enum schedule schedule;
    uint32_t tile_edge; /* edge of a tile in pixels (dynamic, tiles), or rows of a band */
    uint32_t tiles;
    uint64_t primitives, triangles, lights, scene_bytes, bvh_bytes;
    uint64_t duplicates;  /* further primitives of the scene file, left out: master/duplicates.h */
    uint64_t idle_lights; /* further lights of the scene file, left out: they light nothing */
    unsigned features;    /* bits of enum scene_feature that the scene has */
    struct run_times time;
    const struct renderer_stats *renderers; /* in rank order */
    int renderer_count;
    struct render_counts picture;   /* over this run's tiles that are in the picture, each once */
    const struct error_log *errors; /* NULL: none */
    struct error_forecast forecast;
    uint32_t min_samples, max_samples; /* per pixel */
    uint64_t unsampled;                /* pixels that got no sample before the time was over */
    double guessed_rmse;  /* estimated, of these pixels; NaN: there are none, or it is unknown */
    double target;        /* RMSE of adaptive sampling; 0: none */
    unsigned passes;      /* of adaptive sampling; 0: sampling was uniform */
    double missing_share; /* part of the last pass's pixels that a time limit cut off */
    double plan_s;        /* wall seconds of planning passes, while all renderers waited */
    enum sampling_end ended;
    bool has_reference;
    struct truth truth;               /* against the reference */
    struct quantisation quantisation; /* of the picture's file */
    double master_cpu_s;              /* CPU seconds of serving and planning, not of rendering */
    uint64_t master_messages;
    struct resumed resumed;
    struct heat_range heat; /* of the heat map; 0 and 0: there is none */
    /* CPU seconds that the master needs for a result and for sending more work in return: mean over those that were
     * handled without another message. */
    double service_s;
    double answer_wait_s, answer_wait_most_s; /* until a result was looked at: mean, maximum */
    uint32_t repeated_tiles;                  /* that were handed out a second time */
    /* Seconds of rendering for results that came second and for tiles given up half done, except those at the end of
     * the run. */
    double wasted_s;
};

/* Figures derived from a report. */
struct balance {
    double efficiency;    /* sum of busy / (renderers * render time), 0..1 */
    double imbalance;     /* max busy / mean busy, >= 1 */
    double tail_s;        /* last finish - first finish of a renderer, seconds */
    double cpu_share;     /* sum of CPU time / sum of busy, 0..1: below 1 where cores are shared */
    double cpu_imbalance; /* max CPU time / mean CPU time, >= 1 */
};

struct balance report_balance(const struct report *report);

/* The sum of the renderers' counts: what this run has done. */
struct render_counts report_counts(const struct report *report);

/* Counts for the whole picture, including an earlier run's part: samples that are not finite, bounds. What was rendered
 * twice counts once. */
struct render_counts report_picture_counts(const struct report *report);

/* The renderer that met this sample; NULL: it was met in an earlier run. */
const struct renderer_stats *report_finder(const struct report *report,
                                           const struct bad_sample *bad);

/*
 * One line for the user about samples that are not finite: how many, and where the first one is. Text that the caller
 * frees; NULL when there are none.
 */
char *report_bad_samples(const struct report *report);

/* The JSON report (UTF-8, one object, a newline at its end) as text that the caller frees. */
char *report_json(const struct report *report);

/*
 * Prints the table for the user: where the time went, tiles and busy time per rank, efficiency. It fits into `columns`
 * characters per line (0: 80). Of more than 16 ranks only the busiest ones, the idlest ones and the mean are shown.
 */
void report_table(FILE *out, const struct report *report, int columns);

/* Prints a line such as "picture lantern.png", with the path made printable. */
void report_path(FILE *out, const char *label, const char *path);

#endif
