/* Plane geometry of links: segments against rings (buildings) and rectangles (vehicle bodies).
 * Every function is total: any finite input gives a finite result. */
#ifndef GEOMETRY_H
#define GEOMETRY_H
#include <stdbool.h>
#include <stddef.h>

#define PI 3.14159265358979323846

typedef struct { double x, y, z; } Position; /* [m], world frame */
typedef struct { double low[2], high[2]; } Box; /* axis-aligned, in the plane [m] */
/* The footprint of a vehicle: centre, direction of the length axis, half length, half width [m]. */
typedef struct { double center[2], direction[2], half[2]; } Rectangle;

/* The part of a segment from `enter` to `leave`, as fractions of its length. */
typedef struct { double enter, leave; } Span;

double distance_between(Position a, Position b);
bool box_meets_segment(const Box *box, Position a, Position b);
Box box_of_rectangle(const Rectangle *rectangle);

/* Where the straight line through a and b (not only the segment) runs over the rectangle, its
 * outline included. Returns false if it does not, or if a and b coincide in the plane. */
bool rectangle_span(const Rectangle *rectangle, Position a, Position b, Span *span);

/* Crossings of the straight line through a and b with a closed ring, as fractions of a-b, in
 * ascending order: an even number, so that they pair up to the spans inside the ring (even-odd
 * rule). A corner exactly on the line counts as lying left of it: beams through corners and along
 * walls get the result of a beam shifted by an infinitesimal amount to the right.
 * `crossing` has room for `n`. None if a and b coincide in the plane. */
size_t ring_crossings(const double (*ring)[2], size_t n, Position a, Position b, double *crossing);

/* Whether the ring contains the point (even-odd rule). */
bool ring_contains(const double (*ring)[2], size_t n, Position a);

#endif
