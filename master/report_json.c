/* Writes the report of a run as JSON (report_json() of report.h); master/README.md describes its keys. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/scene.h"
#include "master/json.h"
#include "master/report.h"

static void put_farm(struct json *json, const struct report *report)
{
    json_open(json, "farm", '{');
    json_string(json, "version", report->version);
    json_count(json, "processes", (uint64_t)report->processes);
    json_count(json, "renderers", (uint64_t)report->renderer_count);
    json_count(json, "cores", report->cores);
    json_count(json, "at_once", report->processors);
    json_string(json, "kernel", processor_level_names[report->kernel]);
    json_string(json, "schedule", schedule_names[report->schedule]);
    json_count(json, "tile", report->tile_edge);
    json_count(json, "tiles", report->tiles);
    json_close(json, '}');
}

static void put_image(struct json *json, const struct report *report)
{
    json_open(json, "image", '{');
    json_string(json, "file", report->image_file);
    json_count(json, "width", report->image_width);
    json_count(json, "height", report->image_height);
    json_close(json, '}');
}

static void put_features(struct json *json, const char *key, unsigned features)
{
    json_open_inline(json, key, '[');
    for (unsigned i = 0; i < FEATURE_COUNT; i++)
        if (features >> i & 1) json_string(json, NULL, scene_feature_name(i));
    json_close(json, ']');
}

static void put_scene(struct json *json, const struct report *report)
{
    double bytes = (double)report->scene_bytes + (double)report->bvh_bytes;
    json_open(json, "scene", '{');
    json_string(json, "file", report->config);
    json_count(json, "primitives", report->primitives);
    json_count(json, "triangles", report->triangles);
    json_count(json, "duplicates", report->duplicates);
    json_count(json, "lights", report->lights);
    json_count(json, "bytes", report->scene_bytes);
    json_count(json, "bvh_bytes", report->bvh_bytes);
    /* null without any triangle or patch */
    json_number(json, "bytes_per_triangle", bytes / (double)report->triangles);
    put_features(json, "used", report->features);
    put_features(json, "left_out", ~report->features);
    json_close(json, '}');
}

/* Numbers are numbers, all else is the text of an INI file. */
static void put_setting(struct json *json, const struct key *key, const struct settings *settings)
{
    const void *value = (const char *)settings + key->offset;
    bool is_count =
        key->type == VALUE_UNSIGNED || (key->type == VALUE_AUTO && *(const uint32_t *)value > 0);
    if (is_count) {
        json_count(json, key->name, *(const uint32_t *)value);
    } else if (key->type == VALUE_NUMBER) {
        json_number(json, key->name, *(const double *)value);
    } else {
        char *text = key_format(key, settings);
        json_string(json, key->name, text);
        free(text);
    }
}

static void put_settings(struct json *json, const struct settings *settings)
{
    json_open(json, "settings", '{');
    for (size_t i = 0; i < SETTINGS_KEYS;) {
        const char *section = settings_keys[i].section;
        json_open_inline(json, section, '{');
        for (; i < SETTINGS_KEYS && strcmp(settings_keys[i].section, section) == 0; i++)
            if (settings_lists(settings, &settings_keys[i]))
                put_setting(json, &settings_keys[i], settings);
        json_close(json, '}');
    }
    json_close(json, '}');
}

static void put_time(struct json *json, const struct run_times *time)
{
    json_open(json, "time", '{');
    json_seconds(json, "total_s", time->total);
    json_seconds(json, "init_s", time->init);
    json_seconds(json, "load_s", time->load);
    json_seconds(json, "resume_s", time->resume);
    json_seconds(json, "room_s", time->room);
    json_seconds(json, "broadcast_s", time->broadcast);
    json_seconds(json, "build_s", time->build);
    json_seconds(json, "render_s", time->render);
    json_seconds(json, "probe_s", time->probe);
    json_seconds(json, "write_s", time->write);
    json_close(json, '}');
}

static void put_rays(struct json *json, const struct render_counts *counts)
{
    json_open(json, "rays", '{');
    json_count(json, "primary", counts->rays[RAY_PRIMARY]);
    json_count(json, "shadow", counts->rays[RAY_SHADOW]);
    json_count(json, "reflection", counts->rays[RAY_REFLECTION]);
    json_count(json, "refraction", counts->rays[RAY_REFRACTION]);
    json_close(json, '}');
}

static void put_worker(struct json *json, const struct renderer_stats *stats)
{
    json_open_inline(json, NULL, '{');
    json_count(json, "rank", stats->rank);
    json_string(json, "host", stats->host);
    json_count(json, "tiles", stats->tiles);
    json_count(json, "pixels", stats->pixels);
    json_seconds(json, "busy_s", stats->busy_s);
    json_seconds(json, "cpu_s", stats->cpu_s);
    json_seconds(json, "wait_s", stats->wait_s);
    json_seconds(json, "send_s", stats->send_s);
    json_seconds(json, "finish_s", stats->finish_s);
    json_seconds(json, "intersect_s", stats->counts.intersect_s);
    json_seconds(json, "shade_s", stats->counts.shade_s);
    json_count(json, "bytes", stats->bytes);
    if (stats->silent) json_count(json, "silent", 1);
    json_close(json, '}');
}

static void put_workers(struct json *json, const struct report *report)
{
    json_open(json, "workers", '[');
    for (int i = 0; i < report->renderer_count; i++)
        put_worker(json, &report->renderers[i]);
    json_close(json, ']');
}

static void put_master(struct json *json, const struct report *report)
{
    json_open(json, "master", '{');
    json_seconds(json, "cpu_s", report->master_cpu_s);
    json_count(json, "messages", report->master_messages);
    json_fixed(json, "service_s", report->service_s, 9);
    json_seconds(json, "answer_wait_s", report->answer_wait_s);
    json_seconds(json, "answer_wait_most_s", report->answer_wait_most_s);
    json_close(json, '}');
}

static void put_balance(struct json *json, const struct report *report)
{
    struct balance balance = report_balance(report);
    json_open(json, "balance", '{');
    json_number(json, "efficiency", balance.efficiency);
    json_number(json, "imbalance", balance.imbalance);
    json_number(json, "cpu_share", balance.cpu_share);
    json_number(json, "cpu_imbalance", balance.cpu_imbalance);
    json_seconds(json, "tail_s", balance.tail_s);
    json_count(json, "repeated_tiles", report->repeated_tiles);
    json_seconds(json, "wasted_s", report->wasted_s);
    json_close(json, '}');
}

/* Range of the heat map, if there is one: CPU seconds per pixel. */
static void put_heat(struct json *json, const struct heat_range *heat)
{
    if (heat->highest == 0) return;
    json_open(json, "heatmap", '{');
    json_number(json, "black_s", heat->lowest);
    json_number(json, "white_s", heat->highest);
    json_close(json, '}');
}

static void put_vector(struct json *json, const char *key, struct vec3 v)
{
    json_open(json, key, '[');
    json_number(json, NULL, v.x);
    json_number(json, NULL, v.y);
    json_number(json, NULL, v.z);
    json_close(json, ']');
}

static void put_first_bad(struct json *json, const struct report *report,
                          const struct render_counts *counts)
{
    if (!counts->nonfinite) {
        json_null(json, "first");
        return;
    }
    const struct bad_sample *bad = &counts->first;
    const struct renderer_stats *stats = report_finder(report, bad);
    json_open_inline(json, "first", '{');
    if (stats)
        json_count(json, "rank", stats->rank);
    else
        json_null(json, "rank");
    json_open(json, "pixel", '[');
    json_count(json, NULL, bad->x);
    json_count(json, NULL, bad->y);
    json_close(json, ']');
    json_count(json, "sample", bad->sample);
    json_count(json, "depth", bad->depth);
    json_open(json, "ray", '{');
    put_vector(json, "origin", bad->origin);
    put_vector(json, "direction", bad->direction);
    json_close(json, '}');
    json_close(json, '}');
}

static void put_numerics(struct json *json, const struct report *report,
                         const struct render_counts *counts)
{
    json_open(json, "numerics", '{');
    json_count(json, "nonfinite", counts->nonfinite);
    put_first_bad(json, report, counts);
    json_count(json, "exact_fallbacks", counts->exact_fallbacks);
    json_count(json, "unmatched_media", counts->unmatched_media);
    json_count(json, "open_media", counts->open_media);
    json_close(json, '}');
}

static void put_error_row(struct json *json, const struct error_row *row)
{
    json_open_inline(json, NULL, '{');
    json_seconds(json, "elapsed_s", row->elapsed_s);
    json_number(json, "samples_per_pixel", row->samples);
    json_number(json, "estimated_rmse", row->estimate.rmse);
    json_number(json, "estimated_low", row->estimate.low);
    json_number(json, "estimated_high", row->estimate.high);
    if (!isnan(row->true_rmse)) json_number(json, "true_rmse", row->true_rmse);
    json_number(json, "sampled_share", row->sampled_share);
    json_close(json, '}');
}

static void put_errors(struct json *json, const struct error_log *errors)
{
    json_open(json, "error", '[');
    for (size_t i = 0; errors && i < errors->count; i++)
        put_error_row(json, &errors->rows[i]);
    json_close(json, ']');
}

/* The predicted cost of a smaller error: forecast->goal. */
static void put_forecast(struct json *json, const struct report *report)
{
    const struct error_forecast *forecast = &report->forecast;
    if (!forecast->known) {
        json_null(json, "forecast");
        return;
    }
    double low, high;
    double seconds = forecast_seconds(forecast, forecast->goal, &low, &high);
    json_open(json, "forecast", '{');
    json_number(json, "slope", -forecast->slope);
    json_number(json, "slope_spread", forecast->slope_spread);
    json_number(json, "rmse", forecast->goal);
    if (forecast->samples > 0) json_number(json, "samples", forecast->samples);
    json_seconds(json, "render_s", seconds);
    json_seconds(json, "render_low_s", low);
    json_seconds(json, "render_high_s", high);
    json_close(json, '}');
}

static void put_sampling(struct json *json, const struct report *report)
{
    static const char *const ends[] = {[ENDED_BY_SAMPLES] = "samples",
                                       [ENDED_BY_TARGET] = "target",
                                       [ENDED_BY_MAX_SAMPLES] = "max_samples",
                                       [ENDED_BY_TIME] = "time",
                                       [ENDED_WITHOUT_ERROR] = "no_error"};
    json_open(json, "sampling", '{');
    json_count(json, "min_samples", report->min_samples);
    json_count(json, "max_samples", report->max_samples);
    json_count(json, "passes", report->passes);
    json_number(json, "missing_share", report->missing_share);
    json_seconds(json, "plan_s", report->plan_s);
    json_string(json, "ended", ends[report->ended]);
    json_count(json, "unsampled_pixels", report->unsampled);
    json_number(json, "guessed_rmse", report->guessed_rmse);
    if (report->forecast.beyond) {
        json_number(json, "beyond_rmse", report->forecast.goal);
        if (report->forecast.max_samples > 0)
            json_count(json, "enough_samples", report->forecast.max_samples);
    }
    json_close(json, '}');
}

/* The number of rows whose true error is known, and of those whose interval contains it. */
static void put_coverage(struct json *json, const struct error_log *errors)
{
    uint64_t known = 0, held = 0;
    for (size_t i = 0; errors && i < errors->count; i++) {
        const struct error_row *row = &errors->rows[i];
        if (isnan(row->true_rmse)) continue;
        known++;
        held += row->estimate.low <= row->true_rmse && row->true_rmse <= row->estimate.high;
    }
    json_count(json, "rows", known);
    json_count(json, "rows_held", held);
}

static void put_reference(struct json *json, const struct report *report)
{
    if (!report->has_reference) {
        json_null(json, "reference");
        return;
    }
    json_open(json, "reference", '{');
    json_number(json, "rmse", report->truth.rmse);
    json_number(json, "max", report->truth.most);
    json_number(json, "p999", report->truth.p999);
    put_coverage(json, report->errors);
    json_close(json, '}');
}

static void put_quantisation(struct json *json, const struct quantisation *quantisation)
{
    json_open(json, "quantisation", '{');
    json_number(json, "rmse", quantisation->rmse);
    json_number(json, "max", quantisation->most);
    json_count(json, "clipped_pixels", quantisation->clipped);
    json_number(json, "clipped_rmse", quantisation->clipped_rmse);
    json_close(json, '}');
}

static void put_quality(struct json *json, const struct report *report)
{
    struct render_counts counts = report_picture_counts(report);
    put_errors(json, report->errors);
    put_forecast(json, report);
    put_sampling(json, report);
    put_reference(json, report);
    json_open(json, "bound", '{');
    json_number(json, "truncation", counts.truncation);
    json_count(json, "rays", counts.bound_rays);
    json_close(json, '}');
    put_quantisation(json, &report->quantisation);
    /* The error of the arithmetic is unknown: measuring it takes the same picture in higher precision. */
    json_null(json, "arithmetic");
    put_numerics(json, report, &counts);
    json_open(json, "resumed", '{');
    json_count(json, "tiles", report->resumed.tiles);
    json_count(json, "pixels", report->resumed.pixels);
    json_count(json, "records", report->resumed.records);
    json_seconds(json, "seconds_saved", report->resumed.seconds);
    json_seconds(json, "seconds_repeated", report->resumed.repeated_s);
    json_close(json, '}');
}

char *report_json(const struct report *report)
{
    struct json json;
    struct render_counts counts = report_counts(report);
    json_begin(&json);
    json_open(&json, NULL, '{');
    put_farm(&json, report);
    put_image(&json, report);
    put_scene(&json, report);
    put_time(&json, &report->time);
    put_rays(&json, &counts);
    put_workers(&json, report);
    put_master(&json, report);
    put_balance(&json, report);
    put_heat(&json, &report->heat);
    put_quality(&json, report);
    put_settings(&json, report->settings);
    json_close(&json, '}');
    return json_end(&json);
}
