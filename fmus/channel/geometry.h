/* Plane geometry of links: segments against rings (buildings) and rectangles (vehicle bodies).
 * Every function is total: any finite input gives a finite result. */
#ifndef GEOMETRY_H
#define GEOMETRY_H
#include "portable_math.h"
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* As fmin and fmax, but without NaN, and so one instruction instead of a call. */
static inline double smaller(double a, double b) { return a < b ? a : b; }
static inline double larger(double a, double b) { return a > b ? a : b; }

typedef struct { double x, y, z; } Position; /* [m], world frame */
/* A rectangle along the axes, in the plane: centre and half its extent [m]. */
typedef struct { double center[2], half[2]; } Area;
/* The footprint of a vehicle: centre, direction of the length axis, half length, half width [m]. */
typedef struct { double center[2], direction[2], half[2]; } Rectangle;

/* The part of a segment from `enter` to `leave`, as fractions of its length. */
typedef struct { double enter, leave; } Span;

static inline double distance_between(Position a, Position b) {
    double x = b.x - a.x, y = b.y - a.y, z = b.z - a.z;
    return sqrt(x * x + y * y + z * z);
}
/* Unit vector of a heading [rad], of any finite size. */
void unit_vector(double heading, double direction[2]);

/* The area from `low` to `high`, grown by a hair, so that what is inside stays inside in spite of
 * rounding. */
Area area_between(const double low[2], const double high[2]);
Area area_around(const Rectangle *rectangle);

/* A segment in the plane with a margin around it. */
typedef struct { double middle[2], half[2], margin[2]; } Corridor;
static inline Corridor corridor(Position a, Position b, const double margin[2]) {
    return (Corridor){{(a.x + b.x) / 2, (a.y + b.y) / 2}, {(b.x - a.x) / 2, (b.y - a.y) / 2},
                      {margin[0], margin[1]}};
}

/* Whether the area comes nearer to the segment than the margin, in x and in y; may be true if it only
 * just does not. By the axes that can separate a segment from a rectangle. */
static inline bool area_meets(const Area *area, const Corridor *c) {
    double x = fabs(area->center[0] - c->middle[0]), y = fabs(area->center[1] - c->middle[1]);
    double half_x = area->half[0] + c->margin[0], half_y = area->half[1] + c->margin[1];
    double step_x = fabs(c->half[0]), step_y = fabs(c->half[1]);
    if (x > half_x + step_x || y > half_y + step_y) return false;
    double across = c->half[0] * (area->center[1] - c->middle[1])
        - c->half[1] * (area->center[0] - c->middle[0]);
    return fabs(across) <= half_x * step_y + half_y * step_x;
}

/* Narrow `span` to where -half <= start + t * step <= half (slab test); false if nothing is left. */
static inline bool clip(double start, double step, double half, Span *span) {
    if (step == 0) return fabs(start) <= half;
    double t0 = (-half - start) / step, t1 = (half - start) / step;
    span->enter = larger(span->enter, smaller(t0, t1));
    span->leave = smaller(span->leave, larger(t0, t1));
    return span->enter <= span->leave;
}

/* Where the straight line through a and b (not only the segment) runs over the rectangle, its
 * outline included. Returns false if it does not, or if a and b coincide in the plane. */
static inline bool rectangle_span(const Rectangle *r, Position a, Position b, Span *span) {
    double c = r->direction[0], s = r->direction[1];
    double x = a.x - r->center[0], y = a.y - r->center[1], dx = b.x - a.x, dy = b.y - a.y;
    double along = c * dx + s * dy, across = c * dy - s * dx;
    /* most lines pass by: the distance of the centre from the line against the reach of the corners */
    if (fabs(dx * y - dy * x) > r->half[0] * fabs(across) + r->half[1] * fabs(along)) return false;
    *span = (Span){-INFINITY, INFINITY};
    return clip(c * x + s * y, along, r->half[0], span) && clip(c * y - s * x, across, r->half[1], span)
        && isfinite(span->enter) && isfinite(span->leave);
}

/* Crossings of the straight line through a and b with a closed ring, as fractions of a-b, in
 * ascending order: an even number, so that they pair up to the spans inside the ring (even-odd
 * rule). A corner exactly on the line counts as lying left of it: beams through corners and along
 * walls get the result of a beam shifted by an infinitesimal amount to the right.
 * `crossing` has room for `n`. None if a and b coincide in the plane. */
size_t ring_crossings(const double (*ring)[2], size_t n, Position a, Position b, double *crossing);

/* Whether the ring contains the point (even-odd rule). */
bool ring_contains(const double (*ring)[2], size_t n, Position a);

#endif
