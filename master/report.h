/* What a run cost: the JSON report and the table at the end. */
#ifndef FARM_MASTER_REPORT_H
#define FARM_MASTER_REPORT_H

#include <stdio.h>

#include "common/protocol.h"
#include "common/settings.h"
#include "master/forecast.h"
#include "master/image_file.h"
#include "master/timeline.h"
#include "master/truth.h"

/* Wall seconds of the parts of a run on rank 0; they add up to total but for moments between. */
struct run_times {
    double total, init, load, broadcast, build, render, write;
    double probe;  /* of the pre-pass, part of render: mean of the renderers */
    double resume; /* reading the journal of an earlier run, and whether there is one */
    double room;   /* until the memory of picture and adaptive sampling is there */
};

/* What was taken over from the journal of an earlier run. */
struct resumed {
    uint32_t tiles;   /* of this run, that needed no rendering */
    uint64_t pixels;  /* of these */
    uint64_t records; /* good ones in the journal */
    double seconds;   /* that they took to render, on all renderers together */
    double cpu_s;     /* CPU seconds of that */
    double render_s;  /* seconds of rendering that they spared this run: shared by its processors */
    double again_s;   /* what the rest took that was saved, too, and is rendered again */
    struct render_counts counts; /* of what needed no rendering, as found_sum() */
};

/* What ended the sampling. */
enum sampling_end {
    ENDED_BY_SAMPLES, /* every pixel had its `samples`: uniform sampling */
    ENDED_BY_TARGET,
    ENDED_BY_MAX_SAMPLES,
    ENDED_BY_TIME
};

struct report {
    const char *version;    /* of the farm */
    const char *config;     /* path as the user gave it */
    const char *image_file; /* path */
    uint32_t image_width, image_height;
    int processes;
    uint32_t cores;              /* that the renderers may use, on all machines together */
    uint32_t processors;         /* renderers that can work at a time, each on a core */
    enum processor_level kernel; /* what rank 0's processor runs */
    enum schedule schedule;
    uint32_t tile_edge; /* pixels: of a tile (dynamic, tiles), rows of a band */
    uint32_t tiles;
    uint64_t primitives, triangles, lights, scene_bytes, bvh_bytes;
    uint64_t duplicates;  /* primitives that the file has besides: master/duplicates.h */
    uint64_t idle_lights; /* that it has besides, which light nothing */
    unsigned features;    /* enum scene_feature */
    struct run_times time;
    const struct renderer_stats *renderers; /* in rank order */
    int renderer_count;
    struct render_counts picture;   /* of this run's tiles in the picture, each once */
    const struct error_log *errors; /* NULL: none */
    struct error_forecast forecast;
    uint32_t min_samples, max_samples; /* per pixel */
    uint64_t unsampled;                /* pixels that got no sample before the time was over */
    double guessed_rmse;               /* about, of these; NaN: none, or nobody knows */
    double target;                     /* RMSE of adaptive sampling; 0: none */
    unsigned passes;                   /* of adaptive sampling; 0: it was not */
    double missing_share;              /* of the last pass's pixels: a time limit cut it off */
    double plan_s; /* wall seconds in which passes were planned and all waited */
    enum sampling_end ended;
    bool has_reference;
    struct truth truth;               /* against the reference */
    struct quantisation quantisation; /* of the picture's file */
    double master_cpu_s;              /* of serving and of plans, not of rendering */
    uint64_t master_messages;
    struct resumed resumed;
    struct heat_range heat; /* of the heat map; 0 and 0: none */
    double service_s; /* CPU seconds of the master for an answer and more work in return: mean of
                       * those that no other message came with */
    double answer_wait_s, answer_wait_most_s; /* until an answer was looked at: mean, most */
    uint32_t repeated_tiles;                  /* handed out a second time */
    /* Of rendering, in answers that came second and in tiles given up half done, but for those at the end
     * of the run. */
    double wasted_s;
};

/* Figures that follow from a report. */
struct balance {
    double efficiency; /* sum of busy / (renderers * render time), 0..1 */
    double imbalance;  /* max busy / mean busy, >= 1 */
    double tail_s;     /* last finish - first finish of a renderer, seconds */
    double cpu_share;  /* sum of CPU time / sum of busy, 0..1: less than 1 where cores are shared */
    double cpu_imbalance; /* max CPU time / mean CPU time, >= 1 */
};

struct balance report_balance(const struct report *report);

/* The renderers' counts together: what this run did. */
struct render_counts report_counts(const struct report *report);

/* What holds of the whole picture, an earlier run's part included: the samples that are not finite,
 * the bounds. What was rendered twice counts once. */
struct render_counts report_picture_counts(const struct report *report);

/*
 * One line for a person about samples that are not finite: how many, and where the first one is, as
 * text that the caller frees; NULL when there are none.
 */
char *report_bad_samples(const struct report *report);

/* The JSON report (UTF-8, one object, a newline at its end) as text that the caller frees. */
char *report_json(const struct report *report);

/*
 * The table for a person: where the time went, tiles and busy time per rank, efficiency. Fits in
 * columns characters (0: 80). Of more than 16 ranks only the busiest, the idlest and the mean are
 * shown.
 */
void report_table(FILE *out, const struct report *report, int columns);

/* A line of that table: "picture lantern.png", as a terminal may get it. */
void report_path(FILE *out, const char *label, const char *path);

#endif
