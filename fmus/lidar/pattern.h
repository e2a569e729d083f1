/* The scan pattern: in which directions a sensor looks. The same for all sensors of a run. */
#ifndef PATTERN_H
#define PATTERN_H
#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint32_t channels, azimuths;
    double elevation_top, elevation_bottom; /* of the first and the last channel [rad] */
    double pitch, roll;                     /* of the mounted sensor [rad] */
    double range;                           /* [m] */
} PatternParameters;

/* Rays of one vertical plane, in the heading frame: origin at the sensor, x along the vehicle's
 * heading, z up. Their slopes (vertical over horizontal length) descend. */
typedef struct {
    double x, y;  /* horizontal unit vector of the plane */
    uint32_t bin; /* the azimuth bin that holds it */
    uint32_t count;
    const double *slope, *inverse_slope; /* tangent of the elevation; its inverse, 0 for 0 */
    const double *level, *rise;          /* horizontal and vertical part of the unit vector */
} Column;

typedef struct {
    PatternParameters parameters;
    /* Direction of azimuth a and channel k in the sensor frame:
     * (level[k] * azimuth_x[a], level[k] * azimuth_y[a], rise[k]). */
    double *azimuth_x, *azimuth_y, *level, *rise;
    /* The same rays in the heading frame, as columns. A level sensor has one column per azimuth,
     * all with the same elevations; each ray of a tilted sensor is a column of its own. */
    int tilted;
    uint32_t columns_per_azimuth, rays_per_column;
    double *column_x, *column_y;
    uint32_t *column_bin;
    double *column_slope, *column_inverse_slope, *column_level, *column_inverse_level,
        *column_rise;
    void *memory;
} Pattern;

/* Compute the tables for `parameters`, unless they are those in the pattern. An all-zero Pattern is
 * valid and empty. Returns nonzero if memory is short. */
int pattern_prepare(Pattern *, const PatternParameters *parameters);
void pattern_clear(Pattern *);

/* Index of a ray in column_slope, column_inverse_slope, column_level, ... */
static inline size_t pattern_ray(const Pattern *p, uint32_t azimuth, uint32_t channel) {
    return p->tilted ? (size_t)azimuth * p->parameters.channels + channel : channel;
}

/* Column number `column` of azimuth `azimuth`. */
Column pattern_column(const Pattern *, uint32_t azimuth, uint32_t column);

#endif
