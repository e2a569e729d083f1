/* Patches: the points of one scan that lie in one direction at one range, the unit in which
 * obstacles are segmented. */
#ifndef PATCHES_H
#define PATCHES_H
#include "kernel.h"

/* The sides of a box around points, world frame. */
enum { X_MINIMUM, X_MAXIMUM, Y_MINIMUM, Y_MAXIMUM, SIDES };

/* Directions are counted along the perimeter of the unit diamond |x| + |y| = 1, which is monotonic
 * in the azimuth and cheaper than an arc tangent: steps of 0.11 to 0.22 degrees. */
enum { DIRECTIONS = 2048, RANGES = 8192 };
#define RANGE_STEP 0.25                /* [m] */
#define FARTHEST (RANGES * RANGE_STEP) /* [m] */
#define NARROWEST (4.0 / DIRECTIONS)   /* direction, at the axes [rad] */

typedef struct {
    uint32_t direction, range; /* counted */
    int32_t label;             /* of the points, if the scan is segmented by labels; else 0 */
    uint32_t points;
    double side[SIDES];        /* of the box around the points, world frame [m] */
    double place[2];           /* of the nearest point, levelled frame [m] */
    double range2;             /* its squared horizontal distance [m^2] */
    double height, foot;       /* of the highest and the lowest point above the ground [m] */
} Patch;

typedef struct {
    Patch *patches;  /* as they were met; several may have one direction and range */
    Patch *sorted;   /* by direction, then range; unique */
    uint32_t *place; /* of each of `patches` in `sorted` */
    uint32_t *order, *spare;
    size_t count, capacity, sorted_count, sorted_capacity, place_capacity, order_capacity,
        spare_capacity;
    uint32_t first[DIRECTIONS + 1]; /* of each direction in `sorted`, and the end */
} Patches;

/* One point of an obstacle. */
typedef struct {
    double place[2], world[2]; /* levelled and world frame [m] */
    double height;             /* above the ground [m] */
    int32_t label;
} ObstaclePoint;

/* Add a point nearer than FARTHEST; `*patch` is the index of its patch in `patches`. */
int patches_add(Patches *, const ObstaclePoint *, uint32_t *patch, Problem *);
/* Fill `sorted`, `place` and `first`; the order in which points were added has no influence on
 * `sorted`. */
int patches_sort(Patches *, Problem *);
void patches_free(Patches *);

#endif
