#include "master/progress.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

#include "common/message.h"
#include "master/figure.h"
#include "master/terminal.h"

static const double redraw_s = 0.1; /* as often as an eye can follow */
static const double line_s = 5;     /* a log of an hour's rendering stays readable */

/* Time constants of smoothing the time left: 3 s; in short runs smooth_part of the time so far, as the first
 * estimates would otherwise outlast them. */
static const double smooth_s = 3;
static const double smooth_part = 0.25;

enum { LINE_SIZE = 256, SHARE_WIDTH = sizeof "100 %" - 1, BAR_MIN = 10, BAR_MAX = 40 };

static bool draws_bar(const struct progress *progress)
{
    return progress->descriptor >= 0;
}

/* Removes the bar; stderr is locked, as other threads print messages. */
static void erase_bar(void *state)
{
    struct progress *progress = state;
    if (!progress->drawn) return;
    fputs("\r\033[K", progress->out);
    fflush(progress->out);
    progress->drawn = false;
}

void progress_start(struct progress *progress, FILE *out, double now, double before)
{
    int descriptor = terminal_draws() ? terminal_open(out) : -1;
    *progress = (struct progress){
        .out = out,
        .descriptor = descriptor,
        .started = now,
        .before = before,
        .last_shown = now,
        .left = -1,
    };
    if (draws_bar(progress)) message_clear_line(erase_bar, progress);
}

/* Notes the beginning of a pass, of which what earlier passes have done is no part. */
static void note_pass(struct progress *progress, const struct progress_state *state)
{
    if (state->pass == progress->pass) return;
    progress->begin_share = state->pass > 1 ? state->share_done : 0;
    progress->pass = state->pass;
    progress->share = 0;
}

/* The estimate of all that there is to do may grow; the bar then stands still. */
static void note_share(struct progress *progress, const struct progress_state *state)
{
    double done = fmin(state->share_done, 1), before = progress->begin_share;
    progress->share = fmax(progress->share, before < 1 ? (done - before) / (1 - before) : 1);
}

/*
 * Estimates the time left by the rate so far, without what an earlier run did. As parts of a picture differ in
 * cost, the estimate is smoothed instead of jumping, and counts down with the time meanwhile.
 */
static void estimate_left(struct progress *progress, double share, double before, double now)
{
    double own = share - before;
    if (own <= 0.01 * (1 - before)) return; /* too little is known */
    double estimate = (now - progress->started) * (1 - share) / own;
    if (progress->left < 0) {
        progress->left = estimate;
        return;
    }
    double passed = now - progress->last_shown;
    double smooth = fmin(smooth_s, smooth_part * (now - progress->started));
    double left = fmax(progress->left - passed, 0);
    progress->left = left + (estimate - left) * (1 - exp(-passed / smooth));
}

/* Takes a time limit into account, which is certain. If nothing else ends the run, the share shown is that of
 * the time alone, as what there is to do in a pass does not tell when the run ends. */
static void heed_limit(struct progress *progress, const struct progress_state *state, double now)
{
    double left = fmax(state->ends - now, 0);
    if (!(state->limit > 0)) return;
    if (state->only_limit || progress->left < 0 || left < progress->left) progress->left = left;
    if (state->only_limit) progress->share = fmax(1 - left / state->limit, 0);
}

/* The texts shown beside the bar, most important first. */
enum field { FIELD_LEFT, FIELD_TILES, FIELD_RATE, FIELD_ELAPSED, FIELDS };

struct fields {
    char text[FIELDS][48];
};

struct pass_name {
    char text[16];
};

/* "pass 2", or nothing without adaptive sampling. */
static struct pass_name pass_name(const struct progress_state *state)
{
    struct pass_name name = {""};
    if (state->pass > 0) snprintf(name.text, sizeof name.text, "pass %u", state->pass);
    return name;
}

/* Fields are padded to the widest value, so that the bar does not change its length all the time. */
static void make_fields(struct fields *fields, const struct progress *progress,
                        const struct progress_state *state, double now)
{
    double elapsed = now - progress->started;
    struct figure rate = figure_count((double)state->rays / elapsed);
    struct figure left = progress->left < 0 ? (struct figure){"-:--"} : figure_span(progress->left);
    uint32_t done = state->tiles_done - state->tiles_before;
    uint32_t tiles = state->tiles - state->tiles_before;
    int digits = snprintf(NULL, 0, "%u", tiles);
    size_t size = sizeof fields->text[0];
    snprintf(fields->text[FIELD_LEFT], size, "%5s left", left.text);
    struct pass_name pass = pass_name(state);
    snprintf(fields->text[FIELD_TILES], size, "%s%s%*u/%u tiles", pass.text,
             pass.text[0] ? " " : "", digits, done, tiles);
    snprintf(fields->text[FIELD_RATE], size, "%6s rays/s", rate.text);
    snprintf(fields->text[FIELD_ELAPSED], size, "%5s",
             figure_span(progress->before + elapsed).text);
}

/* How many fields fit into `room` characters beside the percentage and the shortest bar. */
static int fitting_fields(const struct fields *fields, int room, int *used)
{
    int count = 0;
    *used = SHARE_WIDTH + 3 + BAR_MIN; /* 3 for " [...]" */
    for (; count < FIELDS; count++) {
        int length = 2 + (int)strlen(fields->text[count]);
        if (*used + length > room) break;
        *used += length;
    }
    return count;
}

static void append_bar(char *line, double share, int width)
{
    int full = (int)(share * width);
    char bar[BAR_MAX + 1];
    memset(bar, '-', (size_t)width);
    memset(bar, '#', (size_t)full);
    bar[width] = '\0';
    size_t length = strlen(line);
    snprintf(line + length, LINE_SIZE - length, " [%s]", bar);
}

/* One column stays free: with a character in the last column some terminals begin a new line. */
static void make_line(char *line, const struct fields *fields, double share, int columns)
{
    int room = columns - 1, used;
    line[0] = '\0';
    if (room < SHARE_WIDTH) return;
    snprintf(line, LINE_SIZE, "%3d %%", (int)(100 * share));
    int count = fitting_fields(fields, room, &used);
    if (used > room) return;
    int spare = room - used;
    append_bar(line, share, BAR_MIN + (spare < BAR_MAX - BAR_MIN ? spare : BAR_MAX - BAR_MIN));
    for (int i = 0; i < count; i++) {
        size_t length = strlen(line);
        snprintf(line + length, LINE_SIZE - length, "  %s", fields->text[i]);
    }
}

static void draw_bar(struct progress *progress, const struct progress_state *state, double now)
{
    char line[LINE_SIZE];
    struct fields fields;
    make_fields(&fields, progress, state, now);
    make_line(line, &fields, progress->share, terminal_width(progress->descriptor));
    flockfile(stderr);
    fprintf(progress->out, "\r%s\033[K", line); /* erase to the end of the line */
    fflush(progress->out);
    progress->drawn = true;
    funlockfile(stderr);
}

static void print_line(const struct progress *progress, const struct progress_state *state,
                       double now)
{
    double elapsed = now - progress->started;
    struct pass_name pass = pass_name(state);
    const char *join = !pass.text[0] ? "" : state->only_limit ? ", " : " of ";
    flockfile(stderr);
    fprintf(progress->out, "farm: %d %%%s%s, %u of %u tiles, %s rays/s, %s elapsed",
            (int)(100 * progress->share), join, pass.text, state->tiles_done - state->tiles_before,
            state->tiles - state->tiles_before, figure_count((double)state->rays / elapsed).text,
            figure_span(progress->before + elapsed).text);
    if (progress->left >= 0) fprintf(progress->out, ", %s left", figure_span(progress->left).text);
    fputc('\n', progress->out);
    fflush(progress->out);
    funlockfile(stderr);
}

void progress_update(struct progress *progress, const struct progress_state *state, double now)
{
    note_pass(progress, state);
    if (now - progress->last_shown < (draws_bar(progress) ? redraw_s : line_s)) return;
    note_share(progress, state);
    estimate_left(progress, state->share_done, state->share_before, now);
    heed_limit(progress, state, now);
    if (draws_bar(progress))
        draw_bar(progress, state, now);
    else
        print_line(progress, state, now);
    progress->last_shown = now;
}

void progress_end(struct progress *progress)
{
    flockfile(stderr);
    erase_bar(progress);
    funlockfile(stderr);
    if (!draws_bar(progress)) return;
    message_clear_line(NULL, NULL);
    close(progress->descriptor);
    progress->descriptor = -1;
}
