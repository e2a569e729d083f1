/* The parts of random numbers by counter that units share: a mixer of bits and normal quantiles. */
#ifndef RANDOM_NORMAL_H
#define RANDOM_NORMAL_H
#include <stdint.h>

/* 2^64 / golden ratio: steps of a counter by it are far apart. */
#define RANDOM_STRIDE UINT64_C(0x9e3779b97f4a7c15)

/* A permutation of the 64-bit numbers in which every input bit moves about half of the output's:
 * the finaliser of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014; Stafford's variant 13). Here, so
 * that it becomes part of the loops that need it. */
static inline uint64_t mixed_bits(uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

/* A number of the standard normal distribution from 32 random bits: the quantile of the middle of
 * the bits' 2^-32-wide interval (Wichura 1988, AS 241, routine PPND7: relative error 1e-7). */
double standard_normal(uint32_t bits);

/* The same of each of `count` numbers, in a fraction of the time. */
void standard_normals(const uint32_t *bits, uint32_t count, double *normal);

#endif
