#include "map.h"

#include <math.h>
#include <stdlib.h>

static int check_corner(const double *corners, const int32_t *building, size_t i,
                        Problem *problem) {
    for (size_t axis = 0; axis < 2; axis++)
        if (!isfinite(corners[2 * i + axis]))
            return fail(problem, "building.vertex[%zu, %zu] is %g", i, axis, corners[2 * i + axis]);
    if (building[i] < 0)
        return fail(problem, "building.index[%zu] is %ld, must be 0 or more", i,
                    (long)building[i]);
    if (i > 0 && building[i] < building[i - 1])
        return fail(problem, "building.index[%zu] is %ld after %ld; it must not descend", i,
                    (long)building[i], (long)building[i - 1]);
    return 0;
}

static Footprint footprint_of(const double *corners, size_t first, size_t end) {
    Footprint footprint = {.first = first, .count = end - first,
                           .low = {INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY}};
    for (size_t i = first; i < end; i++)
        for (int axis = 0; axis < 2; axis++) {
            double at = corners[2 * i + axis];
            if (at < footprint.low[axis]) footprint.low[axis] = at;
            if (at > footprint.high[axis]) footprint.high[axis] = at;
        }
    return footprint;
}

int map_open(Map *map, const double *corners, const int32_t *building, size_t count,
             Problem *problem) {
    map->corners = corners;
    map->count = map->near_count = 0;
    for (size_t first = 0, end; first < count; first = end) {
        for (end = first; end < count && building[end] == building[first]; end++)
            if (check_corner(corners, building, end, problem)) return 1;
        if (end < count && check_corner(corners, building, end, problem)) return 1;
        Footprint footprint = footprint_of(corners, first, end);
        if (footprint.low[0] == footprint.high[0] && footprint.low[1] == footprint.high[1])
            continue;
        if (reserve(&map->footprints, &map->capacity, map->count + 1, sizeof footprint, problem))
            return 1;
        map->footprints[map->count++] = footprint;
    }
    return 0;
}

int map_focus(Map *map, const double place[2], double range, Problem *problem) {
    map->near_count = 0;
    if (reserve(&map->near, &map->near_capacity, map->count, sizeof *map->near, problem)) return 1;
    for (size_t i = 0; i < map->count; i++) {
        const Footprint *footprint = &map->footprints[i];
        int is_near = 1;
        for (int axis = 0; axis < 2; axis++)
            is_near = is_near && footprint->low[axis] <= place[axis] + range
                      && footprint->high[axis] >= place[axis] - range;
        if (is_near) map->near[map->near_count++] = footprint;
    }
    return 0;
}

/* Even-odd rule, and the distance from the edges. */
static int is_in_or_at(const double *corners, size_t count, const double p[2], double margin) {
    int is_inside = 0;
    for (size_t i = 0, before = count - 1; i < count; before = i++) {
        const double *a = &corners[2 * before], *b = &corners[2 * i];
        double ab[2] = {b[0] - a[0], b[1] - a[1]}, ap[2] = {p[0] - a[0], p[1] - a[1]};
        double length2 = ab[0] * ab[0] + ab[1] * ab[1], dot = ab[0] * ap[0] + ab[1] * ap[1];
        double along = dot <= 0.0 ? 0.0 : dot >= length2 ? 1.0 : dot / length2;
        double x = ap[0] - along * ab[0], y = ap[1] - along * ab[1];
        if (x * x + y * y <= margin * margin) return 1;
        if ((a[1] > p[1]) != (b[1] > p[1]) && ap[0] < ap[1] * ab[0] / ab[1])
            is_inside = !is_inside;
    }
    return is_inside;
}

int map_covers(const Map *map, const double place[2], double margin) {
    for (size_t i = 0; i < map->near_count; i++) {
        const Footprint *footprint = map->near[i];
        if (place[0] < footprint->low[0] - margin || place[0] > footprint->high[0] + margin
            || place[1] < footprint->low[1] - margin || place[1] > footprint->high[1] + margin)
            continue;
        if (is_in_or_at(&map->corners[2 * footprint->first], footprint->count, place, margin))
            return 1;
    }
    return 0;
}

void map_free(Map *map) {
    free(map->footprints);
    free(map->near);
}
