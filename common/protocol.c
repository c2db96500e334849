#include "common/protocol.h"

#include <math.h>
#include <string.h>

#include "common/scene.h"

bool bad_sample_before(const struct bad_sample *a, const struct bad_sample *b)
{
    if (a->y != b->y) return a->y < b->y;
    if (a->x != b->x) return a->x < b->x;
    return a->sample < b->sample;
}

static void keep_first(struct render_counts *counts, const struct bad_sample *sample)
{
    if (!counts->nonfinite || bad_sample_before(sample, &counts->first)) counts->first = *sample;
}

void render_counts_bad(struct render_counts *counts, const struct bad_sample *sample)
{
    keep_first(counts, sample);
    counts->nonfinite++;
}

void error_sum_add(struct error_sum *sum, const struct error_sum *more)
{
    sum->squares += more->squares;
    sum->fourths += more->fourths;
}

void render_counts_add(struct render_counts *sum, const struct render_counts *more)
{
    for (int kind = 0; kind < RAY_KINDS; kind++)
        sum->rays[kind] += more->rays[kind];
    sum->primary_hits += more->primary_hits;
    if (more->nonfinite) keep_first(sum, &more->first);
    sum->nonfinite += more->nonfinite;
    sum->unmatched_media += more->unmatched_media;
    sum->open_media += more->open_media;
    sum->exact_fallbacks += more->exact_fallbacks;
    sum->intersect_s += more->intersect_s;
    sum->shade_s += more->shade_s;
    sum->bound_rays += more->bound_rays;
    sum->truncation = fmax(sum->truncation, more->truncation);
    error_sum_add(&sum->sampling, &more->sampling);
    error_sum_add(&sum->halfway, &more->halfway);
}

void renderer_stats_add(struct renderer_stats *stats, const struct tile *tile,
                        const struct result_header *header)
{
    stats->busy_s += header->busy_s;
    stats->cpu_s += header->cpu_s;
    if (header->busy_s > 0) stats->finish_s = header->start_s + header->busy_s;
    if (tile->pass == TILE_PROBE) return;
    if (header->pixels == RESULT_DROPPED) return;
    stats->tiles++;
    stats->pixels += header->pixels;
    render_counts_add(&stats->counts, &header->counts);
}

static bool span_inside(uint32_t first, uint32_t count, uint32_t size)
{
    return first < size && count <= size - first;
}

bool tile_message_valid(const struct tile *tile, uint32_t width, uint32_t height)
{
    if (!span_inside(tile->x, tile->w, width) || !span_inside(tile->y, tile->h, height))
        return false;
    uint64_t area = (uint64_t)tile->w * tile->h;
    /* No phase is valid for a tile without pixels. */
    if (area > TILE_MAX_PIXELS || tile->phase >= area) return false;
    /* Up to this step, tile_pixels() cannot overflow. */
    return tile->step >= 1 && tile->step <= TILE_MAX_PIXELS;
}

bool lot_header_valid(const struct lot_header *header)
{
    return header->answer_s >= 0 && header->reports <= LOT_TILES && header->wakes_master <= 1;
}

bool lot_report_valid(const float *report_s, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        if (!(report_s[i] >= 0)) return false;
    return true;
}

static bool seconds_valid(double seconds)
{
    return seconds >= 0 && seconds <= SECONDS_MOST;
}

/* The sums may be infinite: squares may overflow. */
static bool error_sum_valid(const struct error_sum *sum)
{
    return sum->squares >= 0 && sum->fourths >= 0;
}

bool render_counts_valid(const struct render_counts *counts)
{
    const struct bad_sample *first = &counts->first;
    /* An infinite truncation is a valid bound (nothing is known), NaN is not. */
    return seconds_valid(counts->intersect_s) && seconds_valid(counts->shade_s) &&
           counts->truncation >= 0 && first->x < PICTURE_MAX_EDGE && first->y < PICTURE_MAX_EDGE &&
           first->sample < SAMPLES_MAX && error_sum_valid(&counts->sampling) &&
           error_sum_valid(&counts->halfway);
}

bool refinements_valid(const struct refinement *refinements, uint32_t count, uint32_t last)
{
    for (uint32_t i = 0; i < count; i++)
        if (refinements[i].from > refinements[i].to || refinements[i].to > last) return false;
    return true;
}

bool drop_message_valid(const struct drop *drops, size_t bytes)
{
    size_t count = bytes / sizeof *drops;
    if (bytes % sizeof *drops != 0 || count < 1 || count > DROP_TILES) return false;
    for (size_t i = 0; i < count; i++)
        if (drops[i].finished > 1) return false;
    return true;
}

static bool times_valid(const struct result_header *header)
{
    return seconds_valid(header->start_s) && seconds_valid(header->busy_s) &&
           seconds_valid(header->cpu_s);
}

bool dropped_valid(const struct result_header *header)
{
    return header->pixels == RESULT_DROPPED && times_valid(header);
}

bool unfinished_valid(const struct result_header *header)
{
    return header->pixels == RESULT_UNFINISHED && times_valid(header);
}

bool result_message_valid(const struct result_header *header, size_t bytes, const struct tile *tile,
                          bool halves)
{
    /* The size is checked before any field: a short message has no header. */
    if (bytes < sizeof *header || header->tile_id != tile->id) return false;
    uint32_t pixels = tile_pixels(tile);
    if (tile_is_refined(tile) ? header->pixels > pixels : header->pixels != pixels) return false;
    return bytes >= result_bytes(tile, header->pixels, halves) && times_valid(header) &&
           render_counts_valid(&header->counts);
}

static bool text_terminated(const char *text, size_t size)
{
    return memchr(text, '\0', size) != NULL;
}

bool ready_message_valid(const struct ready *ready, size_t bytes, int rank)
{
    return bytes == sizeof *ready && rank >= 0 && ready->rank == (uint32_t)rank &&
           ready->reserved == 0 && text_terminated(ready->host, sizeof ready->host);
}

bool start_message_valid(const struct start *start, size_t bytes)
{
    return bytes == sizeof *start && seconds_valid(start->elapsed_s) &&
           seconds_valid(start->patience);
}

bool stats_message_valid(const struct renderer_stats *stats, size_t bytes, int rank)
{
    if (bytes != sizeof *stats || rank < 0 || stats->rank != (uint32_t)rank || stats->silent ||
        stats->reserved)
        return false;
    const double seconds[] = {
        stats->busy_s, stats->cpu_s, stats->wait_s, stats->send_s, stats->finish_s,
    };
    for (size_t i = 0; i < sizeof seconds / sizeof *seconds; i++)
        if (!seconds_valid(seconds[i])) return false;
    return render_counts_valid(&stats->counts) && text_terminated(stats->host, sizeof stats->host);
}

bool welcome_valid(const struct welcome *welcome, const char *build)
{
    return welcome->magic == WELCOME_MAGIC &&
           text_terminated(welcome->build, sizeof welcome->build) &&
           strcmp(welcome->build, build) == 0;
}
