#include "gap.h"
#include <math.h>

static double shortest_between(const Area *a, const Area *b) {
    double square = 0;
    for (int k = 0; k < 2; k++) {
        double gap = fabs(a->center[k] - b->center[k]) - a->half[k] - b->half[k];
        if (gap > 0) square += gap * gap;
    }
    return sqrt(square) * (1 - 1e-9);
}

Gap gap_between(const Area *a, const Area *b, double top) {
    return (Gap){a, b, top, shortest_between(a, b), 1};
}

/* A little less than exp(x) for x >= 0, and without a call. */
static double lower_exponential(double x) { return 1 + x * (1 + x * (0.5 + x * (1 / 6.1 + x / 24.1))); }

bool gap_meets(Gap *gap, const Scene *s, const Propagation *m, uint32_t k) {
    Cover cover = building_cover(&s->buildings, k, gap->a, gap->b);
    if (cover.is_clear) return false;
    if (m->parameters->finite_buildings && s->buildings.height[k] <= gap->top) return true;
    double nepers = cover.inside * gap->shortest * m->indoor_nepers;
    if (nepers > 0) gap->loss *= lower_exponential(nepers);
    if (cover.is_hidden) gap->loss *= m->two_walls;
    return true;
}
