#include "bench/kernel_export.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/outside.h"
#include "common/message.h"

static uint64_t count_of(const struct scene *scene, enum primitive_kind kind)
{
    return scene->primitives[kind].count;
}

/* ---- Tachyon ---- */

static void dat_vec(FILE *out, const char *key, struct vec3 v)
{
    fprintf(out, " %s %.9g %.9g %.9g", key, v.x, v.y, v.z);
}

/*
 * Tachyon's right is on the left: a frustum whose left and right are exchanged corrects that. Its rays go
 * through the far corners of pixels: half a pixel moves them to the middle.
 */
static void dat_view(FILE *out, const struct view *view)
{
    double half_y = vec_length(view->camera.down), half_x = half_y * view->width / view->height;
    fprintf(out,
            "BEGIN_SCENE\nRESOLUTION %u %u\nCAMERA\nPROJECTION PERSPECTIVE ZOOM 1\n"
            "ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH %u\n",
            view->width, view->height, view->max_depth + 1);
    dat_vec(out, "CENTER", view->camera.eye);
    dat_vec(out, "VIEWDIR", view->camera.forward);
    dat_vec(out, "UPDIR", vec_neg(vec_normalize(view->camera.down)));
    double off_x = half_x / view->width, off_y = half_y / view->height;
    fprintf(out, "\nFRUSTUM %.9g %.9g %.9g %.9g\nEND_CAMERA\n", half_x + off_x, off_x - half_x,
            -half_y - off_y, half_y - off_y);
    fputs("BACKGROUND_GRADIENT SKY_SPHERE", out);
    dat_vec(out, "UPDIR", view->background_up);
    fputs(" TOPVAL 1 BOTTOMVAL -1", out);
    dat_vec(out, "TOPCOLOR", view->background_top);
    dat_vec(out, "BOTTOMCOLOR", view->background_bottom);
    fputc('\n', out);
}

/* Transmitted light has no colour, only its mean. */
static void dat_materials(FILE *out, const struct scene *scene)
{
    for (uint64_t i = 0; i < scene->materials.count; i++) {
        const struct material *m = &scene_materials(scene)[i];
        double mean = (m->color.x + m->color.y + m->color.z) / 3;
        fprintf(out,
                "TEXDEF m%llu AMBIENT %.9g DIFFUSE %.9g SPECULAR %.9g OPACITY %.9g\n"
                "PHONG PLASTIC %.9g PHONG_SIZE %.9g",
                (unsigned long long)i, m->ambient, m->diffuse, m->reflection,
                1 - m->transmission * mean, m->specular, m->shininess);
        dat_vec(out, "COLOR", m->color);
        fputs(" TEXFUNC 0\n", out);
    }
}

static void dat_lights(FILE *out, const struct scene *scene)
{
    for (uint64_t i = 0; i < scene->lights.count; i++) {
        fputs("LIGHT", out);
        dat_vec(out, "CENTER", scene_lights(scene)[i].position);
        fputs(" RAD 0", out);
        dat_vec(out, "COLOR", scene_lights(scene)[i].color);
        fputc('\n', out);
    }
}

static void dat_triangle(FILE *out, const struct scene *scene, uint32_t id)
{
    static const char *const keys[2][3] = {{"V0", "V1", "V2"}, {"N0", "N1", "N2"}};
    bool smooth = primitive_kind(id) == PRIMITIVE_PATCH;
    fputs(smooth ? "STRI" : "TRI", out);
    for (int k = 0; k < 3; k++)
        dat_vec(out, keys[0][k], scene_vertices(scene)[corner_indices(scene, id)[k]]);
    for (int k = 0; k < 3 && smooth; k++)
        dat_vec(out, keys[1][k],
                scene_normals(scene)[scene_patches(scene)[primitive_index(id)].normal[k]]);
    fprintf(out, " m%u\n", primitive_material(scene, id));
}

static void dat_ring(FILE *out, struct vec3 center, struct vec3 normal, double radius,
                     uint32_t material)
{
    if (!(radius > 0)) return;
    fputs("RING", out);
    dat_vec(out, "CENTER", center);
    dat_vec(out, "NORMAL", normal);
    fprintf(out, " INNER 0 OUTER %.9g m%u\n", radius, material);
}

static void dat_cone(FILE *out, const struct cone *cone)
{
    double radius = 0.5 * (cone->base_radius + cone->apex_radius);
    struct vec3 axis = vec_normalize(vec_sub(cone->apex, cone->base));
    fputs("FCYLINDER", out);
    dat_vec(out, "BASE", cone->base);
    dat_vec(out, "APEX", cone->apex);
    fprintf(out, " RAD %.9g m%u\n", radius, cone->material);
    if (!cone->capped) return;
    dat_ring(out, cone->base, vec_neg(axis), radius, cone->material);
    dat_ring(out, cone->apex, axis, radius, cone->material);
}

static void dat_flat(FILE *out, const struct scene *scene)
{
    for (enum primitive_kind kind = PRIMITIVE_TRIANGLE; kind_is_triangle(kind); kind++)
        for (uint32_t i = 0; i < count_of(scene, kind); i++)
            dat_triangle(out, scene, primitive_id(kind, i));
    for (uint64_t i = 0; i < count_of(scene, PRIMITIVE_DISC); i++) {
        const struct disc *disc = &scene_discs(scene)[i];
        dat_ring(out, disc->center, disc->normal, disc->radius, disc->material);
    }
    for (uint64_t i = 0; i < count_of(scene, PRIMITIVE_PLANE); i++) {
        fputs("PLANE", out);
        dat_vec(out, "CENTER", scene_planes(scene)[i].point);
        dat_vec(out, "NORMAL", scene_planes(scene)[i].normal);
        fprintf(out, " m%u\n", scene_planes(scene)[i].material);
    }
}

static void dat_solids(FILE *out, const struct scene *scene)
{
    for (uint64_t i = 0; i < count_of(scene, PRIMITIVE_SPHERE); i++) {
        const struct sphere *sphere = &scene_spheres(scene)[i];
        fputs("SPHERE", out);
        dat_vec(out, "CENTER", sphere->center);
        fprintf(out, " RAD %.9g m%u\n", sphere->radius, sphere->material);
    }
    for (uint64_t i = 0; i < count_of(scene, PRIMITIVE_BOX); i++) {
        fputs("BOX", out);
        dat_vec(out, "MIN", scene_boxes(scene)[i].min);
        dat_vec(out, "MAX", scene_boxes(scene)[i].max);
        fprintf(out, " m%u\n", scene_boxes(scene)[i].material);
    }
    for (uint64_t i = 0; i < count_of(scene, PRIMITIVE_CONE); i++)
        dat_cone(out, &scene_cones(scene)[i]);
}

void export_tachyon(const char *path, const struct scene *scene)
{
    FILE *out = open_to_write("%s", path);
    dat_view(out, &scene->view);
    dat_materials(out, scene);
    dat_lights(out, scene);
    dat_flat(out, scene);
    dat_solids(out, scene);
    fputs("END_SCENE\n", out);
    close_written(out);
}

/* ---- POV-Ray ---- */

static void pov_vec(FILE *out, const char *key, struct vec3 v)
{
    fprintf(out, "%s<%.9g,%.9g,%.9g>", key, v.x, v.y, v.z);
}

/* Dot products with up, from -1 to 1, become 0 to 1, the range of the colour map. */
static void pov_sky(FILE *out, const struct view *view)
{
    struct vec3 bottom = view->background_bottom, top = view->background_top;
    if (vec_is_same(bottom, top)) {
        pov_vec(out, "background { rgb ", top);
        fputs(" }\n", out);
        return;
    }
    pov_vec(out, "sky_sphere { pigment { gradient ", view->background_up);
    pov_vec(out, " color_map { [0 rgb ", bottom);
    pov_vec(out, "] [1 rgb ", top);
    pov_vec(out, "] } scale 2 translate ", vec_neg(view->background_up));
    fputs(" } }\n", out);
}

/* location + direction is the middle of the picture; right and up span its whole width and height. */
static void pov_view(FILE *out, const struct view *view)
{
    const struct camera *camera = &view->camera;
    fprintf(out,
            "#version 3.7;\nglobal_settings { assumed_gamma 1 max_trace_level %u "
            "adc_bailout %.9g ambient_light rgb 1 }\ncamera { perspective",
            view->max_depth + 1, view->cutoff);
    pov_vec(out, " location ", camera->eye);
    pov_vec(out, " direction ", camera->forward);
    pov_vec(out, " right ", vec_scale(camera->right, 2.0 * view->width / view->height));
    pov_vec(out, " up ", vec_scale(camera->down, -2));
    fputs(" }\n", out);
    pov_sky(out, view);
}

/* POV-Ray multiplies the own colour of a transparent surface by 1 - filter: compensated here. */
static void pov_materials(FILE *out, const struct scene *scene)
{
    for (uint64_t i = 0; i < scene->materials.count; i++) {
        const struct material *m = &scene_materials(scene)[i];
        double opaque = fmax(1 - m->transmission, 1e-3), filter = 1 - opaque;
        if (!(m->transmission > 0)) opaque = 1, filter = 0;
        fprintf(out,
                "#declare M%llu = material { texture { pigment { rgbf <%.9g,%.9g,%.9g,%.9g> }\n",
                (unsigned long long)i, m->color.x, m->color.y, m->color.z, filter);
        fprintf(out, "finish { ambient %.9g diffuse %.9g phong %.9g phong_size %.9g",
                m->ambient / opaque, m->diffuse / opaque, m->specular, m->shininess);
        if (m->reflection > 0) fprintf(out, " reflection { %.9g }", m->reflection);
        fprintf(out, " } } interior { ior %.9g } }\n", m->ior);
    }
}

static void pov_lights(FILE *out, const struct scene *scene)
{
    for (uint64_t i = 0; i < scene->lights.count; i++) {
        pov_vec(out, "light_source { ", scene_lights(scene)[i].position);
        pov_vec(out, " rgb ", scene_lights(scene)[i].color);
        fputs(" }\n", out);
    }
}

/* The vertices or normals of a mesh2, numbered in the order in which its corners use them. */
struct numbered {
    uint32_t *number;  /* number of each of the scene's; UINT32_MAX: not used */
    uint32_t *members; /* those that are used */
    uint32_t count;
};

static struct numbered numbered_none(uint64_t all)
{
    struct numbered list = {allocate(all, sizeof(uint32_t)), allocate(all, sizeof(uint32_t)), 0};
    memset(list.number, 0xff, all * sizeof *list.number);
    return list;
}

static void numbered_add(struct numbered *list, const uint32_t corners[3])
{
    for (int k = 0; k < 3; k++) {
        if (list->number[corners[k]] != UINT32_MAX) continue;
        list->members[list->count] = corners[k];
        list->number[corners[k]] = list->count++;
    }
}

static void numbered_free(struct numbered *list)
{
    free(list->number);
    free(list->members);
}

static void pov_places(FILE *out, const char *key, const struct numbered *list,
                       const struct vec3 *places)
{
    fprintf(out, "%s { %u", key, list->count);
    for (uint32_t i = 0; i < list->count; i++)
        pov_vec(out, ",\n", places[list->members[i]]);
    fputs(" }\n", out);
}

struct mesh {
    enum primitive_kind kind;
    uint32_t material;
    uint64_t faces;
    struct numbered places, normals;
};

static struct mesh collect_mesh(const struct scene *scene, enum primitive_kind kind,
                                uint32_t material)
{
    struct mesh mesh = {.kind = kind, .material = material};
    mesh.places = numbered_none(scene->vertices.count);
    mesh.normals = numbered_none(scene->normals.count);
    for (uint32_t i = 0; i < count_of(scene, kind); i++) {
        if (primitive_material(scene, primitive_id(kind, i)) != material) continue;
        mesh.faces++;
        numbered_add(&mesh.places, corner_indices(scene, primitive_id(kind, i)));
        if (kind == PRIMITIVE_PATCH) numbered_add(&mesh.normals, scene_patches(scene)[i].normal);
    }
    return mesh;
}

static void pov_faces(FILE *out, const struct scene *scene, const struct mesh *mesh, bool normals)
{
    fprintf(out, "%s { %llu", normals ? "normal_indices" : "face_indices",
            (unsigned long long)mesh->faces);
    const uint32_t *number = normals ? mesh->normals.number : mesh->places.number;
    for (uint32_t i = 0; i < count_of(scene, mesh->kind); i++) {
        uint32_t id = primitive_id(mesh->kind, i);
        if (primitive_material(scene, id) != mesh->material) continue;
        const uint32_t *corner =
            normals ? scene_patches(scene)[i].normal : corner_indices(scene, id);
        fprintf(out, ",\n<%u,%u,%u>", number[corner[0]], number[corner[1]], number[corner[2]]);
    }
    fputs(" }\n", out);
}

/* Writes one mesh for each material, as a mesh has only one interior. */
static void pov_mesh(FILE *out, const struct scene *scene, enum primitive_kind kind,
                     uint32_t material)
{
    struct mesh mesh = collect_mesh(scene, kind, material);
    if (mesh.faces) {
        fputs("mesh2 {\n", out);
        pov_places(out, "vertex_vectors", &mesh.places, scene_vertices(scene));
        if (mesh.normals.count)
            pov_places(out, "normal_vectors", &mesh.normals, scene_normals(scene));
        pov_faces(out, scene, &mesh, false);
        if (mesh.normals.count) pov_faces(out, scene, &mesh, true);
        fprintf(out, "material { M%u } }\n", material);
    }
    numbered_free(&mesh.places);
    numbered_free(&mesh.normals);
}

static void pov_end(FILE *out, uint32_t material)
{
    fprintf(out, " material { M%u } }\n", material);
}

static void pov_cone(FILE *out, const struct cone *cone)
{
    bool even = cone->base_radius == cone->apex_radius;
    pov_vec(out, even ? "cylinder { " : "cone { ", cone->base);
    if (!even) fprintf(out, ",%.9g", cone->base_radius);
    pov_vec(out, ",", cone->apex);
    fprintf(out, ",%.9g%s", cone->apex_radius, cone->capped ? "" : " open");
    pov_end(out, cone->material);
}

static void pov_solids(FILE *out, const struct scene *scene)
{
    for (uint64_t i = 0; i < count_of(scene, PRIMITIVE_SPHERE); i++) {
        const struct sphere *sphere = &scene_spheres(scene)[i];
        pov_vec(out, "sphere { ", sphere->center);
        fprintf(out, ",%.9g", sphere->radius);
        pov_end(out, sphere->material);
    }
    for (uint64_t i = 0; i < count_of(scene, PRIMITIVE_BOX); i++) {
        pov_vec(out, "box { ", scene_boxes(scene)[i].min);
        pov_vec(out, ",", scene_boxes(scene)[i].max);
        pov_end(out, scene_boxes(scene)[i].material);
    }
    for (uint64_t i = 0; i < count_of(scene, PRIMITIVE_CONE); i++)
        pov_cone(out, &scene_cones(scene)[i]);
}

static void pov_flat(FILE *out, const struct scene *scene)
{
    for (uint64_t i = 0; i < count_of(scene, PRIMITIVE_DISC); i++) {
        const struct disc *disc = &scene_discs(scene)[i];
        pov_vec(out, "disc { ", disc->center);
        pov_vec(out, ",", disc->normal);
        fprintf(out, ",%.9g", disc->radius);
        pov_end(out, disc->material);
    }
    for (uint64_t i = 0; i < count_of(scene, PRIMITIVE_PLANE); i++) {
        const struct plane *plane = &scene_planes(scene)[i];
        pov_vec(out, "plane { ", plane->normal);
        fprintf(out, ",%.9g", vec_dot(plane->normal, plane->point));
        pov_end(out, plane->material);
    }
}

void export_povray(const char *path, const struct scene *scene)
{
    FILE *out = open_to_write("%s", path);
    pov_view(out, &scene->view);
    pov_materials(out, scene);
    pov_lights(out, scene);
    for (uint32_t m = 0; m < scene->materials.count; m++) {
        pov_mesh(out, scene, PRIMITIVE_TRIANGLE, m);
        pov_mesh(out, scene, PRIMITIVE_PATCH, m);
    }
    pov_flat(out, scene);
    pov_solids(out, scene);
    close_written(out);
}
