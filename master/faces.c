#include "master/faces.h"

#include "common/message.h"

bool corners_have_area(struct vec3 a, struct vec3 b, struct vec3 c)
{
    struct vec3 ab = vec_sub(b, a), ac = vec_sub(c, a);
    /* The fast test, which nearly all of a mesh's faces pass. A cross product of 0 may also be an underflow. */
    struct vec3 cross = vec_cross(ab, ac);
    if (!vec_is_zero(cross)) return true;
    return !vec_is_zero(ab) && !vec_is_zero(ac) &&
           !vec_is_zero(vec_cross(vec_normalize(ab), vec_normalize(ac)));
}

/* Whether any triangle of a polygon has an area. */
static bool triangles_have_area(const struct vec3 *corners, const struct triangulation *triangles)
{
    for (size_t i = 0; i < triangles->count; i++) {
        const uint32_t *corner = triangles->triangles[i];
        if (corners_have_area(corners[corner[0]], corners[corner[1]], corners[corner[2]]))
            return true;
    }
    return false;
}

static void note(struct faces *faces, bool has_area, long line)
{
    faces->count++;
    if (has_area) return;
    if (faces->flat++ == 0) faces->first_flat = line;
}

void faces_note_triangle(struct faces *faces, const struct vec3 corners[3], long line)
{
    note(faces, corners_have_area(corners[0], corners[1], corners[2]), line);
}

void faces_note_polygon(struct faces *faces, const struct vec3 *corners,
                        const struct triangulation *triangles, const char *path, long line)
{
    if (triangles->improper && !faces->told_improper) {
        user_warning(path, line,
                     "a polygon crosses itself or is bent so far that its triangles overlap, "
                     "which may look wrong");
        faces->told_improper = true;
    }
    note(faces, triangles_have_area(corners, triangles), line);
}

void faces_warn_of_flat(const struct faces *faces, const char *path)
{
    if (faces->flat > 0)
        user_warning(path, faces->first_flat,
                     "faces without an area, whose corners lie on a line, are never seen: %llu of "
                     "%llu, the first one here",
                     (unsigned long long)faces->flat, (unsigned long long)faces->count);
}
