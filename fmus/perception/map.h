/* The map of buildings that a vehicle carries: what lies in or at one of them is no vehicle. */
#ifndef MAP_H
#define MAP_H
#include "kernel.h"

/* One building: a ring of corners, either sense, open. */
typedef struct {
    size_t first, count;  /* corners */
    double low[2], high[2]; /* [m] */
} Footprint;

typedef struct {
    const double *corners; /* world frame [m]; not ours */
    Footprint *footprints;
    const Footprint **near;
    size_t count, capacity, near_count, near_capacity;
} Map;

/* Read rings from `corners` and the building of each corner. Rings that are a single point are no
 * buildings: FMI wants arrays to start with an element. */
int map_open(Map *, const double *corners, const int32_t *building, size_t count, Problem *);
/* Keep for map_covers only what is within `range` of a place, in x or y. */
int map_focus(Map *, const double place[2], double range, Problem *);
/* Whether a place is inside a building, or within `margin` of one. */
int map_covers(const Map *, const double place[2], double margin);
void map_free(Map *);

#endif
