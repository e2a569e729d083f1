#include "geometry.h"
#include <math.h>

double distance_between(Position a, Position b) {
    double x = b.x - a.x, y = b.y - a.y, z = b.z - a.z;
    return sqrt(x * x + y * y + z * z);
}

/* Narrow `span` to where low <= start + t * step <= high (slab test); false if nothing is left. */
static bool clip(double start, double step, double low, double high, Span *span) {
    if (step == 0) return low <= start && start <= high;
    double t0 = (low - start) / step, t1 = (high - start) / step;
    if (t0 > t1) { double t = t0; t0 = t1; t1 = t; }
    if (t0 > span->enter) span->enter = t0;
    if (t1 < span->leave) span->leave = t1;
    return span->enter <= span->leave;
}

bool box_meets_segment(const Box *box, Position a, Position b) {
    Span span = {0, 1};
    return clip(a.x, b.x - a.x, box->low[0], box->high[0], &span)
        && clip(a.y, b.y - a.y, box->low[1], box->high[1], &span);
}

Box box_of_rectangle(const Rectangle *r) {
    double c = fabs(r->direction[0]), s = fabs(r->direction[1]);
    double x = c * r->half[0] + s * r->half[1], y = s * r->half[0] + c * r->half[1];
    return (Box){{r->center[0] - x, r->center[1] - y}, {r->center[0] + x, r->center[1] + y}};
}

bool rectangle_span(const Rectangle *r, Position a, Position b, Span *span) {
    double c = r->direction[0], s = r->direction[1];
    double x = a.x - r->center[0], y = a.y - r->center[1], dx = b.x - a.x, dy = b.y - a.y;
    double along = c * dx + s * dy, across = c * dy - s * dx;
    *span = (Span){-INFINITY, INFINITY};
    return clip(c * x + s * y, along, -r->half[0], r->half[0], span)
        && clip(c * y - s * x, across, -r->half[1], r->half[1], span)
        && isfinite(span->enter) && isfinite(span->leave);
}

/* Insertion sort: crossings are few. */
static void sort(double *value, size_t n) {
    for (size_t i = 1; i < n; i++) {
        double moved = value[i];
        size_t k = i;
        for (; k > 0 && value[k - 1] > moved; k--) value[k] = value[k - 1];
        value[k] = moved;
    }
}

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
    sort(crossing, count);
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
