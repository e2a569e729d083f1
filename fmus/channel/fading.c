#include "fading.h"
#include "portable_math.h"
#include "random.h"
#include <math.h>

double fading_bound(const Parameters *p) {
    return p->fading == FADING_NONE || p->fading_clipped ? 1 : LARGEST_FADE;
}

typedef struct { const Parameters *p; int64_t packet, receiver; uint8_t hop, attempt; } Stream;

/* The next pair of numbers of this frame and receiver. */
static Uniforms next(Stream *s) {
    return draw(s->p->seed, DRAW_FADING, s->packet, (uint16_t)(s->hop | s->attempt++ << 8),
                s->receiver);
}

/* Gamma distribution of shape m >= 1 and scale 1. One in 20 attempts fails; the last of 100 is
 * taken in any case. */
static double gamma_above_one(Stream *s, double m) {
    double d = m - 1.0 / 3, c = 1 / sqrt(9 * d);
    for (;;) {
        Uniforms a = next(s), b = next(s);
        /* Box-Muller: 1 - first is never 0 */
        double sine, cosine;
        sine_cosine(2 * PI * a.second, &sine, &cosine);
        double normal = sqrt(-2 * natural_logarithm(1 - a.first)) * cosine;
        double v = 1 + c * normal;
        if (s->attempt > 200) return d;
        if (v <= 0) continue;
        v = v * v * v;
        double u = 1 - b.first;
        double log_ratio = 0.5 * normal * normal + d * (1 - v + natural_logarithm(v));
        if (natural_logarithm(u) < log_ratio) return d * v;
    }
}

double fading_factor(const Parameters *p, double distance, int64_t packet, uint8_t hop,
                     int64_t receiver) {
    if (p->fading == FADING_NONE) return 1;
    double m = distance < p->fading_distance ? p->fading_near_m : p->fading_far_m;
    Stream s = {.p = p, .packet = packet, .receiver = receiver, .hop = hop};
    double factor;
    if (m >= 1) {
        factor = gamma_above_one(&s, m) / m;
    } else { /* of shape m + 1, times u^(1 / m) */
        double u = 1 - next(&s).first;
        factor = gamma_above_one(&s, m + 1) * power(u, 1 / m) / m;
    }
    return p->fading_clipped && factor > 1 ? 1 : fmin(factor, LARGEST_FADE);
}
