#include "view.h"

#include <math.h>
#include <string.h>

#include "memory.h"
#include "portable_math.h"

/* A corner closer than this to the sensor's z axis [m] has no azimuth; it is moved to azimuth 0. */
static const double AXIS_RADIUS = 1e-100;

/* A sensor nearer to the plane of a face than this [m] touches it, and is behind it: on which side
 * of it the sensor is, would be left to rounding. */
static const double TOUCHING = 1e-9;

/* Room for every face that the scene could have. */
static int reserve(View *view, const Scene *scene) {
    int failed = 0;
    size_t corners = scene->corner_count, longest = 1; /* of the rings; each begins a wall */
    if (corners > UINT32_MAX / 8)
        return 1;
    for (size_t i = 0; i < scene->count; i++)
        longest = scene->prism[i].count > longest ? scene->prism[i].count : longest;
    view->ring
        = with_room(view->ring, &view->ring_capacity, longest, 2 * sizeof *view->ring, &failed);
    view->face = with_room(view->face, &view->face_capacity, 1 + corners + 2 * scene->count,
                           sizeof *view->face, &failed);
    view->corner = with_room(view->corner, &view->corner_capacity, 2 * corners,
                             sizeof *view->corner, &failed);
    view->corner_of = with_room(view->corner_of, &view->corner_of_capacity, 6 * corners,
                                sizeof *view->corner_of, &failed);
    view->seen
        = with_room(view->seen, &view->seen_capacity, scene->count, sizeof *view->seen, &failed);
    return failed;
}

static int within_range(const Prism *prism, const Viewpoint *from, double range) {
    double x = prism->center[0] - from->position[0], y = prism->center[1] - from->position[1];
    double reach = range + prism->radius;
    return x * x + y * y <= reach * reach;
}

/* Square of the distance of the edge a - b from the origin. */
static double edge_distance_square(const double *a, const double *b) {
    double x = b[0] - a[0], y = b[1] - a[1], length_square = x * x + y * y;
    double along = length_square > 0.0 ? -(a[0] * x + a[1] * y) / length_square : 0.0;
    along = fmin(fmax(along, 0.0), 1.0);
    double px = a[0] + along * x, py = a[1] + along * y;
    return px * px + py * py;
}

/* A face with the given outward normal, a unit vector in the heading frame. */
static Face *add_face(View *view, const Pattern *pattern, const double *normal, double distance,
                      Surface surface) {
    Face *face = view->face + view->face_count++;
    for (int i = 0; i < 3; i++) {
        const double *turn = pattern->turn[i];
        double turned = turn[0] * normal[0] + turn[1] * normal[1] + turn[2] * normal[2];
        face->plane[i] = -turned / distance;
    }
    face->distance = distance;
    face->surface = surface;
    face->first = (uint32_t)view->corner_of_count;
    face->count = 0;
    face->convex = 1;
    return face;
}

static void add_corner(View *view, Face *face, size_t corner) {
    view->corner_of[view->corner_of_count++] = (uint32_t)corner;
    face->count++;
}

/* `a` and `b` are the ends of a wall in the heading frame, from left to right for who sees it from
 * outside; the numbers are those of its corners. */
static void add_wall(View *view, const Pattern *pattern, const Prism *prism, const double *a,
                     const double *b, const size_t *number) {
    double x = b[0] - a[0], y = b[1] - a[1], area = a[0] * y - a[1] * x;
    double range = pattern->parameters.range;
    double length = sqrt(x * x + y * y), distance = -area / length; /* NaN without a length */
    if (!(distance > TOUCHING) || edge_distance_square(a, b) > range * range)
        return;
    const double normal[3] = {y / length, -x / length, 0.0};
    Face *face = add_face(view, pattern, normal, distance, prism->surface);
    for (int i = 0; i < 4; i++)
        add_corner(view, face, number[i]);
}

/* The corner (x, y, z) of the heading frame. */
static Corner corner_at(const Pattern *pattern, double x, double y, double z) {
    const double(*turn)[3] = pattern->turn;
    Corner corner = {
        .x = turn[0][0] * x + turn[0][1] * y + turn[0][2] * z,
        .y = turn[1][0] * x + turn[1][1] * y + turn[1][2] * z,
        .z = turn[2][0] * x + turn[2][1] * y + turn[2][2] * z,
    };
    if (fabs(corner.x) < AXIS_RADIUS && fabs(corner.y) < AXIS_RADIUS) {
        corner.x = AXIS_RADIUS;
        corner.y = 0.0;
    }
    return corner;
}

/* The corners of a prism whose ring in the heading frame is in `view->ring`. */
static void add_corners(View *view, const Prism *prism, const Viewpoint *from,
                        const Pattern *pattern) {
    double low = prism->bottom - from->position[2], high = prism->top - from->position[2];
    Corner *bottom = view->corner + view->corner_count, *top = bottom + prism->count;
    view->seen[view->seen_count++] = (Seen){prism, (uint32_t)view->corner_count};
    view->corner_count += 2 * prism->count;
    for (size_t i = 0; i < prism->count; i++) {
        const double *at = view->ring + 2 * i;
        bottom[i] = corner_at(pattern, at[0], at[1], low);
        top[i] = corner_at(pattern, at[0], at[1], high);
        bottom[i].azimuth = pattern_azimuth(pattern, bottom[i].x, bottom[i].y);
        int same = top[i].x == bottom[i].x && top[i].y == bottom[i].y; /* a level sensor */
        top[i].azimuth = same ? bottom[i].azimuth : pattern_azimuth(pattern, top[i].x, top[i].y);
    }
}

static void add_prism(View *view, const Scene *scene, const Prism *prism, const Viewpoint *from,
                      const double *forward, const Pattern *pattern) {
    for (size_t i = 0; i < prism->count; i++) {
        const double *corner = scene->corner + 2 * (prism->first + i);
        double x = corner[0] - from->position[0], y = corner[1] - from->position[1];
        view->ring[2 * i] = forward[0] * x + forward[1] * y;
        view->ring[2 * i + 1] = forward[0] * y - forward[1] * x;
    }
    size_t bottom = view->corner_count, top = bottom + prism->count;
    add_corners(view, prism, from, pattern);
    for (size_t i = 0; i < prism->count; i++) {
        size_t j = i + 1 < prism->count ? i + 1 : 0;
        const size_t number[4] = {bottom + i, bottom + j, top + j, top + i};
        add_wall(view, pattern, prism, view->ring + 2 * i, view->ring + 2 * j, number);
    }
}

/* The top of a prism, if it is seen from above, and its bottom, if it is seen from below. */
static void add_caps(View *view, const Seen *seen, const Viewpoint *from,
                     const Pattern *pattern) {
    static const double UP[3] = {0.0, 0.0, 1.0}, DOWN[3] = {0.0, 0.0, -1.0};
    const Prism *prism = seen->prism;
    double above = from->position[2] - prism->top, below = prism->bottom - from->position[2];
    int convex = prism->owner != NO_OWNER; /* the boxes of vehicles are */
    if (above > TOUCHING) {
        Face *face = add_face(view, pattern, UP, above, prism->surface);
        face->convex = convex;
        for (size_t i = 0; i < prism->count; i++)
            add_corner(view, face, seen->first + prism->count + i);
    }
    if (below > TOUCHING) {
        Face *face = add_face(view, pattern, DOWN, below, prism->surface);
        face->convex = convex;
        for (size_t i = prism->count; i-- > 0;)
            add_corner(view, face, seen->first + i);
    }
}

int view_build(View *view, const Scene *scene, const Viewpoint *from, const Pattern *pattern) {
    static const double UP[3] = {0.0, 0.0, 1.0};
    if (reserve(view, scene))
        return 1;
    double forward[2];
    sine_cosine(from->heading, &forward[1], &forward[0]);
    view->face_count = view->corner_count = view->corner_of_count = view->seen_count = 0;
    double height = from->position[2]; /* from below the ground is not seen */
    add_face(view, pattern, UP, height > TOUCHING ? height : HUGE_VAL, GROUND_SURFACE);
    for (size_t p = 0; p < scene->count; p++) {
        const Prism *prism = scene->prism + p;
        if (prism->owner != from->vehicle && within_range(prism, from, pattern->parameters.range))
            add_prism(view, scene, prism, from, forward, pattern);
    }
    for (size_t i = 0; i < view->seen_count; i++)
        add_caps(view, view->seen + i, from, pattern);
    return 0;
}

void view_clear(View *view) {
    free(view->face);
    free(view->corner);
    free(view->corner_of);
    free(view->seen);
    free(view->ring);
    memset(view, 0, sizeof *view);
}
