/* Points as the sensor reports them: range noise, dropout and intensity. */
#ifndef CLOUD_H
#define CLOUD_H
#include <stdint.h>

#include "pattern.h"
#include "raster.h"
#include "records.h"
#include "view.h"

typedef struct {
    double range_noise; /* standard deviation [m] */
    double dropout;     /* probability that a hit is not reported */
} Noise;

/* The points of one azimuth's hits, in the order of the channels; returns their number, at most
 * that of the channels. `key` is the scan's (see random.h). */
uint32_t cloud_points(const View *, const Pattern *, const Hits *, uint32_t azimuth, const Noise *,
                      uint64_t key, Point *points);

#endif
