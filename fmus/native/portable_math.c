#include "portable_math.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

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

/* sum of c[k] x^k over the `n` coefficients, an even number up to 32: pairs of terms, pairs of pairs
 * and so on (G. Estrin, 1960), which a processor calculates side by side. */
static inline double polynomial(const double *c, int n, double x) {
    double sum[16];
    int count = n / 2;
    for (int k = 0; k < count; k++) sum[k] = c[2 * k] + c[2 * k + 1] * x;
    while (count > 1) {
        x *= x;
        int pairs = count / 2;
        for (int k = 0; k < pairs; k++) sum[k] = sum[2 * k] + sum[2 * k + 1] * x;
        if (count % 2) sum[pairs] = sum[count - 1];
        count = pairs + count % 2;
    }
    return sum[0];
}

static const int64_t HALF_ROOT = 0x3FE6A09E667F3BCD; /* bits of 1 / sqrt 2 */
static const double LOG_2_HIGH = 0x1.62e42feep-1; /* 32 bits: exact times any exponent */
static const double LOG_2_LOW = 0x1.a39ef35793c76p-33;

double natural_logarithm(double x) {
    if (x == 0) return -INFINITY;
    int64_t bits; /* x = 2^exponent m with m in [1/sqrt 2, sqrt 2) */
    memcpy(&bits, &x, sizeof bits);
    int64_t exponent = (bits - HALF_ROOT) >> 52;
    bits -= exponent * (INT64_C(1) << 52);
    double m;
    memcpy(&m, &bits, sizeof m);
    /* log m = 2 artanh z with |z| < 0.172; the terms left out are below 2 z^25 / 25 = 6e-21 */
    static const double C[12] = {0,        1.0 / 3,  1.0 / 5,  1.0 / 7,  1.0 / 9,  1.0 / 11,
                                 1.0 / 13, 1.0 / 15, 1.0 / 17, 1.0 / 19, 1.0 / 21, 1.0 / 23};
    double z = (m - 1.0) / (m + 1.0), series = polynomial(C, 12, z * z);
    double e = (double)exponent;
    return e * LOG_2_HIGH + (2.0 * z + (2.0 * z * series + e * LOG_2_LOW));
}

/* W. Kahan: the error of 1 + x cancels in the quotient. */
double natural_logarithm_of_one_plus(double x) {
    double u = 1.0 + x;
    return u == 1.0 ? x : natural_logarithm(u) * (x / (u - 1.0));
}

double exponential(double x) {
    if (x < -708.0) return 0.0;
    if (x > 709.0) return INFINITY;
    double k = floor(x * 1.4426950408889634074 + 0.5);
    double r = (x - k * LOG_2_HIGH) - k * LOG_2_LOW; /* |r| < 0.347 */
    /* Taylor series; the terms left out are below r^14 / 14! = 5e-18 */
    static const double C[14] = {
        0,         1.0,        1.0 / 2,     1.0 / 6,      1.0 / 24,       1.0 / 120,       1.0 / 720,
        1.0 / 5040, 1.0 / 40320, 1.0 / 362880, 1.0 / 3628800, 1.0 / 39916800, 1.0 / 479001600,
        1.0 / 6227020800,
    };
    int64_t bits = ((int64_t)k + 1023) << 52; /* 2^k */
    double scale;
    memcpy(&scale, &bits, sizeof scale);
    return scale * (1.0 + polynomial(C, 14, r));
}

double power(double x, double y) { return exponential(y * natural_logarithm(x)); }

/* erfc x = t exp(P(2 t - 1) - x^2) with t = 2 / (2 + x); P is the Chebyshev series of the 60 nodes,
 * calculated with 60 digits; the terms left out are below 3e-17. */
double complementary_error(double x) {
    static const double C[28] = {
        -6.71794084056692266e-1, 6.7264322397765672764e-1, 4.7343306841904428319e-2, -4.6895610231175296479e-2,
        -9.8726893663899585729e-3, 8.824938557060623171e-3, 1.7589335577990160867e-3, -2.3458125004828533504e-3,
        -1.4624686337800336423e-4, 6.7367879558023495912e-4, -9.3735031170981704879e-5, -1.7430294720307621998e-4,
        7.14010141275703064e-5, 3.1745179749437403869e-5, -3.0187884551394244299e-5, 1.3772664134464418368e-7,
        8.562623420121285649e-6, -2.9479868769982592501e-6, -1.27231190486886998e-6, 1.2500276612569753517e-6,
        -1.6849800720653297471e-7, -2.4958327617196670135e-7, 1.5334345920908176839e-7, 1.444865804625267546e-9,
        -3.9171820510271858252e-8, 1.1172352263623757873e-8, 4.0608821469697202197e-9, -1.8902306008944536579e-9,
    };
    double t = 2.0 / (2.0 + x), p = polynomial(C, 28, 2.0 * t - 1.0);
    return t * exponential(p - x * x);
}

/* Arc tangent of q in [0, 1]: subtract the nearest of four angles, then a Taylor series whose terms
 * left out are below 0.126^19 / 19 = 4e-19. */
static double arc_tangent(double q) {
    static const double TANGENT[] = {0.0, 0.25, 0.5, 0.75, 1.0};
    static const double ANGLE[] = {0.0, 0.24497866312686415417, 0.46364760900080611621,
                                   0.64350110879328438680, 0.78539816339744830962};
    int k = (int)(4.0 * q + 0.5);
    double z = (q - TANGENT[k]) / (1.0 + q * TANGENT[k]), s = z * z;
    double series = 1.0
        - s * (1.0 / 3
               - s * (1.0 / 5
                      - s * (1.0 / 7
                             - s * (1.0 / 9
                                    - s * (1.0 / 11
                                           - s * (1.0 / 13 - s * (1.0 / 15 - s / 17)))))));
    return ANGLE[k] + z * series;
}

double direction_angle(double y, double x) {
    double a = fabs(x), b = fabs(y);
    if (a == 0 && b == 0) return 0;
    double angle = b <= a ? arc_tangent(b / a) : PI / 2 - arc_tangent(a / b);
    if (x < 0) angle = PI - angle;
    return y < 0 ? -angle : angle;
}
