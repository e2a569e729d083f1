/* Random numbers by counter: a number depends on what it is for (seed, scan, vehicle, ray) and on
 * nothing else, so that a sensor's noise does not change with the traffic around it or with the
 * order in which sensors are computed. */
#ifndef RANDOM_H
#define RANDOM_H
#include <stdint.h>

/* The key of all random numbers of one scan of one sensor. */
uint64_t scan_key(int64_t seed, int64_t time, int64_t vehicle);

/* 64 random bits of one ray. */
uint64_t ray_bits(uint64_t key, uint32_t azimuth, uint32_t channel);

/* A number of the standard normal distribution from 32 random bits: the quantile of the middle of
 * the bits' 2^-32-wide interval (Wichura 1988, AS 241, routine PPND7: relative error 1e-7). */
double normal_quantile(uint32_t bits);

#endif
