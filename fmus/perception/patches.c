#include "patches.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t direction_of(const double place[2]) {
    double sum = fabs(place[0]) + fabs(place[1]);
    if (!(sum > 0.0)) return 0;
    double along = place[1] / sum;
    if (place[0] < 0.0) along = (place[1] < 0.0 ? -2.0 : 2.0) - along;
    return (uint32_t)((along + 2.0) * (DIRECTIONS / 4.0)) % DIRECTIONS;
}

/* Whether a place is the one to keep of two: the nearer one, or the first in a total order. */
static int is_nearer(const double place[2], double range2, const Patch *patch) {
    if (range2 != patch->range2) return range2 < patch->range2;
    if (place[0] != patch->place[0]) return place[0] < patch->place[0];
    return place[1] < patch->place[1];
}

static double least(double a, double b) { return a < b ? a : b; }
static double most(double a, double b) { return a > b ? a : b; }

static void extend(Patch *patch, const ObstaclePoint *point, double range2) {
    patch->points++;
    for (int axis = 0; axis < 2; axis++) {
        double *side = &patch->side[2 * axis];
        side[0] = least(side[0], point->world[axis]);
        side[1] = most(side[1], point->world[axis]);
    }
    patch->height = most(patch->height, point->height);
    patch->foot = least(patch->foot, point->height);
    if (!is_nearer(point->place, range2, patch)) return;
    memcpy(patch->place, point->place, sizeof patch->place);
    patch->range2 = range2;
}

int patches_add(Patches *patches, const ObstaclePoint *point, uint32_t *index, Problem *problem) {
    const double *place = point->place;
    double range2 = place[0] * place[0] + place[1] * place[1];
    uint32_t direction = direction_of(place);
    uint32_t range = (uint32_t)(sqrt(range2) * (1.0 / RANGE_STEP));
    if (patches->count) { /* scans come ray by ray: mostly it is that of the last point */
        Patch *last = &patches->patches[patches->count - 1];
        if (last->direction == direction && last->range == range && last->label == point->label) {
            extend(last, point, range2);
            *index = (uint32_t)patches->count - 1;
            return 0;
        }
    }
    if (reserve(&patches->patches, &patches->capacity, patches->count + 1, sizeof(Patch), problem))
        return 1;
    *index = (uint32_t)patches->count;
    patches->patches[patches->count++] = (Patch){
        .direction = direction, .range = range, .label = point->label, .points = 1,
        .side = {point->world[0], point->world[0], point->world[1], point->world[1]},
        .place = {place[0], place[1]}, .range2 = range2, .height = point->height,
        .foot = point->height,
    };
    return 0;
}

/* ---- sorting -------------------------------------------------------------------------------- */

static uint32_t range_of(const Patch *patch) { return patch->range; }
static uint32_t direction_key(const Patch *patch) { return patch->direction; }

/* A stable counting sort of the indices in `from` into `to`. */
static void sort_by(uint32_t (*key)(const Patch *), uint32_t keys, const Patches *patches,
                    const uint32_t *from, uint32_t *to) {
    uint32_t start[RANGES + 1] = {0};
    for (size_t i = 0; i < patches->count; i++) start[key(&patches->patches[from[i]]) + 1]++;
    for (uint32_t k = 0; k < keys; k++) start[k + 1] += start[k];
    for (size_t i = 0; i < patches->count; i++)
        to[start[key(&patches->patches[from[i]])]++] = from[i];
}

static void join(Patch *patch, const Patch *other) {
    patch->points += other->points;
    for (int side = 0; side < SIDES; side++)
        patch->side[side] = side % 2 ? most(patch->side[side], other->side[side])
                                     : least(patch->side[side], other->side[side]);
    patch->height = most(patch->height, other->height);
    patch->foot = least(patch->foot, other->foot);
    if (!is_nearer(other->place, other->range2, patch)) return;
    memcpy(patch->place, other->place, sizeof patch->place);
    patch->range2 = other->range2;
}

static int make_room(Patches *patches, Problem *problem) {
    size_t count = patches->count;
    return reserve(&patches->sorted, &patches->sorted_capacity, count, sizeof(Patch), problem)
           || reserve(&patches->place, &patches->place_capacity, count, sizeof(uint32_t), problem)
           || reserve(&patches->order, &patches->order_capacity, count, sizeof(uint32_t), problem)
           || reserve(&patches->spare, &patches->spare_capacity, count, sizeof(uint32_t), problem);
}

int patches_sort(Patches *patches, Problem *problem) {
    patches->sorted_count = 0;
    memset(patches->first, 0, sizeof patches->first);
    if (patches->count == 0) return 0;
    if (make_room(patches, problem)) return 1;
    for (size_t i = 0; i < patches->count; i++) patches->order[i] = (uint32_t)i;
    sort_by(range_of, RANGES, patches, patches->order, patches->spare);
    sort_by(direction_key, DIRECTIONS, patches, patches->spare, patches->order);
    size_t count = 0;
    for (size_t i = 0; i < patches->count; i++) {
        const Patch *patch = &patches->patches[patches->order[i]];
        Patch *last = count ? &patches->sorted[count - 1] : NULL;
        if (last && last->direction == patch->direction && last->range == patch->range)
            join(last, patch);
        else {
            patches->sorted[count++] = *patch;
            patches->first[patch->direction + 1] = (uint32_t)count;
        }
        patches->place[patches->order[i]] = (uint32_t)count - 1;
    }
    for (uint32_t d = 0; d < DIRECTIONS; d++)
        if (patches->first[d + 1] < patches->first[d]) patches->first[d + 1] = patches->first[d];
    patches->sorted_count = count;
    return 0;
}

void patches_free(Patches *patches) {
    free(patches->patches);
    free(patches->sorted);
    free(patches->place);
    free(patches->order);
    free(patches->spare);
}
