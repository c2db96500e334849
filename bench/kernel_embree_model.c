/* Converts the farm's scene block to geometries of Embree. */
#include <stdlib.h>
#include <string.h>

#include "bench/kernel_embree.h"
#include "common/message.h"

static void count_own(struct model *model, uint64_t count, size_t size)
{
    model->own_bytes += count * size;
}

static void *own(struct model *model, uint64_t count, size_t size)
{
    count_own(model, count, size);
    return allocate(count, size);
}

/* Only the vertices that this part uses. */
static void fill_mesh(const struct part *part, RTCGeometry geometry)
{
    const struct scene *scene = part->model->scene;
    uint64_t vertices = scene->vertices.count;
    uint32_t *number = allocate(vertices, sizeof *number), used = 0;
    memset(number, 0xff, vertices * sizeof *number);
    unsigned *corners = rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), part->count);
    for (uint32_t i = 0; i < part->count; i++)
        for (int k = 0; k < 3; k++) {
            uint32_t vertex = corner_indices(scene, primitive_id(part->kind, part->index[i]))[k];
            if (number[vertex] == UINT32_MAX) number[vertex] = used++;
            corners[3 * i + (unsigned)k] = number[vertex];
        }
    struct f3 *places = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                RTC_FORMAT_FLOAT3, sizeof *places, used);
    for (uint64_t i = 0; i < vertices; i++)
        if (number[i] != UINT32_MAX) places[number[i]] = f3_of(scene_vertices(scene)[i]);
    free(number);
}

static void fill_patch_normals(struct model *model, struct part *part)
{
    part->normal = own(model, 3 * (uint64_t)part->count, sizeof *part->normal);
    for (uint32_t i = 0; i < part->count; i++)
        memcpy(&part->normal[3 * i], scene_patches(model->scene)[part->index[i]].normal,
               3 * sizeof *part->normal);
}

static void fill_spheres(struct part *part, RTCGeometry geometry)
{
    part->spheres = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4,
                                            4 * sizeof(float), part->count);
    for (uint32_t i = 0; i < part->count; i++) {
        const struct sphere *sphere = &scene_spheres(part->model->scene)[part->index[i]];
        struct f3 center = f3_of(sphere->center);
        float values[4] = {center.x, center.y, center.z, (float)sphere->radius};
        if (sphere->inside_only) fatal("spheres that are seen only from within are not supported");
        memcpy(&part->spheres[4 * i], values, sizeof values);
    }
}

static struct solid_cone solid_cone_of(const struct cone *cone)
{
    struct vec3 axis = vec_sub(cone->apex, cone->base);
    double height = vec_length(axis);
    return (struct solid_cone){
        .base = f3_of(cone->base),
        .axis = f3_of(vec_normalize(axis)),
        .height = (float)height,
        .base_radius = (float)cone->base_radius,
        .apex_radius = (float)cone->apex_radius,
        .slope = (float)((cone->apex_radius - cone->base_radius) / height),
        .capped = cone->capped,
    };
}

static void fill_solids(struct model *model, struct part *part)
{
    const struct scene *scene = model->scene;
    struct solid_cone *cones = NULL;
    struct solid_box *boxes = NULL;
    struct flat_disc *discs = NULL;
    if (part->kind == PRIMITIVE_CONE) part->solids = cones = own(model, part->count, sizeof *cones);
    if (part->kind == PRIMITIVE_BOX) part->solids = boxes = own(model, part->count, sizeof *boxes);
    if (part->kind == PRIMITIVE_DISC) part->solids = discs = own(model, part->count, sizeof *discs);
    for (uint32_t i = 0; i < part->count; i++) {
        uint32_t from = part->index[i];
        if (cones) cones[i] = solid_cone_of(&scene_cones(scene)[from]);
        if (boxes)
            boxes[i] = (struct solid_box){f3_of(scene_boxes(scene)[from].min),
                                          f3_of(scene_boxes(scene)[from].max)};
        if (discs)
            discs[i] = (struct flat_disc){f3_of(scene_discs(scene)[from].center),
                                          f3_of(scene_discs(scene)[from].normal),
                                          (float)scene_discs(scene)[from].radius};
    }
}

/* Embree may show a filter the same crossing more than once. */
void shadow_pass(struct shadow_query *query, const struct part *part, unsigned geometry,
                 unsigned primitive, float t)
{
    unsigned count = query->seen < SEEN_MAX ? query->seen : SEEN_MAX;
    for (unsigned i = 0; i < count; i++)
        if (query->crossings[i].geometry == geometry &&
            query->crossings[i].primitive == primitive && query->crossings[i].t == t)
            return;
    unsigned at = query->seen++ % SEEN_MAX;
    query->crossings[at].geometry = geometry;
    query->crossings[at].primitive = primitive;
    query->crossings[at].t = t;
    query->through =
        f3_mul(query->through, part->model->materials[part->material[primitive]].transmitted);
}

/* Called for single rays only. */
static void filter_shadow(const struct RTCFilterFunctionNArguments *arguments)
{
    if (!arguments->valid[0]) return;
    const struct RTCHit *hit = (const struct RTCHit *)arguments->hit;
    const struct RTCRay *ray = (const struct RTCRay *)arguments->ray;
    shadow_pass((struct shadow_query *)arguments->context, arguments->geometryUserPtr, hit->geomID,
                hit->primID, ray->tfar);
    arguments->valid[0] = 0;
}

static enum RTCGeometryType geometry_type(enum primitive_kind kind)
{
    if (kind_is_triangle(kind)) return RTC_GEOMETRY_TYPE_TRIANGLE;
    return kind == PRIMITIVE_SPHERE ? RTC_GEOMETRY_TYPE_SPHERE_POINT : RTC_GEOMETRY_TYPE_USER;
}

static void attach_part(struct model *model, struct part *part, unsigned id)
{
    enum RTCGeometryType type = geometry_type(part->kind);
    RTCGeometry geometry = rtcNewGeometry(model->device, type);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtcSetGeometryUserData(geometry, part);
    if (type == RTC_GEOMETRY_TYPE_TRIANGLE) {
        fill_mesh(part, geometry);
        if (part->kind == PRIMITIVE_PATCH) fill_patch_normals(model, part);
    } else if (type == RTC_GEOMETRY_TYPE_SPHERE_POINT) {
        fill_spheres(part, geometry);
    } else {
        fill_solids(model, part);
        rtcSetGeometryUserPrimitiveCount(geometry, part->count);
        solids_attach(geometry);
    }
    if (part->transparent && type != RTC_GEOMETRY_TYPE_USER)
        rtcSetGeometryOccludedFilterFunction(geometry, filter_shadow);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(model->rtc, geometry, id);
    rtcReleaseGeometry(geometry);
}

static void add_part(struct model *model, enum primitive_kind kind, bool transparent)
{
    const struct scene *scene = model->scene;
    uint64_t all = scene->primitives[kind].count;
    struct part *part = &model->parts[model->part_count];
    *part = (struct part){.model = model, .kind = kind, .transparent = transparent};
    part->index = allocate(all, sizeof *part->index);
    part->material = allocate(all, sizeof *part->material);
    for (uint32_t i = 0; i < all; i++) {
        uint32_t id = primitive_id(kind, i);
        if (transmits(scene, id) != transparent) continue;
        part->material[part->count] = primitive_material(scene, id);
        part->index[part->count++] = i;
    }
    if (part->count == 0) {
        free(part->index);
        free(part->material);
        return;
    }
    count_own(model, part->count, sizeof *part->material);
    attach_part(model, part, model->part_count++);
    free(part->index);
    part->index = NULL;
}

static void fill_materials(struct model *model)
{
    const struct scene *scene = model->scene;
    model->materials = own(model, scene->materials.count, sizeof *model->materials);
    for (uint64_t i = 0; i < scene->materials.count; i++) {
        const struct material *m = &scene_materials(scene)[i];
        model->materials[i] = (struct surface_material){
            .color = f3_of(m->color),
            .ambient = f3_of(vec_scale(m->color, m->ambient)),
            .diffuse = f3_of(vec_scale(m->color, m->diffuse)),
            .transmitted = f3_of(vec_scale(m->color, m->transmission)),
            .specular = (float)m->specular,
            .shininess = (float)m->shininess,
            .reflection = (float)m->reflection,
            .ior = (float)m->ior,
            .transparent = m->transmission > 0,
        };
    }
}

static void fill_lights(struct model *model)
{
    model->light_count = (unsigned)model->scene->lights.count;
    model->lights = allocate(model->light_count, sizeof *model->lights);
    for (unsigned i = 0; i < model->light_count; i++) {
        const struct light *light = &scene_lights(model->scene)[i];
        model->lights[i] = (struct point_light){f3_of(light->position), f3_of(light->color)};
    }
}

void model_create(struct model *model, const struct scene *scene, RTCDevice device)
{
    *model = (struct model){.scene = scene, .device = device, .rtc = rtcNewScene(device)};
    if (scene->primitives[PRIMITIVE_PLANE].count) fatal("unbounded planes are not supported");
    rtcSetSceneFlags(model->rtc, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(model->rtc, RTC_BUILD_QUALITY_HIGH);
    fill_materials(model);
    fill_lights(model);
    model->normals = own(model, scene->normals.count, sizeof *model->normals);
    for (uint64_t i = 0; i < scene->normals.count; i++)
        model->normals[i] = f3_of(scene_normals(scene)[i]);
    for (unsigned kind = 0; kind < PRIMITIVE_KINDS; kind++) {
        if (scene->primitives[kind].count == 0) continue;
        add_part(model, kind, false);
        add_part(model, kind, true);
    }
}

void model_destroy(struct model *model)
{
    for (unsigned i = 0; i < model->part_count; i++) {
        free(model->parts[i].material);
        free(model->parts[i].normal);
        free(model->parts[i].solids);
    }
    free(model->materials);
    free(model->lights);
    free(model->normals);
    rtcReleaseScene(model->rtc);
}
