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

typedef struct {
    PatternParameters parameters;
    /* Direction of azimuth a and channel k in the sensor frame:
     * (level[k] * azimuth_x[a], level[k] * azimuth_y[a], rise[k]). The azimuths are there twice,
     * one turn after the other, so that no loop over some of them has to wrap around. */
    double *azimuth_x, *azimuth_y, *level, *rise;
    double *slope;     /* rise / level, descending; and NAN behind the last */
    double *farthest;  /* 1 / horizontal distance of the range [1/m] */
    double turn[3][3]; /* sensor frame <- heading frame (x along the vehicle's heading, z up) */
    /* Channels by slope: cell c = (slope[0] - slope) * cell_scale has `per_cell` channels at most,
     * and `before[c]` are in the cells before it. */
    uint32_t *before;
    uint32_t cells, per_cell;
    double cell_scale;
    void *memory;
} Pattern;

/* Compute the tables for `parameters`, unless they are those in the pattern. An all-zero Pattern is
 * valid and empty. Returns nonzero if memory is short. */
int pattern_prepare(Pattern *, const PatternParameters *parameters);
void pattern_clear(Pattern *);

/* Number of the azimuth at the direction (x, y), or the next one clockwise of it. */
uint32_t pattern_azimuth(const Pattern *, double x, double y);

static inline uint32_t pattern_cell(const Pattern *p, double slope) {
    double cell = (p->slope[0] - slope) * p->cell_scale, last = p->cells - 1;
    cell = cell > 0.0 ? cell : 0.0; /* also where NaN: 0 * infinity of one channel */
    return (uint32_t)(int32_t)(cell < last ? cell : last);
}

/* How many channels have a slope of `limit`, which may be infinite, or more. */
static inline uint32_t pattern_channels_from(const Pattern *p, double limit) {
    uint32_t k = p->before[pattern_cell(p, limit)];
    for (uint32_t i = 0; i < p->per_cell; i++)
        k += p->slope[k] >= limit;
    return k;
}

#endif
