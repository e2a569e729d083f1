/* Where the ego vehicle sees too little: filter windows over its own matrix. */
#ifndef BLIND_ZONE_H
#define BLIND_ZONE_H
#include "region.h"

typedef struct {
    uint32_t window_smallest, window_largest; /* sides in cells: smallest, twice it, ... */
    double threshold;                         /* T1, mean index per cell */
    uint32_t threshold_exponent;
    double threshold_distance;                /* [m] */
    double region_share;                      /* least share of a window in the region */
    double overlap;                           /* share of a window */
} ZoneSettings;

/* A square parallel to the matrix. */
typedef struct {
    double center[2]; /* matrix frame: origin in its centre, x along its heading, y left [m] */
    double range;     /* half the side [m] */
    double importance; /* apparent size: range / (range + distance from the sensor) */
    uint32_t row, column, size; /* its cells: the rear right one and their number along a side */
} Zone;

/* A window that is blind. */
typedef struct {
    uint32_t row, column, size;
    uint64_t inside; /* its sub-cells in the region */
    double index;    /* mean over these */
    double distance; /* of its centre from the sensor [m] */
} Window;

typedef struct {
    Zone *zones; /* most important first */
    Window *windows;
    uint64_t *points, *inside; /* integral images, (rows + 1) x (columns + 1) */
    uint8_t *is_covered;       /* cells of accepted windows */
    size_t count, capacity, window_count, window_capacity, points_capacity, inside_capacity,
        covered_capacity;
} Zones;

/* Replace the contents of `zones` by the blind zones of a scan in a region. */
int zones_find(Zones *, const ZoneSettings *, const ScanSettings *, const Scan *, const Region *,
               Problem *);
void zones_free(Zones *);

#endif
