#include "portable_math.h"

#include <math.h>

/* pi/2 in two parts; the first has 33 bits, so that k * HALF_PI_HIGH is exact for k < 2^20. */
static const double HALF_PI_HIGH = 0x1.921fb544p+0;
static const double HALF_PI_LOW = 0x1.0b4611a626331p-34;

/* Taylor series; on [-pi/4, pi/4] the terms left out are below 5e-17. */
static double sine_series(double x) {
    double s = x * x;
    return x + x * s
                   * (-1.0 / 6
                      + s * (1.0 / 120
                             + s * (-1.0 / 5040
                                    + s * (1.0 / 362880
                                           + s * (-1.0 / 39916800
                                                  + s * (1.0 / 6227020800
                                                         - s / 1307674368000))))));
}

static double cosine_series(double x) {
    double s = x * x;
    return 1.0
           + s * (-1.0 / 2
                  + s * (1.0 / 24
                         + s * (-1.0 / 720
                                + s * (1.0 / 40320
                                       + s * (-1.0 / 3628800
                                              + s * (1.0 / 479001600
                                                     + s * (-1.0 / 87178291200
                                                            + s / 20922789888000)))))));
}

void sine_cosine(double angle, double *sine, double *cosine) {
    double k = floor(angle * (2.0 / PI) + 0.5);
    double rest = (angle - k * HALF_PI_HIGH) - k * HALF_PI_LOW;
    double s = sine_series(rest), c = cosine_series(rest);
    switch ((long)k & 3) {
    case 0: *sine = s, *cosine = c; break;
    case 1: *sine = c, *cosine = -s; break;
    case 2: *sine = -s, *cosine = -c; break;
    default: *sine = -c, *cosine = s; break;
    }
}

double natural_logarithm(double x) {
    int exponent;
    double m = frexp(x, &exponent); /* exact; m in [1/2, 1) */
    if (m < 0.70710678118654752) {
        m *= 2.0;
        exponent--;
    }
    /* log m = 2 artanh z with |z| < 0.172; the terms left out are below 2 z^13 / 13 = 2e-11 */
    double z = (m - 1.0) / (m + 1.0), s = z * z;
    double series
        = 1.0 + s * (1.0 / 3 + s * (1.0 / 5 + s * (1.0 / 7 + s * (1.0 / 9 + s / 11))));
    return exponent * 0.69314718055994530942 + 2.0 * z * series;
}
