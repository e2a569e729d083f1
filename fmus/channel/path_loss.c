#include "path_loss.h"
#include "decibel.h"
#include "geometry.h"
#include <math.h>

PathLoss path_loss_prepare(const Parameters *p) {
    PathLoss s = {.parameters = p, .first = p->band_edges ? 0 : CENTER,
                  .last = p->band_edges ? BANDS - 1 : CENTER};
    for (int band = 0; band < BANDS; band++) {
        double root = p->wavelength[band] / (4 * PI);
        s.at_one_metre[band] = root * root;
    }
    return s;
}

static double limited(double gain) { return larger(smaller(gain, 1), LEAST_GAIN); }

static bool is_lossless(const Parameters *p, double square) {
    return square <= p->lossless_distance * p->lossless_distance || square < 1e-200;
}

static void exponent_gains(const PathLoss *s, const Path *path, double gain[BANDS]) {
    const Parameters *p = s->parameters;
    double spread = is_lossless(p, path->square) ? INFINITY
        : p->path_loss_exponent == 2 ? 1 / path->square
                                     : power(path->square, -p->path_loss_exponent / 2);
    for (int k = 0; k < BANDS; k++) gain[k] = limited(s->at_one_metre[k] * spread);
}

/* Reflection coefficient of the ground under the grazing angle of this sine and cosine. */
static double reflection(double permittivity, double sine, double cosine) {
    double root = sqrt(larger(permittivity - cosine * cosine, 0)), sum = sine + root;
    return sum > 0 ? (sine - root) / sum : 0; /* 0 / 0: the ground is air, nothing is reflected */
}

static void two_ray_gains(const PathLoss *s, const Path *path, double gain[BANDS]) {
    const Parameters *p = s->parameters;
    double square = path->plane_square;
    if (!(square > 0)) { /* above each other: no angle, no excess */
        for (int k = s->first; k <= s->last; k++) gain[k] = 1;
        return;
    }
    double low = path->height[0] - path->height[1], high = path->height[0] + path->height[1];
    double direct = sqrt(square + low * low), reflected = sqrt(square + high * high);
    double excess = 4 * path->height[0] * path->height[1] / (reflected + direct);
    double gamma = reflection(p->permittivity, high / reflected, sqrt(square) / reflected);
    for (int k = s->first; k <= s->last; k++) {
        double sine, cosine, turns = excess / p->wavelength[k];
        sine_cosine(2 * PI * (turns - floor(turns)), &sine, &cosine);
        double sum = 1 + gamma * gamma + 2 * gamma * cosine;
        gain[k] = limited(s->at_one_metre[k] * sum / square);
    }
}

static void breakpoint_gains(const PathLoss *s, const Path *path, double gain[BANDS]) {
    const Parameters *p = s->parameters;
    double at = p->breakpoint_distance, factor = 1;
    if (!is_lossless(p, path->square)) {
        bool is_near = path->square < at * at;
        double loss_db = is_near ? p->breakpoint_near_loss_db : p->breakpoint_far_loss_db;
        double exponent = is_near ? p->path_loss_exponent : p->breakpoint_far_exponent;
        double ratio = is_near ? path->square : path->square / (at * at);
        factor = limited(from_db(-loss_db) * power(ratio, -exponent / 2));
    }
    for (int k = s->first; k <= s->last; k++) gain[k] = factor;
}

void path_gains(const PathLoss *s, const Path *path, double gain[BANDS]) {
    switch (s->parameters->path_loss) {
    case PATH_LOSS_TWO_RAY: two_ray_gains(s, path, gain); break;
    case PATH_LOSS_BREAKPOINT: breakpoint_gains(s, path, gain); break;
    case PATH_LOSS_EXPONENT: exponent_gains(s, path, gain); break;
    }
    if (s->first == s->last) gain[0] = gain[2] = gain[CENTER];
}

double path_highest_gain(const PathLoss *s, double plane_square) {
    const Parameters *p = s->parameters;
    /* all models but two rays fall with the distance, two rays at best add up */
    Path path = {.square = plane_square, .plane_square = plane_square};
    double gain[BANDS];
    switch (p->path_loss) {
    case PATH_LOSS_EXPONENT: exponent_gains(s, &path, gain); break;
    case PATH_LOSS_TWO_RAY:
        gain[CENTER] = smaller(4 * s->at_one_metre[CENTER] / plane_square, 1);
        break;
    case PATH_LOSS_BREAKPOINT: {
        double at = p->breakpoint_distance * p->breakpoint_distance, beyond[BANDS];
        breakpoint_gains(s, &path, gain);
        path.square = larger(plane_square, at); /* there the gain may leap */
        breakpoint_gains(s, &path, beyond);
        gain[CENTER] = larger(gain[CENTER], beyond[CENTER]);
        break;
    }
    default: return 1;
    }
    return gain[CENTER] * (1 + 1e-9);
}
