#include "geometry.h"
#include "sort.h"
#include <math.h>

void unit_vector(double heading, double direction[2]) {
    sine_cosine(fmod(heading, 2 * PI), &direction[1], &direction[0]); /* fmod is exact */
}

Area area_between(const double low[2], const double high[2]) {
    Area area;
    for (int k = 0; k < 2; k++) {
        area.center[k] = (low[k] + high[k]) / 2;
        area.half[k] = (high[k] - low[k]) / 2 + 1e-9 * (1 + fabs(low[k]) + fabs(high[k]));
    }
    return area;
}

Area area_around(const Rectangle *r) {
    double c = fabs(r->direction[0]), s = fabs(r->direction[1]);
    double x = c * r->half[0] + s * r->half[1], y = s * r->half[0] + c * r->half[1];
    return area_between((double[]){r->center[0] - x, r->center[1] - y},
                        (double[]){r->center[0] + x, r->center[1] + y});
}

static bool is_nearer(const double *a, const double *b) { return *a < *b; }

/* Crossings are few. */
DEFINE_INSERTION_SORT(sort_crossings, double, is_nearer)

size_t ring_crossings(const double (*ring)[2], size_t n, Position a, Position b, double *crossing) {
    double dx = b.x - a.x, dy = b.y - a.y, square = dx * dx + dy * dy;
    if (n == 0 || !(square > 0)) return 0;
    size_t count = 0;
    /* side: twice the signed area of (a, b, corner); positive to the left of a-b */
    double px = ring[n - 1][0] - a.x, py = ring[n - 1][1] - a.y, side_p = dx * py - dy * px;
    for (size_t i = 0; i < n; i++) {
        double qx = ring[i][0] - a.x, qy = ring[i][1] - a.y, side_q = dx * qy - dy * qx;
        if ((side_p >= 0) != (side_q >= 0)) {
            /* interpolated along the wall, so that rounding cannot move it off the wall even
             * where wall and line all but coincide */
            double u = side_p / (side_p - side_q);
            crossing[count++] = ((px + u * (qx - px)) * dx + (py + u * (qy - py)) * dy) / square;
        }
        px = qx, py = qy, side_p = side_q;
    }
    sort_crossings(crossing, count);
    return count;
}

bool ring_contains(const double (*ring)[2], size_t n, Position a) {
    bool inside = false;
    for (size_t i = 0, k = n - 1; i < n; k = i++) {
        double px = ring[k][0], py = ring[k][1], qx = ring[i][0], qy = ring[i][1];
        if ((py > a.y) != (qy > a.y) && a.x < px + (qx - px) * ((a.y - py) / (qy - py)))
            inside = !inside;
    }
    return inside;
}
