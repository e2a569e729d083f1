/* Diffraction over a row of knife edges. */
#ifndef KNIFE_EDGE_H
#define KNIFE_EDGE_H
#include <stddef.h>
#include <stdint.h>

/* The profile of a link: `distance` from the transmitter [m], strictly ascending, and `height` [m]
 * of the transmitting antenna, `n - 2` edges and the receiving antenna. */
typedef struct { const double *distance, *height; size_t n; } Profile;

/* Loss over one edge of diffraction parameter v [dB], ITU-R P.526, "single knife-edge obstacle":
 *     J(v) = 6.9 + 20 log10(sqrt((v - 0.1)^2 + 1) + v - 0.1),  0 for v <= -0.7. */
double knife_edge_db(double v);

/* Loss over all edges of the profile [dB]: M. Boban, T. T. V. Vinhoza, M. Ferreira, J. Barros,
 * O. K. Tonguz, "Impact of vehicles as obstacles in vehicular ad hoc networks", IEEE JSAC 29(1),
 * 2011, after ITU-R P.526, "multiple isolated obstacles": a rope stretched over the profile touches
 * the major edges;
 *     L = sum J(majors) + sum J(highest edge in each gap) + C,
 * C by `spacing_correction_db`.
 * `factor` under the root of v = h sqrt(factor / lambda (1 / d1 + 1 / d2)): 2 in P.526.
 * `major` is scratch of n numbers. The profile has at least its two antennas. */
double knife_edges_db(const Profile *profile, double wavelength, double factor, uint32_t *major);

#endif
