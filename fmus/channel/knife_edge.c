#include "knife_edge.h"
#include <math.h>

double knife_edge_db(double v) {
    if (v <= -0.7) return 0;
    double u = v - 0.1;
    return 6.9 + 20 * log10(sqrt(u * u + 1) + u);
}

/* Height of edge o over the straight line from point a to point b of the profile [m]. */
static double height_over_line(const Profile *p, size_t a, size_t o, size_t b) {
    double rise = p->height[b] - p->height[a], d = p->distance[b] - p->distance[a];
    return p->height[o] - (p->height[a] + rise * (p->distance[o] - p->distance[a]) / d);
}

/* Loss of edge o alone between points a and b [dB]. */
static double edge_between_db(const Profile *p, size_t a, size_t o, size_t b, double wavelength,
                              double factor) {
    double d1 = p->distance[o] - p->distance[a], d2 = p->distance[b] - p->distance[o];
    double radius = sqrt(wavelength * d1 * d2 / (d1 + d2)); /* of the first Fresnel zone */
    return knife_edge_db(sqrt(factor) * height_over_line(p, a, o, b) / radius);
}

/* The points that a rope stretched from the first to the last point touches, both included: from
 * each, go to the point that is seen under the steepest angle, the nearest of equals. */
static size_t stretch_rope(const Profile *p, uint32_t *major) {
    size_t count = 0, at = 0;
    major[count++] = 0;
    while (at + 1 < p->n) {
        size_t next = at + 1;
        double steepest = -INFINITY;
        for (size_t k = at + 1; k < p->n; k++) {
            double slope = (p->height[k] - p->height[at]) / (p->distance[k] - p->distance[at]);
            if (slope > steepest) steepest = slope, next = k;
        }
        major[count++] = (uint32_t)next;
        at = next;
    }
    return count;
}

/* Loss of the edge that comes nearest to the line between neighbours a and b of the rope [dB]. */
static double gap_db(const Profile *p, size_t a, size_t b, double wavelength, double factor) {
    if (b - a < 2) return 0;
    size_t nearest = a + 1;
    double height = height_over_line(p, a, nearest, b);
    for (size_t k = a + 2; k < b; k++) {
        double other = height_over_line(p, a, k, b);
        if (other > height) height = other, nearest = k;
    }
    return edge_between_db(p, a, nearest, b, wavelength, factor);
}

/* C = -10 log10(prod s_i sum s_i / (s_1 s_N prod_{i=2..N} (s_{i-1} + s_i))) [dB], with s_i the
 * distances between neighbours of the rope. Factors are paired to stay in range. */
static double spacing_correction_db(const Profile *p, const uint32_t *major, size_t count) {
    if (count < 4) return 0; /* exactly 0 for up to one edge */
    double ratio = p->distance[major[count - 1]] - p->distance[major[0]];
    for (size_t i = 1; i + 1 < count; i++) {
        double before = p->distance[major[i]] - p->distance[major[i - 1]];
        double after = p->distance[major[i + 1]] - p->distance[major[i]];
        ratio *= (i + 2 < count ? after : 1) / (before + after);
    }
    return -10 * log10(ratio);
}

double knife_edges_db(const Profile *p, double wavelength, double factor, uint32_t *major) {
    if (p->n <= 2) return 0;
    size_t count = stretch_rope(p, major);
    double loss = spacing_correction_db(p, major, count);
    for (size_t i = 1; i + 1 < count; i++)
        loss += edge_between_db(p, major[i - 1], major[i], major[i + 1], wavelength, factor);
    for (size_t i = 1; i < count; i++)
        loss += gap_db(p, major[i - 1], major[i], wavelength, factor);
    return loss;
}
