/* Functions whose results are the same bits on every machine: only +, -, * and /, which IEEE 754
 * rounds correctly. The C library's sin, cos, exp and log differ between libraries in
 * the last bit, and a recording's fingerprint would differ with them.
 *
 * Every file that computes coordinates includes this header for the pragma: a fused multiply-add
 * rounds once where the others round twice. */
#ifndef PORTABLE_MATH_H
#define PORTABLE_MATH_H

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#define PI 3.14159265358979323846

/* The largest argument of sine_cosine [rad]. */
#define ANGLE_LIMIT 1e6

/* Sine and cosine of `angle` [rad], |angle| <= ANGLE_LIMIT, with an error below 2 units in the last
 * place of 1. */
void sine_cosine(double angle, double *sine, double *cosine);

/* Natural logarithm of a normal `x` > 0; -INFINITY of 0. Relative error below 1e-15. */
double natural_logarithm(double x);

/* log(1 + x) for x > -1, with a relative error below 1e-15 also where x is small. */
double natural_logarithm_of_one_plus(double x);

/* e^x, with a relative error below 1e-15 |x| + 1e-15; 0 below -708, INFINITY above 709. */
double exponential(double x);

/* x^y of a normal `x` > 0, with a relative error below 1e-15 (1 + |y log x|). */
double power(double x, double y);

/* Complementary error function of x >= 0, with a relative error below 1e-15 (1 + x^2). */
double complementary_error(double x);

/* Angle of the vector (x, y) from the x axis [rad], in [-pi, pi]; 0 for (0, 0). */
double direction_angle(double y, double x);

#endif
