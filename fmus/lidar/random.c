#include "random.h"

#include <math.h>

#include "portable_math.h"

static const uint64_t GOLDEN = 0x9e3779b97f4a7c15u; /* 2^64 / golden ratio */

/* The finaliser of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014; Stafford's variant 13). */
static uint64_t mix(uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

uint64_t scan_key(int64_t seed, int64_t time, int64_t vehicle) {
    uint64_t key = mix((uint64_t)seed + GOLDEN);
    key = mix((key ^ (uint64_t)time) + GOLDEN);
    return mix((key ^ (uint64_t)vehicle) + GOLDEN);
}

uint64_t ray_bits(uint64_t key, uint32_t azimuth, uint32_t channel) {
    uint64_t ray = (uint64_t)azimuth << 32 | channel;
    return mix(key + (ray + 1) * GOLDEN);
}

/* AS 241: a rational function of the squared deviation near the median, and one of
 * sqrt(-log tail probability) in the tails. Beyond that root = 5 the tail is below 2^-32. */
static double tail_quantile(double p) {
    double root = sqrt(-natural_logarithm(p)), r = root - 1.6;
    double above = 1.4234372777e0
                   + r * (2.7568153900e0 + r * (1.3067284816e0 + r * 1.7023821103e-1));
    double below = 1.0 + r * (7.3700164250e-1 + r * 1.2021132975e-1);
    return above / below;
}

double normal_quantile(uint32_t bits) {
    double p = ((double)bits + 0.5) * 0x1p-32, q = p - 0.5;
    if (q < -0.425)
        return -tail_quantile(p);
    if (q > 0.425)
        return tail_quantile(1.0 - p);
    double r = 0.180625 - q * q;
    double above = 3.3871327179e0
                   + r * (5.0434271938e1 + r * (1.5929113202e2 + r * 5.9109374720e1));
    double below = 1.0 + r * (1.7895169469e1 + r * (7.8757757664e1 + r * 6.7187563600e1));
    return q * above / below;
}
