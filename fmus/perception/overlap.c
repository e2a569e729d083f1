#include "overlap.h"

#include <math.h>

/* A square clipped by four half-planes has at most eight corners. */
enum { CORNERS = 8 };
typedef struct {
    double corner[CORNERS][2];
    int count;
} Polygon;

/* Keep the part of a convex polygon where `sign` times coordinate `axis` is at most `limit`
 * (I. Sutherland, G. Hodgman, Reentrant Polygon Clipping, CACM 17(1), 1974). */
static Polygon clip(const Polygon *polygon, int axis, double sign, double limit) {
    Polygon kept = {.count = 0};
    for (int i = 0; i < polygon->count; i++) {
        const double *a = polygon->corner[i], *b = polygon->corner[(i + 1) % polygon->count];
        double beyond_a = sign * a[axis] - limit, beyond_b = sign * b[axis] - limit;
        if (beyond_a <= 0.0 && kept.count < CORNERS) {
            kept.corner[kept.count][0] = a[0];
            kept.corner[kept.count++][1] = a[1];
        }
        if ((beyond_a < 0.0) == (beyond_b < 0.0) || beyond_a == 0.0 || beyond_b == 0.0) continue;
        if (kept.count == CORNERS) continue;
        double part = beyond_a / (beyond_a - beyond_b);
        kept.corner[kept.count][0] = a[0] + part * (b[0] - a[0]);
        kept.corner[kept.count++][1] = a[1] + part * (b[1] - a[1]);
    }
    return kept;
}

/* Gauss's formula, counter-clockwise positive. */
static double area_of(const Polygon *polygon) {
    double doubled = 0.0;
    for (int i = 0; i < polygon->count; i++) {
        const double *a = polygon->corner[i], *b = polygon->corner[(i + 1) % polygon->count];
        doubled += a[0] * b[1] - a[1] * b[0];
    }
    return 0.5 * doubled;
}

double overlap_area(double range, const double center[2], double half, double cosine,
                    double sine) {
    double reach = half * (fabs(cosine) + fabs(sine));
    double x = fabs(center[0]), y = fabs(center[1]);
    if (!(x < range + reach && y < range + reach)) return 0.0;
    if (x + reach <= range && y + reach <= range) return 4.0 * half * half;
    static const int SIGNS[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}; /* counter-clockwise */
    Polygon polygon = {.count = 4};
    for (int i = 0; i < 4; i++) {
        double u = SIGNS[i][0] * half, v = SIGNS[i][1] * half;
        polygon.corner[i][0] = center[0] + u * cosine - v * sine;
        polygon.corner[i][1] = center[1] + u * sine + v * cosine;
    }
    for (int axis = 0; axis < 2; axis++) {
        polygon = clip(&polygon, axis, 1.0, range);
        polygon = clip(&polygon, axis, -1.0, range);
    }
    /* rounding must not make the intersection larger than either square */
    double area = area_of(&polygon), bound = 4.0 * fmin(range * range, half * half);
    return area > 0.0 ? fmin(area, bound) : 0.0;
}
