/* What a shadow ray passes on its way: surfaces that transmit light. */
#ifndef FARM_WORKER_PASSAGES_H
#define FARM_WORKER_PASSAGES_H

#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/scene.h"
#include "worker/inlined.h"

/* The number of times that a ray crosses the surface of a transparent primitive. */
struct passage {
    uint32_t material, primitive;
    uint32_t crossings;
};

/* Most rays pass few transparent primitives; more of them move to the heap. */
#define INLINE_PASSAGES 16

/* The passages of one ray, in the order in which they were found; reused for the rays of a batch. */
struct passages {
    size_t count, capacity;
    struct passage *at; /* fixed; allocated if capacity is larger */
    struct passage fixed[INLINE_PASSAGES];
};

static inline void passages_begin(struct passages *passages)
{
    passages->count = 0;
    passages->capacity = INLINE_PASSAGES;
    passages->at = passages->fixed;
}

static inline void passages_end(struct passages *passages)
{
    if (passages->at != passages->fixed) free(passages->at);
}

static RARE void passages_grow(struct passages *passages)
{
    size_t capacity = 2 * passages->capacity;
    if (passages->at == passages->fixed) {
        passages->at = allocate(capacity, sizeof *passages->at);
        memcpy(passages->at, passages->fixed, sizeof passages->fixed);
    } else {
        passages->at = reallocate(passages->at, capacity, sizeof *passages->at);
    }
    passages->capacity = capacity;
}

static inline void passages_add(struct passages *passages, uint32_t material, uint32_t primitive,
                                uint32_t crossings)
{
    if (passages->count == passages->capacity) passages_grow(passages);
    passages->at[passages->count++] = (struct passage){material, primitive, crossings};
}

static inline int by_material(const void *a, const void *b)
{
    const struct passage *p = a, *q = b;
    if (p->material != q->material) return p->material < q->material ? -1 : 1;
    return (p->primitive > q->primitive) - (p->primitive < q->primitive);
}

/*
 * Insertion sort for the usual few passages, for which qsort() of the C library would take longer than the
 * rest of the filter.
 */
static inline void passages_sort(struct passages *passages)
{
    struct passage *at = passages->at;
    if (passages->count > INLINE_PASSAGES) {
        qsort(at, passages->count, sizeof *at, by_material);
        return;
    }
    for (size_t i = 1; i < passages->count; i++) {
        const struct passage next = at[i];
        size_t place = i;
        for (; place > 0 && by_material(&next, &at[place - 1]) < 0; place--)
            at[place] = at[place - 1];
        at[place] = next;
    }
}

/*
 * The product of the factors, always in the same order: the same bits for every tree. A primitive with pieces
 * in several leaves may have been found more than once.
 */
static inline struct vec3 passages_filter(struct passages *passages,
                                          const struct material *materials)
{
    struct vec3 light = vec3(1, 1, 1);
    passages_sort(passages);
    for (size_t i = 0; i < passages->count; i++) {
        const struct passage *passage = &passages->at[i];
        if (i > 0 && passage->primitive == passage[-1].primitive) continue;
        const struct material *material = &materials[passage->material];
        struct vec3 factor = vec_scale(material->color, material->transmission);
        for (uint32_t k = 0; k < passage->crossings; k++)
            light = vec_mul(light, factor);
    }
    return light;
}

/* The transmittance for a ray's passages; NULL: nothing is transparent. */
static inline struct vec3 transmittance_of(const struct scene *scene, struct passages *passages,
                                           bool blocked)
{
    if (blocked) return vec3(0, 0, 0);
    return passages ? passages_filter(passages, scene_materials(scene)) : vec3(1, 1, 1);
}

#endif
