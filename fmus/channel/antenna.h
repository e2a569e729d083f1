/* Antennas and their pattern. */
#ifndef ANTENNA_H
#define ANTENNA_H
#include "geometry.h"
#include "parameters.h"

/* One end of a link. */
typedef struct {
    Position at;
    double height;  /* above the ground beneath [m] */
    double heading; /* of the carrier [rad] */
    size_t body;    /* of the carrier in `Bodies`, or NO_BODY */
} Antenna;

/* Gain of the pattern at `azimuth` [rad] from the heading on, counter-clockwise, by linear
 * interpolation in dB between the `n` equally spaced samples. */
double pattern_gain_db(const double *gain_db, size_t n, double azimuth);

/* Gain of both antennas of a link together; one sample needs no direction. Where an antenna stands
 * exactly above the other the link leaves in the direction of the x axis. */
double antennas_gain_db(const Parameters *, const Antenna *a, const Antenna *b);

#endif
