/*
 * Reads Eric Haines' Neutral File Format ("A Proposal for Standard Graphics Environments", IEEE CG&A 7(11), 1987). Each
 * statement has a function below; a statement's name is the first word of its line.
 *
 * Our own choices: Ks is the share of the highlight as well as that of the reflection. Ambient light is 0. Lights
 * without a colour have the brightness 1/sqrt(number of all lights in the file). The near plane (hither) has no effect.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/faces.h"
#include "master/loader.h"
#include "master/placement.h"
#include "master/scan.h"
#include "master/text_file.h"
#include "master/triangulate.h"

struct nff_light {
    struct light light;
    bool colored;
};

struct nff {
    const struct part *part;
    struct loader *loader;
    struct builder *builder;
    struct scan scan; /* its path is valid as long as the loader */

    bool has_view, has_background;
    struct vec3 from, at, up;
    double angle; /* degrees, between the centres of the first and the last row of pixels */
    long view_line;
    unsigned seen; /* bits of enum view_field */
    uint32_t resolution[2];
    struct vec3 background;

    bool has_material, told_gain, told_inside;
    uint32_t material;

    struct nff_light *lights;
    size_t light_count;

    struct vec3 *corners, *normals; /* of the polygon being read */
    uint32_t *vertex_index, *normal_index;
    uint32_t corner_room;
    struct triangulation triangulation;
    struct faces faces;
};

enum view_field { FROM = 1, AT = 2, UP = 4, ANGLE = 8, RESOLUTION = 16 };

static bool refuse(const struct nff *nff, const char *text)
{
    user_error(nff->scan.path, nff->scan.line, "%s", nff->scan.too_large ? NUMBER_TOO_LARGE : text);
    return false;
}

/* Reports an error that the builder has returned in `why`. Returns whether there was none (NULL). */
static bool accept(const struct nff *nff, const char *why)
{
    return !why || refuse(nff, why);
}

/* The same for what has a place: the message also says what places it. */
static bool accept_placed(const struct nff *nff, const char *why)
{
    if (!why) return true;
    char *text = why_placed(why, &nff->part->placed);
    refuse(nff, text);
    free(text);
    return false;
}

/* Called after the numbers of a statement have been read. Returns whether they were good and nothing else is on the
 * line, else reports what was expected. */
static bool complete(struct nff *nff, bool good, const char *expected)
{
    return (good && scan_at_end(&nff->scan)) || refuse(nff, expected);
}

/* ---- the view ---- */

static bool read_view(struct nff *nff)
{
    if (nff->has_view) return refuse(nff, "a second view, expected one");
    nff->has_view = true;
    nff->view_line = nff->scan.line;
    return complete(nff, true, "text after 'v', expected the view on the lines after it");
}

static bool in_view(struct nff *nff, unsigned field)
{
    if (!nff->has_view) return refuse(nff, "a line of a view without 'v', expected 'v' before it");
    if (nff->seen & field) return refuse(nff, "a part of the view twice, expected it once");
    nff->seen |= field;
    return true;
}

static bool read_from(struct nff *nff)
{
    return in_view(nff, FROM) &&
           complete(nff, scan_vector(&nff->scan, &nff->from), "'from' needs three numbers");
}

static bool read_at(struct nff *nff)
{
    return in_view(nff, AT) &&
           complete(nff, scan_vector(&nff->scan, &nff->at), "'at' needs three numbers");
}

static bool read_up(struct nff *nff)
{
    return in_view(nff, UP) &&
           complete(nff, scan_vector(&nff->scan, &nff->up), "'up' needs three numbers");
}

static bool read_angle(struct nff *nff)
{
    return in_view(nff, ANGLE) &&
           complete(nff, scan_number(&nff->scan, &nff->angle) && nff->angle > 0 && nff->angle < 180,
                    "'angle' needs a number > 0 and < 180");
}

static bool read_hither(struct nff *nff)
{
    double hither;
    return in_view(nff, 0) &&
           complete(nff, scan_number(&nff->scan, &hither), "'hither' needs a number");
}

static bool read_resolution(struct nff *nff)
{
    uint32_t *size = nff->resolution;
    return in_view(nff, RESOLUTION) &&
           complete(nff,
                    scan_unsigned(&nff->scan, &size[0]) && scan_unsigned(&nff->scan, &size[1]) &&
                        size[0] >= 1 && size[0] <= PICTURE_MAX_EDGE && size[1] >= 1 &&
                        size[1] <= PICTURE_MAX_EDGE,
                    "'resolution' needs two whole numbers from 1 to " DIGITS(PICTURE_MAX_EDGE));
}

static bool read_background(struct nff *nff)
{
    struct vec3 *color = &nff->background;
    if (nff->has_background) return refuse(nff, "a second background, expected one");
    nff->has_background = true;
    return complete(
        nff, scan_vector(&nff->scan, color) && color->x >= 0 && color->y >= 0 && color->z >= 0,
        "'b' needs a colour: three numbers >= 0");
}

/* ---- lights and materials ---- */

static bool read_light(struct nff *nff)
{
    struct nff_light new = {.colored = false};
    bool good = scan_vector(&nff->scan, &new.light.position);
    if (good && !scan_at_end(&nff->scan)) {
        new.colored = true;
        good = scan_vector(&nff->scan, &new.light.color);
    }
    if (!complete(nff, good, "'l' needs a position and may have a colour: 3 or 6 numbers"))
        return false;
    if (new.colored &&
        !(new.light.color.x >= 0 && new.light.color.y >= 0 && new.light.color.z >= 0))
        return refuse(nff, "a light's colour is negative, expected three numbers >= 0");
    nff->lights = grow(nff->lights, nff->light_count, sizeof *nff->lights);
    nff->lights[nff->light_count++] = new;
    return true;
}

static bool read_material(struct nff *nff)
{
    struct material m = {.ambient = 0};
    struct scan *scan = &nff->scan;
    bool good = scan_vector(scan, &m.color) && scan_number(scan, &m.diffuse) &&
                scan_number(scan, &m.specular) && scan_number(scan, &m.shininess) &&
                scan_number(scan, &m.transmission) && scan_number(scan, &m.ior);
    if (!complete(nff, good, "'f' needs eight numbers: R G B Kd Ks Shine T ior")) return false;
    m.reflection = m.specular;
    /* Files set the index of refraction to 0 where nothing is transmitted. */
    if (m.ior == 0 && m.transmission == 0) m.ior = 1;
    if (m.specular > 1) return refuse(nff, "Ks is out of range, expected a number from 0 to 1");
    if (!accept(nff, builder_add_material(nff->builder, &m, &nff->material))) return false;
    nff->has_material = true;
    if (nff->told_gain) return true;
    nff->told_gain = warn_of_gain(&m, nff->scan.path, scan->line, "");
    nff->told_gain |= warn_of_bright_color(&m, nff->scan.path, scan->line, "");
    return true;
}

static uint32_t current_material(struct nff *nff)
{
    return nff->has_material ? nff->material : default_material(nff->loader);
}

/* ---- objects ---- */

static bool read_sphere(struct nff *nff)
{
    struct sphere sphere = {.material = current_material(nff)};
    bool good = scan_vector(&nff->scan, &sphere.center) && scan_number(&nff->scan, &sphere.radius);
    if (!complete(nff, good, "'s' needs a center and a radius: four numbers")) return false;
    sphere.inside_only = sphere.radius < 0;
    sphere.radius = fabs(sphere.radius) * nff->part->placement.scale;
    sphere.center = placement_point(&nff->part->placement, sphere.center);
    return accept_placed(nff, builder_add_sphere(nff->builder, &sphere));
}

/* Reads one end of a cone, which has a line of its own. */
static bool read_cone_end(struct nff *nff, struct vec3 *point, double *radius)
{
    bool good = scan_next_line(&nff->scan) && scan_vector(&nff->scan, point) &&
                scan_number(&nff->scan, radius);
    return complete(nff, good, "'c' needs two lines more, each with a point and a radius");
}

static bool read_cone(struct nff *nff)
{
    struct cone cone = {.material = current_material(nff), .capped = 0};
    if (!complete(nff, true, "text after 'c', expected base and apex on the lines after it") ||
        !read_cone_end(nff, &cone.base, &cone.base_radius) ||
        !read_cone_end(nff, &cone.apex, &cone.apex_radius))
        return false;
    if ((cone.base_radius < 0 || cone.apex_radius < 0) && !nff->told_inside) {
        user_warning(nff->scan.path, nff->scan.line,
                     "a cone with a negative radius is seen from outside too");
        nff->told_inside = true;
    }
    const struct placement *placement = &nff->part->placement;
    cone.base = placement_point(placement, cone.base);
    cone.apex = placement_point(placement, cone.apex);
    cone.base_radius = fabs(cone.base_radius) * placement->scale;
    cone.apex_radius = fabs(cone.apex_radius) * placement->scale;
    return accept_placed(nff, builder_add_cone(nff->builder, &cone));
}

static void make_corner_room(struct nff *nff, uint32_t corners)
{
    if (corners <= nff->corner_room) return;
    nff->corner_room = corners;
    nff->corners = reallocate(nff->corners, corners, sizeof *nff->corners);
    nff->normals = reallocate(nff->normals, corners, sizeof *nff->normals);
    nff->vertex_index = reallocate(nff->vertex_index, corners, sizeof *nff->vertex_index);
    nff->normal_index = reallocate(nff->normal_index, corners, sizeof *nff->normal_index);
}

static bool read_corner(struct nff *nff, uint32_t i, bool with_normals)
{
    struct scan *scan = &nff->scan;
    bool good = scan_next_line(scan) && scan_vector(scan, &nff->corners[i]) &&
                (!with_normals || scan_vector(scan, &nff->normals[i]));
    if (!complete(nff, good,
                  with_normals ? "expected a corner of 'pp': a point and a normal, six numbers"
                               : "expected a corner of 'p': three numbers"))
        return false;
    const struct placement *placement = &nff->part->placement;
    nff->corners[i] = placement_point(placement, nff->corners[i]);
    if (!accept_placed(nff,
                       builder_add_vertex(nff->builder, nff->corners[i], &nff->vertex_index[i])))
        return false;
    return !with_normals ||
           accept_placed(nff, builder_add_normal(nff->builder,
                                                 placement_direction(placement, nff->normals[i]),
                                                 &nff->normal_index[i]));
}

static const char *add_face(struct nff *nff, const uint32_t corner[3], bool with_normals)
{
    const uint32_t *v = nff->vertex_index, *n = nff->normal_index;
    struct triangle triangle = {{v[corner[0]], v[corner[1]], v[corner[2]]}, current_material(nff)};
    if (!with_normals) return builder_add_triangle(nff->builder, &triangle);
    struct patch patch = {.normal = {n[corner[0]], n[corner[1]], n[corner[2]]},
                          .material = triangle.material};
    memcpy(patch.vertex, triangle.vertex, sizeof patch.vertex);
    return builder_add_patch(nff->builder, &patch);
}

/* Reads the number of corners and checks it, before memory for them is allocated. */
static bool read_corner_count(struct nff *nff, uint32_t *corners)
{
    char word[32];
    struct scan ahead = nff->scan;
    if (scan_unsigned(&nff->scan, corners) && *corners >= 3 && *corners <= POLYGON_MAX_CORNERS)
        return complete(nff, true,
                        "text after the number of corners, expected the end of the line");
    /* In quotes, as the word might read like part of the message. */
    char *given = scan_word(&ahead, word, sizeof word) ? format_text("'%s'", word) : NULL;
    user_error(
        nff->scan.path, nff->scan.line,
        "%s in place of a polygon's number of corners, expected 3 to " DIGITS(POLYGON_MAX_CORNERS),
        given ? given : "nothing");
    free(given);
    return false;
}

static bool read_corners(struct nff *nff, bool with_normals)
{
    uint32_t corners;
    if (!read_corner_count(nff, &corners)) return false;
    make_corner_room(nff, corners);
    for (uint32_t i = 0; i < corners; i++)
        if (!read_corner(nff, i, with_normals)) return false;
    if (!accept(nff, triangulate(nff->corners, corners, &nff->triangulation))) return false;
    faces_note_polygon(&nff->faces, nff->corners, &nff->triangulation, nff->scan.path,
                       nff->scan.line);
    for (size_t i = 0; i < nff->triangulation.count; i++)
        if (!accept_placed(nff, add_face(nff, nff->triangulation.triangles[i], with_normals)))
            return false;
    return true;
}

static bool read_polygon(struct nff *nff)
{
    return read_corners(nff, false);
}

static bool read_patch(struct nff *nff)
{
    return read_corners(nff, true);
}

/* ---- the file ---- */

static const struct {
    const char *word;
    bool (*read)(struct nff *nff);
} statements[] = {
    {"p", read_polygon},     {"pp", read_patch},
    {"s", read_sphere},      {"c", read_cone},
    {"f", read_material},    {"l", read_light},
    {"b", read_background},  {"v", read_view},
    {"from", read_from},     {"at", read_at},
    {"up", read_up},         {"angle", read_angle},
    {"hither", read_hither}, {"resolution", read_resolution},
};

static bool read_statement(struct nff *nff)
{
    char word[32];
    scan_word(&nff->scan, word, sizeof word);
    for (size_t i = 0; i < sizeof statements / sizeof *statements; i++)
        if (strcmp(word, statements[i].word) == 0) return statements[i].read(nff);
    user_error(nff->scan.path, nff->scan.line,
               "unknown statement '%s', expected v, b, l, f, s, c, p or pp", word);
    return false;
}

static bool add_lights(struct nff *nff)
{
    double share = 1 / sqrt((double)nff->light_count);
    for (size_t i = 0; i < nff->light_count; i++) {
        struct light light = nff->lights[i].light;
        if (!nff->lights[i].colored) light.color = vec3(share, share, share);
        light.position = placement_point(&nff->part->placement, light.position);
        if (!accept_placed(nff, builder_add_light(nff->builder, &light))) return false;
    }
    return true;
}

/* Sets a setting that nothing has set yet. value has the setting's type. */
static void offer(struct nff *nff, const char *section, const char *name, const void *value,
                  size_t size)
{
    size_t index = setting_index(section, name);
    struct origin *origin = &nff->loader->origins[index];
    if (origin->file) return;
    memcpy((char *)nff->loader->settings + settings_keys[index].offset, value, size);
    *origin = (struct origin){nff->scan.path, nff->view_line};
}

/* Converts NFF's angle, between the centres of the first and the last row of pixels, to a field of view in degrees,
 * which extends to the edges of the picture: half a pixel more on each side. */
static double edge_to_edge(double angle, uint32_t height)
{
    if (height < 2) return angle;
    double half = tan(angle * (M_PI / 360)) * ((double)height / (height - 1));
    return atan(half) * (360 / M_PI);
}

static bool offer_view(struct nff *nff)
{
    if (!nff->has_view) return true;
    if ((nff->seen & (FROM | AT | UP | ANGLE)) != (FROM | AT | UP | ANGLE)) {
        user_error(nff->scan.path, nff->view_line,
                   "the view is not complete, expected from, at, up and angle");
        return false;
    }
    const struct placement *placement = &nff->part->placement;
    nff->from = placement_point(placement, nff->from);
    nff->at = placement_point(placement, nff->at);
    nff->up = placement_direction(placement, nff->up);
    if (nff->seen & RESOLUTION) {
        offer(nff, "image", "width", &nff->resolution[0], sizeof nff->resolution[0]);
        offer(nff, "image", "height", &nff->resolution[1], sizeof nff->resolution[1]);
    }
    double fov = edge_to_edge(nff->angle, nff->loader->settings->image.height);
    offer(nff, "camera", "eye", &nff->from, sizeof nff->from);
    offer(nff, "camera", "look_at", &nff->at, sizeof nff->at);
    offer(nff, "camera", "up", &nff->up, sizeof nff->up);
    offer(nff, "camera", "fov", &fov, sizeof fov);
    return true;
}

/* A file with a view but without a background gets a black one. */
static void offer_background(struct nff *nff)
{
    if (nff->loader->background_set || !(nff->has_view || nff->has_background)) return;
    nff->loader->settings->background.bottom = nff->background;
    nff->loader->settings->background.top = nff->background;
    nff->loader->background_set = true;
}

static bool read_all(struct nff *nff)
{
    bool any = false;
    for (; scan_next_line(&nff->scan); any = true)
        if (!read_statement(nff)) return false;
    if (!any) { /* it has been truncated or never written */
        user_error(nff->scan.path, 0, "has no statements, expected at least one");
        return false;
    }
    faces_warn_of_flat(&nff->faces, nff->scan.path);
    if (!add_lights(nff) || !offer_view(nff)) return false;
    offer_background(nff);
    return true;
}

bool load_nff(const struct part *part)
{
    struct text_file file;
    if (!text_file_read(part->path, SCENE_MAX_BYTES, &file)) return false;
    struct nff nff = {.part = part, .loader = part->loader, .builder = part->loader->builder};
    nff.scan = scan_start(file.text, keep_path(part->loader, part->path), false);
    bool good = read_all(&nff);
    free(nff.lights);
    free(nff.corners);
    free(nff.normals);
    free(nff.vertex_index);
    free(nff.normal_index);
    triangulation_free(&nff.triangulation);
    text_file_free(&file);
    return good;
}
