#include "worker/bvh_split.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "worker/bvh_cut.h"
#include "worker/shape.h"

/* ---- bins ---- */

/* Bins per axis: BINS_FEW for up to twice as many items, which are not worth more; else BINS_MAX. */
#define BINS_MAX 16
#define BINS_FEW 8

/* One axis. begin, end: weights of the items that begin and of those that end in a bin. */
struct bins {
    struct extent extent[BINS_MAX];
    uint32_t begin[BINS_MAX], end[BINS_MAX];
};

struct binning {
    unsigned count; /* number of bins in use */
    unsigned axis;  /* spatial split: the only one in use */
    float4 low, scale;
    struct bins axes[3];
};

/* Empty bins. Places on an axis, (x - low) * scale, are 0 .. count, in bins. The scale is 0 where [low, high] is a
 * point, or so short that its inverse overflows. */
static void place_bins(struct binning *binning, uint32_t items, float4 low, float4 high)
{
    binning->axis = 0;
    binning->count = items <= 2 * BINS_FEW ? BINS_FEW : BINS_MAX;
    binning->low = low;
    for (unsigned axis = 0; axis < 3; axis++) {
        float scale = (float)binning->count / (high[axis] - low[axis]);
        binning->scale[axis] = scale <= FLT_MAX ? scale : 0;
        struct bins *bins = &binning->axes[axis];
        for (unsigned b = 0; b < binning->count; b++) {
            bins->extent[b] = empty_extent();
            bins->begin[b] = bins->end[b] = 0;
        }
    }
    binning->low[3] = binning->scale[3] = 0;
}

/* Adds the items with indices in [begin, end) to bins. */
typedef void bin_items(const struct bvh_input *input, struct binning *binning, uint32_t begin,
                       uint32_t end);

/* Separate bins for the items of each iteration. */
struct bin_parts {
    const struct bvh_input *input;
    uint32_t begin, end, chunk; /* chunk: items of an iteration */
    bin_items *bin;
    struct binning *parts;
};

static void bin_part(void *context, uint32_t iteration)
{
    const struct bin_parts *all = context;
    uint32_t begin = all->begin + iteration * all->chunk;
    uint32_t end = begin + smaller(all->end - begin, all->chunk);
    all->bin(all->input, &all->parts[iteration], begin, end);
}

/* Adds minima, maxima and sums of integers: the result does not depend on the order. */
static void add_bins(struct binning *binning, const struct binning *more)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        struct bins *to = &binning->axes[axis];
        const struct bins *from = &more->axes[axis];
        for (unsigned b = 0; b < binning->count; b++) {
            extend(&to->extent[b], &from->extent[b]);
            to->begin[b] += from->begin[b];
            to->end[b] += from->end[b];
        }
    }
}

/* The most chunks of a range: each has bins of its own, 2 KB, which one thread adds up in the end. */
#define CHUNKS_MAX 1024u

/* Adds all items of a range to bins, which must be empty. chunk: how many are worth a thread. */
static void bin_range(const struct bvh_input *input, struct binning *binning,
                      const struct range *range, bin_items *bin, uint32_t chunk)
{
    uint32_t begin = range->first, end = begin + range->count;
    chunk = larger(chunk, divide_up(range->count, CHUNKS_MAX));
    uint32_t parts = divide_up(range->count, chunk);
    if (!input->pool || parts < 2) {
        bin(input, binning, begin, end);
        return;
    }
    struct bin_parts all = {input, begin, end, chunk, bin, allocate(parts, sizeof *all.parts)};
    for (uint32_t i = 0; i < parts; i++)
        all.parts[i] = *binning;
    thread_pool_for(input->pool, parts, bin_part, &all);
    for (uint32_t i = 0; i < parts; i++)
        add_bins(binning, &all.parts[i]);
    free(all.parts);
}

/* The cheapest border, the end of bin `last`; cost is infinite if there is none. */
struct border {
    unsigned last;
    double cost, overlap;
};

static inline bool is_empty_bin(const struct bins *bins, unsigned b)
{
    return bins->begin[b] == 0 && bins->end[b] == 0 &&
           bins->extent[b].min[0] > bins->extent[b].max[0];
}

/* Evaluates all borders of one axis: costs of right sides in a sweep from the right, of left ones from the left. Few
 * items leave most bins empty; a border behind an empty bin is as good as the one before. */
static struct border sweep_bins(const struct binning *binning, unsigned axis,
                                const uint32_t *right_weights)
{
    const struct bins *bins = &binning->axes[axis];
    const unsigned count = binning->count;
    struct extent rights[BINS_MAX + 1], left = empty_extent();
    double right_cost[BINS_MAX + 1];
    uint32_t right_weight = 0, left_weight = 0;
    struct border best = {0, INFINITE, 0};
    rights[count] = empty_extent();
    right_cost[count] = INFINITE;
    for (unsigned b = count - 1; b > 0; b--) {
        rights[b] = rights[b + 1];
        right_cost[b] = right_cost[b + 1];
        if (is_empty_bin(bins, b)) continue;
        extend(&rights[b], &bins->extent[b]);
        right_weight += right_weights[b];
        if (right_weight > 0) right_cost[b] = extent_half_area(&rights[b]) * cost_of(right_weight);
    }
    for (unsigned b = 0; b + 1 < count; b++) {
        if (is_empty_bin(bins, b)) continue;
        extend(&left, &bins->extent[b]);
        left_weight += bins->begin[b];
        if (left_weight == 0) continue;
        double cost = extent_half_area(&left) * cost_of(left_weight) + right_cost[b + 1];
        if (!(cost < best.cost)) continue;
        best = (struct border){b, cost, (double)left.max[axis] - (double)rights[b + 1].min[axis]};
    }
    return best;
}

/* ---- object split ---- */

static inline void add_to_bin(struct bins *bins, float place, const struct extent *extent,
                              uint32_t weight)
{
    unsigned b = (unsigned)(int)place;
    extend(&bins->extent[b], extent);
    bins->begin[b] += weight;
}

static void bin_by_center(const struct bvh_input *input, struct binning *binning, uint32_t begin,
                          uint32_t end)
{
    const struct item *items = input->items;
    const float4 low = binning->low, scale = binning->scale;
    const float4 last = all4((float)(binning->count - 1));
    for (uint32_t i = begin; i < end; i++) {
        struct extent extent = item_extent(&items[i]);
        float4 place = min4((half_center(&extent) - low) * scale, last);
        add_to_bin(&binning->axes[0], place[0], &extent, items[i].weight);
        add_to_bin(&binning->axes[1], place[1], &extent, items[i].weight);
        add_to_bin(&binning->axes[2], place[2], &extent, items[i].weight);
    }
}

struct split find_object_split(const struct bvh_input *input, const struct range *range)
{
    struct binning binning;
    struct split best = {.cost = INFINITE, .overlap = INFINITE};
    place_bins(&binning, range->count, range->centers.min, range->centers.max);
    bin_range(input, &binning, range, bin_by_center, CHUNK_ITEMS);
    for (unsigned axis = 0; axis < 3; axis++) {
        if (!(binning.scale[axis] > 0)) continue;
        struct border border = sweep_bins(&binning, axis, binning.axes[axis].begin);
        if (!(border.cost < best.cost)) continue;
        best = (struct split){.axis = axis,
                              .low = binning.low[axis],
                              .scale = binning.scale[axis],
                              .end = (float)(border.last + 1),
                              .cost = border.cost,
                              .overlap = border.overlap};
    }
    if (isinf(best.cost)) best.axis = longest_axis(&range->extent);
    return best;
}

/* ---- spatial split ---- */

static float border_at(const struct binning *binning, unsigned bin)
{
    return binning->low[binning->axis] + (float)bin / binning->scale[binning->axis];
}

static unsigned bin_at(const struct binning *binning, float x)
{
    float place = (x - binning->low[binning->axis]) * binning->scale[binning->axis];
    float last = (float)(binning->count - 1);
    return (unsigned)(int)(place < last ? place : last);
}

/* Cuts a triangle at the borders of the bins first .. last and adds the pieces to them. */
static void bin_pieces(const struct corners *corners, struct binning *binning,
                       const struct extent *extent, unsigned first, unsigned last)
{
    const unsigned axis = binning->axis;
    struct extent rest = *extent, left, right;
    for (unsigned b = first; b < last; b++) {
        if (!cut_triangle(corners, &rest, axis, border_at(binning, b + 1), &left, &right)) continue;
        extend(&binning->axes[axis].extent[b], &left);
        rest = right;
    }
    extend(&binning->axes[axis].extent[last], &rest);
}

static void bin_by_place(const struct bvh_input *input, struct binning *binning, uint32_t begin,
                         uint32_t end)
{
    struct bins *bins = &binning->axes[binning->axis];
    for (uint32_t i = begin; i < end; i++) {
        const struct item *item = &input->items[i];
        float low = item->min[binning->axis], high = item->max[binning->axis];
        /* what is no triangle goes into the bin of its centre as a whole */
        if (!is_triangle(item->id)) low = high = 2 * half_center_at(item, binning->axis);
        unsigned first = bin_at(binning, low), last = bin_at(binning, high);
        struct extent extent = item_extent(item);
        bins->begin[first] += item->weight;
        bins->end[last] += item->weight;
        if (first == last) {
            extend(&bins->extent[first], &extent);
        } else {
            struct corners corners = corners_of(input, item->id);
            bin_pieces(&corners, binning, &extent, first, last);
        }
    }
}

/* How many times as long as by its centre it takes to bin a triangle by its pieces: 4.5 to 6.5. */
#define CUTTING 5

struct split find_spatial_split(const struct bvh_input *input, const struct range *range,
                                const struct split *split)
{
    struct binning binning;
    place_bins(&binning, range->count, range->extent.min, range->extent.max);
    binning.axis = split->axis;
    if (!(binning.scale[split->axis] > 0)) return *split;
    bin_range(input, &binning, range, bin_by_place, CHUNK_ITEMS / CUTTING);
    struct border border = sweep_bins(&binning, split->axis, binning.axes[split->axis].end);
    if (!(border.cost < split->cost)) return *split;
    return (struct split){.axis = split->axis,
                          .spatial = true,
                          .plane = border_at(&binning, border.last + 1),
                          .cost = border.cost};
}

/* ---- dividing ---- */

void halve_range(const struct bvh_input *input, const struct range *range, struct range *left,
                 struct range *right)
{
    uint32_t middle = range->first + range->count / 2, end = range->first + range->count;
    *left = range_empty(range->first);
    for (uint32_t i = range->first; i < middle; i++)
        range_add(left, &input->items[i]);
    *right = range_empty(middle);
    right->room = range->room;
    for (uint32_t i = middle; i < end; i++)
        range_add(right, &input->items[i]);
}

static inline bool is_left(const struct item *item, const struct split *split)
{
    float place = half_center_at(item, split->axis);
    if (split->spatial) return place * 2 < split->plane;
    return (place - split->low) * split->scale < split->end;
}

/* Cuts the triangles across the plane in two as long as there is room; the right parts are added at the end. Returns
 * the number of items then. */
static uint32_t cut_items(const struct bvh_input *input, const struct range *range,
                          const struct split *split)
{
    uint32_t end = range->first + range->count, limit = end + range->room;
    for (uint32_t i = range->first; i < range->first + range->count && end < limit; i++) {
        struct item *item = &input->items[i];
        bool across =
            item->min[split->axis] < split->plane && item->max[split->axis] > split->plane;
        if (!across || !is_triangle(item->id)) continue;
        struct corners corners = corners_of(input, item->id);
        end += cut_item(&corners, item, split->axis, split->plane, &input->items[end]);
    }
    return end - range->first;
}

/* Divides the room in proportion to the numbers of items. Those on the right move up to make room for those on the
 * left. */
static void share_room(struct item *items, uint32_t room, struct range *left, struct range *right)
{
    uint64_t count = (uint64_t)left->count + right->count;
    left->room = (uint32_t)((uint64_t)room * left->count / count);
    right->room = room - left->room;
    uint32_t moved = left->room < right->count ? left->room : right->count;
    uint32_t first = right->first + left->room;
    memcpy(&items[first + right->count - moved], &items[right->first], moved * sizeof *items);
    right->first = first;
}

void split_range(const struct bvh_input *input, const struct range *range,
                 const struct split *split, struct range *left, struct range *right)
{
    if (isinf(split->cost)) {
        halve_range(input, range, left, right);
        return;
    }
    struct item *items = input->items;
    uint32_t count = split->spatial ? cut_items(input, range, split) : range->count;
    uint32_t begin = range->first, end = range->first + count;
    struct range sides[2] = {range_empty(begin), range_empty(begin)};
    for (;;) {
        for (; begin < end && is_left(&items[begin], split); begin++)
            range_add(&sides[0], &items[begin]);
        for (; begin < end && !is_left(&items[end - 1], split); end--)
            range_add(&sides[1], &items[end - 1]);
        if (begin == end) break;
        struct item item = items[begin];
        items[begin] = items[end - 1];
        items[end - 1] = item;
    }
    if (sides[0].count == 0 || sides[1].count == 0) {
        struct range all = sides[sides[0].count == 0];
        all.room = range->room - (count - range->count);
        halve_range(input, &all, left, right);
        return;
    }
    *left = sides[0];
    *right = sides[1];
    right->first = begin;
    share_room(items, range->room - (count - range->count), left, right);
}
