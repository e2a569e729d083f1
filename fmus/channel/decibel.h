/* Factors and decibels. */
#ifndef DECIBEL_H
#define DECIBEL_H
#include "portable_math.h"

#define LOG_10 2.302585092994045684

static inline double from_db(double db) { return exponential(db * (LOG_10 / 10)); }
static inline double to_db(double factor) { return natural_logarithm(factor) * (10 / LOG_10); }

#endif
