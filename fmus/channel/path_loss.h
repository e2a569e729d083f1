/* Mean loss over the distance, between isotropic antennas, as a gain (a factor of at most 1). */
#ifndef PATH_LOSS_H
#define PATH_LOSS_H
#include "parameters.h"

/* The gain falls no further than this: 3000 dB. It keeps its logarithm finite. */
#define LEAST_GAIN 1e-300

/* The model, prepared for many links. */
typedef struct {
    const Parameters *parameters;
    double at_one_metre[BANDS]; /* (lambda / (4 pi))^2, gain of free space at 1 m */
    int first, last;            /* bands to be computed; without band edges only the centre */
} PathLoss;

/* The way from antenna to antenna. */
typedef struct {
    double square;       /* of the distance [m2] */
    double plane_square; /* of its projection on the ground [m2] */
    double height[2];    /* of the antennas above the ground beneath [m] */
} Path;

PathLoss path_loss_prepare(const Parameters *);

/* Gain at each band.
 *
 * exponent:   (lambda / (4 pi))^2 d^-alpha, free space (ITU-R P.525-4, eq. 3) for alpha = 2;
 *             1 up to `lossless_distance` (Veins: 1 m, which makes a step of 48 dB there).
 * two-ray:    (lambda / (4 pi d_g))^2 |1 + Gamma exp(i phi)|^2 with the distance on the ground d_g,
 *             phi = 2 pi (d_los - d_ref) / lambda and the reflection of a horizontally polarised wave
 *             Gamma = (sin t - sqrt(eps - cos^2 t)) / (sin t + sqrt(eps - cos^2 t));
 *             C. Sommer, S. Joerer, F. Dressler, "On the applicability of two-ray path loss models
 *             for vehicular network simulation", VNC 2012, eqs. (4) to (10). The ground is flat:
 *             the heights are those above the ground beneath each antenna.
 * breakpoint: L1 + 10 alpha_1 log10 d before the breakpoint d_b, L2 + 10 alpha_2 log10 (d / d_b) from
 *             it on [dB]; not continuous unless the parameters make it so; 0 dB up to
 *             `lossless_distance`.
 *
 * All are far-field formulas. Cut off at 0 dB they stay finite down to coincident antennas, and in
 * the two-ray model also to antennas above each other and on the ground. */
void path_gains(const PathLoss *, const Path *, double gain[BANDS]);

/* No path that is longer on the ground than the root of `plane_square` has a higher gain at the
 * centre. A little too high rather than too low. */
double path_highest_gain(const PathLoss *, double plane_square);

#endif
