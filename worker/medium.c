#include "worker/medium.h"

#include <stdlib.h>
#include <string.h>

#include "common/message.h"

/* A stack: its top medium, on another stack. */
struct medium {
    uint32_t below;  /* the stack below; MEDIUM_OUTSIDE: none */
    uint32_t object; /* a solid's primitive id; PRIMITIVE_NONE: identified by ior alone */
    double ior;
    uint32_t next; /* the next in the same hash chain */
};

struct media {
    const struct scene *scene;
    struct medium *stacks;    /* [0] is the world outside */
    uint32_t count, capacity; /* capacity: a power of two */
    uint32_t *heads;          /* heads of the hash chains, [capacity]; 0: empty */
    uint32_t *above;          /* scratch of take_out(), [room] */
    uint32_t room;            /* as many as the deepest stack so far has needed, or more */
};

#define FIRST_CAPACITY 64u

struct media *media_create(const struct scene *scene)
{
    struct media *media = allocate_zeroed(1, sizeof *media);
    media->scene = scene;
    media->capacity = FIRST_CAPACITY;
    media->stacks = allocate(media->capacity, sizeof *media->stacks);
    media->heads = allocate(media->capacity, sizeof *media->heads);
    media_clear(media);
    return media;
}

void media_destroy(struct media *media)
{
    if (!media) return;
    free(media->stacks);
    free(media->heads);
    free(media->above);
    free(media);
}

void media_clear(struct media *media)
{
    memset(media->heads, 0, (size_t)media->capacity * sizeof *media->heads);
    media->stacks[MEDIUM_OUTSIDE] = (struct medium){.object = PRIMITIVE_NONE, .ior = 1};
    media->count = 1;
}

const struct scene *media_scene(const struct media *media)
{
    return media->scene;
}

uint32_t media_count(const struct media *media)
{
    return media->count;
}

/* ---- equal stacks, equal numbers ---- */

static uint32_t *chain(struct media *media, uint32_t below, const struct medium *top)
{
    uint64_t bits;
    memcpy(&bits, &top->ior, sizeof bits);
    /* Multipliers: 2^64 / the golden ratio, and the first one of SplitMix64's finaliser. */
    bits = (bits ^ top->object) * UINT64_C(0x9e3779b97f4a7c15);
    bits = (bits ^ bits >> 29 ^ below) * UINT64_C(0xbf58476d1ce4e5b9);
    return &media->heads[(uint32_t)(bits >> 32) & (media->capacity - 1)];
}

static void link_stack(struct media *media, uint32_t index)
{
    struct medium *top = &media->stacks[index];
    uint32_t *head = chain(media, top->below, top);
    top->next = *head;
    *head = index;
}

static void enlarge(struct media *media)
{
    if (media->capacity > UINT32_MAX / 2) fatal("too many different stacks of media");
    media->capacity *= 2;
    media->stacks = reallocate(media->stacks, media->capacity, sizeof *media->stacks);
    media->heads = reallocate(media->heads, media->capacity, sizeof *media->heads);
    memset(media->heads, 0, (size_t)media->capacity * sizeof *media->heads);
    for (uint32_t i = 1; i < media->count; i++)
        link_stack(media, i);
}

static uint32_t push(struct media *media, uint32_t below, struct medium medium)
{
    for (uint32_t i = *chain(media, below, &medium); i != 0; i = media->stacks[i].next) {
        const struct medium *top = &media->stacks[i];
        if (top->below == below && top->object == medium.object && top->ior == medium.ior) return i;
    }
    if (media->count == media->capacity) enlarge(media);
    medium.below = below;
    media->stacks[media->count] = medium;
    link_stack(media, media->count);
    return media->count++;
}

/* ---- crossings ---- */

/* The topmost entry with this medium, or MEDIUM_OUTSIDE. */
static uint32_t find(const struct media *media, uint32_t stack, const struct medium *medium)
{
    for (; stack != MEDIUM_OUTSIDE; stack = media->stacks[stack].below) {
        const struct medium *top = &media->stacks[stack];
        if (top->object == medium->object && top->ior == medium->ior) break;
    }
    return stack;
}

static void make_room(struct media *media, uint32_t count)
{
    if (count < media->room) return;
    media->room = count ? 2 * count : 16;
    media->above = reallocate(media->above, media->room, sizeof *media->above);
}

/* The stack without the medium of entry `place`, which is part of it. */
static uint32_t take_out(struct media *media, uint32_t stack, uint32_t place)
{
    uint32_t rest = media->stacks[place].below, count = 0;
    for (uint32_t above = stack; above != place; above = media->stacks[above].below) {
        make_room(media, count);
        media->above[count++] = above;
    }
    /* Pushes the media above it again, from the lowest one up. */
    while (count > 0)
        rest = push(media, rest, media->stacks[media->above[--count]]);
    return rest;
}

static struct medium medium_of(const struct scene *scene, uint32_t primitive)
{
    const struct material *material = &scene_materials(scene)[primitive_material(scene, primitive)];
    return (struct medium){.object =
                               primitive_is_solid(scene, primitive) ? primitive : PRIMITIVE_NONE,
                           .ior = material->ior};
}

bool is_same_medium(const struct scene *scene, uint32_t a, uint32_t b)
{
    struct medium one = medium_of(scene, a), other = medium_of(scene, b);
    return one.object == other.object && one.ior == other.ior;
}

struct crossing_media media_cross(struct media *media, uint32_t stack, uint32_t primitive,
                                  bool entering)
{
    struct medium medium = medium_of(media->scene, primitive);
    uint32_t place = find(media, stack, &medium);
    bool inside = place != MEDIUM_OUTSIDE, solid = medium.object != PRIMITIVE_NONE;
    struct crossing_media crossing = {.from = media->stacks[stack].ior, .stack = stack};
    if (entering) {
        crossing.unmatched = solid && inside;
        if (!crossing.unmatched) crossing.stack = push(media, stack, medium);
    } else {
        crossing.unmatched = !inside;
        if (inside)
            crossing.stack = take_out(media, stack, place);
        else
            crossing.from = medium.ior;
    }
    crossing.to = media->stacks[crossing.stack].ior;
    return crossing;
}

struct crossing_media media_by_side(const struct scene *scene, uint32_t primitive, bool entering)
{
    double ior = medium_of(scene, primitive).ior;
    return (struct crossing_media){.from = entering ? 1 : ior, .to = entering ? ior : 1};
}
