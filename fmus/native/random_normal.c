#include "random_normal.h"

#include <math.h>

#include "portable_math.h"

/* AS 241: a rational function of the squared deviation near the median, and one of
 * sqrt(-log tail probability) in the tails. Beyond that root = 5 the tail is below 2^-32. */
static double tail_quantile(double p) {
    double root = sqrt(-natural_logarithm(p)), r = root - 1.6;
    double above = 1.4234372777e0
                   + r * (2.7568153900e0 + r * (1.3067284816e0 + r * 1.7023821103e-1));
    double below = 1.0 + r * (7.3700164250e-1 + r * 1.2021132975e-1);
    return above / below;
}

static double middle_quantile(double q) {
    double r = 0.180625 - q * q;
    double above = 3.3871327179e0
                   + r * (5.0434271938e1 + r * (1.5929113202e2 + r * 5.9109374720e1));
    double below = 1.0 + r * (1.7895169469e1 + r * (7.8757757664e1 + r * 6.7187563600e1));
    return q * above / below;
}

/* The probability in the middle of the interval. */
static double probability(uint32_t bits) {
    return ((double)bits + 0.5) * 0x1p-32;
}

/* The middle is |p - 1/2| <= 0.425: bits from here on, up to as many below 2^32. */
static const uint32_t MIDDLE = 322122547; /* 0.075 x 2^32 */

static int is_tail(uint32_t bits) {
    return bits - MIDDLE > UINT32_MAX - 2 * MIDDLE;
}

static double tail_normal(uint32_t bits) {
    double p = probability(bits);
    return p < 0.5 ? -tail_quantile(p) : tail_quantile(1.0 - p);
}

double standard_normal(uint32_t bits) {
    return is_tail(bits) ? tail_normal(bits) : middle_quantile(probability(bits) - 0.5);
}

/* A block of all as if they were in the middle, then the 15 % that are in the tails once more: no
 * loop has branches that depend on the data. */
void standard_normals(const uint32_t *bits, uint32_t count, double *normal) {
    enum { BLOCK = 64 };
    for (uint32_t first = 0; first < count; first += BLOCK) {
        uint32_t end = count - first < BLOCK ? count : first + BLOCK, tail[BLOCK], tails = 0;
        for (uint32_t i = first; i < end; i++)
            normal[i] = middle_quantile(probability(bits[i]) - 0.5);
        for (uint32_t i = first; i < end; i++) {
            tail[tails] = i;
            tails += is_tail(bits[i]);
        }
        for (uint32_t j = 0; j < tails; j++)
            normal[tail[j]] = tail_normal(bits[tail[j]]);
    }
}
