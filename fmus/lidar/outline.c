#include "outline.h"

#include <math.h>
#include <string.h>

#include "portable_math.h"

/* Edges closer than this to a plane through the axis [rad] are taken to lie in it. */
static const double RADIAL = 1e-10;

/* Twice the area of the triangle that the axis and p and q make in the xy plane, counter-clockwise
 * positive. An edge right through the axis goes past it on the side of which its ends decide, so
 * that the way back goes past it on the same side. */
static double area_at_axis(const Corner *p, const Corner *q) {
    static const double NEXT_TO_NOTHING = 1e-300; /* [m^2] */
    double area = p->x * q->y - p->y * q->x;
    if (area != 0.0)
        return area;
    return p->x < q->x || (p->x == q->x && p->y < q->y) ? NEXT_TO_NOTHING : -NEXT_TO_NOTHING;
}

/* The slope of an edge in a plane through the axis: the mean of its ends, or, where it goes through
 * the axis, that of the axis. */
static double radial_slope(const Corner *p, const Corner *q, double dot) {
    double at_p = sqrt(p->x * p->x + p->y * p->y), at_q = sqrt(q->x * q->x + q->y * q->y);
    if (dot > 0.0)
        return 0.5 * (p->z / at_p + q->z / at_q);
    double up = p->z * at_q + q->z * at_p;
    return up > 0.0 ? HUGE_VAL : -HUGE_VAL;
}

static void set_slope(Edge *edge, const Corner *p, const Corner *q, double area, double dot) {
    memset(edge->slope, 0, sizeof edge->slope);
    if (fabs(area) <= RADIAL * fabs(dot)) {
        edge->slope[2] = radial_slope(p, q, dot);
    } else {
        edge->slope[0] = -(p->y * q->z - p->z * q->y) / area;
        edge->slope[1] = -(p->z * q->x - p->x * q->z) / area;
    }
}

/* Azimuths from p to q, counter-clockwise positive. Less than a right angle is the shorter way, so
 * that rounding cannot turn nothing into a whole turn. */
static int64_t steps(const Corner *p, const Corner *q, double area, double dot,
                     int64_t azimuths) {
    int64_t ahead = (int64_t)q->azimuth - (int64_t)p->azimuth;
    ahead += ahead < 0 ? azimuths : 0;
    int counter_clockwise = dot > 0.0 ? 2 * ahead <= azimuths : area >= 0.0;
    return counter_clockwise || ahead == 0 ? ahead : ahead - azimuths;
}

Outline outline_of(const View *view, const Face *face, const Pattern *pattern, Edge *edge) {
    const uint32_t *corner_of = view->corner_of + face->first;
    int64_t azimuths = pattern->parameters.azimuths, at = 0;
    Outline outline = {.edge = edge};
    const Corner *start = view->corner + corner_of[0], *p = start;
    for (uint32_t i = 1; i <= face->count; i++) {
        const Corner *q = i < face->count ? view->corner + corner_of[i] : start;
        double area = area_at_axis(p, q), dot = p->x * q->x + p->y * q->y;
        int64_t count = steps(p, q, area, dot, azimuths);
        if (count != 0) {
            Edge *next = edge + outline.count++;
            next->from = at;
            next->to = at += count;
            set_slope(next, p, q, area, dot);
            outline.low = at < outline.low ? at : outline.low;
            outline.high = at > outline.high ? at : outline.high;
        }
        p = q;
    }
    int64_t first = (start->azimuth + outline.low + 1) % azimuths;
    outline.first = (uint32_t)(first < 0 ? first + azimuths : first);
    return outline;
}
