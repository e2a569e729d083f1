/* Random numbers by counter: a number depends on what it is for (seed, scan, vehicle, ray) and on
 * nothing else, so that a sensor's noise does not change with the traffic around it or with the
 * order in which sensors are computed. */
#ifndef RANDOM_H
#define RANDOM_H
#include <stdint.h>

#include "random_normal.h"

/* The key of all random numbers of one scan of one sensor. */
static inline uint64_t scan_key(int64_t seed, int64_t time, int64_t vehicle) {
    uint64_t key = mixed_bits((uint64_t)seed + RANDOM_STRIDE);
    key = mixed_bits((key ^ (uint64_t)time) + RANDOM_STRIDE);
    return mixed_bits((key ^ (uint64_t)vehicle) + RANDOM_STRIDE);
}

/* 64 random bits of one ray. */
static inline uint64_t ray_bits(uint64_t key, uint32_t azimuth, uint32_t channel) {
    uint64_t ray = (uint64_t)azimuth << 32 | channel;
    return mixed_bits(key + (ray + 1) * RANDOM_STRIDE);
}

#endif
