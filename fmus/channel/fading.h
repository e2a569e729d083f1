/* Fast fading of the received power. */
#ifndef FADING_H
#define FADING_H
#include "parameters.h"

/* No draw amplifies more than this factor: the uniform numbers that make it have 53 bits, and the
 * shape m is at least 0.5. */
#define LARGEST_FADE 200.0

/* The largest factor by which fading can amplify. */
double fading_bound(const Parameters *);

/* The factor on the mean power of a frame at a receiver `distance` [m] away in the plane; 1 without
 * fading. Nakagami-m fading of the amplitude is a power of Gamma distribution with shape m and mean
 * 1 (M. Nakagami, "The m-distribution", 1960), drawn as by G. Marsaglia, W. W. Tsang, "A simple
 * method for generating gamma variables", ACM TOMS 26(3), 2000. Clipped at 1 with `fading_clipped`. */
double fading_factor(const Parameters *, double distance, int64_t packet, uint8_t hop,
                     int64_t receiver);

#endif
