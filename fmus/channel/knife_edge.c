#include "knife_edge.h"
#include "decibel.h"
#include <math.h>

EdgeScale edge_scale(const Parameters *p) {
    EdgeScale s;
    for (int k = 0; k < BANDS; k++) s.at[k] = sqrt(p->knife_edge_factor / p->wavelength[k]);
    return s;
}

double edge_loss_db(EdgeLoss s) { return to_db(s.factor) + s.huge * to_db(HUGE_LOSS); }

static void attenuate(EdgeLoss *s, double loss) {
    s->factor *= loss;
    if (s->factor > HUGE_LOSS) s->factor /= HUGE_LOSS, s->huge++;
}

EdgeLoss edges_loss(const Edges *e, double scale) {
    EdgeLoss s = e->spacing;
    for (size_t k = 0; k < e->n; k++) attenuate(&s, knife_edge_loss(e->v[k] * scale));
    return s;
}

/* Height of edge o over the straight line from point a to point b of the profile [m]. */
static double height_over_line(const Profile *p, size_t a, size_t o, size_t b) {
    double rise = p->height[b] - p->height[a], d = p->distance[b] - p->distance[a];
    return p->height[o] - (p->height[a] + rise * (p->distance[o] - p->distance[a]) / d);
}

/* Add edge o between points a and b. */
static void add_edge(Edges *s, const Profile *p, size_t a, size_t o, size_t b) {
    double d1 = p->distance[o] - p->distance[a], d2 = p->distance[b] - p->distance[o];
    s->v[s->n++] = height_over_line(p, a, o, b) * sqrt((d1 + d2) / (d1 * d2));
}

/* The points that a rope stretched from the first to the last point touches, both included, also
 * where it is straight: the upper hull. */
static size_t stretch_rope(const Profile *p, uint32_t *major) {
    const double *d = p->distance, *h = p->height;
    size_t count = 0;
    for (size_t k = 0; k < p->n; k++) {
        for (; count > 1; count--) { /* drop points below the rope */
            size_t a = major[count - 2], o = major[count - 1];
            if ((h[o] - h[a]) * (d[k] - d[a]) >= (h[k] - h[a]) * (d[o] - d[a])) break;
        }
        major[count++] = (uint32_t)k;
    }
    return count;
}

/* Add the edge that comes nearest to the line between neighbours a and b of the rope, the first of
 * equals. */
static void add_gap(Edges *s, const Profile *p, size_t a, size_t b) {
    if (b - a < 2) return;
    double slope = (p->height[b] - p->height[a]) / (p->distance[b] - p->distance[a]);
    size_t nearest = a + 1;
    double highest = -INFINITY;
    for (size_t k = a + 1; k < b; k++) {
        double height = p->height[k] - slope * (p->distance[k] - p->distance[a]);
        if (height > highest) highest = height, nearest = k;
    }
    add_edge(s, p, a, nearest, b);
}

/* C. Factors are paired to stay in range. */
static EdgeLoss spacing(const Profile *p, const uint32_t *major, size_t count) {
    EdgeLoss s = {1, 0};
    if (count < 4) return s; /* C is exactly 0 for up to one edge */
    const double *d = p->distance;
    for (size_t i = 1; i + 1 < count; i++) {
        double before = d[major[i]] - d[major[i - 1]], after = d[major[i + 1]] - d[major[i]];
        attenuate(&s, (before + after) / (i + 2 < count ? after : d[p->n - 1] - d[0]));
    }
    return s;
}

void knife_edges(const Profile *p, uint32_t *major, Edges *s) {
    s->n = 0;
    size_t count = stretch_rope(p, major);
    for (size_t i = 1; i < count; i++) {
        add_gap(s, p, major[i - 1], major[i]);
        if (i + 1 < count) add_edge(s, p, major[i - 1], major[i], major[i + 1]);
    }
    s->spacing = spacing(p, major, count);
}
