/* Segmentation of a scan's patches into bodies, from geometry alone. */
#ifndef SEGMENTS_H
#define SEGMENTS_H
#include "neighbours.h"

/* Directions in which the extents of bodies are measured: half of them over the quadrant from 0 to
 * 90 degrees, the others at right angles to these. */
enum { QUADRANT = 16, EXTENTS = 2 * QUADRANT };

typedef struct {
    float low[EXTENTS], high[EXTENTS]; /* along each direction [m] */
    double height;                     /* of the highest point [m] */
} Shape;

typedef struct {
    Search search;
    uint32_t *shape_of; /* of each root: index into shapes */
    Shape *shapes;
    size_t shape_of_capacity, shape_count, shape_capacity;
    double axes[EXTENTS][2]; /* unit vectors */
} Segments;

#define NO_CLUSTER UINT32_MAX

/* Number the bodies of the sorted patches 0, 1, ... in the order of their first patches.
 * `is_static` says which patches belong to buildings, `sensor_height` where the sensor is [m]. On
 * success `cluster_of` (an element per patch) has the body of each, or NO_CLUSTER if it is of a
 * building or too large for a vehicle. */
int segments_find(Segments *, const SegmentSettings *, const Patches *, double sensor_height,
                  const uint8_t *is_static, uint32_t *cluster_of, size_t *clusters, Problem *);
void segments_free(Segments *);

#endif
