/* Diffraction over a row of knife edges. */
#ifndef KNIFE_EDGE_H
#define KNIFE_EDGE_H
#include "parameters.h"
#include <math.h>
#include <stddef.h>
#include <stdint.h>

/* The profile of a link: `distance` from the transmitter [m], strictly ascending, and `height` [m]
 * of the transmitting antenna, `n - 2` edges and the receiving antenna. */
typedef struct { const double *distance, *height; size_t n; } Profile;

/* sqrt(factor / lambda) at each band, see knife_edges. */
typedef struct { double at[BANDS]; } EdgeScale;
EdgeScale edge_scale(const Parameters *);

/* A loss as a factor: `factor` HUGE_LOSS^`huge`, which no number of edges can carry out of range. */
typedef struct { double factor; uint32_t huge; } EdgeLoss;
#define HUGE_LOSS 1e200

static inline double edge_gain(EdgeLoss s) { return s.huge > 0 ? 0 : 1 / s.factor; }
double edge_loss_db(EdgeLoss);

/* Loss over one edge of diffraction parameter v, ITU-R P.526, "single knife-edge obstacle":
 *     J(v) = 6.9 + 20 log10(sqrt((v - 0.1)^2 + 1) + v - 0.1) dB,  0 dB for v <= -0.7,
 * as a factor on the power. */
static inline double knife_edge_loss(double v) {
    double u = v - 0.1, root = sqrt(u * u + 1) + u;
    return v > -0.7 ? 4.8977881936844614 * root * root : 1; /* 10^0.69 */
}

/* What the loss over a profile is made of, before the wavelength comes in. */
typedef struct {
    double *v; /* of each edge, divided by sqrt(factor / lambda) */
    size_t n;
    EdgeLoss spacing; /* C */
} Edges;

/* The edges of a profile that count: M. Boban, T. T. V. Vinhoza, M. Ferreira, J. Barros,
 * O. K. Tonguz, "Impact of vehicles as obstacles in vehicular ad hoc networks", IEEE JSAC 29(1),
 * 2011, after ITU-R P.526, "multiple isolated obstacles": a rope stretched over the profile touches
 * the major edges;
 *     L = sum J(majors) + sum J(highest edge in each gap) + C,
 *     C = -10 log10(prod s_i sum s_i / (s_1 s_N prod_{i=2..N} (s_{i-1} + s_i))) >= 0 dB,
 * with s_i the distances between neighbours of the rope, and
 *     v = h sqrt(factor / lambda (1 / d1 + 1 / d2)),
 * factor = 2 in P.526.
 * `edges->v` has room for 2 n numbers, `major` is scratch of n. The profile has at least its two
 * antennas. */
void knife_edges(const Profile *profile, uint32_t *major, Edges *edges);

/* Their loss at the wavelength of `scale`; at least 1. */
EdgeLoss edges_loss(const Edges *, double scale);

#endif
