/* Factors and decibels. */
#ifndef DECIBEL_H
#define DECIBEL_H
#include "portable_math.h"
#include <stdint.h>
#include <string.h>

#define LOG_10 2.302585092994045684

static inline double from_db(double db) { return exponential(db * (LOG_10 / 10)); }
/* At least the decibels of a normal factor, by up to 3 dB more, without a logarithm. */
static inline double rough_db(double factor) {
    int64_t bits;
    memcpy(&bits, &factor, sizeof bits);
    return ((bits >> 52) - 1022) * 3.0102999566398121; /* factor < 2^n */
}
static inline double to_db(double factor) { return natural_logarithm(factor) * (10 / LOG_10); }

#endif
