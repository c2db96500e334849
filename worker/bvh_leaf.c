#include "worker/bvh_leaf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/whole.h"
#include "worker/primitive.h"

struct bvh_leaf bvh_leaf_of(const struct scene *scene, uint32_t id)
{
    return (struct bvh_leaf){.id = id & INT32_MAX, .transparent = transmits(scene, id)};
}

/* Reads the vertices of a leaf's triangles, relative to the tree's centre. */
struct corner_reader {
    const struct scene *scene;
    const double *center;
    const struct bvh_leaf *leaves;
};

static double corner_place(const struct corner_reader *reader, uint32_t i, unsigned corner,
                           unsigned axis)
{
    const uint32_t *vertices = corner_indices(reader->scene, reader->leaves[i].id);
    const struct vec3 *at = &scene_vertices(reader->scene)[vertices[corner]];
    return vec_component(at, axis) - reader->center[axis];
}

/*
 * The unit: a power of two with which places are at most PLACE_MAX, coordinates at most COORDINATE_MAX units, and the
 * inverse is a normal float; 0: there is none.
 */
#define PLACE_MAX      65534.0
#define COORDINATE_MAX 0x1p40
#define UNIT_MIN       0x1p-120
#define UNIT_MAX       0x1p120

static double find_unit(double extent, double largest)
{
    int exponent;
    if (!(largest <= UNIT_MAX)) return 0; /* includes NaN */
    frexp(larger_number(extent / PLACE_MAX, UNIT_MIN), &exponent);
    double unit = ldexp(1, exponent);
    return largest <= COORDINATE_MAX * unit ? unit : 0;
}

static uint32_t count_triangles(const struct bvh_leaf *leaves, uint32_t count)
{
    uint32_t triangles = 0;
    while (triangles < count && is_triangle(leaves[triangles].id))
        triangles++;
    return triangles;
}

static void write_places(const struct corner_reader *reader, uint32_t triangles, double unit,
                         struct bvh_corners *corners)
{
    for (unsigned row = 0; row < CORNER_ROWS; row++) {
        double base = (double)corners->base[row / 3];
        for (uint32_t i = 0; i < triangles; i++) {
            double place = (corner_place(reader, i, row % 3, row / 3) - base) / unit;
            corners->place[row * triangles + i] = (uint16_t)(place + 0.5);
        }
    }
}

uint32_t bvh_write_corners(const struct scene *scene, const double center[3],
                           struct bvh_leaf *leaves, uint32_t count)
{
    struct corner_reader reader = {scene, center, leaves};
    struct bvh_corners *corners = (void *)(leaves + count);
    uint32_t triangles = count_triangles(leaves, count);
    if (triangles == 0) return 0;
    double extent = 0, largest = 0;
    memset(corners, 0, corner_entries(triangles) * sizeof *leaves);
    for (unsigned axis = 0; axis < 3; axis++) {
        double low = INFINITE, high = -INFINITE;
        for (uint32_t i = 0; i < 3 * triangles; i++) {
            double place = corner_place(&reader, i / 3, i % 3, axis);
            low = smaller_number(low, place);
            high = larger_number(high, place);
        }
        corners->base[axis] = round_down(low);
        extent = larger_number(extent, high - (double)corners->base[axis]);
        largest = larger_number(largest, larger_number(fabs(low), fabs(high)) + fabs(center[axis]));
    }
    double unit = find_unit(extent, largest);
    corners->inverse = unit > 0 ? (float)(1 / unit) : NAN;
    if (unit > 0) write_places(&reader, triangles, unit, corners);
    return corner_entries(triangles);
}

/* ---- all leaves ---- */

/* The leaves of this many consecutive nodes, some thousand entries, are written by one thread. */
#define PART_NODES 256u

struct leaf_part {
    uint64_t entries;
    uint64_t room; /* with the quantized vertices, as a number of entries */
    uint64_t first;
};

struct leaf_writer {
    const struct bvh_input *input;
    struct bvh_node *nodes;
    uint32_t node_count;
    struct bvh_leaf *leaves;
    struct leaf_part *parts;
};

static uint32_t part_end(const struct leaf_writer *writer, uint32_t part)
{
    uint32_t begin = part * PART_NODES, left = writer->node_count - begin;
    return begin + (left < PART_NODES ? left : PART_NODES);
}

static void sort_by_id(struct item *items, uint32_t count)
{
    for (uint32_t i = 1; i < count; i++) {
        struct item item = items[i];
        uint32_t place = i;
        for (; place > 0 && items[place - 1].id > item.id; place--)
            items[place] = items[place - 1];
        items[place] = item;
    }
}

/* Sorts items by id and merges pieces of the same primitive into one item; returns how many are left. */
static uint32_t join_pieces(struct item *items, uint32_t count)
{
    uint32_t left = 0;
    sort_by_id(items, count);
    for (uint32_t i = 0; i < count; i++)
        if (i == 0 || items[i].id != items[i - 1].id) items[left++].id = items[i].id;
    return left;
}

static void measure_part(void *context, uint32_t iteration)
{
    struct leaf_writer *writer = context;
    struct leaf_part *part = &writer->parts[iteration];
    *part = (struct leaf_part){0, 0, 0};
    for (uint32_t n = iteration * PART_NODES; n < part_end(writer, iteration); n++) {
        struct bvh_node *node = &writer->nodes[n];
        for (unsigned slot = 0; slot < BVH_WIDTH; slot++) {
            if (node->count[slot] == 0) continue;
            struct item *items = writer->input->items + node->child[slot];
            uint32_t count = join_pieces(items, node->count[slot]), triangles = 0;
            while (triangles < count && is_triangle(items[triangles].id))
                triangles++;
            node->count[slot] = count;
            part->entries += count;
            part->room += count + (triangles > 0 ? corner_entries(triangles) : 0);
        }
    }
}

static void write_part(void *context, uint32_t iteration)
{
    const struct leaf_writer *writer = context;
    const struct bvh_input *input = writer->input;
    uint64_t place = writer->parts[iteration].first;
    for (uint32_t n = iteration * PART_NODES; n < part_end(writer, iteration); n++) {
        struct bvh_node *node = &writer->nodes[n];
        for (unsigned slot = 0; slot < BVH_WIDTH; slot++) {
            uint32_t count = node->count[slot];
            if (count == 0) continue;
            const struct item *items = input->items + node->child[slot];
            struct bvh_leaf *leaf = writer->leaves + place;
            for (uint32_t i = 0; i < count; i++)
                leaf[i] = bvh_leaf_of(input->scene, items[i].id);
            node->child[slot] = (uint32_t)place;
            place += count + bvh_write_corners(input->scene, input->center, leaf, count);
        }
    }
}

struct leaf_room bvh_write_leaves(const struct bvh_input *input, struct bvh_node *nodes,
                                  uint32_t node_count, struct bvh_leaf *leaves)
{
    uint32_t parts = divide_up(node_count, PART_NODES);
    struct leaf_writer writer = {input, nodes, node_count, leaves,
                                 allocate(parts, sizeof *writer.parts)};
    struct leaf_room all = {0, 0};
    thread_pool_for(input->pool, parts, measure_part, &writer);
    for (uint32_t i = 0; i < parts; i++) {
        writer.parts[i].first = all.room;
        all.entries += writer.parts[i].entries;
        all.room += writer.parts[i].room;
    }
    if (all.room > UINT32_MAX) fatal("the scene has more triangles than a tree can hold");
    thread_pool_for(input->pool, parts, write_part, &writer);
    free(writer.parts);
    return all;
}
