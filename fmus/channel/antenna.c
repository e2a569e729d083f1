#include "antenna.h"
#include <math.h>

double pattern_gain_db(const double *gain_db, size_t n, double azimuth) {
    double turns = azimuth / (2 * PI), at = (turns - floor(turns)) * (double)n;
    double below = floor(at), share = at - below;
    size_t k = (size_t)below % n; /* `at` may round up to n */
    return gain_db[k] * (1 - share) + gain_db[(k + 1) % n] * share;
}

static double gain_towards(const Parameters *p, const Antenna *a, const Antenna *b) {
    double direction = direction_angle(b->at.y - a->at.y, b->at.x - a->at.x);
    return pattern_gain_db(p->antenna_gain_db, p->antenna_gains, direction - a->heading);
}

double antennas_gain_db(const Parameters *p, const Antenna *a, const Antenna *b) {
    if (p->antenna_gains == 1) return 2 * p->antenna_gain_db[0];
    return gain_towards(p, a, b) + gain_towards(p, b, a);
}
