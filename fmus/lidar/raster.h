/* What the rays of one azimuth hit first: exact intersection, kept by distance. */
#ifndef RASTER_H
#define RASTER_H
#include <stdint.h>

#include "pattern.h"
#include "view.h"

/* The nearest hits of the rays of one azimuth, one entry per channel. */
typedef struct {
    double *distance;        /* horizontal [m]; where nothing is hit, that of the sensor's range */
    double *cosine;          /* of the angle of incidence, 0..1 */
    const Surface **surface; /* NULL where nothing is hit */
    size_t distance_capacity, cosine_capacity, surface_capacity;
} Hits;

/* Make room for `channels` entries. An all-zero Hits is valid. Returns nonzero if memory is short.
 */
int hits_reserve(Hits *, uint32_t channels);
void hits_clear(Hits *);

/* Trace the rays of azimuth number `azimuth`. The pointers in `hits` point into the view. */
void trace_azimuth(const View *, const Pattern *, uint32_t azimuth, Hits *hits);

#endif
