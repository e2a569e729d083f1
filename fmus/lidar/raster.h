/* What the rays of a scan hit first: exact intersection, kept by distance. */
#ifndef RASTER_H
#define RASTER_H
#include <stdint.h>

#include "outline.h"
#include "pattern.h"
#include "view.h"

#define NOTHING UINT32_MAX

/* The nearest hits, by azimuth, then channel. */
typedef struct {
    double *nearness; /* 1 / horizontal distance [1/m]; of the range where nothing is hit */
    uint32_t *face;   /* number in View.face, or NOTHING */
    /* Room for the tracing of one face: its edges, and where it begins and ends at each azimuth. */
    Edge *edge;
    double *lower, *upper, *crossing;
    size_t nearness_capacity, face_capacity, edge_capacity, lower_capacity, upper_capacity,
        crossing_capacity;
} Hits;

/* Trace all rays of a scan. An all-zero Hits is valid. Returns nonzero if memory is short. */
int trace(const View *, const Pattern *, Hits *hits);
void hits_clear(Hits *);

#endif
