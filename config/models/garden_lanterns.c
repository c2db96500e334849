/* The lanterns of the garden, of several sizes and styles. */
#include "config/models/garden.h"
#include "config/models/lantern.h"

/* The first one is lit: garden.ini has a light inside of it. */
static const struct standing {
    struct lantern lantern;
    double x, z, up, yaw, scale;
} lanterns[] = {
    {{LANTERN_YUKIMI, 0.23, 1, 0.25, true, false, 1001}, -2.35, 0.1, -0.02, 12, 1.05},
    {{LANTERN_KASUGA, 0.14, 1, 0.35, true, false, 1002}, -1.8, -4.8, -0.02, 20, 0.85},
    {{LANTERN_KASUGA, 0.17, 1.1, 0.5, false, false, 1003}, 3.95, -0.6, -0.02, -25, 0.72},
    {{LANTERN_YUKIMI, 0.14, 0.9, 0.4, true, false, 1004}, 1.45, -5.1, -0.02, 10, 0.9},
};

void add_lanterns(struct mesh *mesh)
{
    for (size_t i = 0; i < sizeof lanterns / sizeof lanterns[0]; i++) {
        const struct standing *s = &lanterns[i];
        struct mesh_transform t =
            transform_place(ground_point(s->x, s->z, s->up), s->yaw, s->scale);
        lantern_add(mesh, &s->lantern, &t);
    }
}
